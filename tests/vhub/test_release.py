"""When packets leave for free-running clients: at anchor + due in realtime, at once in fast, in order always."""

from __future__ import annotations

from typing import Final

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foosim.common.json_text import decode_json
from foosim.protocol import channels
from foosim.protocol.messages import Tempo
from foosim.vhub.network.packet import Flight
from foosim.vhub.paced_release import ANCHOR_WINDOW_NS, Release, Releases
from tests.vhub.test_sessions import PERIODS, Hub, sent

MS: Final = 1_000_000
T: Final = 2 * MS
START: Final = 10_000 * MS


def flight(due_ns: int, sequence: int = 1) -> Flight:
    made = Flight("camera", "watcher", "ball", sequence, 0, 0, b"x")
    made.due_ns = due_ns
    return made


def releases(factor: float = 1.0) -> Releases:
    made = Releases(T)
    made.set_tempo(factor, False)
    return made


def numbers(taken: list[Release]) -> list[tuple[str, int]]:
    return [(release.client, release.number) for release in taken]


@pytest.mark.parametrize("factor", [1.0, 2.0, 0.5])
def test_a_packet_leaves_at_anchor_plus_due(factor: float) -> None:
    made = releases(factor)
    made.committed(10, START + int(10 * T / factor))
    now = START + int(10 * T / factor)
    made.add("watcher", 1, 10, [flight(11 * T)], now)
    at = START + int(11 * T / factor)
    assert made.deadline_ns == at
    assert made.take(at - 1) == [] and numbers(made.take(at)) == [("watcher", 1)]
    assert made.take(at + 10**12) == []


def test_what_leaves_together_leaves_with_its_latest() -> None:
    made = releases()
    made.committed(10, START + 10 * T)
    made.add("watcher", 1, 10, [flight(10 * T + 5, 1), flight(10 * T + 900, 2), flight(10 * T + 7, 3)], START)
    assert made.deadline_ns == START + 10 * T + 900
    (release,) = made.take(START + 11 * T)
    assert [flying.sequence for flying in release.flights] == [1, 2, 3] and release.tick == 10


def test_it_counts_how_late_packets_leave() -> None:
    """Behind their due time by the wall clock, whether their tick was closed late or they were taken late."""
    made = releases()
    made.committed(10, START + 10 * T)
    made.add("watcher", 1, 10, [flight(11 * T, 1), flight(11 * T, 2), flight(11 * T, 3)], START + 10 * T)
    made.take(START + 11 * T)
    assert made.lateness.count == 3 and made.lateness.max_ns == 0
    made.add("watcher", 2, 11, [flight(12 * T, 4)], START + 15 * T)
    made.take(START + 16 * T)
    assert made.lateness.count == 4 and made.lateness.as_json() == {"p50": 0.01, "p99": 8.0, "max": 8.0}
    made.add("watcher", 3, 12, [flight(30 * T, 5)], START + 17 * T)
    made.set_tempo(2.0, False)
    made.take(START + 17 * T)
    made.add("watcher", 4, 13, [flight(31 * T, 6)], START + 17 * T)
    made.take(START + 40 * T)
    made.committed(40, START + 40 * T)
    made.add("watcher", 5, 41, [flight(90 * T, 7)], START + 40 * T)
    made.take(START + 41 * T, everything=True)
    assert made.lateness.count == 4, "what no clock gave a time, and what the end of the run let go, is not late"


def test_never_before_its_tick_is_closed() -> None:
    made = releases()
    made.committed(10, START + 10 * T)
    late = START + 30 * T
    made.add("watcher", 1, 10, [flight(11 * T)], late)
    assert made.deadline_ns == late and numbers(made.take(late)) == [("watcher", 1)]


def test_in_fast_it_leaves_at_once_in_the_order_of_ticks() -> None:
    made = releases(0.0)
    made.committed(10, START)
    for tick in range(3):
        for client in ("z", "a"):
            made.add(client, tick + 1, tick, [flight(100 * T)], START)
    assert numbers(made.take(START)) == [("a", 1), ("a", 2), ("a", 3), ("z", 1), ("z", 2), ("z", 3)]


def test_before_the_first_commit_it_leaves_at_once() -> None:
    made = releases()
    made.add("watcher", 1, 0, [flight(50 * T)], START)
    assert made.deadline_ns == START


def test_the_anchor_is_the_least_of_the_last_second() -> None:
    made = releases()
    for tick, lag in ((0, 5 * MS), (1, 1 * MS), (2, 9 * MS)):
        made.committed(tick, START + tick * T + lag)
    made.add("watcher", 1, 2, [flight(100 * T)], START)
    assert made.deadline_ns == START + 100 * T + 1 * MS, "late commits do not spoil it"
    made.take(10**18)
    later = START + 2 * T + 9 * MS + ANCHOR_WINDOW_NS + 1
    made.committed(500, later)
    made.add("watcher", 2, 500, [flight(600 * T)], later)
    assert made.deadline_ns == later + 100 * T, "what is older than a second is forgotten"


def test_another_pace_or_a_pause_learns_the_anchor_anew() -> None:
    made = releases()
    made.committed(10, START)
    made.set_tempo(1.0, True)
    made.set_tempo(1.0, False)
    now = START + 60_000 * MS
    made.add("watcher", 1, 10, [flight(12 * T)], now)
    assert made.deadline_ns == now, "no anchor yet"
    made.take(now)
    made.committed(11, now)
    made.add("watcher", 2, 11, [flight(13 * T)], now)
    assert made.deadline_ns == now + 2 * T
    made.set_tempo(2.0, False)
    made.committed(12, now + T)
    made.add("watcher", 3, 12, [flight(16 * T)], now + T)
    assert numbers(made.take(now + 3 * T)) == [("watcher", 2), ("watcher", 3)]


@pytest.mark.parametrize("tempo", [(0.0, False), (2.0, False), (0.001, True)])
def test_what_waits_by_an_old_pace_leaves_when_it_changes(tempo: tuple[float, bool]) -> None:
    made = releases(0.001)
    made.committed(10, START)
    for number in (1, 2, 3):
        made.add("watcher", number, 10 + number, [flight((10 + number) * T)], START)
    assert made.deadline_ns is not None and made.deadline_ns > START + 1000 * MS
    made.set_tempo(*tempo)
    assert numbers(made.take(START + 1)) == [("watcher", 1), ("watcher", 2), ("watcher", 3)]


def test_a_client_gets_nothing_before_what_it_was_released_earlier() -> None:
    """A commit that came early moves the anchor: what follows would overtake what waits."""
    made = releases()
    made.committed(10, START + 10 * T + 5 * MS)
    made.add("watcher", 1, 10, [flight(11 * T)], START + 10 * T)
    made.add("other", 1, 10, [flight(11 * T)], START + 10 * T)
    made.committed(11, START + 11 * T)
    made.add("watcher", 2, 11, [flight(11 * T + 1)], START + 10 * T)
    assert numbers(made.take(START + 11 * T + 5 * MS)) == [("other", 1), ("watcher", 1), ("watcher", 2)]


def test_the_same_tempo_again_changes_nothing() -> None:
    made = releases()
    made.committed(10, START)
    made.set_tempo(1.0, False)
    made.add("watcher", 1, 10, [flight(12 * T)], START)
    assert made.deadline_ns == START + 2 * T


@settings(max_examples=100)
@given(
    steps=st.lists(
        st.tuples(st.sampled_from(["a", "b"]), st.integers(0, 5), st.integers(0, 3 * T), st.integers(0, 2 * T)),
        max_size=30,
    ),
    factor=st.sampled_from([0.0, 1.0, 3.0]),
)
def test_nothing_is_lost_and_a_clients_downlinks_leave_in_order(
    steps: list[tuple[str, int, int, int]], factor: float
) -> None:
    """Due times grow from tick to tick, as closings make them; the hub looks as often as it likes."""
    made = releases(factor)
    now, due = START, 0
    said: dict[str, list[int]] = {"a": [], "b": []}
    count = {"a": 0, "b": 0}
    for tick, (client, lag, more, wait) in enumerate(steps):
        made.committed(tick, now + lag)
        due += more
        count[client] += 1
        made.add(client, count[client], tick, [flight(due)], now)
        now += wait
        taken = made.take(now)
        assert all(release.at_ns <= now for release in taken)
        for release in taken:
            said[release.client].append(release.number)
    for release in made.take(10**18):
        said[release.client].append(release.number)
    assert said == {client: list(range(1, last + 1)) for client, last in count.items()}


def test_a_report_tells_how_late_packets_left() -> None:
    """One tick is closed 7 ms late, so what was due within it leaves that much later than the clock said."""
    hub = Hub()
    hub.say(channels.TEMPO, "supervisor", Tempo("realtime", False))
    hub.begin()
    hub.enter("ear")
    assert decode_json(hub.core.heartbeat().report)["lateness_ms"] is None
    hub.commit(0)
    for name in PERIODS:
        hub.done(name, 0, *([sent(1, "ear")] if name == "hand" else []))
    hub.now_ns = T + 7 * MS
    hub.commit(1)
    hub.core.wake(hub.now_ns)
    (down,) = [down for down in hub.said(channels.DOWN) if down.packets]
    late = hub.now_ns - max(packet.due_ns for packet in down.packets)
    assert late >= 7 * MS
    told = decode_json(hub.core.heartbeat().report)["lateness_ms"]
    assert told == {
        "p50": late / MS,
        "p99": late / MS,
        "max": late / MS,
    }

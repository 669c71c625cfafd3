"""When packets leave for free-running clients: at anchor + due in realtime, at once in fast, in order always."""

from __future__ import annotations

from typing import Any, Final

from hypothesis import given, settings
from hypothesis import strategies as st

from foosim.common.json_text import decode_json
from foosim.protocol import channels
from foosim.protocol.messages import Tempo
from foosim.vhub.network.packet import Flight
from foosim.vhub.paced_release import ANCHOR_WINDOW_NS, Releases
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


STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("commit"), st.integers(0, 3 * T)),
        st.tuples(st.just("close"), st.sampled_from("ab"), st.lists(st.integers(0, 3 * T), max_size=3)),
        st.tuples(st.just("pace"), st.sampled_from((0.0, 0.5, 1.0, 3.0)), st.booleans()),
        st.tuples(st.just("wait"), st.sampled_from((0, 1, T, 9 * T, ANCHOR_WINDOW_NS))),
    ),
    max_size=40,
)


@settings(max_examples=200)
@given(steps=STEPS, factor=st.sampled_from((0.0, 1.0, 3.0)))
def test_packets_leave_at_the_anchor_plus_the_latest_due_time(steps: list[Any], factor: float) -> None:
    """The anchor is the least lag of the last second of commits. Without one, and in fast, packets leave at once; never
    before their tick is closed, nor before earlier ones of their client. What waits leaves when the pace changes."""
    made, now, tick, paused = releases(factor), START, 0, False
    anchors: list[tuple[int, int]] = []
    waiting: list[tuple[int, str, int]] = []
    count = {"a": 0, "b": 0}
    for step, *what in steps:
        if step == "commit":
            tick, now = tick + 1, now + what[0]
            made.committed(tick, now)
            if factor:
                anchors = [known for known in anchors if known[0] >= now - ANCHOR_WINDOW_NS]
                anchors.append((now, now - int(tick * T / factor)))
        elif step == "close":
            client, due = what
            count[client] += 1
            made.add(client, count[client], tick, [flight(tick * T + after) for after in due], now)
            at_ns = max([now, *(at_ns for at_ns, name, _ in waiting if name == client)])
            if anchors and due:
                at_ns = max(at_ns, min(anchor for _, anchor in anchors) + int((tick * T + max(due)) / factor))
            waiting = sorted([*waiting, (at_ns, client, count[client])])
        elif step == "pace":
            if what != [factor, paused]:
                anchors, waiting = [], [(0, name, number) for _, name, number in waiting]
            factor, paused = what
            made.set_tempo(factor, paused)
        else:
            now += what[0]
            leaving = [one for one in waiting if one[0] <= now]
            assert [(release.client, release.number) for release in made.take(now)] == [one[1:] for one in leaving]
            waiting = [one for one in waiting if one[0] > now]
        assert made.deadline_ns == min((at_ns for at_ns, _, _ in waiting), default=None)
    assert [(release.client, release.number) for release in made.take(0, everything=True)] == [
        one[1:] for one in waiting
    ]


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

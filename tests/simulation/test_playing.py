"""The core of a replay on virtual time: when what is published, in order, from one anchor; and what can be asked."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any, Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from foosim.capture.mcap.checks import CaptureError
from foosim.common.errors import BadValue
from foosim.common.json_text import decode_json, encode_json
from foosim.common.limits import LAG_ANCHOR_NS
from foosim.common.units import Pace, parse_pace
from foosim.protocol.messages import Answer, Request
from foosim.runtime.keys import split_keys
from foosim.simulation.play.core import AT_ONCE_MAX, STEPS_MAX, Playback, Span
from foosim.simulation.play.entries import Entry
from foosim.simulation.play.requests import ANSWERS_KEPT, ARGUMENTS, Requests

MS = 1_000_000
TICK_NS = 2 * MS
START_NS = 123_456_789_000


def entries(*times_ms: float) -> list[Entry]:
    return [Entry(int(time * MS), "packets", "/packets/a/b/c", str(time).encode()) for time in times_ms]


class Theatre:
    """Plays to a list on virtual time."""

    def __init__(
        self,
        times_ms: Sequence[float],
        pace: str = "realtime",
        span_ms: tuple[float, float] | None = None,
        loop: bool = False,
        paused: bool = False,
    ) -> None:
        first, last = span_ms or (0, times_ms[-1])
        self.now_ns = START_NS
        self.span = Span(int(first * MS), int(last * MS))
        self.all = entries(*times_ms)
        self.heard: list[tuple[int, int]] = []
        """Wall time since the start and captured time of each entry, in ns."""
        self.playback = Playback(self.entries_from, self.span, TICK_NS, parse_pace(pace), loop, paused)

    def entries_from(self, time_ns: int) -> Iterator[Entry]:
        return iter([entry for entry in self.all if entry.time_ns >= time_ns])

    @property
    def heard_ms(self) -> list[float]:
        return [time_ns / MS for _, time_ns in self.heard]

    def turn(self) -> int | None:
        """Do all that is to be done now; return when there is more."""
        while True:
            due = self.playback.advance(self.now_ns)
            self.heard += [(self.now_ns - START_NS, entry.time_ns) for entry in due]
            deadline_ns = self.playback.deadline_ns(self.now_ns)
            if self.playback.ended or deadline_ns is None or deadline_ns > self.now_ns:
                return deadline_ns

    def play(self, until_ms: float = 10_000.0) -> None:
        """Go on until the end, or until a wall time since the start."""
        until_ns = START_NS + int(until_ms * MS)
        while (deadline_ns := self.turn()) is not None and not self.playback.ended:
            if deadline_ns > until_ns:
                break
            self.now_ns = deadline_ns
        if not self.playback.ended:
            self.now_ns = until_ns
            self.turn()


LAST_MS: Final = 60
CHANGES: Final = st.one_of(
    st.tuples(st.sampled_from(["pause", "resume"]), st.just(0)),
    st.tuples(st.just("step"), st.integers(1, 6)),
    st.tuples(st.just("seek"), st.integers(0, LAST_MS)),
    st.tuples(st.just("pace"), st.sampled_from([1, 2, 4])),
)


@given(
    st.lists(st.integers(0, 2 * LAST_MS), min_size=1, max_size=30),
    st.lists(st.tuples(st.integers(0, 30), CHANGES), max_size=8),
    st.booleans(),
)
def test_requests_leave_nothing_out_and_repeat_nothing(
    halves: list[int], changes: list[tuple[int, tuple[str, int]]], paused: bool
) -> None:
    """Compared with pieces of time: each has the entries of its captured times, each at its time; silence is played."""
    times = sorted(half / 2 for half in halves)
    theatre = Theatre(times, span_ms=(0, LAST_MS), paused=paused)
    playback, heard = theatre.playback, list[tuple[float, float]]()
    wall, at, pace, place = 0.0, 0.0, 1, 0
    for passed, (verb, number) in [*changes, (1000, ("end", 0))]:
        theatre.play(wall + passed)
        until = at if paused else min(LAST_MS, at + passed * pace)
        while not paused and place < len(times) and times[place] <= until:
            heard.append((wall + (times[place] - at) / pace, times[place]))
            place += 1
        is_over = until == LAST_MS and not paused
        assert playback.ended == is_over
        if is_over:
            break
        wall, at = wall + passed, until
        now_ns = theatre.now_ns
        assert playback.time_ns(now_ns) == int(at * MS) and playback.state() == ("paused" if paused else "playing")
        if verb in ("pause", "resume"):
            getattr(playback, verb)(now_ns)
            paused = verb == "pause"
        elif verb == "pace":
            playback.set_pace(parse_pace(f"{number}x"), now_ns)
            pace = number
        elif verb == "seek":
            playback.seek(number * MS, now_ns)
            at, place = number, sum(time < number for time in times)
        elif verb == "step":
            playback.step(number, now_ns)
            paused, at = True, min(LAST_MS, (at // 2 + number) * 2)
            while place < len(times) and times[place] <= at:
                heard.append((wall, times[place]))
                place += 1
            theatre.turn()
            if at == LAST_MS:
                break
    assert theatre.heard == [(int(wall * MS), int(time * MS)) for wall, time in heard]
    assert (playback.published, playback.late_ns_max, playback.slips, playback.failure) == (len(heard), 0, 0, "")


@pytest.mark.parametrize("pace", ["2x", "0.5x", "3x", "1/3x"])
def test_the_rate_scales_the_wall_time_from_the_first_on(pace: str) -> None:
    theatre = Theatre([0, 1, 7, 100], pace)
    theatre.play()
    factor = Fraction(pace.removesuffix("x"))
    for wall_ns, time_ns in theatre.heard:
        assert 0 <= wall_ns - time_ns / factor < 1, "rounded up to a ns"


def test_fast_waits_for_nothing() -> None:
    theatre = Theatre([0, 1, 7, 100], "fast")
    theatre.play()
    assert theatre.heard == [(0, int(t * MS)) for t in (0, 1, 7, 100)] and theatre.playback.ended


def test_deadlines_do_not_add_up_lateness() -> None:
    """Each turn comes late by up to 3 ms: the last entry is late by its own turn, not by all of them."""
    rng = random.Random(5)
    theatre = Theatre([float(t) for t in range(1000)])
    while not theatre.playback.ended:
        deadline_ns = theatre.turn()
        assert deadline_ns is not None
        theatre.now_ns = deadline_ns + rng.randrange(3 * MS)
    assert len(theatre.heard) == 1000
    assert all(0 <= wall_ns - time_ns <= 3 * MS for wall_ns, time_ns in theatre.heard)
    assert 0 < theatre.playback.late_ns_max <= 3 * MS and theatre.playback.slips == 0


def test_a_long_lag_moves_the_anchor_and_is_counted() -> None:
    theatre = Theatre([0, 10, 1000, 1010, 2000])
    theatre.play(500)
    theatre.now_ns += 600 * MS + LAG_ANCHOR_NS  # it was stopped for that long
    theatre.play()
    walls = [wall_ns // MS for wall_ns, _ in theatre.heard]
    assert walls == [0, 10, 1200, 1210, 2200] and theatre.playback.slips == 1


def test_steps_that_are_requested_before_the_first_is_done_add_up() -> None:
    theatre = Theatre([t / 2 for t in range(41)], paused=True)
    theatre.playback.step(2, theatre.now_ns)
    theatre.playback.step(1, theatre.now_ns)
    assert theatre.playback.heading_ns(theatre.now_ns) == 3 * TICK_NS
    theatre.turn()
    assert theatre.heard_ms[-1] == 6
    for wrong in (0, -1, STEPS_MAX + 1):
        with pytest.raises(BadValue, match="not a number of ticks"):
            theatre.playback.step(wrong, 0)
    with pytest.raises(BadValue, match="not a time that is played, 0 s to 20 ms, '21 ms'"):
        theatre.playback.seek(21 * MS, theatre.now_ns)


def test_a_loop_plays_its_part_again_until_it_is_stopped() -> None:
    theatre = Theatre([0, 3, 5, 8, 20], span_ms=(2, 10), loop=True)
    theatre.play(30)
    assert theatre.heard_ms == [3, 5, 8] * 3 + [3, 5, 8][:3]
    assert [wall_ns // MS for wall_ns, _ in theatre.heard][3:6] == [9, 11, 14]
    assert theatre.playback.rounds == theatre.playback.jumps == 3 and not theatre.playback.ended
    empty = Theatre([50], span_ms=(0, 10), loop=True, pace="fast")
    empty.play()
    assert empty.playback.ended and "nothing of the capture is selected" in empty.playback.failure


def test_time_never_runs_beyond_the_next_entry() -> None:
    """A turn that is late holds the clock back: no listener gets a time whose packets come later."""
    playback = Theatre([0, 10, 100]).playback
    playback.advance(0)
    assert playback.time_ns(50 * MS) == 10 * MS
    assert playback.advance(50 * MS) == entries(10) and playback.time_ns(60 * MS) == 60 * MS
    assert playback.deadline_ns(60 * MS) == 100 * MS


def test_a_problem_ends_it_behind_what_was_read() -> None:
    def read(time_ns: int) -> Iterator[Entry]:
        yield from entries(0, 5)
        raise CaptureError("the file is damaged")

    playback = Playback(read, Span(0, 1000 * MS), TICK_NS, Pace("realtime"), loop=True)
    assert playback.advance(0) == entries(0) and playback.failure == ""
    assert playback.advance(5 * MS) == entries(5)
    assert (playback.state(), playback.time_ns(5 * MS)) == ("ended", 5 * MS)
    assert playback.failure == "the file is damaged"


def test_no_more_than_some_are_published_between_two_looks() -> None:
    many = entries(0) * (AT_ONCE_MAX + 10)
    playback = Playback(lambda time_ns: iter(many), Span(0, 1), TICK_NS, Pace("fast"))
    assert len(playback.advance(0)) == AT_ONCE_MAX and not playback.ended
    assert len(playback.advance(0)) == 10 and playback.ended


# --- requests and keys -----------------------------------------------------------------------------------------------


def asked(theatre: Theatre) -> Requests:
    return Requests(theatre.playback, TICK_NS, {"capture": "run.mcap"})


def request(verb: str, identity: str = "1", sender: str = "me", **arguments: Any) -> Request:
    return Request(sender, identity, verb, encode_json(arguments))


def refusal(answer: Answer) -> str:
    assert not answer.accepted
    return answer.text


def test_requests_are_done_once_and_answered_with_the_status() -> None:
    theatre = Theatre([float(t) for t in range(100)], paused=True)
    requests = asked(theatre)
    answer = requests.answer(request("step", count=3), theatre.now_ns)
    assert answer.accepted and answer.sender == "me" and answer.tick == 3
    assert requests.answer(request("step", count=3), theatre.now_ns) is answer, "said again, it is one step"
    theatre.turn()
    assert theatre.heard_ms == [0, 1, 2, 3, 4, 5, 6]
    requests.answer(request("seek", "2", time_ns=50 * MS), theatre.now_ns)
    requests.answer(request("rate", "3", pace="2x"), theatre.now_ns)
    status = decode_json(requests.answer(request("resume", "4"), theatre.now_ns).result)
    assert status == {
        "time_ns": 50 * MS, "rate": "2x", "state": "playing", "jumps": 1, "published": 7, "capture": "run.mcap"
    }  # fmt: skip
    assert decode_json(requests.answer(request("pause", "5"), theatre.now_ns).result)["state"] == "paused"
    assert not requests.stopped
    requests.answer(request("stop", "6"), theatre.now_ns)
    assert requests.stopped


def test_what_cannot_be_done_is_refused_with_the_choices() -> None:
    theatre = Theatre([0, 10])
    requests = asked(theatre)
    refused: dict[str, tuple[dict[str, Any], str]] = {
        "paus": ({}, "there are: pause, rate, resume, seek, status, step, stop), 'paus', nearest is 'pause'"),
        "step": ({}, "step has count argument"),
        "pause": ({"count": 1}, "pause has no arguments"),
        "rate": ({"pace": "quick"}, "not a pace (realtime, fast or a factor such as 2x), 'quick'"),
        "seek": ({"time_ns": "soon"}, "seek: time_ns is not a whole number, 'soon'"),
    }
    for number, (verb, (arguments, text)) in enumerate(refused.items()):
        assert text in refusal(requests.answer(request(verb, str(number), **arguments), 0))
    bad = (Request("me", "a", "step", b"{"), Request("me", "b", "step", b"[]"))
    assert all(not requests.answer(wrong, 0).accepted for wrong in bad)
    assert not requests.answer(request("step", "c", count=True), 0).accepted
    assert not requests.answer(request("step", "d", count=-1), 0).accepted
    theatre.play()
    assert refusal(requests.answer(request("pause", "e"), theatre.now_ns)) == "the replay has ended"
    assert set(ARGUMENTS) == {"status", "pause", "resume", "step", "seek", "rate", "stop"}


def test_the_answers_of_so_many_are_kept() -> None:
    requests = asked(Theatre([0, 10], paused=True))
    first = requests.answer(request("status", sender="first"), 0)
    for number in range(ANSWERS_KEPT):
        requests.answer(request("status", sender=f"n{number}"), 0)
    assert requests.answer(request("status", sender="first"), 0) is not first


def test_keys_do_what_requests_do() -> None:
    theatre = Theatre([float(t) for t in range(0, 20_000, 1000)])
    requests, playback, now_ns = asked(theatre), theatre.playback, theatre.now_ns
    theatre.turn()
    requests.key(" ", now_ns)
    assert playback.state() == "paused"
    requests.key("right", now_ns)
    assert playback.time_ns(now_ns) == 5000 * MS
    requests.key("left", now_ns)
    requests.key("left", now_ns)
    assert playback.time_ns(now_ns) == 0, "no further than the beginning"
    requests.key("s", now_ns)
    theatre.turn()
    assert playback.time_ns(now_ns) == TICK_NS
    for key, rate in (("up", "2x"), ("up", "4x"), ("down", "2x"), ("down", "realtime"), ("down", "0.5x")):
        requests.key(key, now_ns)
        assert playback.clock(now_ns).rate == rate
    for _ in range(20):
        requests.key("up", now_ns)
    assert playback.clock(now_ns).rate == "1000x"
    requests.key("x", now_ns)
    requests.key(" ", now_ns)
    assert playback.state() == "playing" and not requests.stopped
    requests.key("q", now_ns)
    assert requests.stopped


def test_arrows_are_one_key_also_in_two_parts() -> None:
    assert split_keys(" s\x1b[A\x1b[Dq") == ([" ", "s", "up", "left", "q"], "")
    assert split_keys("\x1bOC") == (["right"], "")
    for cut in ("\x1b", "\x1b["):
        keys, rest = split_keys(f"s{cut}")
        assert (keys, rest) == (["s"], cut)
    assert split_keys("\x1b[" + "B") == (["down"], "")

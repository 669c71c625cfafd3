"""The clock of recordings: the position by wall time, and what requests make of it."""

from __future__ import annotations

from typing import Any, Final

import pytest

from foosim.common.errors import BadValue
from foosim.console.clock.deck import Deck

TICK_NS: Final = 2_000_000
SECOND_NS: Final = 1_000_000_000


class Stage(Deck):
    """1,000 ticks of 2 ms, from 500 on, at a wall time that the test sets."""

    def __init__(self) -> None:
        self.now_ns = 0
        self.reading_ns = 0
        """Wall time that passes with each reading of the clock."""
        super().__init__(500, 1500, TICK_NS, self._clock)

    def _clock(self) -> int:
        self.now_ns += self.reading_ns
        return self.now_ns

    def at(self, now_s: float) -> int:
        self.now_ns = round(now_s * SECOND_NS)
        return self.tick()

    def ask(self, verb: str, **arguments: Any) -> int:
        return self.request(verb, arguments, lambda tick, later: None).tick


def test_it_passes_time_at_its_rate_while_it_plays() -> None:
    deck = Stage()
    assert deck.paused and deck.at(7) == 500 and deck.wall_ns(501 * TICK_NS) is None
    deck.ask("play")
    assert deck.at(7.5) == 750 and deck.at(8) == 1000
    deck.ask("rate", pace="0.5x")
    assert deck.at(9) == 1250, "the time that had passed before the change remains"
    assert deck.wall_ns(1300 * TICK_NS) == deck.wall_ns(1300 * TICK_NS - 1) == 9 * SECOND_NS + SECOND_NS // 5


def test_at_its_end_it_is_paused_or_begins_again() -> None:
    deck = Stage()
    deck.ask("play")
    assert (deck.at(2), deck.paused) == (1500, True)
    deck.now_ns = 3 * SECOND_NS
    assert deck.ask("play") == 500, "from there it plays from the beginning"
    deck.ask("loop", on=True)
    jumps = deck.jumps
    assert deck.at(5.2) == 600 and deck.jumps == jumps + 1 and not deck.paused
    assert deck.at(10.2) in range(500, 1500), "several rounds at once"


def test_steps_go_as_far_as_there_are_ticks_and_pause() -> None:
    deck = Stage()
    deck.ask("play")
    deck.now_ns = 10 * TICK_NS
    assert deck.ask("step", count=3) == 513 and deck.paused and deck.at(1) == 513
    jumps = deck.jumps
    assert deck.ask("step", count=-20) == 500 and deck.jumps == jumps + 1, "a step back cuts paths"


@pytest.mark.parametrize(("count", "there"), [(1, 600), (-1, 510)])
def test_a_step_to_a_recorded_moment_while_it_plays_ends_there(count: int, there: int) -> None:
    deck = Stage()
    deck.ask("play")
    deck.now_ns, deck.reading_ns = 50 * TICK_NS, TICK_NS

    def neighbour(tick: int, later: bool) -> int:
        assert (tick, later) == (551, count > 0)
        deck.now_ns += 5 * TICK_NS
        return there

    answer = deck.request("step", {"count": count, "unit": "frames"}, neighbour)
    assert (answer.text, answer.tick) == (f"paused at tick {there}, {there * TICK_NS / SECOND_NS:g} s", there)
    assert deck.tick() == there


def test_a_request_holds_at_one_time_and_none_is_lost() -> None:
    deck = Stage()
    deck.reading_ns = TICK_NS
    assert deck.ask("play") == 500
    answer = deck.request("rate", {"pace": "2x"}, lambda tick, later: None)
    assert (answer.text, answer.tick) == ("at 2x from tick 501, 1.002 s on", 501)
    deck.grow(500, 2000)
    deck.ask("rate", pace="realtime")
    assert deck.tick() == 506, "two ticks until the growth, two until the rate, one since"


@pytest.mark.parametrize(
    ("verb", "arguments", "text"),
    [
        *(("step", {"count": count}, "out of range 1 to 1000000") for count in (0, 1_000_001, -1_000_001)),
        *(("seek", {"tick": tick}, "has 500 to 1500") for tick in (499, 1501, -1)),
        *(("rate", {"pace": pace}, "rate|pace|range") for pace in ("fast", "0x", "quick")),
    ],
)
def test_invalid_requests_change_nothing(verb: str, arguments: dict[str, Any], text: str) -> None:
    deck = Stage()
    with pytest.raises(BadValue, match=text):
        deck.ask(verb, **arguments)
    assert (deck.tick(), str(deck.pace), deck.jumps) == (500, "realtime", 0)


def test_a_recording_that_grows_keeps_its_place_and_one_that_loses_its_beginning_jumps() -> None:
    deck = Stage()
    deck.ask("seek", tick=1500)
    deck.grow(500, 2000)
    deck.ask("play")
    assert deck.at(0.02) == 1510
    jumps = deck.jumps
    deck.grow(1800, 2100)
    assert deck.tick() == 1800 and deck.jumps == jumps + 1

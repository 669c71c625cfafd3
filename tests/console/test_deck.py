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
        super().__init__(500, 1500, TICK_NS, lambda: self.now_ns)

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

"""Where a recording is looked at: the position by wall time, and what people ask for."""

from __future__ import annotations

import pytest

from foosim.common.errors import BadValue
from foosim.console.clock.playhead import Playhead

TICK_NS = 2_000_000
SECOND_NS = 1_000_000_000


def head() -> Playhead:
    """1,000 ticks of 2 ms, from 500 on."""
    return Playhead(500, 1500, TICK_NS)


def test_it_stands_at_the_beginning_until_it_plays_and_passes_time_at_its_rate() -> None:
    playhead = head()
    assert playhead.paused and playhead.at(7 * SECOND_NS) == 500
    playhead.play(7 * SECOND_NS)
    assert playhead.tick(7 * SECOND_NS + SECOND_NS // 2) == 750
    assert playhead.at(7 * SECOND_NS + 3_000_000) == 501.5
    playhead.set_rate("0.5x", 8 * SECOND_NS)
    assert playhead.tick(9 * SECOND_NS) == 1250, "what had passed before the change stays"
    assert playhead.wall_ns(1300) == 9 * SECOND_NS + SECOND_NS // 5


def test_at_its_end_it_is_paused_or_goes_round() -> None:
    playhead = head()
    playhead.play(0)
    assert (playhead.at(2 * SECOND_NS), playhead.wall_ns(1501)) == (1500, None), "exactly at its end it stands"
    playhead.play(3 * SECOND_NS)
    assert playhead.tick(3 * SECOND_NS) == 500, "from there it plays from the beginning"
    playhead.loops = True
    jumps = playhead.jumps
    assert playhead.tick(3 * SECOND_NS + 2 * SECOND_NS + SECOND_NS // 5) == 600
    assert playhead.jumps == jumps + 1 and not playhead.paused
    assert playhead.tick(3 * SECOND_NS + 7 * SECOND_NS + SECOND_NS // 5) in range(500, 1500), "several rounds at once"


def test_steps_go_on_and_back_as_far_as_there_are_ticks_and_pause() -> None:
    playhead = head()
    playhead.play(0)
    playhead.step(3, 10 * TICK_NS)
    assert playhead.paused and playhead.tick(SECOND_NS) == 513
    jumps = playhead.jumps
    playhead.step(-20, 0)
    assert playhead.tick(0) == 500 and playhead.jumps == jumps + 1, "a step back cuts paths"
    for count in (0, 1_000_001, -1_000_001):
        with pytest.raises(BadValue, match="out of range 1 to 1000000"):
            playhead.step(count, 0)


def test_a_tick_that_is_not_there_and_a_rate_without_a_clock_are_refused() -> None:
    playhead = head()
    for tick in (499, 1501, -1):
        with pytest.raises(BadValue, match="has 500 to 1500"):
            playhead.seek(tick, 0)
    for pace in ("fast", "0x", "quick"):
        with pytest.raises(BadValue):
            playhead.set_rate(pace, 0)
    assert playhead.tick(0) == 500 and str(playhead.pace) == "realtime"


def test_a_recording_that_grows_keeps_its_place_and_one_that_loses_its_beginning_jumps() -> None:
    playhead = head()
    playhead.seek(1500, 0)
    playhead.grow(500, 2000, 0)
    playhead.play(0)
    assert playhead.tick(10 * TICK_NS) == 1510
    jumps = playhead.jumps
    playhead.grow(1800, 2100, 10 * TICK_NS)
    assert playhead.tick(10 * TICK_NS) == 1800 and playhead.jumps == jumps + 1

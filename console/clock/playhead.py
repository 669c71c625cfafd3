"""Where a recording is looked at: playing, paused, stepped, sought, looped, at a rate.

Pure: the caller gives the wall time, of one monotonic clock. A position is a tick, with a fraction while it plays.
"""

from __future__ import annotations

from fractions import Fraction
from math import ceil
from typing import Final

from foosim.common.errors import BadValue
from foosim.common.units import Pace, parse_pace

STEP_MAX: Final = 1_000_000
NS_PER_S: Final = 1_000_000_000


class Playhead:
    """One position in a recording from tick `first` to `last`; it starts paused at the first."""

    def __init__(self, first: int, last: int, tick_ns: int) -> None:
        self.first, self.last = first, last
        self.paused = True
        self.loops = False
        self.jumps = 0
        """Seeks, backward steps and rounds: a path ends where this changes."""
        self.pace = Pace("realtime")
        self._tick_ns = tick_ns
        self._at = Fraction(first)
        """Position at the anchor."""
        self._anchor_ns = 0
        """Wall time of it, while it plays."""

    def at(self, now_ns: int) -> float:
        """Return the position, as a tick with a fraction; at its end a recording begins again or pauses."""
        return float(self._advance(now_ns))

    def tick(self, now_ns: int) -> int:
        """Return the tick that was reached."""
        return int(self._advance(now_ns))

    def _advance(self, now_ns: int) -> Fraction:
        if self.paused:
            return self._at
        passed = max(0, now_ns - self._anchor_ns) * self.pace.factor / self._tick_ns
        at = self._at + passed
        if at < self.last:
            return at
        if not self.loops or self.first == self.last:
            self._at, self.paused = Fraction(self.last), True
            return self._at
        self.jumps += 1
        self._anchor(self.first + (at - self.last) % (self.last - self.first), now_ns)
        return self._at

    def _anchor(self, at: Fraction, now_ns: int) -> None:
        self._at, self._anchor_ns = at, now_ns

    def wall_ns(self, tick: int) -> int | None:
        """Return the wall time at which a tick is reached; None while paused."""
        if self.paused:
            return None
        return self._anchor_ns + ceil((tick - self._at) * self._tick_ns / self.pace.factor)

    def grow(self, first: int, last: int, now_ns: int) -> None:
        """Take other ends: a recording that is still being written has grown, or let its oldest files go."""
        at = self._advance(now_ns)
        self.first, self.last = first, last
        if at < first:
            self.jumps += 1
        self._anchor(min(max(at, Fraction(first)), Fraction(last)), now_ns)

    def play(self, now_ns: int) -> None:
        """Play; at the end, from the beginning."""
        if not self.paused:
            return
        if self._at >= self.last:
            self.seek(self.first, now_ns)
        self.paused = False
        self._anchor(self._at, now_ns)

    def pause(self, now_ns: int) -> None:
        """Pause, at a whole tick."""
        self._at, self.paused = Fraction(self.tick(now_ns)), True

    def seek(self, tick: int, now_ns: int) -> None:
        """Go to a tick. Raises BadValue for one that the recording does not have."""
        if not self.first <= tick <= self.last:
            raise BadValue(f"seek: not a tick of the recording, which has {self.first} to {self.last}", tick)
        self.jumps += 1
        self._anchor(Fraction(tick), now_ns)

    def step(self, count: int, now_ns: int) -> None:
        """Go `count` ticks forward, or back when negative, as far as there are ticks, and pause there.

        Raises BadValue for a count out of range.
        """
        if not count or abs(count) > STEP_MAX:
            raise BadValue(f"step: a count out of range 1 to {STEP_MAX}, or negative to go back", count)
        self.pause(now_ns)
        self.jumps += count < 0
        self._at = Fraction(min(max(int(self._at) + count, self.first), self.last))

    def set_rate(self, text: str, now_ns: int) -> None:
        """Continue at another rate. Raises BadValue: a page has no `fast`."""
        pace = parse_pace(text)
        if pace.kind == "fast":
            raise BadValue("rate: a recording is shown at realtime or a factor such as 8x", text)
        self._anchor(self._advance(now_ns), now_ns)
        self.pace = pace

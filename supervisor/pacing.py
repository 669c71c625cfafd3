"""Pacing: when the next order may be released, and how late ticks are.

Order k is the permission to compute tick k. It is released once tick k - W is committed; in realtime also not before
wall time k T (scaled by the factor), so that no command waits for ticks ahead of the clock; while paused,
not at all, but for the ticks that `step` granted.
"""

from __future__ import annotations

from foosim.common import limits
from foosim.common.histogram import Lags
from foosim.common.units import Pace


class Pacer:
    """Decides when orders are released. All wall times are the caller's `now_ns`."""

    def __init__(self, tick_ns: int, pace: Pace) -> None:
        self.tick_ns = tick_ns
        self.pace = pace
        self.paused = False
        self.lags = Lags()
        self.last_lag_ns = 0
        self.anchor_ns = 0
        """Wall time of tick 0 at this pace."""
        self.granted = 0
        """The tick up to which `step` allows while paused."""

    @property
    def is_fast(self) -> bool:
        return self.pace.kind == "fast"

    @property
    def counts_lags(self) -> bool:
        """Whether ticks can be late at all."""
        return not self.is_fast and not self.paused

    def _span_ns(self, ticks: int) -> int:
        """Return the wall time that `ticks` take at this pace."""
        factor = self.pace.factor
        return ticks * self.tick_ns * factor.denominator // factor.numerator

    def start(self, now_ns: int, tick: int = 0) -> None:
        """Set the anchor so that `tick` is due now."""
        self.anchor_ns = now_ns if self.is_fast else now_ns - self._span_ns(tick)

    def may_release(self, tick: int, committed: int, now_ns: int) -> bool:
        """Whether order `tick` may be released now."""
        if tick > committed + limits.RELEASE_AHEAD:
            return False
        if self.paused:
            return tick < self.granted
        return self.is_fast or now_ns >= self.anchor_ns + self._span_ns(tick)

    def release_ns(self, tick: int) -> int | None:
        """When order `tick` is due by the clock; None when no clock decides."""
        if self.paused or self.is_fast:
            return None
        return self.anchor_ns + self._span_ns(tick)

    def committed(self, tick: int, now_ns: int) -> int:
        """Note that frame `tick` is committed; return how far a large lag moved the anchor, in ns."""
        if not self.counts_lags:
            self.last_lag_ns = 0
            return 0
        lag_ns = max(0, now_ns - (self.anchor_ns + self._span_ns(tick)))
        self.last_lag_ns = lag_ns
        self.lags.add(lag_ns)
        if lag_ns <= limits.LAG_ANCHOR_NS:
            return 0
        self.anchor_ns += lag_ns
        return lag_ns

    def pause(self, next_tick: int) -> None:
        """Release nothing from `next_tick` on."""
        self.paused = True
        self.granted = next_tick

    def resume(self, next_tick: int, now_ns: int) -> None:
        """Continue with `next_tick` now."""
        self.paused = False
        self.start(now_ns, next_tick)

    def step(self, next_tick: int, count: int) -> None:
        """Grant `count` ticks from `next_tick` on, and stay paused after them."""
        self.granted = max(self.granted, next_tick) + count if self.paused else next_tick + count
        self.paused = True

    def set_pace(self, pace: Pace, next_tick: int, now_ns: int) -> None:
        """Change the pace from `next_tick` on."""
        self.pace = pace
        self.start(now_ns, next_tick)

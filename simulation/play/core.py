"""The core of a replay: takes requests and the time, returns the entries to publish and the next deadline.

Every deadline is counted from one anchor, a wall time at which a captured time was due, and not from the entry before,
so lateness does not add up. A lag above `LAG_ANCHOR_NS` moves the anchor, and is counted: a replay that cannot keep up
is slower. The core has no clock and no file; it reads ahead by one entry of an iterator.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

from foosim.common.errors import BadValue, Refused
from foosim.common.limits import LAG_ANCHOR_NS
from foosim.common.units import Pace, format_ns
from foosim.protocol.replay_messages import ReplayClock
from foosim.simulation.play.entries import Entry

AT_ONCE_MAX: Final = 256
"""How many entries are published between two looks at requests and keys."""
STEPS_MAX: Final = 1_000_000

PLAYING, PAUSED, ENDED = "playing", "paused", "ended"


@dataclass(frozen=True, slots=True)
class Span:
    """The part that is played: captured times, ends included."""

    first_ns: int
    last_ns: int


class Playback:
    """One replay. Times called `now_ns` are wall times of one monotonic clock."""

    def __init__(
        self,
        entries_from: Callable[[int], Iterator[Entry]],
        span: Span,
        tick_ns: int,
        pace: Pace,
        loop: bool = False,
        paused: bool = False,
    ) -> None:
        """`entries_from` reads the entries from a captured time on; the iterator may raise Refused."""
        self.span: Final = span
        self.pace = pace
        self.ended = False
        self.failure = ""
        """Why it ended before its end."""
        self.published = self.slips = self.rounds = self.jumps = self.late_ns_max = 0
        self._entries_from = entries_from
        self._tick_ns = tick_ns
        self._loop = loop
        self._paused = paused
        self._step_to_ns: int | None = None
        self._go_to(span.first_ns)

    def _go_to(self, time_ns: int) -> None:
        """Continue from a captured time."""
        self._entries = self._entries_from(time_ns)
        self._time_ns = self._last_ns = time_ns
        """Captured time at the anchor, or of a paused replay; captured time of the last published entry."""
        self._anchor_ns: int | None = None
        """Wall time at which `_time_ns` was due; None while paused."""
        self._problem = ""
        self._is_empty = True
        self._load()

    def _load(self) -> None:
        """Read the next entry; None at the end of the span, or where the file is damaged."""
        entry = None
        try:
            entry = next(self._entries, None)
        except Refused as error:
            self._problem = str(error)
        self._next = entry if entry is not None and entry.time_ns <= self.span.last_ns else None

    def advance(self, now_ns: int) -> list[Entry]:
        """Return the entries to publish now, in order, at most `AT_ONCE_MAX`."""
        if self.ended or (self._paused and self._step_to_ns is None):
            return []
        until_ns = self._until_ns(now_ns)
        due: list[Entry] = []
        while self._next is not None and self._next.time_ns <= until_ns and len(due) < AT_ONCE_MAX:
            due.append(self._next)
            self._load()
        if due:
            self.published += len(due)
            self._last_ns = due[-1].time_ns
            self._is_empty = False
            if self._anchor_ns is not None:
                self.late_ns_max = max(self.late_ns_max, now_ns - self._wall_ns(due[0].time_ns))
        if self._next is None or self._next.time_ns > until_ns:
            if self._step_to_ns is not None:
                self._time_ns, self._step_to_ns = until_ns, None
            if self._next is None and (self._problem or until_ns >= self.span.last_ns):
                self._end_round()
        return due

    def _until_ns(self, now_ns: int) -> int:
        """Return the captured time up to which entries are due."""
        if self._step_to_ns is not None:
            return self._step_to_ns
        if self.pace.kind == "fast":
            return self.span.last_ns
        if self._anchor_ns is None:
            self._anchor_ns = now_ns
        if self._next is not None and now_ns - self._wall_ns(self._next.time_ns) > LAG_ANCHOR_NS:
            self.slips += 1
            self._anchor_ns, self._time_ns = now_ns, max(self._time_ns, self._next.time_ns)
        return self._passed_ns(now_ns)

    def _end_round(self) -> None:
        self.rounds += 1
        if self._loop and not self._problem and not self._is_empty:
            self.jumps += 1
            self._go_to(self.span.first_ns)
            return
        self.ended = True
        self._anchor_ns = None
        self._time_ns = self._last_ns if self._problem else self.span.last_ns
        self.failure = self._problem
        if self._loop and not self.failure:
            self.failure = "nothing of the capture is selected, so there is nothing to repeat"

    def deadline_ns(self, now_ns: int) -> int | None:
        """Return when `advance` is due; None while only a request changes something."""
        if self._step_to_ns is not None or self.ended:
            return now_ns
        if self._paused:
            return None
        if self.pace.kind == "fast" or self._anchor_ns is None:
            return now_ns
        return self._wall_ns(self.span.last_ns if self._next is None else self._next.time_ns)

    def time_ns(self, now_ns: int) -> int:
        """Return the captured time at a wall time, at most that of the next entry."""
        if self.pace.kind == "fast" and not self.ended:
            return max(self._time_ns, self._last_ns)
        passed_ns = self._passed_ns(now_ns)
        return passed_ns if self._next is None else min(passed_ns, max(self._time_ns, self._next.time_ns))

    def heading_ns(self, now_ns: int) -> int:
        """Return the captured time at a wall time, or at the end of the step in progress."""
        return self.time_ns(now_ns) if self._step_to_ns is None else self._step_to_ns

    def _passed_ns(self, now_ns: int) -> int:
        """Return the captured time that is due at a wall time."""
        if self._anchor_ns is None:
            return self._time_ns
        factor = self.pace.factor
        passed_ns = (now_ns - self._anchor_ns) * factor.numerator // factor.denominator
        return min(self.span.last_ns, self._time_ns + passed_ns)

    def _wall_ns(self, time_ns: int) -> int:
        """Return the wall time at which a captured time is due, rounded up."""
        assert self._anchor_ns is not None
        factor = self.pace.factor
        return self._anchor_ns - (-(time_ns - self._time_ns) * factor.denominator // factor.numerator)

    def state(self) -> str:
        return ENDED if self.ended else PAUSED if self._paused else PLAYING

    def clock(self, now_ns: int) -> ReplayClock:
        return ReplayClock(self.time_ns(now_ns), str(self.pace), self.state(), self.jumps)

    # --- requests ----------------------------------------------------------------------------------------------------

    def pause(self, now_ns: int) -> None:
        self._hold(now_ns)
        self._paused = True

    def resume(self, now_ns: int) -> None:
        self._hold(now_ns)
        self._paused = False

    def step(self, ticks: int, now_ns: int) -> None:
        """Publish the entries of the next `ticks` ticks at once, and pause after them. Raises BadValue."""
        if not 1 <= ticks <= STEPS_MAX:
            raise BadValue(f"not a number of ticks, 1 to {STEPS_MAX}", ticks)
        at_ns = self.heading_ns(now_ns)
        self.pause(now_ns)
        self._step_to_ns = min((at_ns // self._tick_ns + ticks) * self._tick_ns, self.span.last_ns)

    def seek(self, time_ns: int, now_ns: int) -> None:
        """Continue from a captured time, playing or paused as before. Raises BadValue for a time out of the span."""
        if not self.span.first_ns <= time_ns <= self.span.last_ns:
            first, last = format_ns(self.span.first_ns), format_ns(self.span.last_ns)
            raise BadValue(f"not a time that is played, {first} to {last}", format_ns(time_ns))
        self._hold(now_ns)
        self.jumps += 1
        self._go_to(time_ns)

    def set_pace(self, pace: Pace, now_ns: int) -> None:
        self._hold(now_ns)
        self.pace = pace

    def _hold(self, now_ns: int) -> None:
        """Count from the captured time of now; a step in progress ends here."""
        self._time_ns = self.time_ns(now_ns)
        self._anchor_ns = self._step_to_ns = None

"""The core of a replay: takes entries, requests and the time, says what to publish next and when to look again.

Every deadline is counted from one anchor, a wall time at which a captured time was due, and never from the entry
before: what comes late is caught up. A lag above `LAG_ANCHOR_NS` moves the anchor, and is counted: a replay that cannot
keep up is slower, and says so. Pure: no clock, no file. Whoever reads the file asks `reading` what is wanted, and
gives it to `feed`.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from foosim.common.errors import BadValue
from foosim.common.limits import LAG_ANCHOR_NS
from foosim.common.units import Pace, format_ns
from foosim.protocol.replay_messages import ReplayClock
from foosim.replay.entries import Entry

AT_ONCE_MAX: Final = 256
"""How many entries are published between two looks at requests and keys."""
STEPS_MAX: Final = 1_000_000

PLAYING, PAUSED, WAITING, ENDED = "playing", "paused", "waiting", "ended"


@dataclass(frozen=True, slots=True)
class Span:
    """What is played: captured times, ends included."""

    first_ns: int
    last_ns: int


@dataclass(frozen=True, slots=True)
class Reading:
    """What the core wants to be fed with: entries from a time on. Another number asks anew."""

    number: int
    from_ns: int


@dataclass(frozen=True, slots=True)
class PlayStatistics:
    """What was published, how late, how often the anchor had to be moved, and how often all of it was played."""

    published: int
    late_ns_mean: int
    late_ns_max: int
    slips: int
    rounds: int
    jumps: int


class Playback:
    """One capture on its way out. Times called `now_ns` are wall times of one monotonic clock."""

    def __init__(
        self,
        span: Span,
        tick_ns: int,
        pace: Pace,
        now_ns: int,
        loop: bool = False,
        paused: bool = False,
        delay_ns: int = 0,
    ) -> None:
        """`delay_ns` is the wall time before it begins."""
        self.span: Final = span
        self.pace = pace
        self.reading = Reading(0, span.first_ns)
        self.ended = False
        self.failure = ""
        """Why it ended before its end."""
        self._tick_ns = tick_ns
        self._loop = loop
        self._paused = paused
        self._begin_ns = now_ns + delay_ns
        self._queue: deque[Entry] = deque()
        self._is_last = False
        """Whether nothing comes behind what is queued."""
        self._time_ns = span.first_ns
        """Captured time at the anchor, or where a replay that does not run stands."""
        self._anchor_ns: int | None = None
        """Wall time that belongs to it; None until there is something to play."""
        self._step_to_ns: int | None = None
        self._problem = ""
        self._last_ns = 0
        """Captured time of what was published last."""
        self._published = self._slips = self._rounds = self._jumps = 0
        self._of_round = 0
        self._late_ns_sum = self._late_ns_max = self._timed = 0

    # --- what is fed and published -----------------------------------------------------------------------------------

    @property
    def queued(self) -> int:
        """How many entries wait."""
        return len(self._queue)

    def feed(self, number: int, entries: Iterable[Entry], is_last: bool, problem: str = "") -> None:
        """Take what was read; what was read for an earlier wish is dropped. `problem`: nothing further can be read."""
        if number == self.reading.number and not self._is_last:
            self._queue.extend(entries)
            self._is_last = is_last or bool(problem)
            self._problem = problem

    def advance(self, now_ns: int) -> list[Entry]:
        """Return what is to be published now, in order; it is no more than `AT_ONCE_MAX`."""
        if self.ended or now_ns < self._begin_ns:
            return []
        if self._step_to_ns is not None:
            return self._advance_step(self._step_to_ns)
        if self._paused or not (self._queue or self._is_last):
            return []
        if self._anchor_ns is None:
            self._anchor_ns = now_ns
        if self.pace.kind == "fast":
            due = self._take(self.span.last_ns)
            if due:
                self._time_ns = max(self._time_ns, due[-1].time_ns)
        else:
            if self._queue and now_ns - self._wall_ns(self._queue[0].time_ns) > LAG_ANCHOR_NS:
                self._slips += 1
                self._anchor_ns, self._time_ns = now_ns, max(self._time_ns, self._queue[0].time_ns)
            due = self._take(self._passed_ns(now_ns))
            self._note_late(due, now_ns)
        if not self._queue and self._is_last and (self._problem or self._is_over(now_ns)):
            self._end_round()
        return due

    def _is_over(self, now_ns: int) -> bool:
        return self.pace.kind == "fast" or self._passed_ns(now_ns) >= self.span.last_ns

    def _note_late(self, due: list[Entry], now_ns: int) -> None:
        for entry in due:
            late_ns = max(0, now_ns - self._wall_ns(entry.time_ns))
            self._late_ns_sum += late_ns
            self._late_ns_max = max(self._late_ns_max, late_ns)
        self._timed += len(due)

    def _advance_step(self, to_ns: int) -> list[Entry]:
        due = self._take(to_ns)
        if self._is_last if not self._queue else self._queue[0].time_ns > to_ns:
            self._step_to_ns = None
            self._time_ns = min(to_ns, self.span.last_ns)
            if self._is_last and not self._queue and (self._problem or to_ns >= self.span.last_ns):
                self._end_round()
        return due

    def _take(self, until_ns: int) -> list[Entry]:
        due: list[Entry] = []
        queue = self._queue
        while queue and len(due) < AT_ONCE_MAX and queue[0].time_ns <= until_ns:
            due.append(queue.popleft())
        if due:
            self._last_ns = due[-1].time_ns
        self._published += len(due)
        self._of_round += len(due)
        return due

    def _end_round(self) -> None:
        self._rounds += 1
        self._anchor_ns = None
        self._time_ns = max(self._time_ns, self._last_ns) if self._problem else self.span.last_ns
        if self._problem or not self._loop or not self._of_round:
            self.ended = True
            self.failure = self._problem
            if not self.failure and self._loop:
                self.failure = "nothing of the capture is selected, so there is nothing to repeat"
            return
        self._of_round = 0
        self._go_to(self.span.first_ns)

    def deadline_ns(self, now_ns: int) -> int | None:
        """Return when there is something to do by time; None when only a request or more entries change something."""
        if self.ended:
            return now_ns
        if now_ns < self._begin_ns:
            return self._begin_ns
        if self._step_to_ns is not None or (not self._paused and self.pace.kind == "fast"):
            return now_ns if self._queue or self._is_last else None
        if self._paused or not (self._queue or self._is_last):
            return None
        if self._anchor_ns is None:
            return now_ns
        return self._wall_ns(self._queue[0].time_ns if self._queue else self.span.last_ns)

    # --- where it is -------------------------------------------------------------------------------------------------

    def time_ns(self, now_ns: int) -> int:
        """Return the captured time that a wall time is, never beyond what is still to be published."""
        if self._queue:
            return min(self._passed_ns(now_ns), max(self._time_ns, self._queue[0].time_ns))
        return self._passed_ns(now_ns) if self._is_last else max(self._time_ns, self._last_ns)

    def goal_ns(self, now_ns: int) -> int:
        """Return the captured time at which it stands, or will as soon as a step is done that is under way."""
        return self.time_ns(now_ns) if self._step_to_ns is None else self._step_to_ns

    def _passed_ns(self, now_ns: int) -> int:
        """Return the captured time that is due at a wall time."""
        if self._anchor_ns is None or self.pace.kind == "fast":
            return self._time_ns
        factor = self.pace.factor
        passed_ns = (now_ns - self._anchor_ns) * factor.numerator // factor.denominator
        return min(self.span.last_ns, self._time_ns + passed_ns)

    def _wall_ns(self, time_ns: int) -> int:
        """Return the wall time at which a captured time is due, rounded up: then it is not before that time."""
        assert self._anchor_ns is not None
        factor = self.pace.factor
        return self._anchor_ns - (-(time_ns - self._time_ns) * factor.denominator // factor.numerator)

    def state(self, now_ns: int) -> str:
        """Return what it is doing."""
        if self.ended:
            return ENDED
        if self._paused:
            return PAUSED
        return WAITING if now_ns < self._begin_ns else PLAYING

    def clock(self, now_ns: int) -> ReplayClock:
        """Return what listeners are told of the time."""
        return ReplayClock(self.time_ns(now_ns), str(self.pace), self.state(now_ns), self._jumps)

    def statistics(self) -> PlayStatistics:
        mean_ns = self._late_ns_sum // self._timed if self._timed else 0
        return PlayStatistics(self._published, mean_ns, self._late_ns_max, self._slips, self._rounds, self._jumps)

    # --- requests ----------------------------------------------------------------------------------------------------

    def pause(self, now_ns: int) -> None:
        """Stand still; what is due by now has been published."""
        self._stand(now_ns)
        self._paused = True

    def resume(self, now_ns: int) -> None:
        """Go on; a delay that is left is waited for no longer."""
        self._stand(now_ns)
        self._paused = False
        self._begin_ns = min(self._begin_ns, now_ns)

    def step(self, ticks: int, now_ns: int) -> None:
        """Publish what lies within so many ticks from here, at once, and stand behind them. Raises BadValue."""
        if not 1 <= ticks <= STEPS_MAX:
            raise BadValue(f"not a number of ticks, 1 to {STEPS_MAX}", ticks)
        begin_ns = self._step_to_ns
        self.pause(now_ns)
        self._begin_ns = min(self._begin_ns, now_ns)
        at_ns = self._time_ns if begin_ns is None else begin_ns
        self._step_to_ns = min((at_ns // self._tick_ns + ticks) * self._tick_ns, self.span.last_ns)

    def seek(self, time_ns: int, now_ns: int) -> None:
        """Go to a captured time, and do there what it did before. Raises BadValue for one that is not played."""
        if not self.span.first_ns <= time_ns <= self.span.last_ns:
            first, last = format_ns(self.span.first_ns), format_ns(self.span.last_ns)
            raise BadValue(f"not a time that is played, {first} to {last}", format_ns(time_ns))
        self._stand(now_ns)
        self._go_to(time_ns)

    def set_pace(self, pace: Pace, now_ns: int) -> None:
        """Go on from here at another pace."""
        self._stand(now_ns)
        self.pace = pace

    def _stand(self, now_ns: int) -> None:
        """Make the captured time of now the one from which is counted; a step that is under way ends here."""
        self._time_ns = self.time_ns(now_ns)
        self._anchor_ns = None
        self._step_to_ns = None

    def _go_to(self, time_ns: int) -> None:
        self._queue.clear()
        self._is_last = False
        self._jumps += 1
        self._time_ns = self._last_ns = time_ns
        self._anchor_ns = None
        self.reading = Reading(self._jumps, time_ns)

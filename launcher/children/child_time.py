"""The clock of a child: while it waits for a processor, only the processor time that it receives counts.

A process that hangs sleeps or computes, so all of its time counts. One that is starved of processor time has threads in
state R that do not run, so its clock is slow, and no deadline of the launcher ends it for that. Pure but for `observe`,
which reads /proc. Times are in s.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

PROC: Final = Path("/proc")
EVERY_S: Final = 0.2
"""The shortest time between two observations of a process."""
WINDOW_S: Final = 5.0
"""A process is starved if it lacked a processor for more than half of such a time."""
WARNED_EVERY_S: Final = 30.0
"""The shortest time between two warnings."""


@dataclass(frozen=True, slots=True)
class Observed:
    """What the system reports of a process."""

    is_runnable: bool
    """Whether one of its threads runs, or waits for a processor."""
    processor_s: float
    """The processor time that it has received since its start."""


class ChildTime:
    """The clock of one process, from observations."""

    def __init__(self, now_s: float, observed: Observed | None) -> None:
        self._at_s = self._window_s = now_s
        self._last = observed
        self._lacked_s = self._lacked_before_s = 0.0
        self.starved = ""
        """How much processor time it had in the last window; empty where it did not lack any."""

    def time_s(self, now_s: float) -> float:
        """Return its time: that of the launcher, less the time in which it lacked a processor."""
        return now_s - self._lacked_s

    def is_due(self, now_s: float) -> bool:
        """Whether it is to be observed again."""
        return now_s >= self._at_s + EVERY_S

    def look(self, now_s: float, observed: Observed | None) -> None:
        """Add the interval since the last observation. Without one at both of its ends all of it counts."""
        last, passed_s = self._last, now_s - self._at_s
        self._last, self._at_s = observed, now_s
        if last is not None and observed is not None and last.is_runnable and observed.is_runnable:
            self._lacked_s += min(passed_s, max(0.0, passed_s - (observed.processor_s - last.processor_s)))
        if now_s >= self._window_s + WINDOW_S:
            window_s, lacked_s = now_s - self._window_s, self._lacked_s - self._lacked_before_s
            had = f"{window_s - lacked_s:.1f} s of processor time in {window_s:.0f} s"
            self.starved = had if lacked_s > window_s / 2 else ""
            self._window_s, self._lacked_before_s = now_s, self._lacked_s


class ChildTimes:
    """The clocks of the processes of this machine, by process identifier."""

    def __init__(self, observe: Callable[[int], Observed | None]) -> None:
        self._observe = observe
        self._clocks: dict[int, ChildTime] = {}
        self._warned_s = -WARNED_EVERY_S

    def at(self, pid: int, now_s: float) -> float:
        """Return a process's time at the launcher's time `now_s`."""
        clock = self._clocks.get(pid)
        if clock is None:
            clock = self._clocks[pid] = ChildTime(now_s, self._observe(pid))
        elif clock.is_due(now_s):
            clock.look(now_s, self._observe(pid))
        return clock.time_s(now_s)

    def warning(self, pids: Mapping[str, int], now_s: float) -> str:
        """Return which of these processes, by name, are starved; empty for none, and soon after the last warning."""
        clocks = {name: self._clocks[pid] for name, pid in pids.items() if pid in self._clocks}
        texts = [f"{name} received {clock.starved}" for name, clock in clocks.items() if clock.starved]
        if not texts or now_s < self._warned_s + WARNED_EVERY_S:
            return ""
        self._warned_s = now_s
        return f"this machine is starved of processor time: {', '.join(texts)}; their deadlines are extended"


def observe(pid: int) -> Observed | None:
    """Return what /proc reports of a process; None where there is no /proc, or no such process."""
    try:
        of_all = _fields(PROC / f"{pid}/stat")
        tasks = os.scandir(PROC / f"{pid}/task")
        with tasks:
            is_runnable = of_all[0] == "R" or any(_is_runnable(task.path) for task in tasks)
    except OSError:
        return None
    return Observed(is_runnable, (int(of_all[11]) + int(of_all[12])) / os.sysconf("SC_CLK_TCK"))


def _is_runnable(task: str) -> bool:
    """Whether a thread runs or waits for a processor; False for one that has ended since."""
    try:
        return _fields(Path(task) / "stat")[0] == "R"
    except OSError:
        return False


def _fields(path: Path) -> list[str]:
    """Return the fields of a stat file after the name, which may have spaces: state, parent, ..."""
    return path.read_text().rpartition(")")[2].split()

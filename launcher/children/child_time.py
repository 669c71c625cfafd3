"""The clock of a child: time for which its threads wait for a processor does not count.

So no deadline of the launcher ends a process that is starved of processor time; one that hangs sleeps or computes, and
all of its time counts. Pure but for `waited_s`, which reads /proc. Times are in s.
"""

from __future__ import annotations

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


@dataclass(slots=True)
class _Clock:
    at_s: float
    waited_s: float | None
    """The time for which its threads have waited for a processor; None where that is unknown."""
    window_s: float
    lacked_s: float = 0.0
    lacked_before_s: float = 0.0
    starved: str = ""
    """How much processor time it had in the last window; empty where it did not lack any."""

    def look(self, now_s: float, waited_s: float | None) -> None:
        if waited_s is not None and self.waited_s is not None:
            self.lacked_s += min(now_s - self.at_s, max(0.0, waited_s - self.waited_s))
        self.at_s, self.waited_s = now_s, waited_s
        if now_s >= self.window_s + WINDOW_S:
            window_s, lacked_s = now_s - self.window_s, self.lacked_s - self.lacked_before_s
            had = f"{window_s - lacked_s:.1f} s of processor time in {window_s:.0f} s"
            self.starved = had if lacked_s > window_s / 2 else ""
            self.window_s, self.lacked_before_s = now_s, self.lacked_s


class ChildTimes:
    """The clocks of the processes of this machine, by process identifier."""

    def __init__(self, waited_s: Callable[[int], float | None]) -> None:
        self._waited_s = waited_s
        self._clocks: dict[int, _Clock] = {}
        self._warned_s = -WARNED_EVERY_S

    def at(self, pid: int, now_s: float) -> float:
        """Return a process's time at the launcher's time `now_s`."""
        clock = self._clocks.get(pid)
        if clock is None:
            clock = self._clocks[pid] = _Clock(now_s, self._waited_s(pid), now_s)
        elif now_s >= clock.at_s + EVERY_S:
            clock.look(now_s, self._waited_s(pid))
        return now_s - clock.lacked_s

    def warning(self, pids: Mapping[str, int], now_s: float) -> str:
        """Return which of these processes, by name, are starved; empty for none, and soon after the last warning."""
        clocks = {name: self._clocks[pid] for name, pid in pids.items() if pid in self._clocks}
        texts = [f"{name} received {clock.starved}" for name, clock in clocks.items() if clock.starved]
        if not texts or now_s < self._warned_s + WARNED_EVERY_S:
            return ""
        self._warned_s = now_s
        return f"this machine is starved of processor time: {', '.join(texts)}; their deadlines are extended"


def waited_s(pid: int) -> float | None:
    """Return for how long the threads of a process were runnable and had no processor; None where that is unknown."""
    try:
        stats = [path.read_text().split() for path in (PROC / f"{pid}/task").glob("*/schedstat")]
    except OSError:  # a thread, or the process, has ended
        return None
    return sum(int(stat[1]) for stat in stats) / 1e9 if stats else None

"""Liveness: which hanging processes the launcher kills, by which clock, and when processes are started again.

Deadlines of a process on this machine run on its own clock, from which time is excluded for which its threads wait for
a processor. So one that is starved is not ended; one that hangs sleeps or computes, and all of its time counts. The
launcher requests the supervisor's status once a second. Requests count once the supervisor has published its address;
until then `deadlines.start` applies, for a long journal or a slow machine. A node or a vHub that the run has lost, and
whose process lives, has a grace period to rejoin; before the run has begun it is not killed. Time in which the launcher
itself was suspended does not count. Restarts have an exponential back-off and a limit. Pure but for `waited_s`, which
reads /proc: times are arguments, in s.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from foosim.common import limits
from foosim.deployment.schema import Deadlines
from foosim.runtime.roles.standstill import Standstill

UNANSWERED_MAX: Final = 5
"""Number of unanswered requests after which the supervisor's process is killed."""
QUESTION_S: Final = 1.0
"""Deadline of one request."""
STALLED_S: Final = 1.0
"""Grace period in which a lost process can rejoin before it is killed."""
CUT_OFF_S: Final = 10.0
"""The same for a process on another machine, which may only be disconnected."""
LOOKS_MIN: Final = 2
"""Number of checks after which participation is attributed to this process, not to its predecessor."""
LOOK_S_MAX: Final = 3.0
"""Longest time between two checks; a longer gap means that the launcher was not scheduled."""


def _ns(time_s: float) -> int:
    return round(time_s * 1e9)


class OwnTime:
    """A clock that stops while the launcher is suspended (`runtime.standstill`)."""

    def __init__(self, now_s: float) -> None:
        self._last_ns = _ns(now_s)
        self._standstill = Standstill(self._last_ns)
        self._stood_ns = 0

    def at(self, now_s: float) -> float:
        """Return the time of a check, in s, less the launcher's own standstills."""
        due_ns, self._last_ns = self._last_ns + _ns(LOOK_S_MAX), _ns(now_s)
        self._stood_ns += self._standstill.look(due_ns, self._last_ns)
        return (self._last_ns - self._stood_ns) / 1e9


class SupervisorWatch:
    """Whether the supervisor's process hangs."""

    def __init__(self, deadlines: Deadlines, has_players: bool = False) -> None:
        """`has_players`: they share its process, so it does not answer while one of them acts."""
        self._start_s = deadlines.start_ns / 1e9
        self._unanswered_s = UNANSWERED_MAX * QUESTION_S
        if has_players:
            self._unanswered_s += deadlines.lockstep_fast_ns / 1e9
        self._started_s = 0.0
        self.is_found = False
        """Whether it has published its address."""
        self._silent_s = self._unconnected_s = 0.0
        """The times of the unanswered requests, and of the failed connections, in a row, by its clock."""

    def started(self, now_s: float) -> None:
        """Its process was started or restarted."""
        self._started_s, self.is_found, self._silent_s, self._unconnected_s = now_s, False, 0.0, 0.0

    def answered(self) -> None:
        """It has answered a request."""
        self._silent_s = self._unconnected_s = 0.0

    def unconnected(self, waited_s: float) -> None:
        """It could not be connected to for this time of its clock, which a slow link or machine can do, too."""
        self._unconnected_s += waited_s

    def unanswered(self, waited_s: float) -> None:
        """It has not answered a request for this time of its clock; does not count before it listens."""
        if self.is_found:
            self._silent_s += waited_s

    def why_killed(self, now_s: float) -> str:
        """Return why its process is to be killed at a time of its clock; empty when it is not."""
        if self._silent_s >= self._unanswered_s:
            return f"it had not answered for {self._unanswered_s:g} s"
        if self._unconnected_s >= self._start_s:
            return f"it could not be connected to for {self._start_s:g} s (deadlines.start)"
        if not self.is_found and now_s - self._started_s >= self._start_s:
            return f"it had not published its address within {self._start_s:g} s (deadlines.start)"
        return ""


class StalledWatch:
    """Which of the processes that a run has lost hang."""

    def __init__(self, deadlines: Deadlines) -> None:
        self._start_s = deadlines.start_ns / 1e9
        self._here: dict[str, tuple[int, int]] = {}
        """By name: the process that took part last, and the number of checks at which it did."""
        self._lost: dict[str, tuple[int, float]] = {}
        """Lost processes that live: the process, and since when."""

    def look(
        self, status: Mapping[str, Any], pids: Mapping[str, int], away: set[str], times_s: Mapping[str, float]
    ) -> dict[str, str]:
        """Return the names of the processes to be killed by a status of the run, with the reasons.

        `pids` are the processes that live, by name, and `times_s` the times of their clocks; those of `away` are on
        other machines. One that was started since its name was lost has not sent its hello yet, and has the deadline
        of a start.
        """
        processes = status["processes"] if status["begun"] else {}
        before, self._lost = self._lost, {}
        killed = {}
        for name, pid in sorted(pids.items()):
            last, looks = self._here.get(name, (pid, 0))
            if not processes.get(name, {"lost": False})["lost"]:
                self._here[name] = pid, looks + 1 if last == pid else 1
                continue
            now_s = times_s[name]
            known, since_s = before.get(name, (pid, now_s))
            self._lost[name] = pid, since_s if known == pid else now_s
            was_member = last == pid and looks >= LOOKS_MIN
            limit_s = self._start_s if not was_member else CUT_OFF_S if name in away else STALLED_S
            if now_s >= self._lost[name][1] + limit_s:
                why = f"the run had lost it{_reason(status, name)}"
                killed[name] = f"{why}, and it did not come back within {limit_s:g} s"
        return killed


def _reason(status: Mapping[str, Any], name: str) -> str:
    """Return the run's recorded reason for the loss of a process."""
    reasons = [entry["reason"] for entry in status["recoveries"] if entry["name"] == name and entry["what"] != "join"]
    return f" ({reasons[-1]})" if reasons else ""


PROC: Final = Path("/proc")
OBSERVED_EVERY_S: Final = 0.2
"""The shortest time between two observations of a process."""
STARVED_S: Final = 5.0
"""A process is starved if it lacked a processor for more than half of this time."""
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
        if now_s >= self.window_s + STARVED_S:
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
        elif now_s >= clock.at_s + OBSERVED_EVERY_S:
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


WAITS_S: Final = (0.5, 1.0, 2.0, 4.0, limits.RESTART_PAUSE_NS_MAX / 1e9)
AWAY_S: Final = 4.0
"""Back-off for a process whose machine was unreachable; it is retried without a limit."""
WINDOW_S: Final = 60.0
"""A process that ended this often within this time is given up."""


@dataclass(slots=True)
class _Restarts:
    ended_s: deque[float] = field(default_factory=deque)
    due_s: float | None = None
    failed: bool = False


class Restarts:
    """The processes to restart, and when, by name."""

    def __init__(self) -> None:
        self._by_name: dict[str, _Restarts] = {}

    def ended(self, name: str, now_s: float, at_once: bool = False, is_away: bool = False) -> float | None:
        """Record the end of a process: return its back-off in s, None when it is given up.

        `at_once`: the run waits for it, so the first two restarts have no back-off.
        `is_away`: its machine was unreachable, which does not count against the process.
        """
        known = self._by_name.setdefault(name, _Restarts())
        if is_away:
            known.due_s = now_s + AWAY_S
            return AWAY_S
        while known.ended_s and known.ended_s[0] <= now_s - WINDOW_S:
            known.ended_s.popleft()
        if len(known.ended_s) >= len(WAITS_S):
            known.failed = True
            return None
        waits_s = (0.0, 0.0, *WAITS_S[:-2]) if at_once else WAITS_S
        wait_s = waits_s[len(known.ended_s)]
        known.ended_s.append(now_s)
        known.due_s = now_s + wait_s
        return wait_s

    def give_up(self, name: str) -> None:
        """Do not restart this process: it would end in the same way."""
        self._by_name.setdefault(name, _Restarts()).failed = True

    def forget(self, name: str) -> None:
        """Clear this process's history, on an operator's request."""
        self._by_name.pop(name, None)

    def has_ended(self, name: str) -> bool:
        """Whether this process has ended before."""
        return name in self._by_name

    def is_known(self, name: str) -> bool:
        """Whether this process waits for its restart or is given up."""
        known = self._by_name.get(name)
        return known is not None and (known.failed or known.due_s is not None)

    def due(self, now_s: float) -> list[str]:
        """Take the processes that are due, in name order."""
        waiting = {name: known for name, known in sorted(self._by_name.items()) if known.due_s is not None}
        due = [name for name, known in waiting.items() if known.due_s is not None and known.due_s <= now_s]
        for name in due:
            waiting[name].due_s = None
        return due

    @property
    def failed(self) -> list[str]:
        """Those that are given up, in name order."""
        return sorted(name for name, known in self._by_name.items() if known.failed)

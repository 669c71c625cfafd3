"""Liveness checks: decide from requests, statuses and the time which hanging processes the launcher kills.

Deadlines of a process on this machine run on its own clock (`child_time`), so a starved one is not taken for a hanging
one. The launcher requests the supervisor's status once a second. Requests count once the supervisor has published its
address; until then `deadlines.start` applies, for a long journal or a slow machine. A node or a vHub that the run has
lost, and whose process lives, has a grace period to rejoin; before the run has begun it is not killed. Time in which
the launcher itself was suspended does not count. Pure: times are arguments, in s.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

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
            took_part = last == pid and looks >= LOOKS_MIN
            patience_s = self._start_s if not took_part else CUT_OFF_S if name in away else STALLED_S
            if now_s >= self._lost[name][1] + patience_s:
                why = f"the run had lost it{_reason(status, name)}"
                killed[name] = f"{why}, and it did not come back within {patience_s:g} s"
        return killed


def _reason(status: Mapping[str, Any], name: str) -> str:
    """Return the run's recorded reason for the loss of a process."""
    told = [entry["reason"] for entry in status["recoveries"] if entry["name"] == name and entry["what"] != "join"]
    return f" ({told[-1]})" if told else ""

"""Which processes a launcher kills because they hang: decided from what it asked, what it was told, and the time.

A supervisor is asked for the status once a second. Questions count from when it has said where it listens; until then
it has `deadlines.start`, as a process needs that folds a long journal or whose machine is slow. A node or a vHub that
the run has lost, and whose process lives, has a moment to come back by itself; before the run has begun it is left
alone. Time in which the launcher itself stood still counts for nobody. Pure: times are arguments, in s.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from foosim.deployment.schema import Deadlines
from foosim.runtime.standstill import Standstill

UNANSWERED_MAX: Final = 5
"""How many questions a supervisor may leave unanswered before its process is killed."""
QUESTION_S: Final = 1.0
"""How long the answer to one may take."""
STALLED_S: Final = 1.0
"""How long a process that is lost may take to come back by itself before it is killed."""
CUT_OFF_S: Final = 10.0
"""The same for one on another machine: it may only be cut off, and holds on until it is not."""
LOOKS_MIN: Final = 2
"""At how many looks a process took part before that is not taken for the part of the one before it."""
LOOK_S_MAX: Final = 3.0
"""How long at most the launcher is from one look to the next by itself: beyond that it was not given the processor."""


def _ns(time_s: float) -> int:
    return round(time_s * 1e9)


class OwnTime:
    """A clock that stands while the launcher does not go round (`protocol.standstill`)."""

    def __init__(self, now_s: float) -> None:
        self._last_ns = _ns(now_s)
        self._standstill = Standstill(self._last_ns)
        self._stood_ns = 0

    def at(self, now_s: float) -> float:
        """Return the time at a look, in s, less what the launcher itself stood still."""
        due_ns, self._last_ns = self._last_ns + _ns(LOOK_S_MAX), _ns(now_s)
        self._stood_ns += self._standstill.look(due_ns, self._last_ns)
        return (self._last_ns - self._stood_ns) / 1e9


class SupervisorWatch:
    """Whether the supervisor's process hangs."""

    def __init__(self, deadlines: Deadlines) -> None:
        self._start_s = deadlines.start_ns / 1e9
        self._started_s = 0.0
        self.is_found = False
        """Whether it has said where it listens."""
        self._unanswered = 0

    def started(self, now_s: float) -> None:
        """Its process was started, perhaps again."""
        self._started_s, self.is_found, self._unanswered = now_s, False, 0

    def found(self) -> None:
        """It has said where it listens."""
        self.is_found = True

    def answered(self) -> None:
        """It has answered a question."""
        self._unanswered = 0

    def unanswered(self) -> None:
        """It has not answered a question in time; before it listens it cannot."""
        self._unanswered += self.is_found

    def why_killed(self, now_s: float) -> str:
        """Return why its process is to be killed, for people; empty when it is not."""
        if self._unanswered >= UNANSWERED_MAX:
            return f"it had not answered for {UNANSWERED_MAX * QUESTION_S:g} s"
        if not self.is_found and now_s - self._started_s >= self._start_s:
            return f"it had not said where it listens within {self._start_s:g} s (deadlines.start)"
        return ""


class StalledWatch:
    """Which of the processes that a run has lost hang."""

    def __init__(self, deadlines: Deadlines) -> None:
        self._start_s = deadlines.start_ns / 1e9
        self._here: dict[str, tuple[int, int]] = {}
        """Of each name the process that took part last, and at how many looks it did."""
        self._lost: dict[str, tuple[int, float]] = {}
        """Those that are lost though their processes live: which process, since when."""

    def look(self, status: Mapping[str, Any], pids: Mapping[str, int], away: set[str], now_s: float) -> dict[str, str]:
        """Return whose processes are to be killed by a status of the run, and why, for people.

        `pids` are the processes that live, by name; those of `away` are on other machines. One that was started since
        its name was lost has not said hello yet, and has the time of a start for that.
        """
        processes = status["processes"] if status["begun"] else {}
        before, self._lost = self._lost, {}
        killed = {}
        for name, pid in sorted(pids.items()):
            last, looks = self._here.get(name, (pid, 0))
            if not processes.get(name, {"lost": False})["lost"]:
                self._here[name] = pid, looks + 1 if last == pid else 1
                continue
            known, since_s = before.get(name, (pid, now_s))
            self._lost[name] = pid, since_s if known == pid else now_s
            took_part = last == pid and looks >= LOOKS_MIN
            patience_s = self._start_s if not took_part else CUT_OFF_S if name in away else STALLED_S
            if now_s >= self._lost[name][1] + patience_s:
                why = f"the run had lost it{_reason(status, name)}"
                killed[name] = f"{why}, and it did not come back within {patience_s:g} s"
        return killed


def _reason(status: Mapping[str, Any], name: str) -> str:
    """Return why a run has lost a process, as its account says."""
    told = [entry["reason"] for entry in status["recoveries"] if entry["name"] == name and entry["what"] != "join"]
    return f" ({told[-1]})" if told else ""

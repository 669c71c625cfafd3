"""Restarts of processes, with exponential back-off and a limit. Pure."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Final

from foosim.common import limits

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

"""Players that were away and came back, or left the run: what the vHub tells the supervisor for its account.

It is told in every heartbeat, with a number each, since heartbeats may be lost. Neighbours: `door` notes it, `report`
tells it, `supervisor.departures` takes it.
"""

from __future__ import annotations

from typing import Any, Final

TOLD_MAX: Final = 64
"""How many of the last ones are told."""


class Absences:
    """Who is away, and what is over of it, as of this start of the vHub."""

    def __init__(self) -> None:
        self._away: dict[str, tuple[str, str, int]] = {}
        """Of each that is away: its process, why it is, and the tick that was to be closed next when it went."""
        self._over: list[tuple[int, str, str, str, int]] = []
        self._count = 0
        self.is_new = False
        """Whether there is something of which no heartbeat has told."""

    def begin(self, name: str, boot: str, reason: str, tick: int) -> None:
        """A player's process, which was started as `boot`, is away, and waited for."""
        self._away.setdefault(name, (boot, reason, tick))
        self.is_new = True

    def end(self, name: str, boot: str) -> None:
        """A player is here again before it was given up; where it is the same process, only its connection was cut."""
        if name in self._away:
            before, reason, tick = self._away.pop(name)
            if before != boot:
                self._note("player", name, reason, tick)

    def leave(self, name: str, tick: int) -> None:
        """The run goes on without a player that was waited for, from a tick on, which is written."""
        if name in self._away:
            _, reason, _ = self._away.pop(name)
            self._note("player", name, f"{reason}; the run goes on without it", tick)

    def come_back(self, name: str, tick: int) -> None:
        """A player that had left takes part from a tick on, which is written."""
        self._note("return", name, "back", tick)

    def report(self) -> dict[str, Any]:
        """Return who is away, and what is over: [number, what, name, reason, tick]."""
        return {"away": sorted(self._away), "over": self._over}

    def _note(self, what: str, name: str, reason: str, tick: int) -> None:
        self._count, self.is_new = self._count + 1, True
        self._over = [*self._over[1 - TOLD_MAX :], (self._count, what, name, reason, tick)]

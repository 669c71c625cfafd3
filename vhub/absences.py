"""Absences of players: away, returned, or out of the run. The vHub's part of the run's recoveries.

Entries are numbered and repeated in every heartbeat, since heartbeats may be lost. They are journalled first, so that
a restarted vHub reports them again.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, Final

from foosim.vhub.state.records import AbsencesRecord

REPORTED_MAX: Final = 64
"""How many of the newest entries a heartbeat contains."""


class Absences:
    """The players that are away, and the entries of absences that have ended."""

    def __init__(self) -> None:
        self._away: dict[str, tuple[str, str, int]] = {}
        """By player: the boot of its process (empty if unknown), the reason, and the tick that was closed next at its
        disconnect."""
        self._over: list[tuple[int, str, str, str, int]] = []
        self._count = 0
        self.is_new = False
        """Whether there are changes that are neither journalled nor reported."""

    def restore(self, written: AbsencesRecord, here: Collection[str], came: Collection[str], tick: int) -> None:
        """Restore from the journal. `tick` is its last one: `here` take part after it, `came` returned at it."""
        self._away = {name: (boot, reason, went) for name, boot, reason, went in written.away}
        self._over = [(number, *line) for number, line in enumerate(written.over, 1)]
        self._count = len(self._over)
        for name in sorted(self._away.keys() - here):
            self.leave(name, tick)
        for name in sorted(came):
            if not any((what, who, at) == ("return", name, tick) for _, what, who, _, at in self._over):
                self.come_back(name, tick)

    def record(self) -> AbsencesRecord:
        """Return the journal's record."""
        away = [(name, *about) for name, about in sorted(self._away.items())]
        return AbsencesRecord(away, [(what, name, reason, tick) for _, what, name, reason, tick in self._over])

    def begin(self, name: str, boot: str, reason: str, tick: int) -> None:
        """Begin the absence of a player, whose process was `boot`; the run waits for it."""
        self._away.setdefault(name, (boot, reason, tick))
        self.is_new = True

    def end(self, name: str, boot: str, returns: int) -> None:
        """End an absence with the player's return: no entry where only its connection was cut, and it has its memory.

        That is so where the same process returns; where it is not known which was away, one that had lost a vHub.
        """
        if name in self._away:
            before, reason, tick = self._away.pop(name)
            self.is_new = True
            if before != boot and (before or not returns):
                self._note("player", name, reason, tick)

    def leave(self, name: str, tick: int) -> None:
        """End an absence without a return: the run continues without the player from `tick` on, which is journalled.

        Whether its process is lost, or will return with its memory, is not known."""
        if name in self._away:
            _, reason, _ = self._away.pop(name)
            self._note("away", name, reason, tick)

    def come_back(self, name: str, tick: int) -> None:
        """Add the return of a player that had left; it takes part from `tick` on, which is journalled."""
        self._note("return", name, "back", tick)

    def report(self) -> dict[str, Any]:
        """Return the players that are away and the newest entries: [number, what, name, reason, tick]."""
        return {"away": sorted(self._away), "over": self._over}

    def _note(self, what: str, name: str, reason: str, tick: int) -> None:
        self._count, self.is_new = self._count + 1, True
        self._over = [*self._over[1 - REPORTED_MAX :], (self._count, what, name, reason, tick)]

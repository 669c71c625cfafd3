"""Players that were away and returned, or left the run: the vHub's part of the run's account.

Entries are numbered and repeated in every heartbeat, since heartbeats may be lost. They are in the journal before that,
so that a restarted vHub reports them again.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, Final

from foosim.vhub.state.records import AbsencesRecord

TOLD_MAX: Final = 64
"""How many of the last ones are told."""


class Absences:
    """Who is away, and what is over of it."""

    def __init__(self) -> None:
        self._away: dict[str, tuple[str, str, int]] = {}
        """Of each that is away: its process, why it is, and the tick that was to be closed next when it went."""
        self._over: list[tuple[int, str, str, str, int]] = []
        self._count = 0
        self.is_new = False
        """Whether there is something that is neither written nor told."""

    def go_on(self, written: AbsencesRecord, here: Collection[str], came: Collection[str], tick: int) -> None:
        """Go on from what the vHub before wrote. Behind it others may have left the run or come back (`came`), at the
        tick that it wrote last: `here` are those who take part then."""
        self._away = {name: (boot, reason, went) for name, boot, reason, went in written.away}
        self._over = [(number, *line) for number, line in enumerate(written.over, 1)]
        self._count = len(self._over)
        for name in sorted(self._away.keys() - here):
            self.leave(name, tick)
        for name in sorted(came):
            if not any((what, who, at) == ("return", name, tick) for _, what, who, _, at in self._over):
                self.come_back(name, tick)

    def record(self) -> AbsencesRecord:
        """Return it as it is written down."""
        away = [(name, *about) for name, about in sorted(self._away.items())]
        return AbsencesRecord(away, [(what, name, reason, tick) for _, what, name, reason, tick in self._over])

    def begin(self, name: str, boot: str, reason: str, tick: int) -> None:
        """A player's process, which was started as `boot`, is away, and waited for."""
        self._away.setdefault(name, (boot, reason, tick))
        self.is_new = True

    def end(self, name: str, boot: str) -> None:
        """A player is here again before it was given up; where it is the same process, only its connection was cut."""
        if name in self._away:
            before, reason, tick = self._away.pop(name)
            self.is_new = True
            if before != boot:
                self._note("player", name, reason, tick)

    def deny(self, name: str) -> None:
        """A player is here that a hello of another process had told to be lost while the vHub was away."""
        self._away.pop(name)
        self.is_new = True

    def is_away(self, name: str) -> bool:
        """Whether a player is away."""
        return name in self._away

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

"""Looks after the room that the supervisor's journal has: a run ends in order while its end can still be written."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from foosim.runtime.disk import Level, room_on_disk
from foosim.supervisor.core import SupervisorCore

LOOK_NS: Final = 1_000_000_000


class JournalRoom:
    """Watches the disk of one folder."""

    def __init__(self, folder: Path, reserve: int) -> None:
        self._folder = folder
        self._reserve = reserve
        self._level = Level.FINE
        self._look_ns = 0

    def look(self, now_ns: int, core: SupervisorCore) -> None:
        """Once a second: say that room gets little, and at the reserve end the run."""
        if now_ns < self._look_ns:
            return
        self._look_ns = now_ns + LOOK_NS
        try:
            room = room_on_disk(self._folder, self._reserve)
        except OSError:
            return  # the next record will tell
        if room.level > self._level:
            self._level = room.level
            if room.level is Level.LOW:
                core.say("warning", f"room gets little, at the reserve the run ends: {self._folder}: {room}")
            else:
                core.finish(f"lost room for the journal: {self._folder}: {room}", failed=True)

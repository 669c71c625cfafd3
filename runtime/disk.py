"""The free space of a disk, and its levels.

A reserve is kept free for the end of a run: a file's summary, a journal's last records.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import Final

LOOK_NS: Final = 1_000_000_000
"""The period of reading the free space of a journal's disk."""
_UNITS: Final = {"TiB": 1 << 40, "TB": 10**12, "GiB": 1 << 30, "GB": 10**9, "MiB": 1 << 20, "MB": 10**6, "KiB": 1 << 10}


class Level(IntEnum):
    """The level of free space: LOW below twice the reserve, FULL below the reserve, OUT below a quarter of it."""

    FINE = 0
    LOW = 1
    FULL = 2
    OUT = 3


@dataclass(frozen=True, slots=True)
class Room:
    """Free space and reserve in bytes; `where` names the disk."""

    left: int
    reserve: int
    where: str

    @property
    def level(self) -> Level:
        if self.left < self.reserve // 4:
            return Level.OUT
        if self.left < self.reserve:
            return Level.FULL
        return Level.LOW if self.left < 2 * self.reserve else Level.FINE

    def __str__(self) -> str:
        return (
            f"{size_like(max(0, self.left), self.reserve)} left {self.where}, the reserve is {size_text(self.reserve)}"
        )


def free_bytes(place: int | Path) -> int:
    """Return the free bytes for an unprivileged process on the disk of an open file or a path; raises OSError."""
    found = os.statvfs(place)
    return found.f_bavail * found.f_frsize


def room_on_disk(place: int | Path, reserve: int) -> Room:
    """Return the room on a disk; raises OSError."""
    return Room(free_bytes(place), reserve, "on its disk")


class JournalRoom:
    """Watches the free space for a journal: a run ends in order while its end can still be written."""

    def __init__(self, folder: Path, reserve: int) -> None:
        """At `reserve` bytes of free space the run has to end."""
        self._folder = folder
        self._reserve = reserve
        self._level = Level.FINE
        self._look_ns = 0

    def look(self, now_ns: int) -> tuple[str, str]:
        """Once a second: return what to warn of when space gets low, and why the run has to end once it does; else ""
        and ""."""
        if now_ns < self._look_ns or self._level >= Level.FULL:
            return "", ""
        self._look_ns = now_ns + LOOK_NS
        try:
            room = room_on_disk(self._folder, self._reserve)
        except OSError:
            return "", ""  # writing the next record reports it
        before, self._level = self._level, max(self._level, room.level)
        if self._level is before:
            return "", ""
        text = f"{self._folder}: {room}"
        is_low = self._level is Level.LOW
        return (f"room gets little, at the reserve the run ends: {text}", "") if is_low else ("", text)


def megabytes(count: int) -> str:
    """Return a size for display: `12.4 MB`."""
    return f"{count / 1e6:.1f} MB" if count < 1e10 else f"{count / 1e9:.1f} GB"


def size_text(count: int) -> str:
    """Return a size as in a deployment: exact, in the unit with the shortest number (`64 MiB`)."""
    whole = [f"{count // size} {unit}" for unit, size in _UNITS.items() if count >= size and count % size == 0]
    return min([*whole, f"{count} B"], key=lambda text: len(text.split()[0]))


def size_like(count: int, other: int) -> str:
    """Return a size in the unit in which `size_text` shows another one, with which it is compared: `61.8 MiB`."""
    unit = size_text(other).split()[1]
    if unit not in _UNITS:
        return f"{count} {unit}"
    number = count / _UNITS[unit]
    return f"{number:.1f} {unit}" if number >= 10 else f"{number:.2g} {unit}"

"""Checks of a new capture's path: no existing file, a writable folder, and enough free disk space."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

from foosim.capture.parts import parts_at
from foosim.common.errors import BadValue, Refused
from foosim.deployment.schema import Capture
from foosim.runtime.disk import Level, Room, room_on_disk


def default_capture(world: str, stamp: str) -> Path:
    """Return the default path of a run's capture; `stamp` is the time in its name."""
    stem = f"{world}-{stamp}"
    names = (stem if number == 1 else f"{stem}-{number}" for number in range(1, 1000))
    return next(path for path in (Path("captures") / f"{name}.mcap" for name in names) if not parts_at(path))


def check_texts(*paths: Path | None) -> None:
    """Raise BadValue for a path that is not UTF-8: files of the run, its messages and its capture have it as a text."""
    for path in paths:
        text = "" if path is None else str(path.absolute())
        try:
            text.encode()
        except UnicodeEncodeError:
            raise BadValue("a path that is not UTF-8", text) from None


def check_capture(path: Path) -> Path:
    """Return the path if no file exists there, or where the capture would continue, and its folder, created if missing,
    is writable; raises Refused.
    """
    try:
        for found in parts_at(path).values():
            raise Refused(f"{found} exists, and a capture is never overwritten")
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path.parent):
            return path
    except OSError as error:
        raise Refused(f"{path}: cannot be created, {error.strerror}") from None


@dataclass(frozen=True, slots=True)
class Place:
    """The nearest existing folder to one that a run writes to, and the free space of its disk."""

    there: Path
    room: Room
    ends_run: bool
    """Whether the run ends at the reserve; else it continues without its capture."""

    @property
    def then(self) -> str:
        return "the run ends" if self.ends_run else "the run continues without its capture"

    @property
    def is_refused(self) -> bool:
        """Whether a run would end at once."""
        return self.ends_run and self.room.level >= Level.FULL

    @property
    def is_low(self) -> bool:
        return self.room.level is not Level.FINE


def place_of(settings: Capture, folder: Path, *, is_capture: bool = False) -> Place:
    """Return the room for what a run writes to a folder, which need not be there yet; raises OSError.

    `is_capture`: it is the capture, without which a run may go on. Else it is a journal.
    """
    there = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    ends_run = not is_capture or settings.on_full != "continue_unlogged"
    return Place(there, room_on_disk(there, settings.reserve_bytes), ends_run)


def check_rooms(settings: Capture, capture: Path | None, runs: Path | None) -> list[str]:
    """Return warnings where disks have less than twice the reserve; raises Refused where a run would end at once.

    `capture` is the file, None where none is written here; `runs` is the folder of runs, or of the one to go on, None
    where no journal is written.
    """
    warnings = []
    for folder in (None if capture is None else capture.parent, runs):
        if folder is None:
            continue
        try:
            place = place_of(settings, folder, is_capture=folder is not runs)
        except OSError:
            continue  # the writer reports the error
        text = f"{folder}: {place.room} (capture.reserve)"
        if place.is_refused:
            raise Refused(f"{text}: make room, or lower the reserve; nothing was started")
        if place.is_low:
            warnings.append(f"room gets little, at the reserve {place.then}: {text}")
    return warnings

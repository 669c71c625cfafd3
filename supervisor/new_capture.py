"""Where a run is captured: a file that is not there yet, in a folder that takes files, on a disk with room.

Neighbours: `cli` asks, `doctor`, `up`; `vhub.room_watch` and `main` look after the room while the run lasts.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

from foosim.protocol import wall
from foosim.protocol.deployment import Capture
from foosim.protocol.disk import Level, Room, room_on_disk
from foosim.protocol.errors import Refused
from foosim.vhub.capture_parts import parts_at


class CaptureExists(Refused):
    """A capture is never overwritten."""


def default_capture(world: str) -> Path:
    """Return where a run is captured when nobody says where."""
    stem = f"{world}-{wall.now_stamp()}"
    names = (stem if number == 1 else f"{stem}-{number}" for number in range(1, 1000))
    return next(path for path in (Path("captures") / f"{name}.mcap" for name in names) if not parts_at(path))


def check_capture(path: Path, *, is_split: bool = False) -> Path:
    """Return the path when nothing is there yet and its folder, made where missing, takes files; raises Refused.

    Nor may there be, for one that is split, what is called as the files that it goes on in.
    """
    try:
        for found in parts_at(path).values() if is_split or path.exists() else ():
            raise CaptureExists(f"{found} exists, and a capture is never overwritten")
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path.parent):
            return path
    except OSError as error:
        raise Refused(f"{path}: cannot be created, {error.strerror}") from None


@dataclass(frozen=True, slots=True)
class Place:
    """A folder that a run writes to: the nearest one that is there, and the room on its disk."""

    folder: Path
    there: Path
    room: Room
    then: str
    """What happens at the reserve."""
    ends_run: bool

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
    goes_on = is_capture and settings.on_full == "continue_unlogged"
    there = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    room = room_on_disk(there, settings.reserve_bytes)
    then = "the run goes on without its capture" if goes_on else "the run ends"
    return Place(folder, there, room, then, not goes_on)


def check_rooms(settings: Capture, capture: Path | None, runs: Path | None) -> list[str]:
    """Return warnings where disks have less than twice the reserve; raises Refused where a run would end at once.

    `capture` is the file, None where none is written here; `runs` is the folder of runs, or of the one to go on, None
    where no journal is written.
    """
    warnings = []
    for folder, is_capture in ((None if capture is None else capture.parent, True), (runs, False)):
        if folder is None:
            continue
        try:
            place = place_of(settings, folder, is_capture=is_capture)
        except OSError:
            continue  # who writes there will tell
        text = f"{folder}: {place.room} (capture.reserve)"
        if place.is_refused:
            raise Refused(f"{text}: make room, or lower the reserve; nothing was started")
        if place.is_low:
            warnings.append(f"room gets little, at the reserve {place.then}: {text}")
    return warnings

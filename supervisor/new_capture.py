"""Where a run is captured: a file that is not there yet, in a folder that takes files, on a disk with room.

Neighbours: `cli` asks, `up`; `vhub.room_watch` and `journal_room` look after the room while the run lasts.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from foosim.protocol import wall
from foosim.protocol.deployment import Capture
from foosim.protocol.disk import Level, room_on_disk
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


def check_rooms(settings: Capture, capture: Path | None, runs: Path) -> list[str]:
    """Return warnings where disks have less than twice the reserve; raises Refused where a run would end at once.

    `capture` is the file, None where none is written here; `runs` is the folder of runs, which need not be there yet.
    """
    goes_on = settings.on_full == "continue_unlogged"
    places = [(runs, "the run ends", False)]
    if capture is not None:
        then = "the run goes on without its capture" if goes_on else "the run ends"
        places.insert(0, (capture.parent, then, goes_on))
    warnings = []
    for folder, then, is_optional in places:
        try:
            there = next(place for place in (folder, *folder.parents) if place.exists())
            room = room_on_disk(there, settings.reserve_bytes)
        except OSError:
            continue  # who writes there will tell
        text = f"{folder}: {room} (capture.reserve)"
        if room.level >= Level.FULL and not is_optional:
            raise Refused(f"{text}: make room, or lower the reserve; nothing was started")
        if room.level is not Level.FINE:
            warnings.append(f"room gets little, at the reserve {then}: {text}")
    return warnings

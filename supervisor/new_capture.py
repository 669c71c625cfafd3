"""Where a run is captured: a file that is not there yet, in a folder that takes files. Neighbours: `cli` asks, `up`."""

from __future__ import annotations

import tempfile
from pathlib import Path

from foosim.protocol import wall
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

"""Where the replays of this user listen, so that `foosim-replay control` finds the newest without an address.

A replay holds a lock on its file as long as it lives, so one that is over is never taken for a live one.
"""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import msgspec
import platformdirs

from foosim.common import wall_clock
from foosim.common.errors import Failed


class NoReplay(Failed):
    """No replay runs."""


class Place(msgspec.Struct, frozen=True):
    """Where a replay listens, since when, what it plays, and the folder with its certificates, if it has any."""

    address: str
    started: str
    capture: str
    pki: str = ""


def places_folder() -> Path:
    """Return the folder with a file for each replay of this user."""
    return platformdirs.user_state_path("foosim") / "replays"


@contextmanager
def noted(address: str, capture: Path, pki: Path | None) -> Iterator[None]:
    """Let this replay be found as long as the context lasts. Where no file can be written, it needs its address."""
    path = places_folder() / f"{os.getpid()}-{os.urandom(4).hex()}.json"
    content = Place(address, wall_clock.now_text(), str(capture.absolute()), "" if pki is None else str(pki.absolute()))
    lock = -1
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        fresh = path.with_suffix(".new")  # under its own name it is locked and whole
        lock = os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
        fcntl.flock(lock, fcntl.LOCK_EX)
        os.write(lock, msgspec.json.encode(content))
        fresh.rename(path)
    try:
        yield
    finally:
        with suppress(OSError):
            path.unlink(missing_ok=True)
        if lock >= 0:
            os.close(lock)


def newest_place() -> Place:
    """Return where the newest live replay listens; what others left behind goes. Raises NoReplay."""
    found = []
    folder = places_folder()
    for path in sorted(folder.glob("*.json")) if folder.is_dir() else ():
        with suppress(OSError, msgspec.DecodeError):
            if _is_live(path):
                found.append(msgspec.json.decode(path.read_bytes(), type=Place))
            else:
                path.unlink(missing_ok=True)
    if not found:
        raise NoReplay("no replay runs here: foosim-replay play CAPTURE starts one, --address says where another is")
    return max(found, key=lambda place: place.started)


def _is_live(path: Path) -> bool:
    """Whether a replay holds a file."""
    lock = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    try:
        fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(lock)
    return False

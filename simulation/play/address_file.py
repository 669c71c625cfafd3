"""The addresses of this user's replays, so that `foosim capture control` finds the newest without an address.

A replay holds a lock on its file as long as it lives.
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
from foosim.runtime.run_folder import is_locked


class NoReplay(Failed):
    """No replay is running."""


class Place(msgspec.Struct, frozen=True):
    """The address of a replay, when it began, its capture, and the folder with its certificates, if it has any."""

    address: str
    started: str
    capture: str
    pki: str = ""


def places_folder() -> Path:
    """Return the folder with a file for each replay of this user."""
    return platformdirs.user_state_path("foosim") / "replays"


@contextmanager
def noted(address: str, capture: Path, pki: Path | None) -> Iterator[None]:
    """Publish the address of this replay while the context lasts; nothing where no file can be written."""
    path = places_folder() / f"{os.getpid()}-{os.urandom(4).hex()}.json"
    content = Place(address, wall_clock.now_text(), str(capture.absolute()), "" if pki is None else str(pki.absolute()))
    lock = -1
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        fresh = path.with_suffix(".new")  # it is locked and complete under its final name
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
    """Return the newest live replay, and remove the files of others that have ended. Raises NoReplay."""
    found = []
    folder = places_folder()
    for path in sorted(folder.glob("*.json")) if folder.is_dir() else ():
        with suppress(OSError, msgspec.DecodeError):
            if is_locked(path):
                found.append(msgspec.json.decode(path.read_bytes(), type=Place))
            else:
                path.unlink(missing_ok=True)
    if not found:
        raise NoReplay("no replay runs here: foosim capture play CAPTURE starts one, --address names one elsewhere")
    return max(found, key=lambda place: place.started)

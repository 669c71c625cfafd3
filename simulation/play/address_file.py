"""The addresses of this user's replays, so that `foosim capture control` finds the newest without an address.

A replay has a folder as a run has, and holds its lock as long as it lives.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from foosim.common import wall_clock
from foosim.common.errors import Failed
from foosim.runtime.run_folder import RunFolder, RunInfo, forget_old, live_runs, runs_folder


class NoReplay(Failed):
    """No replay is running."""


def replays_folder() -> Path:
    """Return the folder with a folder for each replay of this user."""
    return runs_folder().with_name("replays")


@contextmanager
def noted(address: str, capture: Path, pki: Path | None) -> Iterator[None]:
    """Publish the address of this replay while the context lasts; nothing where no file can be written."""
    folder = RunFolder(replays_folder() / f"{os.getpid()}-{os.urandom(4).hex()}")
    at = "" if pki is None else str(pki.absolute())
    with suppress(OSError):
        forget_old(replays_folder())
        folder.path.mkdir(parents=True)
        folder.hold(has_spare=False)
        now = wall_clock.now_text()
        folder.write_info(RunInfo(folder.name, "", str(capture.absolute()), os.getpid(), now, address, pki=at))
    try:
        yield
    finally:
        folder.release()
        shutil.rmtree(folder.path, ignore_errors=True)


def newest_replay() -> RunInfo:
    """Return the newest live replay, with its address as `simulation`. Raises NoReplay."""
    infos = (folder.info() for folder in live_runs(replays_folder()))
    found = next((info for info in infos if info is not None), None)
    if found is None:
        raise NoReplay("no replay runs here: foosim capture play CAPTURE starts one, --address names one elsewhere")
    return found

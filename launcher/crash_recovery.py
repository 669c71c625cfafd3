"""Crash recovery: the next start makes complete captures for runs whose launcher died, from file and journal.

The vHub's journal is in the run's folder and has the path of the capture.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from foosim.capture.parts import parts_at
from foosim.common.errors import Malformed, Refused
from foosim.protocol.channels import VHUB
from foosim.protocol.codec import decode_any
from foosim.runtime.journal import JournalError, journal_files, read_records, remove_journal
from foosim.runtime.run_folder import RunFolder, left_runs
from foosim.vhub.recording.recovery import recover_capture, recovered_path
from foosim.vhub.state.records import HeadRecord, HubRecord


def recover_leftovers(report: Callable[[str], None], but: str | None = None) -> None:
    """Recover the captures of this user's runs whose launcher is gone, logging a line each; skip the run `but`.

    The vHub's journal is deleted when the new capture is complete. A failed recovery is logged and deletes nothing.
    """
    for folder in left_runs():
        path = captured_at(folder)
        if path is None or folder.name == but or not parts_at(path) or recovered_path(path).exists():
            continue
        try:
            recovered = recover_capture(path, folder.journals)
        except JournalError:
            continue  # its vHub lives and finishes the capture
        except Refused as error:
            report(f"run {folder.name} ended uncleanly, its capture cannot be recovered: {error}")
            continue
        if recovered is not None:
            report(f"run {folder.name}: {recovered}")
            if not recovered.problem:
                remove_journal(folder.journals, VHUB)


def captured_at(folder: RunFolder) -> Path | None:
    """Return the path of a run's capture from its vHub's journal; None without a journal or a capture."""
    for file in journal_files(folder.journals, VHUB):
        try:
            head = decode_any(HubRecord, next(read_records(file), b""))
        except (JournalError, Malformed):
            continue  # another file may have it
        if isinstance(head, HeadRecord) and head.capture:
            return Path(head.capture)
    return None

"""What runs that ended uncleanly left: at the next start valid captures are made of theirs and the vHub's journals.

A run whose launcher died with everything else has nobody to finish its capture. Its vHub's journal is in the run's
folder and says where the capture is.
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


def recover_leftovers(say: Callable[[str], None], but: str | None = None) -> None:
    """Recover the captures of runs of this user whose launcher is gone, a line each; the run `but` is left as it is.

    A vHub's journal goes when what is recovered is whole. What cannot be recovered stays, and is said.
    """
    for folder in left_runs():
        path = captured_at(folder)
        if path is None or folder.name == but or not parts_at(path) or recovered_path(path).exists():
            continue
        try:
            recovered = recover_capture(path, folder.journals)
        except JournalError:
            continue  # its vHub lives, and finishes what it writes
        except Refused as error:
            say(f"run {folder.name} ended uncleanly, its capture cannot be recovered: {error}")
            continue
        if recovered is not None:
            say(f"run {folder.name}: {recovered}")
            if not recovered.problem:
                remove_journal(folder.journals, VHUB)


def captured_at(folder: RunFolder) -> Path | None:
    """Return where the capture of a run is, as its vHub's journal says; None without a journal or a capture."""
    for file in journal_files(folder.journals, VHUB):
        try:
            head = decode_any(HubRecord, next(read_records(file), b""))
        except (JournalError, Malformed):
            continue  # another file may tell
        if isinstance(head, HeadRecord) and head.capture:
            return Path(head.capture)
    return None

"""Checks before anything is started that a run whose launcher is gone can be resumed.

It reads both journals entirely (`journal_check`), and the capture's files.
"""

from __future__ import annotations

import shlex
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from foosim.capture.mcap.checks import CaptureError
from foosim.capture.parts import files_from, first_there, has_end, head_of, parts_at
from foosim.capture.start_frame import branch_command
from foosim.common.errors import Malformed, Refused
from foosim.launcher.journal_check import check_journals
from foosim.launcher.run_options import RunOptions
from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.protocol.codec import decode_any
from foosim.runtime.journal import JournalError, journal_files, read_records
from foosim.runtime.run_folder import RunFolder
from foosim.vhub.state.records import HeadRecord, HubRecord


def check_resumable(folder: RunFolder, options: RunOptions, capture: Path | None, *, has_hub_here: bool) -> None:
    """Raise Refused, with the reason and the command that begins a new run, when a run cannot be resumed.

    `options` are those that it was started with. The vHub's journal and the capture are checked if it runs on this
    machine.
    """
    if not any(path.stat().st_size for path in journal_files(folder.journals, SUPERVISOR)):
        where = f"run {folder.name} has no journal to resume from in {folder.journals}"
        raise Refused(f"{where}{_new_run(folder, options, capture)}")
    try:
        check_journals(folder, options)
        if has_hub_here:
            _check_hub(folder, capture)
    except (JournalError, CaptureError, Malformed) as error:
        then = _new_run(folder, options, capture)
        raise Refused(f"run {folder.name} cannot be resumed: {error}{then}") from None


def _new_run(folder: RunFolder, options: RunOptions, capture: Path | None) -> str:
    """Return the command that begins a new run, from the capture's last frame if the capture is this run's."""
    if capture is not None and parts_at(capture):
        first = first_there(capture)
        with suppress(CaptureError):
            if head_of(first).get("run") == folder.name:
                return f". {branch_command(replace(options, branch=None).arguments(), first)}"
    return f"; foosim up {shlex.join(options.arguments())} begins a new run"


def _check_hub(folder: RunFolder, capture: Path | None) -> None:
    """Raise the error that would prevent the vHub from resuming from its journal and capture."""
    files = journal_files(folder.journals, VHUB)
    if not files:
        if capture is not None and parts_at(capture):
            raise JournalError(f"the vHub's journal is gone from {folder.journals}")
        return  # it was never begun
    raw = next(read_records(files[0]), None)
    if raw is None:
        return  # it was made, and nothing was written
    head = decode_any(HubRecord, raw)
    if not isinstance(head, HeadRecord) or head.run != folder.name:
        raise Malformed(f"{files[0]}: does not begin with run {folder.name}")
    if head.capture and parts_at(Path(head.capture)):
        _check_capture(Path(head.capture), folder.name)


def _check_capture(path: Path, run: str) -> None:
    first = first_there(path)
    about = head_of(first)
    if about and about.get("run") != run:
        raise CaptureError(f"{first}: was overwritten, it is the capture of run {about.get('run')}")
    if about and has_end(files_from(first)[-1]):
        raise CaptureError(f"{first}: is finished, and a capture is never overwritten")

"""Whether a run whose launcher is gone can go on: asked before anything is started, so that the reason is said at once.

Looked at are the beginnings of both journals and the capture's files. What else may be wrong with them the processes
find that read them whole; they refuse it. Neighbours: `plan` asks, `run_folder`, `protocol.journal`.
"""

from __future__ import annotations

from pathlib import Path

from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.protocol.codec import decode_any
from foosim.protocol.errors import Malformed, Refused
from foosim.protocol.journal import JournalError, journal_files, read_records
from foosim.supervisor.records import HeadRecord as SupervisorHead
from foosim.supervisor.records import RunRecord
from foosim.supervisor.run_folder import RunFolder
from foosim.vhub.capture_parts import files_from, first_there, has_end, head_of, parts_at
from foosim.vhub.records import HeadRecord, HubRecord
from foosim.vhub.rows import CaptureError


def check_resumable(folder: RunFolder, file: Path, capture: Path | None, *, has_hub_here: bool) -> None:
    """Raise Refused, with what is wrong and the command that begins a new run, when a run cannot go on.

    `file` is its deployment. The vHub's journal and the capture are looked at where it runs on this machine.
    """
    begins = f"foosim-supervisor up {file}"
    if not any(path.stat().st_size for path in journal_files(folder.journals, SUPERVISOR)):
        raise Refused(f"run {folder.name} has no journal to go on from in {folder.journals}; {begins} begins a new run")
    if capture is not None and parts_at(capture):
        begins += f" --from {first_there(capture)}"
    try:
        _check_supervisor(folder)
        if has_hub_here:
            _check_hub(folder, capture)
    except (JournalError, CaptureError, Malformed) as error:
        raise Refused(f"run {folder.name} cannot go on: {error}; {begins} begins a new run") from None


def _check_supervisor(folder: RunFolder) -> None:
    """Raise JournalError or Malformed when no file of the supervisor's journal begins with a record of a run."""
    files = journal_files(folder.journals, SUPERVISOR)
    for file in reversed(files):
        raw = next(read_records(file), None)
        if raw is not None:
            if not isinstance(decode_any(RunRecord | SupervisorHead, raw), RunRecord | SupervisorHead):
                raise Malformed(f"{file}: does not begin with a run")
            return
    raise JournalError(f"{files[0]}: its first record is damaged")


def _check_hub(folder: RunFolder, capture: Path | None) -> None:
    """Raise what says why the vHub could not go on from its journal, with its capture."""
    files = journal_files(folder.journals, VHUB)
    if not files:
        if capture is not None and parts_at(capture):
            raise JournalError(f"the vHub's journal is gone from {folder.journals}")
        return  # it was never begun
    raw = next(read_records(files[0]), None)
    if raw is None:
        if len(files) == 1 and files[0].stat().st_size == 0:
            return
        raise JournalError(f"{files[0]}: its first record is damaged")
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

"""Checks that a run's journals are undamaged before it resumes; the error states the command that helps."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

from foosim.common.errors import Malformed, Refused
from foosim.launcher.crash_recovery import captured_at
from foosim.launcher.run_options import RunOptions
from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.protocol.codec import decode, decode_any
from foosim.protocol.messages import Commit
from foosim.runtime.journal import journal_files, read_journal, read_newest, read_whole
from foosim.runtime.run_folder import RunFolder
from foosim.supervisor.records import Checkpoint, CommitRecord, Record
from foosim.vhub.state.resume import last_tick_of


def check_journals(folder: RunFolder, options: RunOptions) -> None:
    """Raise Refused when a journal is damaged or empty; the text has the place, the last tick and the remedy.

    If the vHub's journal is on another machine, the vHub checks it.
    """
    supervisor_records(folder, options)
    if any(path.stat().st_size for path in journal_files(folder.journals, VHUB)):
        _checked(folder, options, VHUB, read_journal(folder.journals, VHUB), last_tick_of)


def supervisor_records(folder: RunFolder, options: RunOptions) -> list[bytes]:
    """Return the records that a supervisor resumes from. Raises Refused as `check_journals` does."""
    return _checked(folder, options, SUPERVISOR, read_newest(folder.journals, SUPERVISOR), _last_commit)


def _checked(
    folder: RunFolder,
    options: RunOptions,
    stem: str,
    records: Iterable[bytes],
    last_tick: Callable[[list[bytes]], int],
) -> list[bytes]:
    whole, damaged = read_whole(records)
    if damaged is None and whole:
        return whole
    what = f"no file of the journal of {stem} in {folder.journals} has a whole record"
    if damaged is not None:
        tick = _tick(whole, last_tick)
        what = f"{damaged}; {'no tick is' if tick < 0 else f'tick {tick} is the last'} before it"
    from foosim.capture.start_frame import branch_command  # brings the reader of captures

    capture = captured_at(folder)
    if capture is None:
        launch = folder.launch()
        capture = Path(launch.capture) if launch is not None and launch.capture else None
    arguments = replace(options, branch=None).arguments()
    raise Refused(f"run {folder.name} cannot be resumed: {what}. {branch_command(arguments, capture)}")


def _tick(records: list[bytes], last_tick: Callable[[list[bytes]], int]) -> int:
    try:
        return last_tick(records)
    except Malformed:
        return -1


def _last_commit(records: list[bytes]) -> int:
    """Return the tick of the last commit, -1 when there is none."""
    for raw in reversed(records):
        record = decode_any(Record, raw)
        commits = record.commits if isinstance(record, Checkpoint) else []
        if isinstance(record, CommitRecord):
            commits = [record.commit]
        if commits:
            return max(decode(Commit, commit).tick for commit in commits)
    return -1

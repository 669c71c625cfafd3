"""Resuming a run whose launcher is gone, and recovering the captures of other runs.

Everything is checked before anything is started: both journals, which are read entirely, and the capture's files. The
error states the command that begins a new run.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from foosim.capture.mcap.checks import CaptureError
from foosim.capture.parts import files_from, first_there, has_end, head_of, parts_at
from foosim.common.errors import Malformed, Refused
from foosim.deployment.schema import places
from foosim.launcher.plan import Plan, make_plan
from foosim.launcher.run_options import RunOptions, launched_options
from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.protocol.codec import decode, decode_any
from foosim.protocol.messages import Commit
from foosim.runtime.journal import (
    JournalError,
    Records,
    journal_files,
    read_journal,
    read_newest,
    read_whole,
    remove_journal,
)
from foosim.runtime.run_folder import RunFolder, left_runs
from foosim.supervisor.records import Checkpoint, CommitRecord, Record
from foosim.vhub.state.records import HeadRecord, HubRecord
from foosim.vhub.state.resume import last_tick_of


def plan_again(folder: RunFolder) -> tuple[Plan, Path | None]:
    """Return the plan and the capture of a run whose launcher is gone. Raises Refused when it cannot be resumed."""
    if folder.is_live() or not folder.is_left():
        raise Refused(f"run {folder.name} is alive: its processes are started again by themselves")
    plan = make_plan(launched_options(folder))
    if not _has_content(folder, SUPERVISOR):
        what = f"run {folder.name} has no journal to resume from in {folder.journals}"
        raise Refused(f"{what}{_new_run(folder, plan.options)}")
    try:
        check_journals(folder, plan.options)
        if VHUB not in places(plan.deployment):
            _check_hub(folder)
    except (JournalError, CaptureError, Malformed) as error:
        then = _new_run(folder, plan.options)
        raise Refused(f"run {folder.name} cannot be resumed: {error}{then}") from None
    return plan, folder.capture()


def _has_content(folder: RunFolder, stem: str) -> bool:
    return any(path.stat().st_size for path in journal_files(folder.journals, stem))


def _new_run(folder: RunFolder, options: RunOptions) -> str:
    """Return the command that begins a new run, from the capture's last frame if the capture is this run's."""
    capture = folder.capture()
    if capture is not None and parts_at(capture):
        first = first_there(capture)
        with suppress(CaptureError):
            if head_of(first).get("run") == folder.name:
                return _branch(options, first)
    return f"; foosim up {shlex.join(options.arguments())} begins a new run"


def _branch(options: RunOptions, capture: Path | None) -> str:
    """Return the command that begins a new run with the last frame of a capture."""
    from foosim.capture.start_frame import branch_command  # brings the reader of captures

    return f". {branch_command(replace(options, branch=None).arguments(), capture)}"


def _check_hub(folder: RunFolder) -> None:
    """Raise the error that would prevent the vHub from resuming from its journal and capture."""
    files, capture = journal_files(folder.journals, VHUB), folder.capture()
    if not files:
        if capture is not None and parts_at(capture):
            raise JournalError(f"the vHub's journal is gone from {folder.journals}")
        return  # it was never begun
    raw = next(Records(files[0]), None)
    if raw is None:
        return  # it was made, and nothing was written
    head = decode_any(HubRecord, raw)
    if not isinstance(head, HeadRecord) or head.run != folder.name:
        raise Malformed(f"{files[0]}: does not begin with run {folder.name}")
    if not head.capture or not parts_at(Path(head.capture)):
        return
    first = first_there(Path(head.capture))
    about = head_of(first)
    if about and about.get("run") != folder.name:
        raise CaptureError(f"{first}: was overwritten, it is the capture of run {about.get('run')}")
    if about and has_end(files_from(first)[-1]):
        raise CaptureError(f"{first}: is finished, and a capture is never overwritten")


# --- journals --------------------------------------------------------------------------------------------------------


def check_journals(folder: RunFolder, options: RunOptions) -> None:
    """Raise Refused when a journal is damaged or empty; the text has the place, the last tick and the remedy.

    If the vHub's journal is on another machine, the vHub checks it.
    """
    supervisor_records(folder, options)
    if _has_content(folder, VHUB):
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
        tick = -1
        with suppress(Malformed):
            tick = last_tick(whole)
        what = f"{damaged}; {'no tick is' if tick < 0 else f'tick {tick} is the last'} before it"
    then = _branch(options, captured_at(folder) or folder.capture())
    raise Refused(f"run {folder.name} cannot be resumed: {what}{then}")


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


# --- captures of other runs ------------------------------------------------------------------------------------------


def recover_leftovers(report: Callable[[str], None], but: str | None = None) -> None:
    """Recover the captures of this user's runs whose launcher is gone, logging a line each; skip the run `but`.

    The vHub's journal, which has the path of the capture, is deleted when the new capture is complete. A failed
    recovery is logged and deletes nothing.
    """
    from foosim.vhub.recording.recovery import recover_capture, recovered_path  # a supervisor does without

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
            head = decode_any(HubRecord, next(Records(file), b""))
        except (JournalError, Malformed):
            continue  # another file may have it
        if isinstance(head, HeadRecord) and head.capture:
            return Path(head.capture)
    return None

"""Begins a run, or resumes one, after all checks of its options, its players and the disks.

`up --detach` starts a launcher in a session of its own, and waits until the run is up. What few starts need (the
recovery of captures) is imported where it is called.
"""

from __future__ import annotations

import subprocess
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

from foosim.common.errors import Failed
from foosim.deployment.schema import places
from foosim.launcher.display import Display
from foosim.launcher.hosts import check_free
from foosim.launcher.outcome import Outcome, detached_outcome, ended_outcome
from foosim.launcher.plan import (
    Plan,
    check_capture,
    check_certificates,
    check_descriptors,
    check_models_here,
    check_players_here,
    check_rooms,
    check_texts,
    default_capture,
    make_plan,
)
from foosim.launcher.run_options import RunOptions
from foosim.launcher.up import Up
from foosim.protocol.channels import VHUB
from foosim.runtime.command import DONE
from foosim.runtime.process import FOOSIM, script
from foosim.runtime.run_folder import RunFolder, create_run, left_runs, runs_folder

POLL_S: Final = 0.05
LINES: Final = 20
"""Size of the log excerpt that is shown for a detached launcher that has ended."""


def begin(
    options: RunOptions,
    capture: Path | None,
    captures: bool,
    run: str | None,
    detached: bool,
    display: Display,
    page: Sequence[str] | None,
) -> Up | Outcome:
    """Return a new run that the caller runs, or start it detached. Raises Refused.

    `captures` is whether a capture is written; without a `capture` its path is the default.
    """
    plan = make_plan(options)
    found = capture or default_capture(plan.deployment.world, plan.stamp)
    check_texts(options.file, options.pki, found, runs_folder())
    check_free([plan.address] if VHUB in places(plan.deployment) else [plan.address, plan.address.next_port()])
    check_models_here(plan)
    check_players_here(plan)
    path = check_capture(found) if captures else None
    _prepare(check_room(plan, path, runs_folder()), plan, display)
    if detached:
        return detached_outcome(_detach(plan, path, run), plan.deployment, path)
    return Up(plan, path, display, run, console=page)


def resume_run(folder: RunFolder, display: Display, page: Sequence[str] | None) -> Up | Outcome:
    """Return a run to be resumed, or the outcome of one that has ended. Raises Refused."""
    if folder.result() is not None:
        _prepare((), None, display)
        return ended_outcome(folder)
    from foosim.launcher.resume import plan_again

    plan, path = plan_again(folder)
    check_players_here(plan)
    _prepare(check_room(plan, path, folder.path), plan, display, folder.name)
    return Up(plan, path, display, None, folder, page)


def check_room(plan: Plan, capture: Path | None, runs: Path) -> list[str]:
    """Return warnings of disks that are nearly full; raises Refused where one is too full, or files are too few."""
    check_descriptors(plan)
    captured_here = None if VHUB in places(plan.deployment) else capture
    return check_rooms(plan.deployment.capture, captured_here, runs)


def _prepare(warnings: Iterable[str], plan: Plan | None, display: Display, resumed: str | None = None) -> None:
    """Show all warnings, and recover captures of other runs."""
    for warning in (*warnings, *([] if plan is None else check_certificates(plan))):
        display.say(warning)
    if left_runs():
        from foosim.launcher.resume import recover_leftovers

        recover_leftovers(display.say, but=resumed)


def _detach(plan: Plan, capture: Path | None, run: str | None) -> RunFolder:
    """Launch a run in the background; return its folder when clients can find it. Raises Failed if it ends before."""
    folder = create_run(plan.deployment.world, run, plan.stamp)
    path = folder.log("up")
    written = ["--no-capture"] if capture is None else ["--capture", str(capture)]
    with path.open("ab") as file:
        process = subprocess.Popen(
            [script(FOOSIM), "up", *plan.options.arguments(), "--run", folder.name, *written],
            stdin=subprocess.DEVNULL,
            stdout=file,
            stderr=subprocess.STDOUT,
            start_new_session=True,  # it outlives the terminal
        )
    try:
        while (code := process.poll()) is None and ((info := folder.info()) is None or not info.radio):
            time.sleep(POLL_S)
    except KeyboardInterrupt:  # then the command reports that the run has not begun
        process.terminate()
        process.wait()
        raise
    if code not in (None, DONE):
        end = "".join(f"\n    {line}" for line in path.read_text("utf-8", "replace").splitlines()[-LINES:])
        raise Failed(f"run {folder.name} has ended with exit code {code}; the end of {path}:{end}")
    return folder

"""Begins a run, or resumes one, after all checks of its options, its players and the disks.

The modules that few starts need (the recovery of captures, detaching) are imported where they are called.
"""

from __future__ import annotations

from pathlib import Path

from foosim.deployment.schema import places
from foosim.launcher.console_child import Page
from foosim.launcher.display import Display
from foosim.launcher.hosts.port_check import check_free
from foosim.launcher.new_capture import check_capture, check_rooms, check_texts, default_capture
from foosim.launcher.outcome import Outcome, detached_outcome, ended_outcome
from foosim.launcher.plan import (
    Plan,
    check_certificates,
    check_models_here,
    check_players_here,
    make_plan,
    plan_again,
)
from foosim.launcher.run_options import RunOptions
from foosim.launcher.up import Up
from foosim.protocol.channels import VHUB
from foosim.runtime.run_folder import RunFolder, left_runs, runs_folder


def begin(
    options: RunOptions,
    capture: Path | None,
    captures: bool,
    run: str | None,
    detached: bool,
    display: Display,
    page: Page | None,
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
    path = check_capture(found, is_split=plan.deployment.capture.is_split) if captures else None
    look_for_room(plan, path, runs_folder(), display)
    _prepare(plan, display, None)
    if detached:
        from foosim.launcher.detach import detach

        return detached_outcome(detach(plan, path, run), plan.deployment, path)
    return Up(plan, path, display, run, console=page)


def go_on(folder: RunFolder, display: Display, page: Page | None) -> Up | Outcome:
    """Return a run to be resumed, or the outcome of one that has ended. Raises Refused."""
    if folder.result() is not None:
        _recover_leftovers(display, None)
        return ended_outcome(folder)
    plan, path = plan_again(folder)
    check_players_here(plan)
    look_for_room(plan, path, folder.path, display)
    _prepare(plan, display, folder.name)
    return Up(plan, path, display, None, folder, page)


def look_for_room(plan: Plan, capture: Path | None, runs: Path, display: Display) -> None:
    """Raise Refused where a disk is too full to begin, and warn where it is nearly full."""
    captured_here = None if VHUB in places(plan.deployment) else capture
    for warning in check_rooms(plan.deployment.capture, captured_here, runs):
        display.say(warning)


def _prepare(plan: Plan, display: Display, resumed: str | None) -> None:
    for warning in check_certificates(plan):
        display.say(warning)
    _recover_leftovers(display, resumed)


def _recover_leftovers(display: Display, resumed: str | None) -> None:
    if left_runs():
        from foosim.launcher.crash_recovery import recover_leftovers

        recover_leftovers(display.say, but=resumed)

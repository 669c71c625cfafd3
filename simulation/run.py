"""Rehearse a deployment: the whole system, players included, in one process on virtual time, on any number of nodes.

The typed function behind `foosim rehearse`. Its result is that of `up`; its digests too, when all players are lockstep.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from foosim.capture.contents import ending_metadata, origin_metadata
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.parts import first_there
from foosim.common.errors import BadValue
from foosim.common.units import Pace
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import apply_sets, load_deployment, with_owners
from foosim.deployment.schema import Deployment
from foosim.node.physics.mesh_trial import check_shapes
from foosim.protocol.fingerprint import library_fingerprint
from foosim.protocol.messages import Answer, Epoch
from foosim.runtime.disk import Level
from foosim.simulation.attendant import Attendant
from foosim.simulation.stepped_world import deal_robots
from foosim.simulation.system import Settings, System
from foosim.supervisor.settings import RunSettings
from foosim.vhub.recording.recorder import Recorder
from foosim.vhub.state.records import Closing
from foosim.world.frame import Frame
from foosim.world.start import Start


@dataclass(slots=True)
class Rehearsed:
    """Result of a rehearsal: the JSON object of `up`, and D(tick) for every tick from 1 on, 32 bytes each."""

    json: dict[str, Any]
    digests: list[bytes] = field(default_factory=list)
    answers: dict[str, Answer] = field(default_factory=dict)


def with_nodes(text: str, name: str, nodes: int, sets: Sequence[str] = ()) -> str:
    """Return a deployment text with its robots on nodes n1 to nN."""
    owners = {"n1": ["*"]} if nodes == 1 else deal_robots(load_deployment(text, name), nodes)
    return with_owners(text, name, owners, sets)


def rehearse(  # noqa: PLR0913  # options of a rehearsal, by keyword
    text: str,
    name: str,
    ticks: int,
    nodes: int | None = 1,
    sets: Sequence[str] = (),
    settings: Settings | None = None,
    *,
    pace: Pace | None = None,
    prepare: Callable[[System], None] | None = None,
    capture: Path | None = None,
    folder: Path | None = None,
    start: Start | None = None,
    progress: Callable[[str], None] | None = None,
    on_stuck: Callable[[dict[str, Any]], None] | None = None,
) -> Rehearsed:
    """Rehearse `ticks` ticks of a deployment text on `nodes` nodes (None: on the declared ones).

    `start` is a frame of another run to begin with (`capture.start_frame.read_branch`). `prepare` is called with the
    built system before it runs, so that a test or notebook can schedule requests.
    `folder` is the base of the relative file paths in the text (None: the current folder).
    `progress` gets a line each second of wall time, from another thread. A player that does not answer within
    `deadlines.lockstep_fast` is interrupted, where this is called from the main thread, and the run ends in order; for
    one that cannot be interrupted `on_stuck` gets the result, from another thread, and should end the process.
    A player that fails ends the run in order, as in processes: the result has `failed` and the reason.
    Raises DeploymentError for a bad text, AssetError for a bad file, CaptureError when `capture` exists or cannot be
    written, BadValue for a `start` that does not fit and for free-running players.
    """
    text = apply_sets(text, name, sets) if nodes is None else with_nodes(text, name, nodes, sets)
    text, files = pin_assets(text, name, folder or Path())
    deployment = load_deployment(text, name).with_assets(files)
    check_shapes(deployment, name, text)
    check_lockstep(deployment)
    settings = settings or Settings()
    rehearsed = Rehearsed({})
    on_commit = settings.on_commit

    def committed(frame: Frame) -> None:
        rehearsed.digests.append(frame.digest)
        if on_commit is not None:
            on_commit(frame)

    settings.on_commit = committed
    pace = pace or Pace("fast")
    run = RunSettings(settings.run, name, text, pace, ticks, start, files=files)
    writer = None if capture is None else _open_capture(capture, deployment, text, name, settings, run)
    system = System(run, settings)
    if prepare is not None:
        prepare(system)
    rehearsed.json, rehearsed.answers = _run(system, writer, capture, progress, on_stuck), system.answers
    return rehearsed


def check_lockstep(deployment: Deployment) -> None:
    """Raise BadValue for free-running players, which a rehearsal cannot have."""
    free = sorted(name for name, player in deployment.players.items() if not player.lockstep)
    if free:
        raise BadValue("a rehearsal has lockstep players only; these are free-running", ", ".join(free))


def _run(
    system: System,
    writer: Recorder | None,
    capture: Path | None,
    progress: Callable[[str], None] | None,
    on_stuck: Callable[[dict[str, Any]], None] | None,
) -> dict[str, Any]:
    """Run a system to its end and finish its capture, whatever ends it; return the result."""
    begun_ns = time.perf_counter_ns()

    def result() -> dict[str, Any]:
        wall_ns, found = time.perf_counter_ns() - begun_ns, system.supervisor.result()
        rtf = round((found["ticks"] - found["first_tick"]) * found["tick_ns"] / wall_ns, 3)
        return {**found, "rtf": rtf, "capture": None if capture is None else str(first_there(capture))}

    def stuck(reason: str) -> None:
        if writer is not None:
            writer.leave()
        if on_stuck is not None:
            on_stuck({**result(), "reason": reason, "failed": True})

    try:
        with Attendant(system, progress, stuck):
            system.run()
        if writer is not None:
            end = system.supervisor.state.end
            writer.finish({} if end is None else ending_metadata(end))
    finally:
        system.close()
        if writer is not None:
            writer.leave()  # an interrupted rehearsal leaves it unfinished
    if writer is not None:
        _check_room(writer, Level.OUT)
    return result()


def _check_room(writer: Recorder, worst: Level) -> None:
    """Raise CaptureError when the capture is full and the deployment requires one."""
    if writer.stops_world and writer.state.level >= worst:
        raise CaptureError(f"the rehearsal ends, its capture is full: {writer.state.text}")


def _open_capture(
    path: Path, deployment: Deployment, text: str, name: str, settings: Settings, run: RunSettings
) -> Recorder:
    """Open a capture that receives all closings and log lines of a rehearsal."""
    metadata = {"run": run.run, "pace": str(run.pace), "fingerprint": library_fingerprint().hex()}
    metadata |= origin_metadata(run.origin)
    writer = Recorder(path, deployment, name, text, metadata)
    on_closing, on_epoch, on_log = settings.on_closing, settings.on_epoch, settings.on_log
    tick = 0

    def keep(closing: Closing) -> None:
        nonlocal tick
        tick = closing.frame.tick
        writer.keep(closing)
        _check_room(writer, Level.FULL)
        if on_closing is not None:
            on_closing(closing)

    def begin(epoch: Epoch) -> None:
        writer.keep(epoch)
        if on_epoch is not None:
            on_epoch(epoch)

    def log(process: str, level: str, line: str) -> None:
        writer.log(level, f"{process}: {line}", tick)
        if on_log is not None:
            on_log(process, level, line)

    settings.on_closing, settings.on_epoch, settings.on_log = keep, begin, log
    return writer

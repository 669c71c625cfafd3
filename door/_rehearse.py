"""Deployments in files: loaded, and rehearsed with events."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from foosim.capture.start_frame import read_branch
from foosim.deployment.loader import apply_sets
from foosim.deployment.schema import Deployment
from foosim.deployment.text.files import read_deployment_text
from foosim.simulation.events import Events
from foosim.simulation.run import Rehearsed
from foosim.simulation.run import rehearse as rehearse_text
from foosim.simulation.simulation import read_for_stepping


def load_deployment(path: str | Path, sets: Sequence[str] = ()) -> Deployment:
    """Return the deployment in a file, checked; `sets` change its values as `--set` does.

    Raises DeploymentError for a bad text, AssetError for a bad file that it names.
    """
    return read_for_stepping(path, sets)


def rehearse(
    deployment: str | Path,
    ticks: int,
    nodes: int = 1,
    events: Sequence[str] = (),
    *,
    sets: Sequence[str] = (),
    capture: str | Path | None = None,
    start: str | None = None,
) -> Rehearsed:
    """Run a deployment's whole system in this process on virtual time, as `foosim rehearse` does.

    Its robots are dealt to `nodes` nodes, n1 to nN. `events` are texts: `kill n2 at 1 s`, `kill n2 for 300 ms at 1 s`,
    `cut n3 for 300 ms at 1 s`, `move red.goal to n2 at 500 ms`. `capture` is the file of a new capture, `start` the
    frame to begin with, `CAPTURE@12.5s`. The result has the JSON object of a run (`json`) and D(tick) of each tick
    (`digests`).

    Raises DeploymentError, AssetError, BadValue for an invalid event or one that the run refuses, CaptureError.
    """
    path = Path(deployment)
    text = apply_sets(read_deployment_text(path), path.name, sets)
    declared = read_for_stepping(path, sets)
    requested = Events(events, declared, nodes)
    begin = None if start is None else read_branch(start, declared).start
    kept = None if capture is None else Path(capture)
    result = rehearse_text(
        text, path.name, ticks, nodes, prepare=requested.prepare, capture=kept, folder=path.parent, start=begin
    )
    requested.check(result.answers)
    return result

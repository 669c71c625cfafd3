"""The status of a captured run at a tick, with the keys of a running one's (`supervisor.status`) as far as a capture
tells: score, ball, who owned what, what had happened. Pure: neighbours are `recording`, `capture_source`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from foosim.common.names import TEAMS
from foosim.console.recorded.recording import Look, Recording
from foosim.world.frame import Frame
from foosim.world.layout import BALL


def status_at(recording: Recording, account: Mapping[str, Any], tick: int, look: Look | None) -> dict[str, Any]:
    """Return the status at a tick, of which `look` is what is shown; `account` is the state of the clock."""
    about, deployment = recording.about, recording.deployment
    first, last = recording.span
    epoch = recording.epoch_at(tick)
    owners = {} if epoch is None else {owner.robot: owner.node for owner in epoch.owners}
    roster = sorted(deployment.nodes) if epoch is None else epoch.roster
    frame = None if look is None else look.frame
    return {
        "run": about.metadata.get("run", ""),
        "world": deployment.world,
        "seed": deployment.seed,
        "ticks": tick,
        "first_tick": first,
        "last_tick": last,
        "tick_ns": recording.tick_ns,
        "epoch": 0 if epoch is None else epoch.epoch,
        **account,
        "finished": recording.index.finished,
        "shown": None if look is None else {"kind": look.kind, "tick": look.tick},
        "digest": {"frame": frame.digest.hex()} if frame is not None and frame.tick == tick else None,
        "score": None if frame is None or frame.score is None else dict(zip(TEAMS, frame.score, strict=True)),
        "ball": _ball(frame),
        "rovers": _rovers(recording, frame),
        "nodes": {node: {"owned": sorted(robot for robot in owners if owners[robot] == node)} for node in roster},
        "recoveries": [
            {
                "what": row.what,
                "name": row.name,
                "reason": row.reason,
                "tick": row.tick,
                "epoch": row.epoch,
                "outage_ms": row.wall_outage_ns / 1e6,
            }
            for row in recording.recoveries
            if row.tick <= tick
        ],
    }


def _ball(frame: Frame | None) -> dict[str, Any] | None:
    """Return where the ball is; None without a table."""
    if frame is None or BALL not in frame.layout:
        return None
    return {"position": [round(value, 4) for value in frame.vector(BALL, "position", 3)]}


def _rovers(recording: Recording, frame: Frame | None) -> dict[str, Any] | None:
    """Return how many rovers there are and drive, and which has the least charge (a share); None without a hall."""
    if frame is None or not frame.layout.rovers:
        return None
    capacity = recording.deployment.hall.rover.battery.capacity
    least, name = min((frame.at(rover.name, "charge"), rover.name) for rover in frame.layout.rovers)
    drive = sum(any(frame.vector(rover.name, "wheel_speeds", 2)) for rover in frame.layout.rovers)
    return {"count": len(frame.layout.rovers), "drive": drive, "least": name, "charge": round(least / capacity, 4)}

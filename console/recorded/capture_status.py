"""The status of a captured run at a tick, with the keys of a running one's (`supervisor.status`) as far as a capture
tells: what rules and kits show, who owned what, what had happened. Pure: neighbours are `recording`, `capture_source`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from foosim.console.recorded.recording import Look, Recording
from foosim.world.assembly.world import world_status, world_texts


def status_at(recording: Recording, account: Mapping[str, Any], tick: int, look: Look | None) -> dict[str, Any]:
    """Return the status at a tick, of which `look` is what is shown; `account` is the state of the clock."""
    about, deployment = recording.about, recording.deployment
    first, last = recording.span
    epoch = recording.epoch_at(tick)
    owners = {} if epoch is None else {owner.robot: owner.node for owner in epoch.owners}
    roster = sorted(deployment.nodes) if epoch is None else epoch.roster
    frame = None if look is None else look.frame
    shown = {} if frame is None else world_status(deployment, frame)
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
        **shown,
        "summary": [] if frame is None else world_texts(deployment, shown),
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

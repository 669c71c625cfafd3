"""Status and result of a run as JSON: for the verb `status`, the display, and the result file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from msgspec.structs import asdict

from foosim.common.json_text import decode_json
from foosim.deployment.schema import places
from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.protocol.run_status import NO_PACKETS, NOT_RECORDED, UNFINISHED
from foosim.supervisor.progress import ProgressMonitor
from foosim.supervisor.state import RunState
from foosim.world.assembly.world import status_numbers, world_status, world_texts
from foosim.world.frame import Frame


def in_quarantine(frame: Frame) -> list[str]:
    """Return the names of the entities in quarantine."""
    marked = [(entity.name, entity.offsets.get("quarantined", -1)) for entity in frame.layout.entities]
    return [name for name, at in marked if at >= 0 and frame.numbers[at] > 0.0]


def result(state: RunState) -> dict[str, Any]:
    """Return the result of a run, or of a run so far."""
    frame = state.frame
    report = state.roster.hub_account
    cut_off = state.cut_off
    wall_ns = state.committed_ns - state.started_ns
    origin = state.settings.origin
    shown = world_status(state.deployment, frame)
    out = in_quarantine(frame)
    return {
        **shown,
        "summary": [*world_texts(state.deployment, shown), *([f"in quarantine: {', '.join(out)}"] if out else [])],
        "quarantined": out,
        "solvers": state.account.solvers,
        "run": state.settings.run,
        "world": state.deployment.world,
        "seed": state.deployment.seed,
        "ticks": frame.tick,
        "first_tick": state.first_tick,
        "tick_ns": state.deployment.tick_ns,
        "rtf": round((frame.tick - state.first_tick) * state.deployment.tick_ns / wall_ns, 3) if wall_ns > 0 else None,
        "lag_ms": None if state.pacer.is_fast else state.pacer.lags.as_json(),
        "lateness_ms": report.get("lateness_ms"),
        "digest": {"frame": frame.digest.hex(), "chain": state.chain.hex()},
        "packets": report.get("packets", NO_PACKETS),
        "metrics": {**status_numbers(shown), **report.get("metrics", {})},
        "recording": _recording(state),
        "from": None if origin is None else {"capture": origin.source, "tick": origin.tick},
        "nodes": {
            name: {
                "owned": sorted(robot for robot, owner in state.owners.items() if owner == name),
                "solved_ticks": state.account.solved_ticks.get(name, 0),
                "free_ticks": state.account.free_ticks.get(name, 0),
            }
            for name in sorted(state.deployment.nodes)
        },
        "recoveries": _recoveries(state),
        "moves": state.account.moves,
        "handovers": state.account.handovers,
        "capture": report.get("capture") or None,
        "reason": "; ".join(part for part in (state.end.reason, cut_off) if part) if state.end is not None else None,
        "failed": state.end is not None and (state.end.failed or bool(cut_off)),
        "failed_component": None
        if state.end is None or state.end.failed_component is None
        else asdict(state.end.failed_component),
    }


def status(
    state: RunState, progress: ProgressMonitor, vhub_lost: dict[str, Any] | None, refused: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the result so far and what only a running system has.

    `vhub_lost` is the present loss of the vHub, `refused` what the supervisor has refused, by sender.
    """
    report = state.roster.hub_account
    pacer = state.pacer
    waiting_for = ", ".join(progress.waiting_for())
    return {
        **result(state),
        "epoch": state.epoch,
        "state": _state(state),
        "begun": not state.is_starting,
        "pace": str(pacer.pace),
        "released": state.released,
        "late": {"lag_ms": pacer.last_lag_ns / 1e6, "waited_for": progress.late, "tick": progress.late_tick},
        "waiting_for": waiting_for,
        "processes": _processes(state, waiting_for, refused),
        "shared": dict(sorted(state.settings.processes.items())),
        "starts": dict(state.roster.starts),
        "vhub_away": state.roster.is_hub_away,
        "vhub_lost": vhub_lost,
        "links": report.get("links", []),
        "links_in_all": report.get("links_in_all", 0),
        "disruptions": {
            "count": state.disruptions,
            "last": [{"tick": tick, "event": decode_json(text.encode())} for tick, text in state.last_disruptions],
        },
        "requests": [asdict(request) for request in state.last_requests],
        "refusals": report.get("refusals", {}),
        "clients": report.get("clients", []),
        "watched": report.get("watched", {}),
    }


def _recoveries(state: RunState) -> list[dict[str, object]]:
    """Return the losses and returns of the account; the time of a lasting outage is null."""
    return [
        {
            "what": entry.what,
            "name": entry.name,
            "reason": entry.reason,
            "tick": entry.tick,
            "epoch": entry.epoch,
            "outage_ms": None if entry.outage_ns < 0 else round(entry.outage_ns / 1e6, 3),
        }
        for entry in state.recovered
    ]


def _recording(state: RunState) -> dict[str, Any]:
    """Return the state of the capture as the vHub reported it last, which after its farewell is final."""
    hub = state.roster.by_name.get(VHUB)
    recording = state.roster.hub_account.get("recording") or NOT_RECORDED
    is_open = state.finished and hub is not None and not hub.farewell and recording["state"] in ("on", "low", "closing")
    return {**recording, "state": UNFINISHED} if is_open else recording


def _processes(state: RunState, waiting_for: str, refused: Mapping[str, Any]) -> dict[str, Any]:
    """Return the last report of each process, in name order, and the supervisor itself after them."""
    hosts = places(state.deployment)
    processes = {
        name: {
            "role": process.role,
            "host": hosts.get(name, ""),
            "lost": process.lost and name not in state.roster.stopped,
            "stopped": name in state.roster.stopped,
            "busy": 0.0 if process.heartbeat is None else round(process.heartbeat.busy, 3),
            "tick": 0 if process.heartbeat is None else process.heartbeat.tick,
            "waiting_for": "" if process.heartbeat is None else process.heartbeat.waiting_for,
            "refused": process.report.get("refused", {}),
            "not_finite": process.report.get("not_finite", {}),
        }
        for name, process in sorted(state.roster.by_name.items())
    }
    own = {"role": SUPERVISOR, "host": "", "lost": False, "stopped": False, "busy": round(state.busy, 3)}
    position = {"tick": state.frame.tick, "waiting_for": waiting_for, "refused": refused}
    return {**processes, SUPERVISOR: {**own, **position}}


def _state(state: RunState) -> str:
    if state.end is not None:
        return "failed" if state.end.failed else "ended"
    if not state.is_open:
        return "recovering" if state.is_resuming else "starting"
    return "paused" if state.pacer.paused else "running"

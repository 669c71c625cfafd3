"""What the supervisor knows of a run, as JSON: for `status`, for the display, and the result at its end.

Neighbours: `requests` answers with it, `display` shows it, `up` prints the result.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from msgspec.structs import asdict

from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.protocol.deployment import places
from foosim.protocol.frame import Frame
from foosim.protocol.json_text import decode_json
from foosim.protocol.layout import BALL
from foosim.protocol.names import TEAMS

if TYPE_CHECKING:
    from foosim.supervisor.core import SupervisorCore


@dataclass(frozen=True, slots=True)
class SupervisorStatistics:
    """What the supervisor has done so far."""

    tick: int
    epoch: int
    moves: int
    handovers: int
    refused: int
    repeated: int
    diverged: int


DISRUPTIONS_SHOWN: Final = 16
"""Events of the network that a status has, the last that were asked for."""
NOT_RECORDED = {"state": "off", "problem": "", "offered": 0, "written": 0, "refused": 0, "bytes": 0}
UNFINISHED: Final = "unfinished"
"""State of a recording of which nobody has said that it is closed: its file has no end, or was closed later."""
NO_PACKETS = {"offered": 0, "delivered": 0, "dropped": 0, "in_flight": 0, "refused": 0}


def result(core: SupervisorCore) -> dict[str, Any]:
    """Return the result of a run, or of a run so far."""
    frame = core.frame
    report = core.roster.hub_account
    cut_off = core.closing.cut_off
    wall_ns = core.committed_ns - core.started_ns
    origin = core.settings.origin
    return {
        "run": core.settings.run,
        "world": core.deployment.world,
        "seed": core.deployment.seed,
        "ticks": frame.tick,
        "first_tick": core.first_tick,
        "tick_ns": core.deployment.tick_ns,
        "rtf": round((frame.tick - core.first_tick) * core.deployment.tick_ns / wall_ns, 3) if wall_ns > 0 else None,
        "lag_ms": None if core.pacer.is_fast else core.pacer.lags.as_json(),
        "lateness_ms": report.get("lateness_ms"),
        "digest": {"frame": frame.digest.hex(), "chain": core.chain.hex()},
        "packets": report.get("packets", NO_PACKETS),
        "recording": _recording(core),
        "from": None if origin is None else {"capture": origin.source, "tick": origin.tick},
        "nodes": {
            name: {
                "owned": sorted(robot for robot, owner in core.owners.items() if owner == name),
                "solved_ticks": core.account.solved_ticks.get(name, 0),
                "ball_ticks": core.account.ball_ticks.get(name, 0),
            }
            for name in sorted(core.deployment.nodes)
        },
        "recoveries": core.recovery.as_json(),
        "moves": core.account.moves,
        "handovers": core.account.handovers,
        "score": _score(frame),
        "capture": report.get("capture") or None,
        "reason": "; ".join(part for part in (core.end.reason, cut_off) if part) if core.end is not None else None,
        "failed": core.end is not None and (core.end.failed or bool(cut_off)),
    }


def status(core: SupervisorCore, now_ns: int) -> dict[str, Any]:
    """Return the result so far and what only a running system has."""
    report = core.roster.hub_account
    pacer = core.pacer
    waiting_for = ", ".join(core.watch.waiting_for(core))
    return {
        **result(core),
        "epoch": core.epoch,
        "state": _state(core),
        "begun": not core.beginning.lasts(core.frame.tick),
        "pace": str(pacer.pace),
        "released": core.released,
        "late": {"lag_ms": pacer.last_lag_ns / 1e6, "waited_for": core.watch.late, "tick": core.watch.late_tick},
        "waiting_for": waiting_for,
        "ball": _ball(core),
        "rovers": _rovers(core),
        "processes": _processes(core, waiting_for),
        "starts": dict(core.roster.starts),
        "vhub_away": core.roster.is_hub_away,
        "vhub_lost": core.absence.as_json(now_ns) if core.roster.is_hub_away else None,
        "links": report.get("links", []),
        "links_in_all": report.get("links_in_all", 0),
        "disruptions": {
            "asked": core.requests.disruptions,
            "last": [
                {"tick": tick, "event": decode_json(text.encode())}
                for tick, text in core.requests.network_events()[-DISRUPTIONS_SHOWN:]
            ],
        },
        "requests": [asdict(asked) for asked in core.requests.asked],
        "refusals": report.get("refusals", {}),
        "clients": report.get("clients", []),
        "watched": report.get("watched", {}),
    }


def _recording(core: SupervisorCore) -> dict[str, Any]:
    """Return how the capture does, as the vHub told last; in a run that is over that is final once it said farewell."""
    hub = core.roster.by_name.get(VHUB)
    told = core.roster.hub_account.get("recording") or NOT_RECORDED
    is_open = core.finished and hub is not None and not hub.farewell and told["state"] in ("on", "low", "closing")
    return {**told, "state": UNFINISHED} if is_open else told


def _score(frame: Frame) -> dict[str, int] | None:
    """Return the goals of both teams; None without a table."""
    return None if frame.score is None else dict(zip(TEAMS, frame.score, strict=True))


def _ball(core: SupervisorCore) -> dict[str, Any] | None:
    """Return where the ball is, and who solves it; None without a table."""
    if BALL not in core.frame.layout:
        return None
    position = core.frame.vector(BALL, "position", 3)
    return {"position": [round(value, 4) for value in position], "solver": core.account.ball_solver}


def _rovers(core: SupervisorCore) -> dict[str, Any] | None:
    """Return how many rovers there are and drive, and which has the least charge (a share); None without a hall."""
    frame, rovers = core.frame, core.frame.layout.rovers
    if not rovers:
        return None
    capacity = core.deployment.hall.rover.battery.capacity
    least, name = min((frame.at(rover.name, "charge"), rover.name) for rover in rovers)
    drive = sum(any(frame.vector(rover.name, "wheel_speeds", 2)) for rover in rovers)
    return {"count": len(rovers), "drive": drive, "least": name, "charge": round(least / capacity, 4)}


def _processes(core: SupervisorCore, waiting_for: str) -> dict[str, Any]:
    """Return all processes as they last told, in name order, and the supervisor itself behind them."""
    hosts = places(core.deployment)
    processes = {
        name: {
            "role": process.role,
            "host": hosts.get(name, ""),
            "lost": process.lost and name not in core.roster.stopped,
            "stopped": name in core.roster.stopped,
            "busy": 0.0 if process.heartbeat is None else round(process.heartbeat.busy, 3),
            "tick": 0 if process.heartbeat is None else process.heartbeat.tick,
            "waiting_for": "" if process.heartbeat is None else process.heartbeat.waiting_for,
            "refused": process.report.get("refused", {}),
        }
        for name, process in sorted(core.roster.by_name.items())
    }
    own = {"role": SUPERVISOR, "host": "", "lost": False, "stopped": False, "busy": round(core.busy, 3)}
    told = {"tick": core.frame.tick, "waiting_for": waiting_for, "refused": core.refusals.by_sender()}
    return {**processes, SUPERVISOR: {**own, **told}}


def _state(core: SupervisorCore) -> str:
    if core.end is not None:
        return "failed" if core.end.failed else "ended"
    if not core.is_open:
        return "starting" if core.take_over is None else "recovering"
    return "paused" if core.pacer.paused else "running"


def score_text(status: dict[str, Any]) -> str:
    """`red 2 : 1 blue`."""
    return f"red {status['score']['red']} : {status['score']['blue']} blue"

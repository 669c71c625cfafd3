"""The table in one process: a rehearsal on one node, codec on, without a capture.

Each engine runs bare for the figure, the median of some runs, then metered for the parts of a tick. The meter is in
the engine and around each process's turns, and costs some microseconds of its own.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median
from typing import Any, Final

from bench.meter import ENGINE_PARTS, Meter, metered_engine
from bench.runs import TABLE
from foosim.client.core import ClientCore
from foosim.node.core import NodeCore
from foosim.protocol import channels
from foosim.protocol.channels import Channel
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings, System
from foosim.supervisor.core import SupervisorCore
from foosim.vhub.core import HubCore
from foosim.world.frame import Frame

WARM_TICKS: Final = 200


@dataclass(frozen=True, slots=True)
class OneProcess:
    """One engine's figure and, from the metered run, microseconds by part; `node` is without its engine."""

    engine: str
    ticks: int
    us_per_tick: float
    rtf: float
    us_of_runs: list[float]
    cpu_us_of_runs: list[float]
    """Processor time: what to compare on a machine that others use, too."""
    metered_us: dict[str, float]
    score: dict[str, int]


def table_one_process(seconds: float = 20.0, repeats: int = 3) -> list[OneProcess]:
    """Measure both engines."""
    return [_measure(engine, seconds, repeats) for engine in ("bullet", "pure")]


def _measure(engine: str, seconds: float, repeats: int) -> OneProcess:
    bare = [_rehearse(engine, seconds, Settings(), None) for _ in range(repeats)]
    runs = [times["total"] for times, _ in bare]
    us, result = median(runs), bare[0][1]
    meter = Meter()
    metered, _ = _rehearse(engine, seconds, _metered_settings(meter), meter)
    node = metered.pop("node") - sum(metered.get(part, 0.0) for part in ENGINE_PARTS)
    parts = {**{part: metered.pop(part) for part in ENGINE_PARTS}, "node": round(node, 1)}
    total, cpu = metered.pop("total"), metered.pop("cpu")
    parts |= metered
    parts |= {"bus": round(total - sum(parts.values()), 1), "total": total, "cpu": cpu}
    rtf = round(result["tick_ns"] / 1e3 / us, 2)
    return OneProcess(
        engine, result["ticks"], us, rtf, runs, [times["cpu"] for times, _ in bare], parts, result["score"]
    )


def _rehearse(
    engine: str, seconds: float, settings: Settings, around: Meter | None
) -> tuple[dict[str, float], dict[str, Any]]:
    """Rehearse, with a meter `around` the turns of each process when one is given; return its times and the result."""
    clock = around or Meter()
    ticks = max(2 * WARM_TICKS, round(seconds * 500))
    settings.on_commit = _count(clock, ticks)
    prepare = None if around is None else _metering(around)
    sets = [f"engine={engine}", "tick=2 ms", "substeps=4"]
    rehearsed = rehearse(TABLE.read_text(), TABLE.name, ticks, 1, sets, settings, prepare=prepare)
    return clock.us_per_tick(), rehearsed.json


def _count(meter: Meter, ticks: int) -> Callable[[Frame], None]:
    """Begin when the caches are warm, mark the end."""

    def committed(frame: Frame) -> None:
        if frame.tick == WARM_TICKS:
            meter.begin(frame.tick)
        elif frame.tick == ticks:
            meter.mark(frame.tick)

    return committed


def _metered_settings(meter: Meter) -> Settings:
    """Return settings with metered cores: one may derive from a compiled class, but not replace its methods."""

    class MeteredHub(HubCore):
        def receive(self, channel: Channel, name: str, payload: bytes, now_ns: int) -> None:
            begun_ns = time.perf_counter_ns()
            super().receive(channel, name, payload, now_ns)
            meter.add(channels.VHUB, begun_ns)

    class MeteredSupervisor(SupervisorCore):
        def receive(self, channel: Channel, name: str, payload: bytes, now_ns: int) -> None:
            begun_ns = time.perf_counter_ns()
            super().receive(channel, name, payload, now_ns)
            meter.add(channels.SUPERVISOR, begun_ns)

    class MeteredNode(NodeCore):
        def receive(self, channel: Channel, name: str, payload: bytes, now_ns: int) -> None:
            begun_ns = time.perf_counter_ns()
            super().receive(channel, name, payload, now_ns)
            meter.add("node", begun_ns)

    return Settings(factory=metered_engine(meter), hub=MeteredHub, supervisor=MeteredSupervisor, node=MeteredNode)


class _MeteredPlayer:
    """A player's core, its reading metered. No settings give its class, and nothing here reads it."""

    def __init__(self, core: ClientCore, meter: Meter) -> None:
        self._core = core
        self.receive = meter.metered("players", core.receive)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._core, name)


def _metering(meter: Meter) -> Callable[[System], None]:
    """Meter the turns of each process, and what players read."""

    def prepare(system: System) -> None:
        for name, process in system.processes.items():
            part = "node" if name in system.solvers else "players" if name in system.players else name
            process.turn = meter.metered(part, process.turn)
            if name in system.players:
                process.core = _MeteredPlayer(process.core, meter)

    return prepare


def lines(rows: list[OneProcess]) -> list[str]:
    """Return the figures for people."""
    shown = []
    for row in rows:
        to_reach = ", to reach 6x" if row.engine == "bullet" else ""
        runs, cpu = (" ".join(f"{us:g}" for us in of_runs) for of_runs in (row.us_of_runs, row.cpu_us_of_runs))
        shown += [
            f"{row.engine:8}{row.us_per_tick:8.1f} us/tick{row.rtf:7.2f}x real time "
            f"({row.ticks} ticks{to_reach}; {row.score['red']} : {row.score['blue']})",
            f"        runs {runs} us, of processor {cpu}",
        ]
        shown.append("        metered: " + "  ".join(f"{part} {us:g}" for part, us in row.metered_us.items()))
    return shown

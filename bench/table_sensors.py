"""The table with all sensors of its rods and its ball, in one process: what they cost, in multiples of b.

A rehearsal on one node without a capture, on Bullet, with the passive player for each team, which hears what it
subscribes to and sends nothing. A rehearsal does the same each time, so each tick has a least time over some repeats,
and what else the machine does is left out; b, measured by turns with them, is had likewise. Figures are means over the
ticks.
"""

from __future__ import annotations

import gc
import json
import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from bench.bare_tick import BareTable
from bench.runs import TABLE, BenchError
from foosim.rehearsal.run import rehearse
from foosim.rehearsal.system import Settings
from foosim.runtime.roles.loop import collect_seldom
from foosim.world.frame import Frame

SENSORS: Final = TABLE.parent / "table_sensors.yaml"
"""The table with all sensors."""
OF_RODS: Final = ("encoder", "counts", "state", "current", "touch")
OF_CAMERA: Final = ("ball", "exact", "tracked", "late")
TEAMS: Final = ("red", "blue")
LINES: Final = ("goal", "defence", "midfield", "attack")
PASSIVE: Final = "foosim.players.football:Passive"
WARM_TICKS: Final = 100
REPEATS: Final = 7


@dataclass(frozen=True, slots=True)
class Sensed:
    """A tick of a case: microseconds, and as a multiple of b of the same run."""

    case: str
    us: float
    b: float


def players(of_rods: Sequence[str], of_camera: Sequence[str]) -> str:
    """Return the setting by which a passive player of each team hears these channels of its rods and of the camera."""
    made = {
        f"player-{team}": {
            "class": PASSIVE,
            "parameters": {"team": team},
            "rate": "100 Hz",
            "lockstep": True,
            "robots": {**{f"{team}.{line}": [*of_rods] for line in LINES}, "camera": [*of_camera]},
        }
        for team in TEAMS
    }
    return f"players={json.dumps(made)}"


def drives(kind: str) -> list[str]:
    """Return the settings by which each rod has another drive."""
    return [f"robots.{team}.{line}.actuators={{motors: {{kind: {kind}}}}}" for team in TEAMS for line in LINES]


def table_sensors(seconds: float = 2.0) -> list[Sensed]:
    """Measure the table as deployed, with all sensors, and what it costs to hear them all or to drive by voltages."""
    text, everything = TABLE.read_text(), SENSORS.read_text()
    usual = players(("encoder",), ("ball",))
    cases = {
        "as deployed": (text, [usual]),
        "all sensors, players hear encoders and the ball": (everything, [usual]),
        "all sensors, players hear all": (everything, [players(OF_RODS, OF_CAMERA)]),
        "all sensors, motors at voltages": (everything, [usual, *drives("rod_voltage")]),
    }
    ticks = WARM_TICKS + max(10, round(seconds * 500))
    table = BareTable()
    times: dict[str, list[list[int]]] = {case: [] for case in cases}
    bare: list[list[int]] = []
    try:
        for _ in range(REPEATS):
            bare.append(_bare(table, ticks - WARM_TICKS))
            for case, (its, sets) in cases.items():
                times[case].append(_rehearsed(its, sets, ticks))
    finally:
        table.close()
    b = _least(bare)
    return [Sensed(case, round(us := _least(runs), 1), round(us / b, 3)) for case, runs in times.items()]


def _bare(table: BareTable, ticks: int) -> list[int]:
    """Return the nanoseconds of each of some bare ticks."""
    spent = []
    for _ in range(ticks):
        begun_ns = time.perf_counter_ns()
        table.run(1)
        spent.append(time.perf_counter_ns() - begun_ns)
    return spent


def _rehearsed(text: str, sets: Sequence[str], ticks: int) -> list[int]:
    """Return the nanoseconds between the commits of a rehearsal, once it is warm."""
    seen: list[int] = []

    def committed(frame: Frame) -> None:
        if frame.tick == WARM_TICKS:
            gc.unfreeze()
            collect_seldom()  # as a process of a run does
        if frame.tick >= WARM_TICKS:
            seen.append(time.perf_counter_ns())

    sets = ["engine=bullet", "tick=2 ms", "substeps=4", *sets]
    run = rehearse(text, TABLE.name, ticks, 1, sets, Settings(on_commit=committed))
    if run.json["failed"]:
        raise BenchError(run.json["reason"])
    return [after - before for before, after in pairwise(seen)]


def _least(runs: Sequence[Sequence[int]]) -> float:
    """Return the mean of the least time of each tick, in us."""
    least: list[int] = [min(of_tick) for of_tick in zip(*runs, strict=True)]
    return sum(least) / len(least) / 1e3


def lines(rows: Sequence[Sensed]) -> list[str]:
    """Return the figures for people."""
    return [f"{row.case:50}{row.us:8.1f} us/tick{row.b:7.2f} b" for row in rows]

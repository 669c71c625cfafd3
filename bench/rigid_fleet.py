"""Fifty rigid robots on two wheels that drive in circles among a hundred boxes at rest: by one node, and by two.

Each robot has a place of its own between boxes that it does not touch, and the pose at 10 Hz. The first figure is
processor time of a rehearsal on one node, in us a tick and in b. The second are runs of processes as `up` makes them,
in pace fast, with one node and with two by turns: how many times as fast two are.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Final
from unittest import mock

import yaml

from bench.bare_tick import bare_tick_us
from bench.distributed import cost_text
from bench.fleet import WARM_TICKS, Rounds
from bench.meter import Meter
from bench.runs import ROOT, ProcessCost, Watched, watch
from foosim.rehearsal.run import rehearse
from foosim.rehearsal.system import Settings
from foosim.world.frame import Frame

ROBOTS: Final = 50
BOXES: Final = 100
ROW: Final = 10
APART_M: Final = 3.0
TICKS_PER_S: Final = 100
TO_REACH: Final = 60.0
"""In b."""
TIMES: Final = 1.5
"""How many times as fast two nodes are to be."""


@dataclass(frozen=True, slots=True)
class RigidFleet:
    """Processor time of a tick in one process, the median of some runs, in us and in b; and of runs of processes with
    one node and with two: ticks a second, and the processes of the run that is the median."""

    us_per_tick: float
    us_of_runs: list[float]
    ratio: float
    at_rest: int
    """Boxes that were at rest at the end."""
    ticks_per_s: dict[int, list[float]]
    processes: dict[int, list[ProcessCost]]
    speed_up: float


def rigid_text(nodes: int = 1) -> str:
    """Return the deployment of the fleet, whose robots are dealt to so many nodes."""
    robots = {
        f"r{number:02}": {
            "like": "one",
            "at": {"x": f"{APART_M * (number % ROW)} m", "y": f"{APART_M * (number // ROW)} m"},
        }
        for number in range(ROBOTS)
    }
    boxes = {
        f"b{number:03}": {
            "model": "box",
            "size": ["30 cm"] * 3,
            "mass": "4 kg",
            "at": {
                "x": f"{APART_M * (number % ROW) + APART_M / 2} m",
                "y": f"{APART_M / 2 * (number // ROW)} m",
                "z": "15 cm",
            },
        }
        for number in range(BOXES)
    }
    data = {
        "format": 2,
        "world": "fleet",
        "seed": 1,
        "tick": "10 ms",
        "substeps": 2,
        "engine": "bullet",
        "pace": "fast",
        "scene": {"kind": "empty"},
        "physics": {"solver_iterations": 20},
        "objects": boxes,
        "templates": {
            "one": {
                "model": "differential_drive",
                "dynamics": "rigid",
                "sensors": {"pose": {"kind": "pose", "rate": "10 Hz"}},
            }
        },
        "robots": robots,
        "nodes": {
            f"n{node + 1}": {
                "launch": "local",
                "robots": [name for place, name in enumerate(robots) if place % nodes == node],
            }
            for node in range(nodes)
        },
        "players": {
            "rounds": {
                "class": f"{Rounds.__module__}:{Rounds.__qualname__}",
                "rate": "100 mHz",
                "lockstep": True,
                "robots": {"*": []},
            }
        },
        "network": {"links": [{"id": "all", "from": "*", "to": "*"}]},
    }
    return yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=200)


def rigid_fleet(seconds: float = 10.0, repeats: int = 3) -> RigidFleet:
    """Measure; `seconds` is the simulated time of each run."""
    alone = [_rehearsed(seconds) for _ in range(repeats)]
    runs: dict[int, list[Watched]] = {1: [], 2: []}
    with TemporaryDirectory() as folder, mock.patch.dict(os.environ, {"PYTHONPATH": str(ROOT)}):
        for _ in range(repeats):
            for nodes, its in runs.items():
                file = Path(folder) / f"fleet{nodes}.yaml"
                file.write_text(rigid_text(nodes))
                its.append(watch("fast", seconds, deployment=file))
    speeds = {nodes: [_ticks_per_s(run) for run in its] for nodes, its in runs.items()}
    middle = {nodes: sorted(its, key=_ticks_per_s)[len(its) // 2] for nodes, its in runs.items()}
    return RigidFleet(
        median(us for us, _, _ in alone),
        [us for us, _, _ in alone],
        round(median(us / b for us, b, _ in alone), 1),
        alone[0][2],
        speeds,
        {nodes: run.costs() for nodes, run in middle.items()},
        round(median(two / one for one, two in zip(speeds[1], speeds[2], strict=True)), 2),
    )


def _ticks_per_s(run: Watched) -> float:
    return round(float(run.result["rtf"]) * TICKS_PER_S, 1)


def _rehearsed(seconds: float) -> tuple[float, float, int]:
    """Return the processor time of a tick, b beside it (us), and how many boxes are at rest."""
    meter, ticks = Meter(), WARM_TICKS + max(10, round(seconds * TICKS_PER_S))
    last: list[Frame] = []

    def committed(frame: Frame) -> None:
        if frame.tick == WARM_TICKS:
            meter.begin(frame.tick)
        elif frame.tick == ticks:
            meter.mark(frame.tick)
            last.append(frame)

    b = bare_tick_us()
    rehearse(rigid_text(), "fleet.yaml", ticks, 1, settings=Settings(on_commit=committed))
    rest = sum(last[0].at(box.name, "slow_ticks") >= WARM_TICKS / 2 for box in last[0].layout.of("box"))
    return meter.us_per_tick()["cpu"], b, rest


def lines(row: RigidFleet) -> list[str]:
    """Return the figures for people."""
    spread = " ".join(f"{us:.0f}" for us in row.us_of_runs)
    shown = [
        f"{ROBOTS} robots, {row.at_rest} of {BOXES} boxes at rest: {row.us_per_tick:8.0f} us a tick (runs {spread}), "
        f"{row.ratio:.1f} b (to reach {TO_REACH:g} b)"
    ]
    for nodes, speeds in row.ticks_per_s.items():
        shown += [
            f"{nodes} {'node' if nodes == 1 else 'nodes'}: {median(speeds):.0f} ticks/s (runs {speeds})",
            f"    us of processor a tick: {cost_text(row.processes[nodes])}",
        ]
    return [*shown, f"two nodes are {row.speed_up:.2f} times as fast as one (to reach {TIMES:g})"]

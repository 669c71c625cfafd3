"""Rigid bodies of any kind: solving of islands, building of a model, memory of a node.

Solving is timed within a rehearsal on one node: load, substeps, log and read of all islands of a tick, in processor
time. A fleet of fifty rigid robots drives in circles; an arm waves beside two boxes that lie in its reach; the yard is
the one in deploy/. Memory is the proportional share (PSS) of a process that has rehearsed the yard.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any, Final

import yaml

from bench.bare_tick import bare_tick_us
from bench.fleet import Rounds
from bench.runs import ROOT, BenchError
from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import Deployment
from foosim.node.physics.interface import Island
from foosim.node.physics.making import make_engine
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings
from foosim.world.assembly.world import initial_numbers
from foosim.world.components.drives import NO_DRIVES
from foosim.world.layout import Layout, build_layout

ROBOTS: Final = 50
TICKS: Final = 300
BUILDS: Final = 20
DEPLOY: Final = ROOT / "deploy"
PSS: Final = """
from foosim.simulation.run import rehearse
from pathlib import Path
file = Path("deploy/yard.yaml")
rehearse(file.read_text(), file.name, 3000, 1, folder=file.parent)
print(next(line.split()[1] for line in open("/proc/self/smaps_rollup") if line.startswith("Pss:")))
"""


@dataclass(frozen=True, slots=True)
class Bodies:
    """Solving of a tick in us and in b by world, building of a model of ten bodies in ms, memory in MB."""

    solve_us: dict[str, float]
    solve_b: dict[str, float]
    build_ms: float
    pss_mb: float


def text_of(robots: dict[str, Any], objects: dict[str, Any], players: dict[str, Any], engine: str = "mujoco") -> str:
    """Return a deployment of rigid bodies on a floor."""
    data = {
        "format": 2,
        "world": "bodies",
        "seed": 1,
        "tick": "10 ms",
        "substeps": 4,
        "engine": engine,
        "pace": "fast",
        "assets": "models",
        "scene": {"kind": "empty", "length": "1 km", "width": "1 km"},
        "objects": objects,
        "robots": robots,
        "players": players,
        "nodes": {"n": {"robots": ["*"]}},
        "network": {"links": [{"id": "all", "from": "*", "to": "*"}]},
    }
    return yaml.safe_dump(json.loads(json.dumps(data)), sort_keys=False, width=200)  # without anchors


def fleet_text(engine: str = "mujoco") -> str:
    """Return fifty robots on two wheels, each going round a circle of its own."""
    robots = {
        f"r{n:02}": {
            "model": "differential_drive",
            "dynamics": "rigid",
            "at": {"x": f"{3 * (n % 8)} m", "y": f"{3 * (n // 8)} m"},
        }
        for n in range(ROBOTS)
    }
    return text_of(robots, {}, {"rounds": _player({name: [] for name in robots})}, engine)


def arm_text() -> str:
    """Return an arm, which holds its pose, and two boxes on the floor in its reach."""
    arm = {"model": "urdf", "file": "arm.urdf", "fixed": True, "actuators": {"joints": {"kind": "joint_position"}}}
    box = {"model": "box", "size": ["20 cm"] * 3, "mass": "1 kg"}
    places = {"one": {"x": "50 cm", "z": "10 cm"}, "two": {"x": "50 cm", "z": "30 cm"}}
    return text_of({"arm": arm}, {name: {**box, "at": at} for name, at in places.items()}, {})


def _player(robots: dict[str, list[str]]) -> dict[str, Any]:
    return {
        "class": f"{Rounds.__module__}:{Rounds.__qualname__}",
        "rate": "100 mHz",
        "lockstep": True,
        "robots": robots,
    }


class _Timed:
    """An engine of islands whose solving is timed; bodies at rest are not solved."""

    def __init__(self, deployment: Deployment, layout: Layout) -> None:
        self._engine: Any = make_engine(deployment, layout)
        self.spent_ns = 0

    def solve(self, island: Island, numbers: list[float], start: Any) -> None:
        """Solve and count."""
        begun_ns = time.thread_time_ns()
        self._engine.solve(island, numbers, start)
        self.spent_ns += time.thread_time_ns() - begun_ns

    def close(self) -> None:
        """Free the engine."""
        self._engine.close()


def _solve_us(text: str, name: str, folder: Path, ticks: int) -> float:
    made: list[_Timed] = []

    def factory(deployment: Deployment, layout: Layout) -> Any:
        made.append(_Timed(deployment, layout))
        return made[-1]

    def begin(frame: Any) -> None:
        if frame.tick == 50:
            for engine in made:
                engine.spent_ns = 0

    rehearse(text, name, ticks + 50, 1, settings=Settings(factory=factory, on_commit=begin), folder=folder)
    return sum(engine.spent_ns for engine in made) / ticks / 1e3


def _build_ms() -> float:
    """Return what the first tick of an island of ten boxes takes longer than the second."""
    box = {"model": "box", "size": ["20 cm"] * 3, "mass": "1 kg"}
    objects = {f"b{n}": {**box, "at": {"x": f"{0.3 * n} m", "z": "10 cm"}} for n in range(10)}
    text = text_of({"post": {"model": "holonomic", "at": {"x": "-9 m"}}}, objects, {})
    deployment = load_deployment(text, "boxes.yaml")
    layout, took = build_layout(deployment), []
    bodies = tuple([entity for entity in layout.entities if entity.is_rigid])
    for _ in range(BUILDS):
        engine: Any = make_engine(deployment, layout)
        spans = []
        for _ in range(2):
            numbers = initial_numbers(deployment, layout)
            begun_ns = time.thread_time_ns()
            engine.solve(Island(bodies, (), (NO_DRIVES,) * len(bodies)), numbers, numbers)
            spans.append(time.thread_time_ns() - begun_ns)
        took.append((spans[0] - spans[1]) / 1e6)
    return median(took)


def bodies(ticks: int = TICKS) -> Bodies:
    """Measure."""
    b_us = bare_tick_us()
    worlds = {
        "fleet of fifty": (fleet_text(), DEPLOY, ticks),
        "yard": ((DEPLOY / "yard.yaml").read_text(), DEPLOY, 10 * ticks),
        "arm and two boxes": (arm_text(), DEPLOY, ticks),
    }
    found = {name: _solve_us(text, "bodies.yaml", folder, count) for name, (text, folder, count) in worlds.items()}
    done = subprocess.run([sys.executable, "-c", PSS], cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode:
        raise BenchError(done.stderr.strip()[-400:])
    return Bodies(
        found, {name: us / b_us for name, us in found.items()}, _build_ms(), int(done.stdout.split()[-1]) / 1e3
    )


def lines(found: Bodies) -> list[str]:
    """Return the figures for people."""
    rows = [f"{name:20}{us:9.1f} us a tick{found.solve_b[name]:8.2f} b" for name, us in found.solve_us.items()]
    return [
        *rows,
        f"a model of ten bodies is built in {found.build_ms:.2f} ms; a node of the yard has {found.pss_mb:.0f} MB",
    ]

"""Rigid bodies of any kind, island by island: what they take of a node's tick, in b, and their engines of memory.

A tick is the division into islands and the solving of all of them, as a node does both. A box that wakes lies on the
floor, which it touches with four points, and is kept from coming to rest; what it costs is what a tick takes more than
with all boxes at rest. The arm has seven joints that swing without a pause, and two boxes in its reach; what its engine
takes is load, command, step and read. The memory is that of a process with a node's modules, eight engines of different
islands, and the spare clients.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import sin
from statistics import median
from typing import Any, Final

import yaml

from bench.bare_tick import BareTable
from bench.machine import pss_mb
from bench.runs import ROOT
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import load_deployment
from foosim.node.physics.interface import ISLAND_ENGINES_MAX, Island
from foosim.node.physics.making import build_in_steps, prepare_spares
from foosim.node.tick import Stepper, Work
from foosim.world.assembly.islands import Assignment, Share, reach_of
from foosim.world.assembly.world import initial_numbers
from foosim.world.layout import Entity, build_layout

NAME: Final = "islands.yaml"
NODE: Final = "n"
BOXES: Final = 100
WAKE: Final = 50
ROBOTS: Final = 50
SETTLED_TICKS: Final = 120
"""Boxes that are put down are at rest after half a second."""
TICKS_PER_S: Final = 100
TICKS_OF_A_BLOCK: Final = 20
BARE_TICKS: Final = 50
"""Of each block, for b."""
TO_REACH: Final = {"wakes": 0.4, "arm": 1.8, "robots": 60.0}
MEMORY_MB: Final = 300.0


@dataclass(frozen=True, slots=True)
class Cost:
    """What something costs of a tick: the median of some blocks, in us and in b, and b itself (us)."""

    name: str
    what: str
    us: float
    ratio: float
    b_us: float


@dataclass(frozen=True, slots=True)
class Memory:
    """The memory of a process with so many engines: its own share of all pages (PSS, MB)."""

    engines: int
    pss_mb: float


class MeteredEngine:
    """An engine of islands, and the processor time that it has taken."""

    def __init__(self, engine: Any) -> None:
        self._engine = engine
        self.spent_ns = 0

    def solve(self, island: Island, numbers: list[float], start: Sequence[float]) -> None:
        """Solve an island."""
        begun_ns = time.process_time_ns()
        self._engine.solve(island, numbers, start)
        self.spent_ns += time.process_time_ns() - begun_ns

    def close(self) -> None:
        self._engine.close()


class Ticks:
    """The rigid bodies of a deployment, solved tick by tick on one node, without sensors, rules or packets."""

    def __init__(self, text: str) -> None:
        text, files = pin_assets(text, NAME, ROOT / "deploy")
        deployment = load_deployment(text, NAME).with_assets(files)
        self._layout = layout = build_layout(deployment)
        self._stepper = Stepper(deployment, layout)
        prepare_spares(deployment, layout)
        steps = build_in_steps(deployment, layout)
        while True:
            try:
                next(steps)
            except StopIteration as end:
                self._engine: Any = end.value
                break
        owners = dict.fromkeys([robot.name for robot in layout.robots], NODE)
        self._assignment = Assignment(layout, reach_of(deployment, layout), (NODE,), owners)
        self.numbers = initial_numbers(deployment, layout)
        self.tick = 0
        self._share: Share | None = None
        self._islands: tuple[tuple[Entity, ...], ...] = ()
        self._movers: tuple[tuple[Entity, ...], ...] = ()

    def slots(self, name: str, field: str) -> slice:
        """Return where a field of an entity is in the numbers."""
        entity = self._layout[name]
        at = entity.offsets[field]
        return slice(at, at + entity.counts[field])

    def run(self, ticks: int, before: Callable[[int], None] | None = None) -> float:
        """Compute some ticks; return the time that one takes (us). `before` is called with each tick's number."""
        spent_ns = 0
        for _ in range(ticks):
            if before is not None:
                before(self.tick)
            begun_ns = time.process_time_ns()
            numbers = self.numbers.copy()
            share = self._assignment.shares(numbers)[NODE]
            if share is not self._share:
                entities = self._layout.entities
                self._share = share
                self._islands = tuple([tuple([entities[index] for index in island]) for island in share.islands])
                self._movers = tuple([tuple([entities[index] for index in near]) for near in share.movers])
            work = Work(self.tick, self._layout, self._islands, share.solved, numbers, {}, self.numbers, self._movers)
            self._stepper.solve(self._engine, work)
            self.numbers = work.numbers
            spent_ns += time.process_time_ns() - begun_ns
            self.tick += 1
        assert not self._stepper.quarantined, self._stepper.quarantined
        return spent_ns / 1e3 / ticks

    def run_engine(self, ticks: int, before: Callable[[int], None] | None = None) -> float:
        """Compute some ticks; return what the engine takes of one (us): load, step and read of all islands."""
        plain, metered = self._engine, MeteredEngine(self._engine)
        self._engine = metered
        self.run(ticks, before)
        self._engine = plain
        return metered.spent_ns / 1e3 / ticks

    def close(self) -> None:
        self._engine.close()


def text_of(objects: dict[str, Any], robots: dict[str, Any] | None = None) -> str:
    """Return a deployment with these things on an empty floor."""
    data = {
        "format": 2,
        "world": "islands",
        "seed": 1,
        "tick": "10 ms",
        "substeps": 4,
        "engine": "bullet",
        "pace": "fast",
        "assets": "models",
        "scene": {"kind": "empty", "length": "1 km", "width": "1 km"},
        "objects": objects,
        "robots": robots or {"post": {"model": "quadrotor", "at": {"x": "-100 m", "z": "10 cm"}}},
        "nodes": {NODE: {"robots": ["*"]}},
        "network": {"links": [{"id": "all", "from": "*", "to": "*"}]},
    }
    return yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=200)


def boxes(count: int, x: float = 0.0) -> dict[str, Any]:
    """Return boxes in a row along y, each beyond the reach of the next."""
    box = {"model": "box", "size": ["20 cm"] * 3, "mass": "2 kg", "speed_limit": "8 m/s"}
    return {"box": {**box, "at": {"x": f"{x} m", "z": "10 cm"}, "count": count, "spacing": {"y": "1 m"}}}


def _ratios(ways: Sequence[Callable[[], float]], blocks: int) -> tuple[list[float], list[float], float]:
    """Measure some things by turns with b; return the medians of their times (us), of their ratios to b, and b (us).

    Times are of the processor: other processes take less part in them.
    """
    bare, table = [], BareTable()
    found: list[list[float]] = [[] for _ in ways]
    table.run(BARE_TICKS)
    for _ in range(blocks):
        begun_ns = time.process_time_ns()
        table.run(BARE_TICKS)
        bare.append((time.process_time_ns() - begun_ns) / 1e3 / BARE_TICKS)
        for number, way in enumerate(ways):
            found[number].append(way())
    table.close()
    ratios = [median([us / b for us, b in zip(times, bare, strict=True)]) for times in found]
    return [median(times) for times in found], ratios, median(bare)


def _of_boxes(blocks: int) -> list[Cost]:
    """What boxes cost that wake, and that are at rest."""
    world = Ticks(text_of(boxes(BOXES)))
    slow = [world.slots(f"box-{number}", "slow_ticks").start for number in range(1, BOXES + 1)]
    world.run(SETTLED_TICKS)
    settled = world.numbers.copy()

    def wake(tick: int) -> None:
        for at in slow[:WAKE]:
            world.numbers[at] = 0.0

    def at_rest() -> float:
        world.numbers = settled.copy()
        return world.run(TICKS_OF_A_BLOCK)

    def more() -> float:
        rest = at_rest()
        return (world.run(TICKS_OF_A_BLOCK, wake) - rest) / WAKE

    (each, rest), (each_b, rest_b), b = _ratios([more, at_rest], blocks)
    world.close()
    return [
        Cost("wakes", "each box that wakes", each, each_b, b),
        Cost("rest", f"{BOXES} boxes at rest", rest, rest_b, b),
    ]


def _of_arm(blocks: int) -> list[Cost]:
    """What an arm costs that swings above two boxes in its reach."""
    robot = {"model": "urdf", "file": "arm.urdf", "fixed": True, "actuators": {"joints": {"kind": "joint_position"}}}
    world = Ticks(text_of(boxes(2, x=0.5), {"arm": robot}))
    wanted = world.slots("arm", "joints.set_point")

    def swing(tick: int) -> None:
        count = wanted.stop - wanted.start
        world.numbers[wanted] = [0.5 * sin(0.05 * tick + joint) for joint in range(count)]

    world.run(SETTLED_TICKS, swing)
    (tick, solve), (tick_b, solve_b), b = _ratios(
        [lambda: world.run(TICKS_OF_A_BLOCK, swing), lambda: world.run_engine(TICKS_OF_A_BLOCK, swing)], blocks
    )
    world.close()
    return [
        Cost("arm", "an arm of seven joints with two boxes", solve, solve_b, b),
        Cost("arm tick", "the whole tick of these", tick, tick_b, b),
    ]


def _of_robots(blocks: int) -> list[Cost]:
    """What fifty robots that are rigid bodies cost among boxes at rest: they fly beside these, each by itself."""
    robots = {
        f"r{number:02}": {
            "model": "quadrotor",
            "at": {"x": "5 m", "y": f"{2 * number} m", "z": "2 m"},
            "actuators": {"rotors": {"kind": "rotor_speeds"}},
        }
        for number in range(ROBOTS)
    }
    world = Ticks(text_of(boxes(BOXES), robots))
    places = [
        (world.slots(name, field), world.numbers[world.slots(name, field)])
        for name in robots
        for field in ("position", "orientation", "linear_velocity", "angular_velocity")
    ]
    rotors = [world.slots(name, "rotors.set_point") for name in robots]

    def hold(tick: int) -> None:
        for at, values in places:
            world.numbers[at] = values
        for at in rotors:
            world.numbers[at] = [500.0] * (at.stop - at.start)

    world.run(SETTLED_TICKS, hold)
    (us,), (ratio,), b = _ratios([lambda: world.run(TICKS_OF_A_BLOCK, hold)], blocks)
    world.close()
    return [Cost("robots", f"{ROBOTS} rigid robots among {BOXES} boxes at rest", us, ratio, b)]


def various(kinds: int) -> str:
    """Return a deployment with boxes of so many kinds, each an island of its own."""
    objects = {}
    for number in range(kinds):
        (box,) = boxes(1, x=2.0 * number).values()
        at = {**box["at"], "z": f"{10 + number / 2} cm"}
        objects[f"box{number}"] = {**box, "size": [f"{20 + number} cm"] * 3, "at": at}
    return text_of(objects)


def engines_memory() -> Memory:
    """Measure the memory of eight engines in a process of its own."""
    program = f"from bench.islands import hold_engines; hold_engines({ISLAND_ENGINES_MAX})"
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    return Memory(ISLAND_ENGINES_MAX, float(done.stdout.split()[-1]))


def hold_engines(count: int) -> None:
    """Build so many engines beside what a node imports, solve some ticks, and print the memory that this takes (MB)."""
    import foosim.node.main  # noqa: F401  # all that a node's process has

    world = Ticks(various(count))
    world.run(SETTLED_TICKS)
    print(pss_mb(os.getpid()))
    world.close()


def islands(seconds: float = 10.0) -> list[Cost | Memory]:
    """Measure all; `seconds` is the simulated time of each."""
    blocks = max(3, round(seconds * TICKS_PER_S / TICKS_OF_A_BLOCK))
    return [*_of_boxes(blocks), *_of_arm(blocks), *_of_robots(blocks), engines_memory()]


def lines(rows: Sequence[Cost | Memory]) -> list[str]:
    """Return the figures for people."""
    shown = []
    for row in rows:
        if isinstance(row, Memory):
            shown.append(f"{row.engines} engines{row.pss_mb:38.0f} MB PSS (to reach {MEMORY_MB:.0f} MB)")
        else:
            wanted = f" (to reach {TO_REACH[row.name]:g} b)" if row.name in TO_REACH else ""
            shown.append(f"{row.what:42}{row.us:9.1f} us, {row.ratio:6.2f} b{wanted}")
    return shown

"""Engines of islands are built before the islands are there, and one that nobody expected is named."""

from __future__ import annotations

from functools import cache
from typing import Any, Final

import pytest
import yaml

from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import Deployment
from foosim.node.core import NodeCore
from foosim.node.engines_pool import AHEAD_TICKS, Solver
from foosim.node.physics.bullet_islands import BulletIslands
from foosim.node.physics.interface import ISLAND_ENGINES_MAX, Island
from foosim.node.tick import Stepper, Work
from foosim.protocol import channels
from foosim.protocol.codec import encode
from foosim.protocol.messages import Build
from foosim.world.assembly.islands import Assignment, reach_of
from foosim.world.assembly.world import initial_numbers
from foosim.world.components.drives import NO_DRIVES
from foosim.world.layout import Layout, build_layout

NAME: Final = "ahead.yaml"
NODE: Final = "n"
BOX: Final = {"model": "box", "size": ["20 cm"] * 3, "mass": "1 kg", "speed_limit": "4 m/s"}


@cache
def text(**objects: tuple[float, float, float]) -> str:
    """A floor with boxes of these names and sizes, at (x, y), and a robot without a part in it."""
    things = {
        name: {**BOX, "size": [f"{size} m"] * 3, "at": {"x": f"{x} m", "y": f"{y} m", "z": f"{size / 2} m"}}
        for name, (size, x, y) in objects.items()
    }
    data: dict[str, Any] = {
        "format": 2,
        "world": "ahead",
        "seed": 1,
        "tick": "10 ms",
        "substeps": 2,
        "engine": "bullet",
        "pace": "fast",
        "scene": {"kind": "empty"},
        "objects": things,
        "robots": {"scout": {"model": "differential_drive", "at": {"x": "-20 m"}}},
        "nodes": {NODE: {"robots": ["scout"]}},
        "network": {"links": [{"id": "all", "from": "*", "to": "*"}]},
    }
    return yaml.safe_dump(data, sort_keys=False)


TWO: Final = text(left=(0.2, 0.0, 0.0), right=(0.3, 0.7, 0.0))


class World:
    """The ticks of one node, whose engine may look ahead."""

    def __init__(self, of: str) -> None:
        self.deployment: Deployment = load_deployment(of, NAME)
        self.layout: Layout = build_layout(self.deployment)
        self.stepper = Stepper(self.deployment, self.layout)
        reach = reach_of(self.deployment, self.layout)
        self.assignment = Assignment(self.layout, reach, (NODE,), {"scout": NODE})
        self.numbers = initial_numbers(self.deployment, self.layout)
        self.engine = BulletIslands(self.deployment, self.layout)

    def push(self, name: str, *velocity: float) -> None:
        at = self.layout[name].offsets["linear_velocity"]
        self.numbers[at : at + 3] = velocity

    def stop(self, name: str) -> None:
        """Have a body be at rest."""
        offsets = self.layout[name].offsets
        for field in ("linear_velocity", "angular_velocity"):
            self.numbers[offsets[field] : offsets[field] + 3] = 0.0, 0.0, 0.0
        self.numbers[offsets["slow_ticks"]] = float(self.stepper.rest.ticks)

    def ahead(self) -> list[tuple[str, ...]]:
        """The names of who may come together."""
        found = self.assignment.approaching(self.numbers, NODE, AHEAD_TICKS)
        entities = self.layout.entities
        return [tuple(entities[index].name for index in (*island.entities, *island.movers)) for island in found]

    def look(self, steps: int = 1000) -> int:
        """Look ahead and build; return how many steps that took."""
        entities = self.layout.entities
        islands = self.assignment.approaching(self.numbers, NODE, AHEAD_TICKS)
        self.engine.expect(
            [(tuple(entities[at] for at in one.entities), tuple(entities[at] for at in one.movers)) for one in islands]
        )
        return next(step for step in range(steps) if not self.engine.build_some())

    def tick(self, number: int) -> str:
        """Compute a tick; return what had to be built within it."""
        share, entities = self.assignment.shares(self.numbers)[NODE], self.layout.entities
        islands = tuple(tuple(entities[at] for at in island) for island in share.islands)
        movers = tuple(tuple(entities[at] for at in near) for near in share.movers)
        work = Work(number, self.layout, islands, share.solved, self.numbers.copy(), {}, self.numbers, movers)
        self.engine.missed = ""
        self.stepper.solve(self.engine, work)
        self.numbers = work.numbers
        return self.engine.missed


def test_who_moves_and_who_is_near_may_come_together() -> None:
    world = World(text(a=(0.2, 0.0, 0.0), b=(0.2, 1.0, 0.0), c=(0.2, 2.0, 0.0), far=(0.2, 9.0, 0.0)))
    assert world.ahead() == [], "nobody moves"
    world.push("a", 1.0, 0.0, 0.0)
    assert world.ahead() == [("a", "b"), ("a", "c")], "each of both gets 2 m far in 50 ticks, the nearest come first"
    at = world.layout["scout"].offsets["position"]
    world.numbers[at : at + 2] = 0.0, -1.5
    assert ("a", "scout") in world.ahead(), "a mover, too"
    world.engine.close()


def test_an_island_that_was_expected_is_there_when_it_comes_and_nothing_else_differs() -> None:
    ahead, late = World(TWO), World(TWO)
    missed: list[tuple[str, str]] = []
    fastest = 0.0
    for world in (ahead, late):
        world.push("left", 3.0, 0.0, 0.0)
    for number in range(40):
        steps = ahead.look() if number % 10 == 1 else 0
        assert number != 1 or steps > 3, "a body or a piece of scenery a step"
        missed.append((ahead.tick(number), late.tick(number)))
        assert ahead.numbers == late.numbers, number
        fastest = max(fastest, ahead.numbers[ahead.layout["right"].offsets["linear_velocity"]])
    assert fastest > 0.3, "the left one has hit the right one"
    assert ("", "left, right") in missed, "without a look the engine of both is built when they meet"
    assert [one for one, _ in missed if one] == ["right"], "the single ones at the first tick"
    ahead.engine.close()
    late.engine.close()


def test_an_engine_that_is_not_complete_is_completed_when_it_is_needed() -> None:
    world, plain = World(TWO), World(TWO)
    for one in (world, plain):
        at = one.layout["left"].offsets["position"]
        one.push("left", 3.0, 0.0, 0.0)
        one.numbers[at] = 0.4
    world.numbers[at] = 0.2
    assert world.ahead() == [("left", "right")]
    with pytest.raises(StopIteration):
        world.look(steps=2)
    world.numbers[at] = 0.4
    assert world.ahead() == [], "they are together"
    assert (world.tick(0), plain.tick(0)) == ("left, right", "left, right") and world.numbers == plain.numbers
    assert not world.engine.build_some()
    world.engine.close()
    plain.engine.close()


def test_engines_that_are_expected_take_the_place_of_those_that_nobody_uses() -> None:
    count = ISLAND_ENGINES_MAX + 4
    places = {f"b{number:02}": (0.2 + 0.01 * number, 0.9 * number, 0.0) for number in range(count)}
    world = World(text(**places))
    for number in range(ISLAND_ENGINES_MAX):
        world.push(f"b{number:02}", 0.5, 0.0, 0.0)
    world.tick(0)
    assert world.look() == 0, "all islands of the last tick are in use"
    for name in places:
        world.stop(name)
    world.push("b00", 0.5, 0.0, 0.0)
    world.numbers[world.layout["b00"].offsets["slow_ticks"]] = 0.0
    world.tick(1)
    assert world.look() > 0, "seven of them are at rest"
    world.push("b00", 4.0, 0.0, 0.0)
    assert [world.tick(number) for number in range(2, 30)] == [""] * 28
    world.engine.close()


def test_engines_of_single_bodies_stay_when_islands_come_and_go() -> None:
    places = {f"b{number:02}": (0.2 + 0.01 * number, 0.9 * number, 0.0) for number in range(ISLAND_ENGINES_MAX)}
    world = World(text(**places))
    bodies = tuple(entity for entity in world.layout.entities if entity.is_rigid)
    world.engine.expect([((one,), ()) for one in bodies[:3]])
    assert world.engine.build_some()
    while world.engine.build_some():
        continue
    for _ in range(2):
        world.engine.expect([((one, other), ()) for one in bodies[:4] for other in bodies[4:]])
        while world.engine.build_some():
            continue
    assert [world.engine.build_some() for _ in range(2)] == [False, False]
    for one in bodies[:3]:
        world.engine.missed = ""
        world.engine.solve(Island((one,), (), (NO_DRIVES,)), world.numbers.copy(), world.numbers)
        assert not world.engine.missed
    world.engine.close()


def test_a_node_builds_ahead_between_ticks_and_names_what_it_did_not_expect() -> None:
    core = NodeCore(NODE, "b1", bytes(32), 0)
    core.receive(channels.BUILD, NODE, encode(Build(NODE, "b1", "first", "run", NAME, TWO, "fast", [])), 0)
    solver = Solver(core)
    solver.build_wanted()
    assert not solver.build_ahead() and not solver.is_building, "it has no frame yet"
    told: list[str] = []
    solver.on_miss = told.append
    world = World(TWO)
    engine = solver.engine_for(world.layout)
    assert isinstance(engine, BulletIslands)
    at = world.layout["left"].offsets["position"]
    world.numbers[at] = 0.4
    everybody = tuple(entity for entity in world.layout.entities if entity.is_rigid)
    assert not engine.missed, "the small run that tells engines apart does not count"
    for number in range(2):
        work = Work(number, world.layout, (everybody[:1],), (everybody[0].index,), world.numbers.copy(), {})
        world.stepper.solve(engine, work)
        solver._tell_missed(engine, number, told.append)
    assert told == [], "single bodies are ready at the start"
    engine.close()
    work = Work(2, world.layout, (everybody,), tuple(one.index for one in everybody), world.numbers.copy(), {})
    world.stepper.solve(engine, work)
    solver._tell_missed(engine, 2, told.append)
    assert told == ["tick 2 has built the engine of an island that nobody expected: left, right (1 so far)"]
    world.engine.close()
    solver.close()

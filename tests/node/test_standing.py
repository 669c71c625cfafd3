"""Rods that stand are left as they are: the bits are those of a solve, which is made as soon as something changes."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path
from random import Random
from typing import Any, Final

import numpy as np
import pytest

from foosim.deployment.loader import apply_sets, load_deployment
from foosim.node.physics.making import make_engine
from foosim.node.tick import Stepper, Work
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.assembly.islands import Assignment, table_reach_of
from foosim.world.assembly.standing import UnmovedBodies
from foosim.world.frame import Frame
from foosim.world.layout import Entity
from foosim.world.robot_packets import Delivered
from tests.placing import place_ball

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
SEED: Final = 18
RODS: Final = ("red.goal", "red.midfield", "blue.goal", "blue.attack")
DRIVES: Final = {
    "rod_position": ("m", (0.05, 2.0)),
    "rod_velocity": ("m", (0.2, 20.0)),
    "rod_force": ("m", (5.0, 0.1)),
    "rod_voltage": ("m", (3.0, 3.0)),
}


class Awake(UnmovedBodies):
    """Lets everything be solved, always."""

    def awake(self, bodies: Sequence[Entity], *_: object) -> list[Entity]:
        return list(bodies)


class Node:
    """One node that computes the whole table; without `rests` it solves everything, always."""

    def __init__(self, engine: str, kind: str, *, rests: bool) -> None:
        sets = [f"engine={engine}", *(f"robots.{rod}.actuators={{m: {{kind: {kind}}}}}" for rod in RODS), "players={}"]
        self.deployment = load_deployment(apply_sets(TABLE.read_text(), TABLE.name, sets), TABLE.name)
        self.frame = initial_frame(self.deployment)
        self.layout = self.frame.layout
        self.stepper = Stepper(self.deployment, self.layout)
        if not rests:
            world = self.stepper.world
            self.stepper._unmoved = Awake(self.layout, world.actuators, world.ruled)
        self.engine = make_engine(self.deployment, self.layout)
        owners = {robot.name: "n" for robot in self.layout.robots}
        self.assignment = Assignment(self.layout, table_reach_of(self.deployment, self.layout), ["n"], owners)
        self.solved = 0

    def tick(self, packets: list[Delivered], throw: tuple[Any, Any] | None = None) -> list[float]:
        layout = self.layout
        numbers, _ = self.stepper.edited(self.frame, [], {})
        if throw is not None:
            place_ball(numbers, layout["ball"], *throw)
        share = self.assignment.shares(numbers)["n"]
        start = numbers.copy()
        self.stepper.deliver(packets, share.solved, numbers, self.frame.tick, start)
        islands = tuple(tuple(layout.entities[index] for index in island) for island in share.islands)
        work = Work(self.frame.tick, layout, islands, share.solved, numbers, {}, start if packets else [])
        self.solved += len(self.stepper._awake(work)[0])
        self.stepper.solve(self.engine, work)
        self.frame = Frame(self.frame.tick + 1, layout, np.array(numbers), {})
        return numbers


@pytest.mark.parametrize("engine", ["pure", "bullet"])
@pytest.mark.parametrize("kind", DRIVES)
def test_it_is_the_same_to_the_last_bit(engine: str, kind: str) -> None:
    """Commands come now and then, for rods of one kind of drive and for the others, and the ball is thrown about."""
    draw, bounds = Random(SEED), DRIVES[kind][1]
    one, other = Node(engine, kind, rests=True), Node(engine, kind, rests=False)
    try:
        stood = 0
        for tick in range(400):
            packets = []
            if draw.random() < 0.02:
                numbers = [bound * draw.uniform(-1, 1) for bound in bounds]
                packets.append(Delivered(0, "me", tick, 0, draw.choice(RODS), "m", struct.pack("<2d", *numbers)))
            if draw.random() < 0.02:
                packets.append(Delivered(0, "me", tick, 1, "red.attack", "position", struct.pack("<2d", 0.0, 0.0)))
            throw = None
            if tick % 100 == 50:
                throw = (draw.uniform(-0.5, 0.5), draw.uniform(-0.3, 0.3), 0.02), (draw.uniform(-5, 5), 1.0, 0.0)
            assert one.tick(packets, throw) == other.tick(packets, throw)
            stood += sum(one.frame.at(rod.name, "unmoved") == 1.0 for rod in one.layout.of("rod"))
        assert stood > 400 and one.solved < 0.8 * other.solved
    finally:
        one.engine.close()
        other.engine.close()


def test_an_edit_wakes_it() -> None:
    one = Node("pure", "rod_position", rests=True)
    for _ in range(3):
        one.tick([])
    assert one.frame.at("red.goal", "unmoved") == 1.0
    numbers = list(one.frame.numbers)
    numbers[one.layout["red.goal"].offsets["joint_velocities"]] = 0.1
    one.stepper._unmoved.wake_edited(one.frame, numbers)
    assert numbers[one.layout["red.goal"].offsets["unmoved"]] == 0.0
    assert numbers[one.layout["blue.goal"].offsets["unmoved"]] == 1.0

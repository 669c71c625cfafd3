"""A robot with a free body that tests put where they want it, tick by tick, and what its sensors read there."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from math import cos, sin
from typing import Final

from foosim.deployment.loader import load_deployment
from foosim.world.assembly.world import initial_numbers
from foosim.world.component_types.registry import model
from foosim.world.component_types.settings import RobotSettings
from foosim.world.components.base import Model
from foosim.world.components.fitted import BoundSensor, sensors_of
from foosim.world.components.sensing import Sensing
from foosim.world.components.view import Mounting, SensingView, WritableView
from foosim.world.layout import build_layout
from foosim.world.scene import ORIGIN, Body, Link, Quaternion, Vector

SLOTS: Final = {"position": 3, "orientation": 4, "linear_velocity": 3, "angular_velocity": 3}


class FreeRobot(RobotSettings):
    """A body that nothing moves."""


@model("free_body", FreeRobot, slots=SLOTS)
class FreeBody(Model):
    """Two links: one that is free, and a hand that is fixed to it."""

    def __init__(self, settings: FreeRobot, at: Mounting) -> None:
        self._at = at

    def body(self) -> Body:
        hand = Link("hand", "fixed", (), 0.0, ORIGIN, parent=0, position=(0.0, 0.0, 1.0))
        return Body(self._at.robot.name, "free_body", ORIGIN, (Link("base", "free", (), 1.0, ORIGIN), hand))

    def place(self, view: WritableView) -> None:
        view.write(self._at.slot("orientation"), 0.0, 0.0, 0.0, 1.0)

    def is_plausible(self, numbers: Sequence[float], before: Sequence[float]) -> bool:
        return True


def text_with(sensor: str, tick: str = "10 ms", more: str = "") -> str:
    """Return a deployment in which the robot `body` has one sensor, of the channel `own`."""
    return f"""format: 2
world: alone
seed: 1
tick: {tick}
substeps: 1
engine: pure
pace: fast
{more}
robots: {{body: {{model: "tests.world.free_body:FreeBody", sensors: {{own: {sensor}}}}}}}
nodes: {{one: {{robots: ["*"]}}}}
"""


class Reader:
    """Reads the sensor `own` of a robot, wherever the test puts it."""

    def __init__(self, text: str, robot: str = "body") -> None:
        self.deployment = load_deployment(text, "alone.yaml")
        self.layout = build_layout(self.deployment)
        self.entity = self.layout[robot]
        self.numbers = initial_numbers(self.deployment, self.layout)
        self.sensor: BoundSensor = next(
            one for one in sensors_of(self.deployment, self.layout, self.entity) if one.channel == "own"
        )

    def put(self, field: str, *numbers: float) -> None:
        """Write a field of the robot."""
        start = self.entity.offsets[field]
        self.numbers[start : start + self.entity.counts[field]] = numbers

    def read(self, tick: int) -> tuple[float, ...]:
        """Return the numbers of a reading; what the sensor remembers is kept."""
        view = SensingView(tick, self.numbers)
        (payload,) = Sensing().sample([self.sensor], view)
        assert payload is not None
        for place, number in view.written.items():
            assert self.entity.split <= place < self.entity.stop, "an owner's slot"
            self.numbers[place] = number
        return struct.unpack(f"<{len(payload) // 8}d", payload)


def about_z(angle: float) -> Quaternion:
    return 0.0, 0.0, sin(angle / 2), cos(angle / 2)


def about_y(angle: float) -> Quaternion:
    return 0.0, sin(angle / 2), 0.0, cos(angle / 2)


def cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]

"""A rotorcraft that flies upright from waypoint to waypoint, moved by kinematics: nothing of its rotors is computed."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import Annotated, Final

from foosim.common import units
from foosim.common.spec_base import default
from foosim.common.units import Quantity
from foosim.world.components.view import Mounting, WritableView
from foosim.world.forms.forms import BODY
from foosim.world.forms.registry import model
from foosim.world.moving.upright import Upright
from foosim.world.parameters.vehicles import (
    Acceleration,
    Antenna,
    Height,
    Radius,
    Speed,
    TurnRate,
    Vehicle,
    body_of,
    is_in_reach,
    set_down,
    upright,
)
from foosim.world.scene import Body, Colour

WHITE: Final[Colour] = (0.90, 0.90, 0.92, 1.0)
Ceiling = Annotated[float, Quantity(units.LENGTH, "1 m", "100 km")]


class RotorcraftRobot(Vehicle):
    """A rotorcraft as a cylinder around its rotors. Its usual actuator is `pilot`, of the kind `waypoint`.

    `speed` is the greatest over the ground, `climb` the greatest upwards and downwards; `acceleration` is the greatest
    of both together, `turn_rate` how fast it turns about the vertical. It takes waypoints up to `ceiling` above z = 0:
    by default 120 m, the limit of the open category (Regulation (EU) 2019/947). The other defaults are those of a
    quadrotor of 1 kg in slow flight.
    """

    height: Height = default("15 cm")
    antenna_height: Antenna = default("10 cm")
    radius: Radius = default("30 cm")
    speed: Speed = default("5 m/s")
    climb: Speed = default("2 m/s")
    acceleration: Acceleration = default("3 m/s2")
    turn_rate: TurnRate = default("90 deg/s")
    ceiling: Ceiling = default("120 m")


@model(
    "rotorcraft",
    RotorcraftRobot,
    slots={**BODY, "heading": 1, "arrived": 1, "blocked": 1},
    motion="rotorcraft",
    actuators={"pilot": {"kind": "waypoint"}},
    units={"heading": ("rad",)},
)
class Rotorcraft:
    """A rotorcraft that stays upright.

    `arrived` is 1 while it hovers at its waypoint, `blocked` whether an obstacle stopped it in the tick.
    """

    def __init__(self, settings: RotorcraftRobot, at: Mounting) -> None:
        self._settings, self._at = settings, at
        self._position = at.slot("position").at
        self._reach_m = self._fastest() * at.spec.tick_ns / 1e9

    def _fastest(self) -> float:
        """Return the greatest speed over ground and upwards together (m/s)."""
        speed, climb = self._settings.speed, self._settings.climb
        return sqrt(speed * speed + climb * climb)

    def body(self) -> Body:
        """Return the cylinder around its rotors, a mark ahead, and the antenna's mast."""
        return body_of(self._settings, self._at.robot.name, "rotorcraft", WHITE, self._fastest())

    def upright(self) -> Upright:
        """Return what it is to obstacles."""
        return upright(self._settings)

    def place(self, view: WritableView) -> None:
        """Set it to its start, at rest."""
        set_down(self._at, self._settings.at, view)

    def is_plausible(self, numbers: Sequence[float], before: Sequence[float]) -> bool:
        """Whether it is no farther away than its speed allows."""
        return is_in_reach(numbers, before, self._position, self._reach_m)

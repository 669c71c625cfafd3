"""A round base that goes in any direction, as on omnidirectional wheels, moved by kinematics."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from foosim.common.spec_base import default
from foosim.world.components.view import Mounting, WritableView
from foosim.world.forms.forms import BODY
from foosim.world.forms.registry import model
from foosim.world.moving.upright import Upright
from foosim.world.parameters.vehicles import (
    Acceleration,
    Speed,
    TurnRate,
    Vehicle,
    body_of,
    is_in_reach,
    set_down,
    upright,
)
from foosim.world.scene import Body, Colour

TEAL: Final[Colour] = (0.10, 0.55, 0.55, 1.0)


class HolonomicRobot(Vehicle):
    """A round base that goes in any direction. Its usual actuator is `motion`, of the kind `x_y_w`.

    `speed` and `acceleration` are the greatest in any direction, and `turn_rate` is how fast it turns at most; how fast
    it turns changes by at most `acceleration` over `radius`, so that the rim has no more. The sizes are those of usual
    research robots.
    """

    speed: Speed = default("1 m/s")
    acceleration: Acceleration = default("1 m/s2")
    turn_rate: TurnRate = default("180 deg/s")


@model(
    "holonomic",
    HolonomicRobot,
    slots={**BODY, "heading": 1, "base_velocity": 3, "blocked": 1},
    motion="holonomic",
    actuators={"motion": {"kind": "x_y_w"}},
    tags=("vehicle",),
    units={"heading": ("rad",), "base_velocity": ("m/s", "m/s", "rad/s")},
)
class Holonomic:
    """A round base that goes in any direction.

    `base_velocity` is what its wheels do, ahead, to the left and turning left; `blocked` whether an obstacle stopped it
    in the tick.
    """

    def __init__(self, settings: HolonomicRobot, at: Mounting) -> None:
        self._settings, self._at = settings, at
        self._position = at.slot("position").at
        self._reach_m = settings.speed * at.spec.tick_ns / 1e9

    def body(self) -> Body:
        """Return the hull, a mark ahead, and the antenna's mast."""
        return body_of(self._settings, self._at.robot.name, "holonomic", TEAL, self._settings.speed)

    def upright(self) -> Upright:
        """Return what it is to obstacles."""
        return upright(self._settings)

    def place(self, view: WritableView) -> None:
        """Set it to its start, at rest."""
        set_down(self._at, self._settings.at, view)

    def is_plausible(self, numbers: Sequence[float], before: Sequence[float]) -> bool:
        """Whether it is no farther away than its speed allows."""
        return is_in_reach(numbers, before, self._position, self._reach_m)

"""A round robot on two driven wheels, moved by kinematics."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Final, Self

from pydantic import model_validator

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.spec_base import default
from foosim.common.units import Quantity, custom_error
from foosim.world.components.view import Mounting, WritableView
from foosim.world.forms.forms import BODY
from foosim.world.forms.registry import model
from foosim.world.moving.upright import Upright
from foosim.world.moving.wheels import Wheels, slips_of
from foosim.world.parameters.vehicles import (
    Acceleration,
    Slip,
    Speed,
    TurnRate,
    Vehicle,
    body_of,
    is_in_reach,
    set_down,
    upright,
)
from foosim.world.scene import Body, Colour

BLUE: Final[Colour] = (0.15, 0.35, 0.75, 1.0)
Track = Annotated[float, Quantity(units.LENGTH, "1 cm", "20 m")]


class DifferentialDriveRobot(Vehicle):
    """A round robot on two driven wheels, `track` apart. Its usual actuator is `motion`, of the kind `v_w`.

    `speed` and `acceleration` are those of the wheels' rims, and so of the robot straight on; it turns at most as fast
    as `turn_rate`. On the ground each wheel rolls less far than it turns, by a share of its own between none and
    `slip`. The sizes are those of usual research robots; they slip on clean floors by less than can be seen.
    """

    track: Track = default("40 cm")
    speed: Speed = default("1 m/s")
    acceleration: Acceleration = default("1 m/s2")
    turn_rate: TurnRate = default("180 deg/s")
    slip: Slip = default("0 %")

    @model_validator(mode="after")
    def _wheels_are_below_the_hull(self) -> Self:
        if self.track > 2.0 * self.radius:
            what = "the wheels would be outside of the robot: its track is more than twice its radius"
            raise custom_error(BadValue(what))
        return self


@model(
    "differential_drive",
    DifferentialDriveRobot,
    slots={**BODY, "heading": 1, "wheel_speeds": 2, "wheel_travel": 2, "blocked": 1},
    motion="differential_drive",
    actuators={"motion": {"kind": "v_w"}},
    tags=("vehicle",),
    units={"heading": ("rad",), "wheel_speeds": ("m/s",), "wheel_travel": ("m",)},
)
class DifferentialDrive:
    """A round robot on two driven wheels.

    `wheel_speeds` are rim speeds, `wheel_travel` is how far the wheels have turned, `blocked` whether an obstacle
    stopped it in the tick.
    """

    def __init__(self, settings: DifferentialDriveRobot, at: Mounting) -> None:
        self._settings, self._at = settings, at
        self._position = at.slot("position").at
        self._reach_m = settings.speed * at.spec.tick_ns / 1e9

    def body(self) -> Body:
        """Return the hull, a mark ahead, and the antenna's mast."""
        settings = self._settings
        return body_of(settings, self._at.robot.name, "differential_drive", BLUE, settings.speed)

    def upright(self) -> Upright:
        """Return what it is to obstacles."""
        return upright(self._settings)

    def wheels(self) -> Wheels:
        """Return its wheels, which slip each by a share of its own."""
        its = self._settings
        slips = slips_of(self._at.spec, self._at.robot.name, its.slip)
        return Wheels(its.track, its.speed, its.acceleration, its.turn_rate, slips)

    def place(self, view: WritableView) -> None:
        """Set it to its start, at rest."""
        set_down(self._at, self._settings.at, view)

    def is_plausible(self, numbers: Sequence[float], before: Sequence[float]) -> bool:
        """Whether it is no farther away than its wheels can have taken it."""
        return is_in_reach(numbers, before, self._position, self._reach_m)

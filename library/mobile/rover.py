"""A rover of a hall: round, on two wheels, with a battery; moved by kinematics."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Final

from foosim.common import units
from foosim.common.spec_base import default
from foosim.common.units import Quantity
from foosim.library.mobile.differential_drive import WHEELS, WheeledMotion
from foosim.library.mobile.hall_settings import Place, hall_of
from foosim.library.mobile.vehicles import body_of
from foosim.library.mobile.wheels import Wheels, slips_of
from foosim.world.component_types.descriptions import BODY
from foosim.world.component_types.registry import model
from foosim.world.component_types.settings import RobotSettings
from foosim.world.components.base import Model
from foosim.world.components.view import Mounting, WritableView
from foosim.world.moving.free_way import ROUNDING
from foosim.world.moving.upright import Upright
from foosim.world.scene import Body, Colour, turn

ORANGE: Final[Colour] = (0.95, 0.50, 0.10, 1.0)
Heading = Annotated[float, Quantity(units.ANGLE, "-360 deg", "360 deg")]
CHARGE: Final = Quantity(units.PROBABILITY, "0 %", "100 %")
Charge = Annotated[float, CHARGE]


class RoverRobot(RobotSettings):
    """A rover and where it starts. Its usual actuator is `drive`, of the kind `wheel_speeds`."""

    x: Place
    y: Place
    heading: Heading = default("0 deg")
    charge: Charge = default("100 %")


@model(
    "rover",
    RoverRobot,
    slots={
        **BODY,
        **WHEELS,
        "blocked": 1,
        "quarantined": 1,
        "down": 1,
        "charge": 1,
        "refused": 1,
    },
    motion=WheeledMotion,
    kit="hall",
    actuators={"drive": {"kind": "wheel_speeds"}},
    rules={"battery": {"kind": "battery"}},
    tags=("vehicle",),
    units={"heading": ("rad",), "wheel_speeds": ("m/s",), "wheel_travel": ("m",), "charge": ("J",)},
)
class Rover(Model):
    """A round robot on two wheels, with a battery.

    `wheel_speeds` are rim speeds, `wheel_travel` is how far the wheels have turned, `blocked` whether an obstacle
    stopped it in the tick, `charge` its energy.
    """

    def __init__(self, settings: RoverRobot, at: Mounting) -> None:
        hall = hall_of(at.spec)
        self._settings, self._at = settings, at
        self._rover = hall.rover
        self._position = at.slot("position").at
        self._x_max, self._y_max = hall.length / 2 - hall.rover.radius, hall.width / 2 - hall.rover.radius
        self._reach_m = hall.rover.drive.speed * at.spec.tick_ns / 1e9 * ROUNDING

    def body(self) -> Body:
        """Return a round hull, a mark ahead, and the antenna's mast where it is higher than the hull."""
        return body_of(self._rover, self._at.robot.name, "rover", ORANGE, self._rover.drive.speed, "rover")

    def upright(self) -> Upright:
        """Return its cylinder for obstacles: its hull, up to the top of its antenna."""
        return Upright(self._rover.radius, 0.0, max(self._rover.height, self._rover.antenna_height))

    def wheels(self) -> Wheels:
        """Return its wheels, which slip each by a share of its own."""
        drive = self._rover.drive
        slips = slips_of(self._at.spec, self._at.robot.name, drive.slip)
        return Wheels(drive.track, drive.speed, drive.acceleration, 2.0 * drive.speed / drive.track, slips)

    def place(self, view: WritableView) -> None:
        """Set it to its start, at rest, with the deployment's charge."""
        settings, at = self._settings, self._at
        view.write(at.slot("position"), settings.x, settings.y, 0.0)
        view.write(at.slot("orientation"), *turn((0.0, 0.0, 1.0), settings.heading))
        view.write(at.slot("heading"), settings.heading)
        view.write(at.slot("charge"), settings.charge * self._rover.battery.capacity)

    def is_plausible(self, numbers: Sequence[float], before: Sequence[float]) -> bool:
        """Whether it is in the hall, no farther away than its wheels can have taken it."""
        start = self._position
        x, y = numbers[start : start + 2]
        dx, dy = x - before[start], y - before[start + 1]
        near = dx * dx + dy * dy <= self._reach_m * self._reach_m
        return near and abs(x) <= self._x_max and abs(y) <= self._y_max

    def out_of_bounds(self, numbers: Sequence[float]) -> str:
        """Return that it is in quarantine, or has a charge that it cannot have."""
        charge = numbers[self._at.slot("charge").at]
        if numbers[self._at.slot("quarantined").at] > 0.0 or not 0.0 <= charge <= self._rover.battery.capacity:
            return "is in quarantine, or has a charge that it cannot have"
        return ""

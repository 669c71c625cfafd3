"""A round robot on two driven wheels: moved by kinematics, or a rigid body."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from foosim.common.exact_math import atan2
from foosim.world.components.view import Mounting, Slot, WritableView
from foosim.world.forms.forms import BODY, JOINTS
from foosim.world.forms.registry import model
from foosim.world.moving.upright import Upright
from foosim.world.moving.wheels import WheelMotors, Wheels, slips_of
from foosim.world.parameters.differential import DifferentialDriveRobot, rigid_body
from foosim.world.parameters.primitives import RIGID
from foosim.world.parameters.vehicles import body_of, is_in_reach, set_down, upright
from foosim.world.scene import Body, Colour, moved, rotate

BLUE: Final[Colour] = (0.15, 0.35, 0.75, 1.0)
GREEN: Final[Colour] = (0.15, 0.55, 0.35, 1.0)
WHEELS: Final = {"heading": 1, "wheel_speeds": 2, "wheel_travel": 2}
"""The heading of a robot, the speeds of its rims, and how far its wheels have turned."""


class RigidDifferentialDrive:
    """A round robot on two driven wheels, as a rigid body that stands on the floor.

    `wheel_speeds` are rim speeds, `wheel_travel` is how far the wheels have turned at the rim, also where they slip.
    """

    def __init__(self, settings: DifferentialDriveRobot, at: Mounting) -> None:
        self._settings, self._at = settings, at
        self._orientation = at.slot("orientation").at
        self._joints, self._rates = at.slot("joint_positions").at, at.slot("joint_velocities").at
        first = at.slot("heading")
        self._derived = Slot(first.at, sum(WHEELS.values()), f"{at.robot.name} {', '.join(WHEELS)}", first.is_own)
        """The fields of `WHEELS`, which follow one another."""
        self._tick_s = at.spec.tick_ns / 1e9
        self._radius = settings.wheel_radius

    def body(self) -> Body:
        """Return hull, wheels and casters."""
        return rigid_body(self._settings, self._at.robot.name, GREEN)

    def wheels(self) -> Wheels:
        """Return its wheels and their motors; how far they slip follows from what they feel."""
        its = self._settings
        motors = WheelMotors(its.wheel_radius, its.torque, self._rates, self._tick_s)
        return Wheels(its.track, its.speed, its.acceleration, its.turn_rate, motors=motors)

    def place(self, view: WritableView) -> None:
        """Set it to its start, on its wheels, at rest."""
        at, where = self._at, self._settings.at
        set_down(at, where, view)
        centre = rotate(where.orientation, (0.0, 0.0, self._settings.centre_height))
        view.write(at.slot("position"), *moved(where.position, centre, 1.0))
        view.write(at.slot("orientation"), *where.orientation)
        view.write(at.slot("contacts"), 0.0, 0.0, -1.0)

    def derive(self, view: WritableView) -> None:
        """Write the heading, which is where x of the hull is seen from above, and what the wheels do at their rims."""
        numbers, at, radius = view.numbers, self._orientation, self._radius
        x, y, z, w = numbers[at : at + 4]
        heading = atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        left, right = numbers[self._rates : self._rates + 2]
        one, other = numbers[self._joints : self._joints + 2]
        view.write(self._derived, heading, left * radius, right * radius, one * radius, other * radius)


@model(
    "differential_drive",
    DifferentialDriveRobot,
    slots={**BODY, **WHEELS, "blocked": 1},
    motion="differential_drive",
    actuators={"motion": {"kind": "v_w"}},
    tags=("vehicle",),
    units={"heading": ("rad",), "wheel_speeds": ("m/s",), "wheel_travel": ("m",)},
    variants={
        "rigid": {
            "made": RigidDifferentialDrive,
            "slots": {**RIGID, **dict.fromkeys(JOINTS, 2), **WHEELS},
            "is_rigid": True,
            "motion": "",
        }
    },
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

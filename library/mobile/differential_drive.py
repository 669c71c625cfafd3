"""A round robot on two driven wheels: moved by kinematics, or a rigid body."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Final

import numpy as np

from foosim.common.exact_math import atan2
from foosim.library.mobile.arcs import Floats, along_arcs, approached
from foosim.library.mobile.differential import DifferentialDriveRobot, rigid_body
from foosim.library.mobile.set_points import set_points_of
from foosim.library.mobile.vehicles import FreeMotion, VehicleModel
from foosim.library.mobile.wheels import WheelMotors, Wheels, slips_of, wheels_of
from foosim.library.rigid.primitives import RIGID
from foosim.world.component_types.descriptions import BODY, JOINTS
from foosim.world.component_types.registry import model
from foosim.world.components.base import Model
from foosim.world.components.entities import Motors
from foosim.world.components.view import Mounting, Slot, WritableView
from foosim.world.layout import Entity
from foosim.world.scene import Body, Colour, moved, rotate

BLUE: Final[Colour] = (0.15, 0.35, 0.75, 1.0)
GREEN: Final[Colour] = (0.15, 0.55, 0.35, 1.0)
WHEELS: Final = {"heading": 1, "wheel_speeds": 2, "wheel_travel": 2}
"""The heading of a robot, the speeds of its rims, and how far its wheels have turned."""
STANDING: Final[Motors] = ((0.0, 0.0), (0.0, 0.0))


class WheeledMotion(FreeMotion):
    """Along arcs, as far as nothing is in the way.

    A wheel approaches the target speed with at most the drive's acceleration and rolls a little less far than it turns.
    From the speeds l and r of the wheels on the ground, v = (l + r) / 2 and w = (r - l) / track, a robot goes along an
    arc (`moving.arcs`), as far as nothing is in the way (`moving.free_way`). It turns on the spot where all is
    blocked, with its wheels slipping.
    """

    fields: ClassVar = (*BODY, *WHEELS, "blocked")
    is_level: ClassVar = True
    takes_arrays: ClassVar = True

    def take(self, entities: Sequence[Entity]) -> None:
        """Keep their tracks, and how far each wheel rolls for what it turns."""
        super().take(entities)
        its = [wheels_of(self.at.spec, self.at.layout, entity) for entity in entities]
        self._track = np.array([one.track for one in its])
        self._rolls = np.array([[1.0 - one.slips[0], 1.0 - one.slips[1]] for one in its])

    def move(self, entities: Sequence[Entity], motors: Sequence[Motors] | Floats, view: WritableView) -> None:
        """Advance these robots by a tick; of each wheel the target speed (m/s) and greatest acceleration (m/s2)."""
        dt, count = self.dt, len(entities)
        state, near = self.start(entities, view)
        place, heading = state[:, 0:3].copy(), state[:, 13].copy()
        speeds, travel = state[:, 14:16].copy(), state[:, 16:18].copy()
        set_points = set_points_of(motors, STANDING)
        targets, rates = set_points[:, :, 0], set_points[:, :, 1]
        is_stopped = np.zeros(count, bool)
        for _ in range(self.substeps):
            speeds = approached(speeds, targets, rates * dt)
            travel = travel + speeds * dt
            ground = speeds * self._rolls
            ahead, turned = (ground[:, 0] + ground[:, 1]) / 2.0, (ground[:, 1] - ground[:, 0]) / self._track * dt
            ways = np.zeros((count, 3))
            arcs = along_arcs(ahead * dt, 0.0, turned, heading)
            ways[:, 0], ways[:, 1], heading = arcs.x, arcs.y, arcs.heading
            place, shares, stops = near.free_way(place, ways)
            is_stopped |= stops
        z, w = arcs.turn_z, arcs.turn_w
        ahead, after = ahead * shares, np.zeros((count, self.state.width))
        after[:, 0:3], after[:, 5], after[:, 6] = place, z, w
        after[:, 7], after[:, 8] = ahead * (1.0 - 2.0 * z * z), ahead * (2.0 * z * w)
        after[:, 12], after[:, 13] = turned / dt, arcs.heading
        after[:, 14:16], after[:, 16:18], after[:, 18] = speeds, travel, is_stopped
        self.state.write(view, after)


class RigidDifferentialDrive(Model):
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
        """Return its wheels and their motors; their slip follows from friction."""
        its = self._settings
        motors = WheelMotors(its.wheel_radius, its.torque, self._rates, self._tick_s)
        return Wheels(its.track, its.speed, its.acceleration, its.turn_rate, motors=motors)

    def place(self, view: WritableView) -> None:
        """Set it to its start, on its wheels, at rest."""
        at, where = self._at, self._settings.at
        view.write(at.slot("heading"), where.yaw)
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
    motion=WheeledMotion,
    actuators={"motion": {"kind": "v_w"}},
    tags=("vehicle",),
    units={"heading": ("rad",), "wheel_speeds": ("m/s",), "wheel_travel": ("m",)},
    variants={
        "rigid": {
            "factory": RigidDifferentialDrive,
            "slots": {**RIGID, **dict.fromkeys(JOINTS, 2), **WHEELS},
            "is_rigid": True,
            "motion": None,
        }
    },
)
class DifferentialDrive(VehicleModel):
    """A round robot on two driven wheels.

    `wheel_speeds` are rim speeds, `wheel_travel` is how far the wheels have turned, `blocked` whether an obstacle
    stopped it in the tick.
    """

    colour: ClassVar = BLUE

    def wheels(self) -> Wheels:
        """Return its wheels, which slip each by a share of its own."""
        its = self.settings
        slips = slips_of(self.at.spec, self.at.robot.name, its.slip)
        return Wheels(its.track, its.speed, its.acceleration, its.turn_rate, slips)

"""Where a component is mounted: a pose in the frame of a link of its robot, and how that moves in the world."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from foosim.common.names import nearest_quoted
from foosim.world.components.base import Sensor
from foosim.world.components.entities import made_model
from foosim.world.components.rows import Rows
from foosim.world.components.view import IncompatibleComponent, Mounting
from foosim.world.kinematics import Twist, forward_kinematics, twist
from foosim.world.placing import MountedAt
from foosim.world.rays.boxes import Floats
from foosim.world.rays.shapes import multiplied, rotated
from foosim.world.scene import Body, Quaternion, Vector, conjugate, moved, multiply, rotate

STATE: Final = ("position", 3), ("orientation", 4)
"""The fields with the pose of a free link."""
OF_TWIST = ("linear_velocity", "angular_velocity")
"""Fields of a free body with the motion of its places."""


class Mounted:
    """A place on a robot. What it keeps follows from deployment and layout."""

    def __init__(self, at: Mounting, where: MountedAt) -> None:
        """Raises IncompatibleComponent for a robot without a body, or a link that the robot does not have."""
        self.entity = at.robot
        self._body = body_at(at)
        self.link = link_index(self._body, where.link)
        self.position, self.orientation = where.position, where.orientation
        link = self._body.links[self.link]
        self.is_free = link.joint == "free"
        """Whether the link moves freely, by itself."""
        starts = [at.robot.offsets[name] if self.is_free else 0 for name, _ in STATE]
        places = [start + step for start, (_, size) in zip(starts, STATE, strict=True) for step in range(size)]
        fixed = [*conjugate(link.principal), *link.centre_of_mass, *self.position, *self.orientation]
        self.free: tuple[NDArray[np.intp], Floats] = np.array(places, np.intp), np.array(fixed)
        """Of a free link: the places of its position and orientation in the frame; its principal axes, conjugated, its
        centre of mass, and the mount's position and orientation. None of any other link."""

    def pose(self, numbers: Sequence[float]) -> tuple[Vector, Quaternion]:
        """Return the place (m) and the orientation of the mount, in the world frame, from the frame's numbers."""
        _, position, orientation = forward_kinematics(self._body, self.entity, numbers)[self.link]
        return moved(position, rotate(orientation, self.position), 1.0), multiply(orientation, self.orientation)

    def twist(self, numbers: Sequence[float]) -> Twist:
        """Return the velocity of the mount (m/s) and how fast it turns (rad/s), both in the world frame."""
        place, _ = self.pose(numbers)
        return twist(self._body, self.entity, numbers, self.link, place)

    def check_twist(self) -> None:
        """Raise IncompatibleComponent where the robot's state lacks the velocity of its places."""
        missing = [field for field in OF_TWIST if field not in self.entity.offsets]
        if self._body.is_free and missing:
            what = f"{self.entity.name} moves freely, and its state has no {', '.join(missing)}"
            raise IncompatibleComponent(("kind",), what, self.entity.model)


class MountedSensor(Sensor):
    """A sensor at a place on a robot: its setting `at`."""

    def __init__(self, settings: Any, at: Mounting) -> None:
        self.mount = Mounted(at, settings.at)


class MountedTogether(Rows):
    """Several places on robots. Those on free links are found at once, with the bits of each by itself."""

    def __init__(self, several: Sequence[Mounted]) -> None:
        places, fixed = zip(*[one.free for one in several], strict=True)
        self._places, self._fixed = np.array(places), np.array(fixed)
        self._jointed = np.array([None if one.is_free else one for one in several], object)

    def poses(self, numbers: Sequence[float], values: Floats | None = None) -> tuple[Floats, Floats]:
        """Return places (3, n) (m) and orientations (4, n) of n mounts, in the world frame, from the frame's numbers.

        `values` are the same as an array.
        """
        state, fixed = (np.array(numbers) if values is None else values)[self._places].T, self._fixed.T
        origins, turned = free_poses(state, fixed[:4], fixed[4:7])
        places, orientations = origins + rotated(turned, fixed[7:10]), multiplied(turned, fixed[10:])
        for number in self._jointed.nonzero()[0]:
            places[:, number], orientations[:, number] = self._jointed[number].pose(numbers)
        return places, orientations


def free_poses(state: Floats, back: Floats, centres: Floats) -> tuple[Floats, Floats]:
    """Return the origins (3, n) and the orientations (4, n) of free links, with the bits of `forward_kinematics`.

    `state` (7, n) are the slots `position` and `orientation`, `back` (4, n) the links' principal axes, conjugated, and
    `centres` (3, n) their centres of mass.
    """
    turned = multiplied(state[3:], back)
    return state[:3] - rotated(turned, centres), turned


def body_at(at: Mounting) -> Body:
    """Return the body of the robot that a component is on. Raises IncompatibleComponent for one without."""
    body: Body | None = made_model(at.spec, at.layout, at.robot).body()
    if body is None:
        raise IncompatibleComponent(("kind",), f"{at.robot.name} has no body to carry it", at.robot.model)
    return body


def link_index(body: Body, name: str | None) -> int:
    """Return the index of a body's link: its name is with or without that of the body. Raises IncompatibleComponent."""
    if name is None:
        return 0
    names = body.link_names
    short = name if name in names else name.removeprefix(f"{body.name}/")
    if short not in names:
        what = f"{body.name} has no such link; there are {', '.join(names)}"
        raise IncompatibleComponent(("at", "link"), what, name, nearest_quoted(name, names))
    return names.index(short)

"""Where a component is mounted: a pose in the frame of a link of its robot, and how that moves in the world."""

from __future__ import annotations

from collections.abc import Sequence

from foosim.common.names import nearest_name
from foosim.common.plain_data import quoted
from foosim.world.components.entities import mounting_of
from foosim.world.components.misfit import Misfit
from foosim.world.components.view import Mounting
from foosim.world.kinematics import Twist, forward_kinematics, twist
from foosim.world.placing import MountedAt
from foosim.world.scene import Body, Quaternion, Vector, moved, multiply, rotate

OF_TWIST = ("linear_velocity", "angular_velocity")
"""Fields of a free body without which nobody knows how its places move."""


class Mounted:
    """A place on a robot. What it keeps follows from deployment and layout."""

    def __init__(self, at: Mounting, where: MountedAt) -> None:
        """Raises Misfit for a robot without a body, or a link that the robot does not have."""
        self._entity = at.robot
        self._body = body_at(at)
        self.link = link_index(self._body, where.link)
        self._position, self._orientation = where.position, where.orientation

    def pose(self, numbers: Sequence[float]) -> tuple[Vector, Quaternion]:
        """Return the place (m) and the orientation of the mount, in the world frame, from the frame's numbers."""
        _, position, orientation = forward_kinematics(self._body, self._entity, numbers)[self.link]
        return moved(position, rotate(orientation, self._position), 1.0), multiply(orientation, self._orientation)

    def twist(self, numbers: Sequence[float]) -> Twist:
        """Return the velocity of the mount (m/s) and how fast it turns (rad/s), both in the world frame."""
        place, _ = self.pose(numbers)
        return twist(self._body, self._entity, numbers, self.link, place)

    def check_twist(self) -> None:
        """Raise Misfit where the robot's state does not say how fast its places move and turn."""
        missing = [field for field in OF_TWIST if field not in self._entity.offsets]
        if self._body.is_free and missing:
            what = f"{self._entity.name} moves freely, and its state has no {', '.join(missing)}"
            raise Misfit(("kind",), what, self._entity.model)


def body_at(at: Mounting) -> Body:
    """Return the body of the robot that a component is on. Raises Misfit for one without."""
    model = at.robot.kind.made(at.spec.settings_of(at.robot.name), mounting_of(at.spec, at.layout, at.robot))
    body: Body | None = model.body()
    if body is None:
        raise Misfit(("kind",), f"{at.robot.name} has no body to carry it", at.robot.model)
    return body


def link_index(body: Body, name: str | None) -> int:
    """Return the index of a body's link: its name is with or without that of the body. Raises Misfit."""
    if name is None:
        return 0
    names = [link.name.removeprefix(f"{body.name}/") for link in body.links]
    name = name.removeprefix(f"{body.name}/")
    if name not in names:
        what = f"{body.name} has no such link; there are {', '.join(names)}"
        raise Misfit(("at", "link"), what, name, quoted(nearest_name(name, names)))
    return names.index(name)

"""The moving links in the view of a camera. Compiled: each picture goes through all moving links of its world."""

from __future__ import annotations

from math import sqrt
from typing import Final

from foosim.common.exact_math import tan
from foosim.world.component_types.descriptions import ABSENT, LINEAR_VELOCITY
from foosim.world.components.optics import Optics
from foosim.world.kinematics import forward_kinematics, twist
from foosim.world.layout import Entity
from foosim.world.scene import ORIGIN, Body, Quaternion, Vector, conjugate, dot, moved, rotate

NOTHING: Final = -1
"""The number of a link that stands or looks like nothing."""

DISTORTED: Final = 2.5
"""A lens with distortion sees up to half a picture more at each side (`rendering.lens`), and a few pixels."""


class Looks:
    """A body with moving links that look like something: of each of its links the number, and the sphere around what
    it looks like, in the link's frame (m)."""

    def __init__(self, body: Body, entity: Entity) -> None:
        self.body, self.entity = body, entity
        self.absent_at: int = entity.offsets.get(ABSENT, -1)
        self.has_speeds: bool = not body.is_free or LINEAR_VELOCITY in entity.offsets
        self.numbers: list[int] = [NOTHING] * len(body.links)
        self.middles: list[Vector] = [ORIGIN] * len(body.links)
        self.radii: list[float] = [0.0] * len(body.links)


class InView:
    """The moving links in the view of one camera."""

    def __init__(self, optics: Optics, bodies: list[Looks]) -> None:
        self.bodies = bodies
        self.exposure: float = optics.exposure
        self.far: float = optics.far
        self.wide: float = tan(optics.fov / 2.0) * (DISTORTED if any(optics.distortion) else 1.0)
        self.high: float = self.wide * optics.height / optics.width
        self.beside: float = sqrt(1.0 + self.wide * self.wide)
        self.above: float = sqrt(1.0 + self.high * self.high)
        self.is_all_around: bool = optics.shadows

    def links(self, numbers: list[float], eye: Vector, orientation: Quaternion) -> list[float]:
        """Return the numbers of the links that touch the view from a pose (m, world frame), as `Sight.links`.

        With shadows these are all within `far`: what is beside the view throws shadows into it.
        """
        found: list[float] = []
        back = conjugate(orientation)
        for looks in self.bodies:
            if looks.absent_at >= 0 and numbers[looks.absent_at] != 0.0:
                continue
            poses = forward_kinematics(looks.body, looks.entity, numbers)
            for index, number in enumerate(looks.numbers):
                if number < 0:
                    continue
                place, turned = poses[index][1], poses[index][2]
                middle, radius = looks.middles[index], looks.radii[index]
                linear, angular = ORIGIN, ORIGIN
                if self.exposure > 0.0 and looks.has_speeds:
                    linear, angular = twist(looks.body, looks.entity, numbers, index)
                    arm = radius + sqrt(dot(middle, middle))
                    radius += (sqrt(dot(linear, linear)) + arm * sqrt(dot(angular, angular))) * self.exposure
                way = moved(moved(place, rotate(turned, middle), 1.0), eye, -1.0)
                if self.touches(rotate(back, way), radius):
                    found.append(float(number))
                    found.extend(place)
                    found.extend(turned)
                    if self.exposure > 0.0:
                        found.extend(linear)
                        found.extend(angular)
        return found

    def touches(self, middle: Vector, radius: float) -> bool:
        """Whether a sphere in the frame of the camera (m) touches its view."""
        x, y, z = middle
        reach = self.far + radius
        if self.is_all_around:
            return x * x + y * y + z * z <= reach * reach
        if not -radius <= x <= reach:
            return False
        return abs(y) - x * self.wide <= radius * self.beside and abs(z) - x * self.high <= radius * self.above

"""What a camera sees: the reading of all cameras, and the moving links in their view.

A picture is a pure function of a frame and is drawn where it is looked at: a reading carries the pose of the camera and
those of the moving links in view, as float64, so that a picture drawn from a packet equals one drawn from the frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import Annotated, Final, NamedTuple

from msgspec import Meta, Struct

from foosim.common import limits
from foosim.common.exact_math import tan
from foosim.world.component_types.descriptions import ABSENT
from foosim.world.component_types.quantities import Count, Metres, QuaternionPart
from foosim.world.components.optics import Optics, moving_links
from foosim.world.components.surroundings import Surroundings
from foosim.world.components.view import Mounting
from foosim.world.kinematics import forward_kinematics, twist
from foosim.world.layout import Entity
from foosim.world.scene import Body, Link, Quaternion, Vector, conjugate, cross, enclosing, moved, rotate, shape_box

LINK: Final = 8
"""Numbers of a link: its number, position and orientation."""
LINK_BLURRED: Final = 14
"""Those of a camera with an exposure: linear and angular velocity, too."""
NUMBERS_MAX: Final = limits.PAYLOAD_BYTES_MAX // 8 - 8
"""Numbers of links in a packet."""


class Sight(Struct, frozen=True, dict=True):
    """What a camera sees at a tick: the pose of the camera, x ahead, y to the left, z up (m, world frame).

    `links` are the moving links in view, each as its number (its place in `optics.moving_links`), the position (m) and
    the orientation (x, y, z, w) of its frame in the world frame, and of a camera with an exposure its linear and
    angular velocity (m/s, rad/s).
    """

    tick: Count
    x: Metres
    y: Metres
    z: Metres
    qx: QuaternionPart
    qy: QuaternionPart
    qz: QuaternionPart
    qw: QuaternionPart
    links: Annotated[tuple[float, ...], Meta(max_length=NUMBERS_MAX)]


class Drawn(NamedTuple):
    """A moving link: its number, its index among the links of its body, and the sphere around its looks, in its frame
    (m)."""

    number: int
    index: int
    centre: Vector
    radius: float


class Movers:
    """The moving links of one layout that look like something, by bodies."""

    def __init__(self, around: Surroundings, at: Mounting) -> None:
        bodies: dict[str, list[Drawn]] = {}
        scene = around.scene
        for number, (name, index) in enumerate(moving_links(scene)):
            if sphere := sphere_of(scene.bodies[name].links[index]):
                bodies.setdefault(name, []).append(Drawn(number, index, *sphere))
        self.bodies: list[tuple[Entity, Body, int, list[Drawn]]] = [
            (at.layout[name], scene.bodies[name], at.layout[name].offsets.get(ABSENT, -1), its)
            for name, its in bodies.items()
        ]
        """Each entity with its body, the place of its absence, -1 without one, and its links."""
        self.count = sum(len(its) for its in bodies.values())


def movers_of(at: Mounting) -> Movers:
    """Return those of a component's layout, which all cameras of it share."""
    around = Surroundings(at.spec, at.layout)
    found = at.layout.shared("movers", at.spec, lambda: Movers(around, at))
    assert isinstance(found, Movers)
    return found


def sphere_of(link: Link) -> tuple[Vector, float] | None:
    """Return the middle and the radius of a sphere around what a link looks like, in its frame (m); None of nothing.

    Its shapes are inside, too: it is drawn by these where its visuals have too many triangles.
    """
    shapes = (*link.visuals, *link.shapes)
    if not shapes:
        return None
    low, high = enclosing([shape_box(shape) for shape in shapes])
    half = moved(high, low, -1.0)
    x, y, z = half
    return moved(low, half, 0.5), 0.5 * sqrt(x * x + y * y + z * z)


class InView:
    """The moving links in the view of one camera."""

    def __init__(self, optics: Optics, movers: Movers) -> None:
        self._movers, self._exposure, self._far = movers, optics.exposure, optics.far
        wide = tan(optics.fov / 2.0)
        high = wide * optics.height / optics.width
        self._wide, self._high = wide, high
        self._beside, self._above = sqrt(1.0 + wide * wide), sqrt(1.0 + high * high)
        self._is_all_around = optics.shadows

    def links(self, numbers: Sequence[float], eye: Vector, orientation: Quaternion) -> list[float]:
        """Return the numbers of the links that touch the view from a pose (m, world frame), as `Sight.links`.

        With shadows these are all within `far`: what is beside the view throws shadows into it.
        """
        found: list[float] = []
        back = conjugate(orientation)
        for entity, body, absent_at, drawn in self._movers.bodies:
            if absent_at >= 0 and numbers[absent_at] != 0.0:
                continue
            poses = forward_kinematics(body, entity, numbers)
            for number, index, centre, radius in drawn:
                _, position, turned = poses[index]
                arm = rotate(turned, centre)
                speeds: tuple[float, ...] = ()
                if self._exposure:
                    linear, angular = twist(body, entity, numbers, index)
                    vx, vy, vz = moved(linear, cross(angular, arm), 1.0)
                    radius += sqrt(vx * vx + vy * vy + vz * vz) * self._exposure  # noqa: PLW2901
                    speeds = *linear, *angular
                x, y, z = rotate(back, moved(moved(position, arm, 1.0), eye, -1.0))
                if self._touches(x, y, z, radius):
                    found += (float(number), *position, *turned, *speeds)
        return found

    def _touches(self, x: float, y: float, z: float, radius: float) -> bool:
        """Whether a sphere about a place in the frame of the camera (m) touches its view."""
        if self._is_all_around:
            reach = self._far + radius
            return x * x + y * y + z * z <= reach * reach
        return (
            -radius <= x <= self._far + radius
            and abs(y) - x * self._wide <= radius * self._beside
            and abs(z) - x * self._high <= radius * self._above
        )

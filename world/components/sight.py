"""What a camera sees: the reading of all cameras, and the moving bodies of a scene.

A picture is a pure function of a frame and is drawn where it is looked at: a reading carries the pose of the camera and
numbers of the moving bodies in view, as float64, so that a picture drawn from a packet equals one drawn from the frame.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import sqrt
from typing import TYPE_CHECKING, Annotated, Any, Final

from msgspec import Meta, Struct

from foosim.common import limits
from foosim.common.errors import BadValue
from foosim.world.component_types.quantities import Count, Metres, QuaternionPart
from foosim.world.components.in_view import Looks
from foosim.world.components.optics import moving_links
from foosim.world.components.surroundings import Surroundings
from foosim.world.components.view import Mounting
from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import Entity, Layout
from foosim.world.scene import ORIGIN, Body, Link, Vector, dot, enclosing, moved, shape_box

if TYPE_CHECKING:  # a client without pictures does without numpy
    import numpy as np
    from numpy.typing import NDArray

PICTURES: Final = "foosim.rendering.pictures:Pictures"
"""What draws the pictures of cameras."""
NUMBERS_MAX: Final = limits.PAYLOAD_BYTES_MAX // 8 - 8
"""Numbers of bodies in a packet."""


class Seen(Struct, frozen=True, dict=True):
    """What is around a sensor at a tick: the pose of the sensor, x ahead, y to the left, z up (m, world frame).

    `bodies` are the moving bodies in view, each as its number (its place in `moving_bodies`) and numbers of its state:
    position (m) and orientation (x, y, z, w) of a free one, positions of joints (m, rad), and of a camera with an
    exposure the velocities of these (m/s, rad/s).
    """

    tick: Count
    x: Metres
    y: Metres
    z: Metres
    qx: QuaternionPart
    qy: QuaternionPart
    qz: QuaternionPart
    qw: QuaternionPart
    bodies: Annotated[tuple[float, ...], Meta(max_length=NUMBERS_MAX)]

    @property
    def _drawn_by(self) -> Any:
        if "drawn_by" not in self.kept:
            raise BadValue("it is drawn from the samples of players, clients and captures alone", self.tick)
        return self.kept["drawn_by"]

    @property
    def kept(self) -> dict[str, Any]:
        """What belongs to the reading and is none of its numbers: `drawn_by`, what draws it, and what was drawn."""
        return self.__dict__


class Sight(Seen, frozen=True, dict=True):
    """What a camera sees at a tick."""

    def image(self) -> NDArray[np.uint8]:
        """Return the picture: (height, width, 3) of red, green, blue. Each is drawn once; all raise as `picture`."""
        return self.picture("image")

    def depth(self) -> NDArray[np.float32]:
        """Return the distances along the axis of the camera (m), (height, width); 0 where nothing is seen."""
        return self.picture("depth")

    def segmentation(self) -> NDArray[np.int32]:
        """Return the number of what is seen, (height, width): number n is `names[n - 1]`, 0 is nothing."""
        return self.picture("segmentation")

    @property
    def names(self) -> tuple[str, ...]:
        """The names of what a segmentation has: entities and scenery."""
        found: tuple[str, ...] = self._drawn_by.names
        return found

    def picture(self, kind: str) -> NDArray[Any]:
        """Return an `image`, `depth` or `segmentation`.

        Raises BadValue for one that the camera does not have, and of a reading that no player or client received;
        AssetError where a file of the world is missing, Malformed for a reading that the network has changed.
        """
        found: NDArray[Any] = self._drawn_by.picture(kind, self)
        return found


def looks_of(at: Mounting) -> list[Looks]:
    """Return the moving bodies of a layout, which all its cameras share."""
    bodies = Surroundings(at.spec, at.layout).bodies
    return at.layout.shared("looks", at.spec, lambda: moving_bodies(bodies, at.layout))


def moving_bodies(bodies: Mapping[str, Body], layout: Layout) -> list[Looks]:
    """Return the bodies with moving links that look like something, in name order."""
    links: dict[str, list[tuple[int, int]]] = {}
    for number, (name, index) in enumerate(moving_links(bodies)):
        if sphere_of(bodies[name].links[index]):
            links.setdefault(name, []).append((index, number))
    return [_looks(bodies[name], layout[name], its) for name, its in links.items()]


def _looks(body: Body, entity: Entity, links: list[tuple[int, int]]) -> Looks:
    """Return a body, whose links are nowhere farther from its place than along the chain to them."""
    origins = [at for _, at, _ in forward_kinematics(body, entity, [0.0] * entity.stop)]
    place, radius = origins[0], 0.0
    ways: list[float] = []
    for index, link in enumerate(body.links):
        arm = link.position if link.parent >= 0 else moved(origins[index], place, -1.0)
        if index == 0 and body.is_free:
            arm = link.centre_of_mass
        ways.append((ways[link.parent] if link.parent >= 0 else 0.0) + sqrt(dot(arm, arm)))
    for index, _ in links:
        middle, its = sphere_of(body.links[index]) or (ORIGIN, 0.0)
        radius = max(radius, ways[index] + sqrt(dot(middle, middle)) + its)
    return Looks(body, entity, place, radius, links)


def sphere_of(link: Link) -> tuple[Vector, float] | None:
    """Return the middle and the radius of a sphere around what a link looks like, in its frame (m); None of nothing.

    Its shapes are inside, too: it is drawn by these where its visuals have too many triangles.
    """
    shapes = (*link.visuals, *link.shapes)
    if not shapes:
        return None
    low, high = enclosing([shape_box(shape) for shape in shapes])
    x, y, z = moved(high, low, -1.0)
    return moved(low, (x, y, z), 0.5), 0.5 * sqrt(x * x + y * y + z * z)

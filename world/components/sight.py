"""What a camera sees: the reading of all cameras, and the moving links in their view.

A picture is a pure function of a frame and is drawn where it is looked at: a reading carries the pose of the camera and
those of the moving links in view, as float64, so that a picture drawn from a packet equals one drawn from the frame.
"""

from __future__ import annotations

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
from foosim.world.layout import Layout
from foosim.world.scene import Link, Scene, Vector, enclosing, moved, shape_box

if TYPE_CHECKING:  # a client without pictures does without numpy
    import numpy as np
    from numpy.typing import NDArray

PICTURES: Final = "foosim.rendering.pictures:Pictures"
"""What draws the pictures of cameras."""
LINK: Final = 8
"""Numbers of a link: its number, position and orientation."""
LINK_BLURRED: Final = 14
"""Those of a camera with an exposure: linear and angular velocity, too."""
NUMBERS_MAX: Final = limits.PAYLOAD_BYTES_MAX // 8 - 8
"""Numbers of links in a packet."""


class Seen(Struct, frozen=True, dict=True):
    """What is around a sensor at a tick: the pose of the sensor, x ahead, y to the left, z up (m, world frame).

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
    """Return the bodies with moving links that look like something, which all cameras of a layout share."""
    scene = Surroundings(at.spec, at.layout).scene
    return at.layout.shared("looks", at.spec, lambda: _looks(scene, at.layout))


def _looks(scene: Scene, layout: Layout) -> list[Looks]:
    found: dict[str, Looks] = {}
    for number, (name, index) in enumerate(moving_links(scene)):
        body = scene.bodies[name]
        if sphere := sphere_of(body.links[index]):
            its = found.setdefault(name, Looks(body, layout[name]))
            its.numbers[index], (its.middles[index], its.radii[index]) = number, sphere
    return [*found.values()]


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

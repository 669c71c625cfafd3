"""A frame from straight above, in parallel projection: a pure function of frame and scene, for any world.

Higher shapes hide lower ones: fixed boxes, hulls and meshes by the height at each pixel, so that a thing on a slope,
or in a hall that is one mesh, is visible; others by their greatest height. Outlines are exact, but a moving mesh has
the outline of its hull. Fixed shapes are painted once.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foosim.common.errors import BadValue
from foosim.painting.shapes import Shapes, View, covered_by_surface
from foosim.world.frame import Frame
from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import Entity, Layout
from foosim.world.scene import ORIGIN, UPRIGHT, Body, Pose, Scene, Shape, enclosing, shape_box, swept_box

Picture: TypeAlias = NDArray[np.uint8]
Region: TypeAlias = tuple[float, float, float, float]
"""The least x and y and the greatest x and y that are shown, in m."""
PIXELS_MAX: Final = 8192
BEYOND: Final = (24, 26, 30)
"""What is painted where nothing is: dark grey."""
STANDING_M: Final = 0.05
"""Lower scenery is ground: it does not widen the shown region."""
MARGIN: Final = 1.02
SIDE_M: Final = 10.0
"""The side of the shown region of an empty world."""


class OverheadPainter:
    """Paints the frames of one layout."""

    def __init__(
        self, scene: Scene, layout: Layout, pixels: tuple[int, int] = (320, 180), region: Region | None = None
    ) -> None:
        """`pixels` are width and height. `region` is shown whole; by default it has all that stands in the world.

        Raises BadValue for invalid pixels or an invalid region.
        """
        width, height = pixels
        if not (1 <= width <= PIXELS_MAX and 1 <= height <= PIXELS_MAX):
            raise BadValue(f"pixels: width and height from 1 to {PIXELS_MAX} are needed", f"{width} x {height}")
        low_x, low_y, high_x, high_y = _standing(scene) if region is None else region
        if not (-inf < low_x < high_x < inf and -inf < low_y < high_y < inf):
            raise BadValue("region: the least x and y, then greater ones are needed", str(region))
        scale = min(width / (high_x - low_x), height / (high_y - low_y))
        left, top = (low_x + high_x) / 2 - width / 2 / scale, (low_y + high_y) / 2 + height / 2 / scale
        self.view = View(width, height, scale, left, top)
        self._moving: list[tuple[Body, Entity]] = []
        moving: list[tuple[int, Shape]] = []
        still: list[tuple[int, Shape]] = [(0, shape) for shape in scene.scenery]
        poses: list[Pose] = [("", ORIGIN, UPRIGHT)]
        links = 0
        for name, body in scene.bodies.items():
            if all(link.joint == "fixed" for link in body.links):
                for number, link in enumerate(body.links, len(poses)):
                    still += [(number, shape) for shape in link.shapes]
                poses += forward_kinematics(body, layout[name], ())
                continue
            self._moving.append((body, layout[name]))
            for number, link in enumerate(body.links, links):
                moving += [(number, shape) for shape in link.shapes]
            links += len(body.links)
        self._shapes = Shapes(moving) if moving else None
        self._ground: Picture = np.empty((height * width, 3), np.uint8)
        self._ground[:] = BEYOND
        self._heights = np.full(height * width, -np.inf, np.float32)
        self._paint_still(still, poses)

    def _paint_still(self, still: Sequence[tuple[int, Shape]], poses: Sequence[Pose]) -> None:
        """Paint fixed shapes, one after the other; at equal heights the later one counts."""
        for number, shape in still:
            one = covered_by_surface(shape, poses[number], self.view)
            if one is None:
                one = Shapes([(number, shape)]).covered(poses, self.view)
            seen = one.heights >= self._heights[one.places]
            self._ground[one.places[seen]] = one.colours[seen]
            self._heights[one.places[seen]] = one.heights[seen]

    def paint(self, frame: Frame) -> Picture:
        """Return the picture of a frame of the layout: uint8, of the shape (height, width, 3), red, green and blue.

        The world's x is to the right, its y up.
        """
        picture = self._ground.copy()
        if self._shapes is not None:
            numbers = frame.numbers
            poses: list[Pose] = []
            for body, entity in self._moving:
                poses += forward_kinematics(body, entity, numbers)
            covered = self._shapes.covered(poses, self.view)
            seen = covered.heights >= self._heights[covered.places]
            picture[covered.places[seen]] = covered.colours[seen]
        return picture.reshape(self.view.height, self.view.width, 3)


def _standing(scene: Scene) -> Region:
    """Return the region of all that stands, with a margin: scenery above the ground, else bodies on fixed bases."""
    boxes = [shape_box(shape) for shape in scene.scenery]
    boxes = [box for box in boxes if box[1][2] > STANDING_M]
    if not boxes:
        boxes = [
            swept_box(body)
            for body in scene.bodies.values()
            if not body.is_free and any(link.shapes for link in body.links)
        ]
    if not boxes:
        return -SIDE_M / 2, -SIDE_M / 2, SIDE_M / 2, SIDE_M / 2
    (low_x, low_y, _), (high_x, high_y, _) = enclosing(boxes)
    x, y = (low_x + high_x) / 2, (low_y + high_y) / 2
    across, along = (max(side * MARGIN / 2, STANDING_M) for side in (high_x - low_x, high_y - low_y))
    return x - across, y - along, x + across, y + along

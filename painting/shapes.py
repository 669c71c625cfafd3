"""Shapes that hang on links, and the pixels that they cover at given poses of these, the higher after the lower."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import frexp
from typing import Final, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foosim.painting.outlines import (
    Numbers,
    Places,
    Windows,
    covered_by_boxes,
    covered_by_corners,
    covered_by_rounds,
    surface_of,
)
from foosim.world.matter.mesh import Mesh
from foosim.world.scene import Box, Capsule, Cylinder, Hull, Pose, Shape, Sphere, rotate

Colours: TypeAlias = NDArray[np.uint8]
AXES: Final = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
WHITE: Final = 255.0
"""The greatest value of a colour in a picture; those of shapes are 0 to 1."""


class View(NamedTuple):
    """What a picture shows: its width and height, pixels to the metre, and x and y (m) of its upper left corner."""

    width: int
    height: int
    scale: float
    left: float
    top: float


BOX_CORNERS: Final = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
BOX_TRIANGLES: Final = np.array(
    [
        triangle
        for a, b, c, d in ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5))
        for triangle in ((a, b, c), (a, c, d))
    ],
    np.int32,
)
LEVEL_DIGITS: Final = 6
"""Heights of faces are rounded to this count of digits of a metre: faces at one level have one height."""


class Covered(NamedTuple):
    """Pixels in the order in which they are painted, with the height (m) and the colour of each; one may be there
    several times, the last counts."""

    places: Places
    heights: NDArray[np.float32]
    colours: Colours


class _Group(NamedTuple):
    """Shapes of one kind and about one size: their numbers among all, half sides or what is round, in their frames.

    Of what is round `sizes` are radius, half the length of the segment, and 1 where its ends are half spheres.
    """

    numbers: NDArray[np.intp]
    sizes: Numbers


class Shapes:
    """Shapes by the link that each hangs on."""

    def __init__(self, shapes: Sequence[tuple[int, Shape]]) -> None:
        self._links = np.array([link for link, _ in shapes], np.intp)
        self._at = np.array([shape.position for _, shape in shapes]).reshape(-1, 3)
        self._axes = np.array([[rotate(shape.orientation, axis) for axis in AXES] for _, shape in shapes]).reshape(
            -1, 3, 3
        )
        """The axes of each shape in the frame of its link."""
        self._colours = _colours([shape for _, shape in shapes])
        self._boxes = _grouped(shapes, lambda shape: shape.geometry.half if isinstance(shape.geometry, Box) else None)
        self._rounds = _grouped(shapes, _round_size)
        self._corners = [
            (number, _faces(shape)[0])
            for number, (_, shape) in enumerate(shapes)
            if isinstance(shape.geometry, Mesh | Hull)
        ]

    def covered(self, poses: Sequence[Pose], view: View) -> Covered:
        """Return the pixels that the shapes cover, with their links at these poses."""
        count = len(self._links)
        positions = np.array([position for _, position, _ in poses])[self._links]
        turned = np.array([orientation for _, _, orientation in poses])[self._links]
        middles = positions + _rotated(turned, self._at)
        axes = np.stack([_rotated(turned, self._axes[:, number]) for number in range(3)], axis=1)
        at = np.stack(((middles[:, 0] - view.left) * view.scale, (view.top - middles[:, 1]) * view.scale), axis=1)
        tops = np.empty(count)
        which: list[NDArray[np.intp]] = []
        places: list[Places] = []
        for group in self._boxes:
            sides = group.sizes[:, :, None] * axes[group.numbers]
            tops[group.numbers] = middles[group.numbers, 2] + np.abs(sides[:, :, 2]).sum(axis=1)
            seen = sides[:, :, :2] * (view.scale, -view.scale)
            windows = Windows(at[group.numbers], np.abs(seen).sum(axis=1).max(axis=0), view.width, view.height)
            _take(windows, covered_by_boxes(windows, seen), group, which, places)
        for group in self._rounds:
            self._add_rounds(group, middles, axes[:, 2], at, tops, view, which, places)
        for number, corners in self._corners:
            placed = _rotated(np.broadcast_to(turned[number], (len(corners), 4)), corners) + positions[number]
            tops[number] = placed[:, 2].max()
            seen = (placed[:, :2] - (view.left, view.top)) * (view.scale, -view.scale)
            found = covered_by_corners(seen, view.width, view.height)
            places.append(found)
            which.append(np.full(len(found), number))
        return _in_order(np.concatenate(which), np.concatenate(places), tops, self._colours)

    @staticmethod
    def _add_rounds(
        group: _Group,
        middles: Numbers,
        axes: Numbers,
        at: Numbers,
        tops: Numbers,
        view: View,
        which: list[NDArray[np.intp]],
        places: list[Places],
    ) -> None:
        radius, length, is_sphere = group.sizes[:, 0], group.sizes[:, 1], group.sizes[:, 2] > 0.0
        axis = axes[group.numbers]
        upright = np.minimum(np.abs(axis[:, 2]), 1.0)
        level = np.sqrt(1.0 - upright * upright)
        rise = np.where(is_sphere, radius, radius * level)
        tops[group.numbers] = middles[group.numbers, 2] + length * upright + rise
        is_level = level > 1e-9
        along = np.where(
            is_level[:, None], axis[:, :2] * (1.0, -1.0) / np.where(is_level, level, 1.0)[:, None], (1.0, 0.0)
        )
        seen_radius, seen_length = radius * view.scale, length * level * view.scale
        half = np.abs(along) * seen_length[:, None] + seen_radius[:, None]
        windows = Windows(at[group.numbers], half.max(axis=0), view.width, view.height)
        flat = np.where(is_sphere, 1.0, upright)
        _take(windows, covered_by_rounds(windows, along, seen_length, seen_radius, flat), group, which, places)


def _take(
    windows: Windows,
    covered: NDArray[np.bool_],
    group: _Group,
    which: list[NDArray[np.intp]],
    places: list[Places],
) -> None:
    of_group, found = windows.places(covered)
    which.append(group.numbers[of_group])
    places.append(found)


def _in_order(which: NDArray[np.intp], places: Places, tops: Numbers, colours: Colours) -> Covered:
    """Return pixels by the heights of their shapes, and at one height by the shapes' numbers."""
    rank = np.empty(len(tops), np.min_scalar_type(len(tops)))  # the smaller, the faster it is sorted
    rank[np.argsort(tops, kind="stable")] = np.arange(len(tops))
    order = np.argsort(rank[which], kind="stable")
    which = which[order]
    return Covered(places[order], tops.astype(np.float32)[which], colours[which])


def _rotated(turned: Numbers, vectors: Numbers) -> Numbers:
    """Return vectors (n, 3) of frames that are turned so (n, 4) in the frame of these: `scene.rotate` for many."""
    qx, qy, qz, qw = (turned[:, number] for number in range(4))
    x, y, z = (vectors[:, number] for number in range(3))
    tx, ty, tz = 2.0 * (qy * z - qz * y), 2.0 * (qz * x - qx * z), 2.0 * (qx * y - qy * x)
    return np.stack(
        (x + qw * tx + (qy * tz - qz * ty), y + qw * ty + (qz * tx - qx * tz), z + qw * tz + (qx * ty - qy * tx)),
        axis=1,
    )


def _grouped(
    shapes: Sequence[tuple[int, Shape]], size_of: Callable[[Shape], tuple[float, float, float] | None]
) -> list[_Group]:
    """Return the shapes that have such a size, those of a power of two together."""
    found: dict[int, list[tuple[int, tuple[float, float, float]]]] = {}
    for number, (_, shape) in enumerate(shapes):
        size = size_of(shape)
        if size is not None:
            found.setdefault(frexp(max(size))[1], []).append((number, size))
    return [
        _Group(np.array([number for number, _ in those], np.intp), np.array([size for _, size in those]))
        for _, those in sorted(found.items())
    ]


def _round_size(shape: Shape) -> tuple[float, float, float] | None:
    geometry = shape.geometry
    if isinstance(geometry, Sphere):
        return geometry.radius, 0.0, 1.0
    if isinstance(geometry, Cylinder | Capsule):
        return geometry.radius, geometry.length / 2, float(isinstance(geometry, Capsule))
    return None


def covered_by_surface(shape: Shape, pose: Pose, view: View) -> Covered | None:
    """Return the pixels that a shape with its link at this pose covers, with the height of its surface at each.

    None for round shapes.
    """
    corners, triangles = _faces(shape)
    if not len(triangles):
        return None
    _, position, turned = pose
    placed = _rotated(np.broadcast_to(np.array(turned), (len(corners), 4)), corners) + np.array(position)
    seen = (placed - (view.left, view.top, 0.0)) * (view.scale, -view.scale, 1.0)
    places, heights = surface_of(seen, triangles, view.width, view.height)
    colours = np.broadcast_to(_colours([shape])[0], (len(places), 3))
    return Covered(places, np.round(heights, LEVEL_DIGITS).astype(np.float32), colours)


def _colours(shapes: Sequence[Shape]) -> Colours:
    colours = np.array([shape.colour[:3] for shape in shapes]).reshape(-1, 3)
    rounded: Colours = np.rint(WHITE * np.clip(colours, 0.0, 1.0)).astype(np.uint8)
    return rounded


def _faces(shape: Shape) -> tuple[Numbers, NDArray[np.int32]]:
    """Return the corners of a box, a hull or a mesh in the frame of its link, (n, 3), and its triangles, (m, 3).

    What is round has none.
    """
    geometry = shape.geometry
    triangles = BOX_TRIANGLES
    if isinstance(geometry, Box):
        vertices = BOX_CORNERS * geometry.half
    elif isinstance(geometry, Mesh | Hull):
        mesh = geometry if isinstance(geometry, Mesh) else geometry.mesh
        vertices, triangles = mesh.vertices, mesh.triangles
    else:
        return np.empty((0, 3)), np.empty((0, 3), np.int32)
    turned = np.broadcast_to(np.array(shape.orientation), (len(vertices), 4))
    return _rotated(turned, vertices) + np.array(shape.position), triangles

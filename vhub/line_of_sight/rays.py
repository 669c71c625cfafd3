"""Where a straight line is inside of a box, a sphere, a cylinder or a mesh, in the frame of that shape.

A line is a start and a unit direction; places on it are metres from the start. A line that touches a face, an edge or
a corner is not inside; of a mesh it is taken for one a little beside it. All of it is + - * / and `sqrt` on plain
floats, or element-wise on arrays (triangles), so a ray has the same bits alone and among a thousand. Sources: slabs of
a box, Kay and Kajiya, "Ray tracing complex scenes" (SIGGRAPH 1986); spheres and cylinders by the point nearest to the
axis (Haines et al., "Precision improvements for ray/sphere intersection", Ray Tracing Gems, 2019); triangles, Woop,
Benthin and Wald, "Watertight ray/triangle intersection" (JCGT 2013), with ties broken as if the line were moved by an
infinitesimal step (Edelsbrunner and Mücke, "Simulation of simplicity", 1990). Neighbour: `geometry`, which puts shapes
into the world.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, sqrt
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foosim.world.mesh import Mesh
from foosim.world.mesh_files import is_closed
from foosim.world.scene import Vector

Span = tuple[float, float]
"""Where a line enters something and where it leaves it (m)."""
Floats: TypeAlias = NDArray[np.float64]

BLOCK: Final = 32
"""Triangles that are looked at together."""
MARGIN_M: Final = 1e-6
"""How much larger boxes are made that only say where to look: far more than rounding, far less than anything."""
STEP_MIN: Final = 1e-30
"""A direction's part below this is taken for this much where boxes only say where to look: no division overflows."""

_EDGES: Final = ((1, 2), (2, 0), (0, 1))
"""Each opposite to the corner of its number."""


def box_span(start: Vector, way: Vector, half: Vector) -> Span | None:
    """Return where a line is inside of a box, centred, with half of its lengths."""
    (x, y, z), (dx, dy, dz), (side_x, side_y, side_z) = start, way, half
    # Written out for each axis, as a loop over them costs several times as much.
    enter, leave = -inf, inf
    if dx != 0.0:
        enter, leave = (-side_x - x) / dx, (side_x - x) / dx
        if dx < 0.0:
            enter, leave = leave, enter
    elif not -side_x < x < side_x:
        return None
    if dy != 0.0:
        one, other = (-side_y - y) / dy, (side_y - y) / dy
        if dy < 0.0:
            one, other = other, one
        enter = one if one > enter else enter  # three times as fast as max
        leave = other if other < leave else leave
    elif not -side_y < y < side_y:
        return None
    if enter >= leave:
        return None
    if dz != 0.0:
        one, other = (-side_z - z) / dz, (side_z - z) / dz
        if dz < 0.0:
            one, other = other, one
        enter = one if one > enter else enter
        leave = other if other < leave else leave
    elif not -side_z < z < side_z:
        return None
    return (enter, leave) if enter < leave else None


def sphere_span(start: Vector, way: Vector, radius: float) -> Span | None:
    """Return where a line is inside of a sphere, centred."""
    x, y, z = start
    dx, dy, dz = way
    middle = -(x * dx + y * dy + z * dz)
    x, y, z = x + middle * dx, y + middle * dy, z + middle * dz
    rest = radius * radius - (x * x + y * y + z * z)
    if rest <= 0.0:
        return None
    half = sqrt(rest)
    return middle - half, middle + half


def cylinder_span(start: Vector, way: Vector, radius: float, half_length: float) -> Span | None:
    """Return where a line is inside of a cylinder, centred, whose axis is z."""
    x, y, z = start
    dx, dy, dz = way
    across = dx * dx + dy * dy
    enter, leave = -inf, inf
    if across == 0.0:
        if x * x + y * y >= radius * radius:
            return None
    else:
        middle = -(x * dx + y * dy) / across
        x, y = x + middle * dx, y + middle * dy
        rest = radius * radius - (x * x + y * y)
        if rest <= 0.0:
            return None
        half = sqrt(rest / across)
        enter, leave = middle - half, middle + half
    if dz == 0.0:
        return (enter, leave) if -half_length < z < half_length else None
    one, other = (-half_length - z) / dz, (half_length - z) / dz
    if one > other:
        one, other = other, one
    enter, leave = max(enter, one), min(leave, other)
    return (enter, leave) if enter < leave else None


def capsule_span(start: Vector, way: Vector, radius: float, half_length: float) -> Span | None:
    """Return where a line is inside of a capsule, centred, whose axis is z: of a cylinder and the spheres at its ends.

    A capsule is convex, so these spans overlap or touch.
    """
    x, y, z = start
    spans = [cylinder_span(start, way, radius, half_length)]
    spans += [sphere_span((x, y, z - end), way, radius) for end in (-half_length, half_length)]
    found = [span for span in spans if span is not None]
    return (min(enter for enter, _ in found), max(leave for _, leave in found)) if found else None


class Pillar:
    """An upright cylinder around a body: its x and y, the square of its radius, its least and greatest z (m); its name.

    It is a little larger than what is given.
    """

    __slots__ = ("high_z", "low_z", "name", "reach", "x", "y")

    def __init__(self, name: str, x: float, y: float, radius: float, low_z: float, high_z: float) -> None:
        radius += MARGIN_M
        self.name, self.x, self.y, self.reach = name, x, y, radius * radius
        self.low_z, self.high_z = low_z - MARGIN_M, high_z + MARGIN_M


def pillars_met_by(pillars: list[Pillar], line: tuple[Vector, Vector]) -> list[str]:
    """Return the names whose pillars a line may pass, seen from above as if it had no ends: it says where to look."""
    (ax, ay, az), (bx, by, bz) = line
    way_x, way_y = bx - ax, by - ay
    square = way_x * way_x + way_y * way_y
    low_z, high_z = (az, bz) if az <= bz else (bz, az)
    met = []
    for pillar in pillars:
        aside = (pillar.x - ax) * way_y - (pillar.y - ay) * way_x
        if aside * aside <= pillar.reach * square and pillar.high_z >= low_z and pillar.low_z <= high_z:
            met.append(pillar.name)
    return met


def boxes_around(
    lows: Sequence[Vector] | Floats, highs: Sequence[Vector] | Floats, margin_m: float = MARGIN_M
) -> Floats:
    """Return boxes (m of them) for `boxes_met_by`, shape (2, 3, m), with a margin."""
    boxes = np.array([lows, highs], dtype=np.float64).reshape(2, -1, 3)
    boxes[0] -= margin_m
    boxes[1] += margin_m
    return np.ascontiguousarray(boxes.transpose(0, 2, 1))


def boxes_met_by(boxes: Floats, line: tuple[Vector, Vector]) -> list[int]:
    """Return the boxes (2, 3, m) that a line meets.

    It only says where to look: a box that a line misses by no more than a margin may be among them.
    """
    first, last = _between_sides(boxes, *_as_columns(line[0], [b - a for a, b in zip(*line, strict=True)]))
    met: list[int] = (np.maximum(first, -MARGIN_M) <= np.minimum(last, 1.0 + MARGIN_M)).nonzero()[0].tolist()
    return met


def _as_columns(start: Vector, way: Sequence[float]) -> tuple[Floats, Floats]:
    """Return a start and a way as columns, the way without a part so small that a division by it overflows."""
    steps = [STEP_MIN if abs(part) < STEP_MIN else part for part in way]
    return np.array(start)[:, None], np.array(steps)[:, None]


def _between_sides(boxes: Floats, start: Floats, step: Floats) -> tuple[Floats, Floats]:
    """Return between which multiples of `step` from `start` (columns) a line is in each box (2, 3, m)."""
    sides = (boxes - start) / step
    first = np.maximum.reduce(np.minimum(sides[0], sides[1]))
    last = np.minimum.reduce(np.maximum(sides[0], sides[1]))
    return first, last


class Triangles:
    """The triangles of a mesh, in blocks of neighbours with a box around each."""

    def __init__(self, mesh: Mesh) -> None:
        self.is_closed = is_closed(mesh)
        corners = mesh.vertices[mesh.triangles]
        corners = corners[np.argsort(_along_a_curve(corners), kind="stable")]
        missing = -len(corners) % BLOCK
        # Blocks are filled up with triangles without an area, which nothing hits, at a place that is in the block.
        filled = np.concatenate((corners, np.repeat(corners[-1:, :1], missing * 3, axis=1).reshape(missing, 3, 3)))
        blocks = filled.reshape(-1, BLOCK * 3, 3)
        self._boxes = boxes_around(blocks.min(axis=1), blocks.max(axis=1))
        # (coordinate, corner, block, triangle): what is computed together stands together.
        self._corners = np.ascontiguousarray(filled.reshape(-1, BLOCK, 3, 3).transpose(3, 2, 0, 1))

    def hits(self, start: Vector, way: Vector) -> list[float]:
        """Return where a line passes through triangles, in order; through the edge of two it passes once.

        A mesh that is closed is passed an even number of times.
        """
        first, last = _between_sides(self._boxes, *_as_columns(start, way))
        corners = self._corners[:, :, first <= last]
        long = max(range(3), key=lambda axis: abs(way[axis]))
        one, other = (long + 1) % 3, (long + 2) % 3
        # Seen along the line, which is the origin then: a triangle is hit if that is on the same side of its edges.
        z = corners[long] - start[long]
        x = (corners[one] - start[one]) - way[one] / way[long] * z
        y = (corners[other] - start[other]) - way[other] / way[long] * z
        edges = [x[i] * y[j] - x[j] * y[i] for i, j in _EDGES]
        sides = [_is_left(edge, x[j] - x[i], y[j] - y[i]) for edge, (i, j) in zip(edges, _EDGES, strict=True)]
        area = edges[0] + edges[1] + edges[2]
        hit = (sides[0] == sides[1]) & (sides[1] == sides[2]) & (area != 0.0)
        weighed = edges[0][hit] * z[0][hit] + edges[1][hit] * z[1][hit] + edges[2][hit] * z[2][hit]
        found: list[float] = np.sort(weighed / area[hit] / way[long]).tolist()
        return found


def _is_left(edge: Floats, dx: Floats, dy: Floats) -> NDArray[np.bool_]:
    """True where the origin is left of an edge, moved by (e, e e) for an infinitesimal e where it is on it.

    `edge` and the differences change their signs, and nothing else, when the edge is walked the other way: so of two
    triangles with a common edge exactly one is hit there.
    """
    on_it = (dy > 0.0) | ((dy == 0.0) & (dx < 0.0))
    left: NDArray[np.bool_] = (edge > 0.0) | ((edge == 0.0) & on_it)
    return left


def _along_a_curve(corners: Floats) -> NDArray[np.int64]:
    """Return where the middles of triangles (m, 3, 3) are on a Z-order curve of 1,024 cells a side."""
    middles = corners.sum(axis=1)
    low = middles.min(axis=0)
    extent = max(float((middles.max(axis=0) - low).max()), 1e-300)
    cells = ((middles - low) / extent * 1023.0).astype(np.int64)
    places = np.zeros(len(corners), dtype=np.int64)
    for bit in range(10):
        for axis in range(3):
            places |= (cells[:, axis] >> bit & 1) << (3 * bit + axis)
    return places

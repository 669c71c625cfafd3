"""Hits of straight lines on the triangles of a mesh, one line or many, with the same bits.

A line is a start and a unit direction; places on it are metres from the start. A line that touches an edge or a corner
is taken for one a little beside it. Source: Woop, Benthin and Wald, "Watertight ray/triangle intersection" (JCGT
2013), with ties broken as if the line were moved by an infinitesimal step (Edelsbrunner and Mücke, "Simulation of
simplicity", 1990).
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from foosim.world.matter.mesh import Mesh
from foosim.world.mesh_files import is_closed
from foosim.world.rays.boxes import STEP_MIN, Floats, as_columns, between_sides, boxes_around
from foosim.world.scene import Vector

BLOCK: Final = 32
"""The count of triangles in a block."""
LINES_AT_ONCE: Final = 16_384
"""The count of lines compared at once with the boxes around blocks: their arrays stay in a cache."""
BLOCKS_AT_ONCE: Final = 512
"""The count of blocks of triangles computed at once, each for a line."""

_EDGES: Final = ((1, 2), (2, 0), (0, 1))
"""Each opposite to the corner of its number."""


class Triangles:
    """The triangles of a mesh, in blocks of neighbours with a box around each."""

    def __init__(self, mesh: Mesh) -> None:
        self.is_closed = is_closed(mesh)
        corners = mesh.vertices[mesh.triangles]
        corners = corners[np.argsort(_along_a_curve(corners), kind="stable")]
        missing = -len(corners) % BLOCK
        # Blocks are filled up with triangles without an area, never hit, at a place in the block.
        filled = np.concatenate((corners, np.repeat(corners[-1:, :1], missing * 3, axis=1).reshape(missing, 3, 3)))
        blocks = filled.reshape(-1, BLOCK * 3, 3)
        self._boxes = boxes_around(blocks.min(axis=1), blocks.max(axis=1))
        # (coordinate, corner, block, triangle): numbers that are computed together are neighbours.
        self._corners = np.ascontiguousarray(filled.reshape(-1, BLOCK, 3, 3).transpose(3, 2, 0, 1))

    def hits(self, start: Vector, way: Vector) -> list[float]:
        """Return where a line passes through triangles, in order; through the edge of two it passes once.

        A mesh that is closed is passed an even number of times.
        """
        first, last = between_sides(self._boxes, *as_columns(start, way))
        corners = self._corners[:, :, first <= last]
        long = max(range(3), key=lambda axis: abs(way[axis]))
        hit, places = _crossed(corners, start, way, long)
        found: list[float] = np.sort(places[hit]).tolist()
        return found

    def hits_of_many(self, starts: Floats, ways: Floats) -> tuple[NDArray[np.int64], Floats]:
        """Return the hits of many lines (3, n): lines and places, in the order of lines, then places.

        Each has the bits that `hits` gives.
        """
        steps = np.where(np.abs(ways) < STEP_MIN, STEP_MIN, ways)
        lines: list[NDArray[np.int64]] = []
        places: list[Floats] = []
        at_once = max(1, LINES_AT_ONCE // self._boxes.shape[2])
        for begin in range(0, starts.shape[1], at_once):
            part = slice(begin, begin + at_once)
            first, last = between_sides(self._boxes[:, :, None, :], starts[:, part, None], steps[:, part, None])
            its, blocks = np.nonzero(first <= last)
            its = its + begin
            far = np.abs(ways[:, its])
            long = np.where(far[0] >= far[1], np.where(far[0] >= far[2], 0, 2), np.where(far[1] >= far[2], 1, 2))
            for axis in range(3):
                for chosen in _shares(np.flatnonzero(long == axis)):
                    line = its[chosen]
                    start, way = starts[:, line, None], ways[:, line, None]
                    hit, where = _crossed(self._corners[:, :, blocks[chosen]], start, way, axis)
                    lines.append(np.broadcast_to(line[:, None], hit.shape)[hit])
                    places.append(where[hit])
        if not lines:
            return np.zeros(0, np.int64), np.zeros(0)
        found, along = np.concatenate(lines), np.concatenate(places)
        order = np.lexsort((along, found))
        return found[order], along[order]

    def corners_of(self, blocks: slice) -> Floats:
        """Return the corners of blocks of triangles, by coordinate, corner and triangle."""
        return self._corners[:, :, blocks].reshape(3, 3, -1)

    @property
    def arrays(self) -> tuple[Floats, Floats, bool]:
        """The boxes around blocks and the corners of triangles, as they are stored; whether the mesh is closed."""
        return self._boxes, self._corners, self.is_closed

    @property
    def blocks(self) -> int:
        """The number of blocks of triangles."""
        return int(self._boxes.shape[2])


def _shares(chosen: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Divide the work, so that arrays stay small."""
    return [chosen[begin : begin + BLOCKS_AT_ONCE] for begin in range(0, len(chosen), BLOCKS_AT_ONCE)]


def _crossed(
    corners: Floats, start: Vector | Floats, way: Vector | Floats, long: int
) -> tuple[NDArray[np.bool_], Floats]:
    """Return the triangles that lines pass through, and the places.

    `corners` are by coordinate, corner, block, triangle; starts and ways are numbers, or a number for each block.
    `long` is the coordinate in which a line goes farthest, the first of equal ones.
    """
    one, other = (long + 1) % 3, (long + 2) % 3
    # Seen along the line, which is the origin then: a triangle is hit if that is on the same side of its edges.
    z = corners[long] - start[long]
    x = (corners[one] - start[one]) - way[one] / way[long] * z
    y = (corners[other] - start[other]) - way[other] / way[long] * z
    edges = [x[i] * y[j] - x[j] * y[i] for i, j in _EDGES]
    sides = [_is_left(edge, x[j] - x[i], y[j] - y[i]) for edge, (i, j) in zip(edges, _EDGES, strict=True)]
    area = edges[0] + edges[1] + edges[2]
    hit = (sides[0] == sides[1]) & (sides[1] == sides[2]) & (area != 0.0)
    weighed = edges[0] * z[0] + edges[1] * z[1] + edges[2] * z[2]
    with np.errstate(divide="ignore", invalid="ignore"):
        return hit, weighed / area / way[long]


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

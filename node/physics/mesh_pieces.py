"""Scenery of triangles for an engine of convex shapes: thin prisms, in pieces, of which an island has the near
ones."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foosim.world.matter.mesh import Mesh
from foosim.world.scene import Hull, Shape, rotate

PIECE_TRIANGLES: Final = 32
THICKNESS_M: Final = 0.005
"""The thickness of a prism behind its triangle (m): contacts begin at the triangle, or within this from its back."""
AREA_MIN_M2: Final = 1e-10
"""Smaller triangles are left out: a body does not rest on these."""

_FACES: Final = np.array(
    [[0, 1, 2], [5, 4, 3], [0, 3, 4], [0, 4, 1], [1, 4, 5], [1, 5, 2], [2, 5, 3], [2, 3, 0]], np.int32
)
"""Of a prism with the corners of its triangle first, counter-clockwise seen from outside."""

Floats: TypeAlias = NDArray[np.float64]


class MeshPieces:
    """The triangles of the meshes among some scenery, as prisms, in pieces that are near one another.

    `pieces` are the shapes of each.
    """

    def __init__(self, scenery: Sequence[Shape]) -> None:
        self.pieces: list[tuple[Shape, ...]] = []
        boxes: list[Floats] = []
        for shape in scenery:
            mesh = shape.geometry
            if not isinstance(mesh, Mesh):
                continue
            corners = _in_the_world(shape, mesh)
            for rows in _pieces(corners.mean(axis=1), np.arange(len(corners))):
                self.pieces.append(tuple([_prism(shape, corners[row]) for row in rows.tolist()]))
                its = corners[rows].reshape(-1, 3)
                boxes.append(np.array([its.min(axis=0) - THICKNESS_M, its.max(axis=0) + THICKNESS_M]))
        self._boxes = np.array(boxes).reshape(-1, 2, 3)

    def near(self, boxes: Floats) -> tuple[int, ...]:
        """Return the pieces whose boxes overlap with one of these, shape (n, 2, 3): least and greatest coordinates."""
        meet = (boxes[:, None, 0] <= self._boxes[None, :, 1]) & (boxes[:, None, 1] >= self._boxes[None, :, 0])
        return tuple(np.flatnonzero(meet.all(axis=2).any(axis=0)).tolist())


def _in_the_world(shape: Shape, mesh: Mesh) -> Floats:
    """Return the corners of all triangles that are large enough, shape (n, 3, 3)."""
    axes = [rotate(shape.orientation, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
    x, y, z = (mesh.vertices[:, number, None] * np.array(axis) for number, axis in enumerate(axes))
    corners: Floats = (x + y + z + np.array(shape.position))[mesh.triangles]
    return corners[_length(_across(corners)) / 2.0 >= AREA_MIN_M2]


def _across(corners: Floats) -> Floats:
    """Return the cross products of the sides of triangles (..., 3, 3), each of twice the area."""
    return np.cross(corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 0, :])


def _length(vectors: Floats) -> Floats:
    found: Floats = np.sqrt((vectors * vectors).sum(axis=-1))
    return found


def _pieces(middles: Floats, rows: NDArray[np.intp]) -> Iterator[NDArray[np.intp]]:
    """Yield the rows of places in groups, halved along the longest side of the box around them."""
    if len(rows) <= PIECE_TRIANGLES:
        yield rows
        return
    its = middles[rows]
    axis = int((its.max(axis=0) - its.min(axis=0)).argmax())
    ordered = rows[np.argsort(its[:, axis], kind="stable")]
    yield from _pieces(middles, ordered[: len(rows) // 2])
    yield from _pieces(middles, ordered[len(rows) // 2 :])


def _prism(shape: Shape, corners: Floats) -> Shape:
    """Return a triangle (3, 3) with its thickness, in the world."""
    normal = _across(corners)
    behind = corners - THICKNESS_M * normal / _length(normal)
    return Shape(Hull(Mesh(np.concatenate((corners, behind)), _FACES, b"")), shape.surface, shape.colour)

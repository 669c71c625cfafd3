"""Shapes of a world as arrays, for many rays at once: their forms, poses, and spheres around them."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import Final

import numpy as np
from numpy.typing import NDArray

from foosim.kernels import C
from foosim.world.matter.mesh import Mesh
from foosim.world.rays.boxes import MARGIN_M, Floats
from foosim.world.rays.solids import CAPSULE, CYLINDER, MESH, SPHERE, Meshes, form_of
from foosim.world.rays.sorted_boxes import Boxes, Indices, SortedBoxes, met_among
from foosim.world.rays.triangles import Triangles
from foosim.world.scene import ORIGIN, Hull, Quaternion, Shape, Vector, moved, multiply, rotate

NOTHING: Final = -1
"""In place of the number of a thing."""

Part = tuple[Shape, int, int, Vector, Quaternion]
"""A shape, the number of the thing that it is of, that of the frame that it is fixed to, and the pose of its link in
that frame."""


class Forms:
    """The forms of m shapes, and their poses in frames. Of shapes at equal distances the first is met."""

    def __init__(self, parts: Sequence[Part], meshes: Meshes) -> None:
        count = len(parts)
        self.forms = np.zeros(count, np.int64)
        self.half = np.zeros((3, count))
        self.things = np.array([thing for _, thing, _, _, _ in parts], np.int64)
        self.frames = np.array([frame for _, _, frame, _, _ in parts], np.int64)
        self.positions = np.zeros((3, count))
        self.orientations = np.zeros((4, count))
        self.middles = np.zeros((3, count))
        """Of the sphere around each, in its own frame, whose radius is in `radii`."""
        self.radii = np.zeros(count)
        self.meshes: list[tuple[Triangles, NDArray[np.bool_]]] = []
        """Each mesh, and the shapes with it."""
        having: dict[int, tuple[Triangles, NDArray[np.bool_]]] = {}
        for number, (shape, _, _, position, orientation) in enumerate(parts):
            form, half = form_of(shape.geometry)
            self.forms[number], self.half[:, number] = form, half
            self.positions[:, number] = moved(position, rotate(orientation, shape.position), 1.0)
            self.orientations[:, number] = multiply(orientation, shape.orientation)
            self.middles[:, number], self.radii[number] = _ball_around(shape, form, half)
            triangles = meshes.triangles_of(shape.geometry)
            if triangles is not None:
                mesh = having.setdefault(id(triangles), (triangles, np.zeros(count, np.bool_)))
                mesh[1][number] = True
        self.meshes = list(having.values())
        self.mesh_numbers = np.full(count, NOTHING, np.int64)
        """Of each shape, the number of its mesh in `meshes`."""
        for place, (_, its) in enumerate(self.meshes):
            self.mesh_numbers[its] = place
        self.primitives = sorted({*self.forms.tolist()} - {MESH})
        """The forms of the shapes, meshes aside."""


def _ball_around(shape: Shape, form: int, half: Vector) -> tuple[Vector, float]:
    """Return the middle, in the shape's frame, and the radius of a sphere around it."""
    middle, (x, y, z) = ORIGIN, half
    if form == SPHERE:
        return middle, x
    if form == CAPSULE:
        return middle, x + z
    if form == CYLINDER:
        return middle, sqrt(x * x + z * z)
    geometry = shape.geometry.mesh if isinstance(shape.geometry, Hull) else shape.geometry
    if isinstance(geometry, Mesh):
        low, high = geometry.box
        x, y, z = (high[0] - low[0]) / 2, (high[1] - low[1]) / 2, (high[2] - low[2]) / 2
        middle = moved(low, (x, y, z), 1.0)
    return middle, sqrt(x * x + y * y + z * z)


class Poses:
    """The poses of some shapes in a row in the world; columns are those of the shapes."""

    def __init__(self, forms: Forms, part: slice, positions: Floats, orientations: Floats) -> None:
        """`positions` (3, k) and `orientations` (4, k) are those of the frames of these shapes, by number."""
        frames = forms.frames[part]
        position, orientation = positions[:, frames], orientations[:, frames]
        places = position + rotated(orientation, forms.positions[:, part])
        turns = multiplied(orientation, forms.orientations[:, part])
        self.middles, self.radii = places + rotated(turns, forms.middles[:, part]), forms.radii[part] + MARGIN_M
        self.columns = np.concatenate((places, self.middles, _rows(turns)))
        """Places and middles of the spheres around shapes; the rows that turn vectors into their frames (15, m)."""

    def boxes(self) -> Boxes:
        """Return boxes around the spheres around the shapes."""
        return self.middles - self.radii, self.middles + self.radii


class Placed:
    """Shapes placed in the world."""

    def __init__(self, forms: Forms, columns: Floats, near: Sequence[SortedBoxes]) -> None:
        """`columns` are those of `Poses`, of all shapes; `near` are the boxes around them, with a margin, in a row."""
        self.forms, self.things, self.columns = forms, forms.things, columns
        self.positions, self.middles = columns[:3], columns[3:6]
        self.radii = forms.radii + MARGIN_M
        """Of the spheres around shapes, with a margin."""
        self._back, self._near = columns[6:], near

    def met(self, low: Floats, high: Floats) -> tuple[Indices, Indices]:
        """Return pairs of some boxes (3, n) and the shapes near them, in the order of boxes, then shapes."""
        return met_among(self._near, low, high)

    def local(self, chosen: Indices, vectors: Floats) -> Floats:
        """Return vectors of the world (3, n) in the frames of the chosen shapes."""
        rows, (x, y, z) = self._back[:, chosen], vectors
        return np.array([rows[one] * x + rows[one + 1] * y + rows[one + 2] * z for one in (0, 3, 6)])


def rotated(orientations: Floats, vectors: Floats) -> Floats:
    """Return `scene.rotate` of many: quaternions (4, n), vectors (3, n)."""
    (qx, qy, qz, qw), (x, y, z) = orientations, vectors
    tx, ty, tz = 2.0 * (qy * z - qz * y), 2.0 * (qz * x - qx * z), 2.0 * (qx * y - qy * x)
    return np.array(
        (x + qw * tx + (qy * tz - qz * ty), y + qw * ty + (qz * tx - qx * tz), z + qw * tz + (qx * ty - qy * tx))
    )


def rotated_each(orientations: Floats, vectors: Floats) -> Floats:
    """Return `rotated` of some vectors (n, r, 3) by each of n quaternions (4, n): (3, n, r)."""
    if C is None:
        return rotated(orientations[:, :, None], vectors.transpose(2, 0, 1))
    found = np.empty((3, *vectors.shape[:2]))
    C.turned(np.ascontiguousarray(orientations), np.ascontiguousarray(vectors), found)
    return found


def multiplied(ones: Floats, others: Floats) -> Floats:
    """Return `scene.multiply` of many: quaternions (4, n)."""
    (ax, ay, az, aw), (bx, by, bz, bw) = ones, others
    return np.array(
        (
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        )
    )


def _rows(turns: Floats) -> Floats:
    """Return the rows of the matrix that takes vectors of the world into frames that are turned so (4, n): (9, n)."""
    x, y, z, w = turns
    xx, yy, zz = 1.0 - 2.0 * (y * y + z * z), 1.0 - 2.0 * (x * x + z * z), 1.0 - 2.0 * (x * x + y * y)
    xy, xz, yz = x * y, x * z, y * z
    wx, wy, wz = w * x, w * y, w * z
    first = (xx, 2.0 * (xy + wz), 2.0 * (xz - wy))
    second = (2.0 * (xy - wz), yy, 2.0 * (yz + wx))
    third = (2.0 * (xz + wy), 2.0 * (yz - wx), zz)
    return np.array((*first, *second, *third))

"""Geometries as triangles with a normal at each corner, in the frame of their shape.

Round shapes have as many sides as their size needs; their corners lie outside of the true surface by as much as the
middles of their faces lie inside. Meshes and hulls are smooth where faces meet at less than `CREASE`.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from foosim.common.batched import exact_arrays
from foosim.common.exact_math import PI
from foosim.world.matter.mesh import Mesh
from foosim.world.scene import Box, Capsule, Cylinder, Geometry, Hull

Floats = NDArray[np.float64]
Corners = tuple[Floats, Floats]
"""Positions (m) and unit normals of the corners of triangles, (t, 3, 3) each, counter-clockwise from outside."""

SIDES: Final = (12, 16, 24, 32, 48, 64)
FLAT_M: Final = 0.0006
"""How far the middle of a face may lie inside of its corners."""
CREASE: Final = 0.75
"""The cosine of the greatest angle between faces that look like one smooth surface."""


def corners_of(geometry: Geometry) -> Corners:
    """Return the triangles of a geometry."""
    if isinstance(geometry, Box):
        return _box(geometry)
    if isinstance(geometry, Mesh):
        return _mesh(geometry)
    if isinstance(geometry, Hull):
        return _mesh(geometry.mesh)
    radius = geometry.radius
    fine = [sides for sides in SIDES if radius * (1.0 - _inner(sides) * _inner(sides)) <= FLAT_M]
    sides = (*fine, SIDES[-1])[0]
    c, s = _circle(sides)
    if isinstance(geometry, Cylinder):
        outer, half = radius * 2.0 / (1.0 + _inner(sides)), geometry.length / 2
        at = np.array([[[0.0, -half], [outer, -half]], [[outer, -half], [outer, half]], [[outer, half], [0.0, half]]])
        normals = np.array([[[0.0, -1.0]] * 2, [[1.0, 0.0]] * 2, [[0.0, 1.0]] * 2])
        return _turned(at, normals, c, s)
    outer = radius * 2.0 / (1.0 + _inner(sides) * _inner(sides))
    half = geometry.length / 2 if isinstance(geometry, Capsule) else 0.0
    quarter = sides // 4
    low = np.stack([c[3 * quarter :], s[3 * quarter :]], axis=1)  # from the pole below to the equator
    high = np.stack([c[: quarter + 1], s[: quarter + 1]], axis=1)
    low = np.concatenate([low, high[:1]])
    normals = np.concatenate([_pairs(low), [[[1.0, 0.0]] * 2] if half else np.zeros((0, 2, 2)), _pairs(high)])
    low, high = low * outer - (0.0, half), high * outer + (0.0, half)
    return _turned(_pairs(np.concatenate([low, high] if half else [low, high[1:]])), normals, c, s)


def _circle(sides: int) -> Corners:
    """Return the cosines and sines of the corners of a circle, from 0 on; those at its quarters are exact."""
    sines, cosines = exact_arrays.sincos(np.arange(sides // 4, dtype=np.float64) * (2.0 * PI / sides))
    sines[0], cosines[0] = 0.0, 1.0
    return (
        np.concatenate([cosines, -sines, -cosines, sines]),
        np.concatenate([sines, cosines, -sines, -cosines]),
    )


def _inner(sides: int) -> float:
    """Return how far the middle of a side is from the centre, of a corner's distance."""
    return float(exact_arrays.cos(np.array([PI / sides]))[0])


def _pairs(line: Floats) -> Floats:
    return np.stack([line[:-1], line[1:]], axis=1)


def _turned(at: Floats, normals: Floats, c: Floats, s: Floats) -> Corners:
    """Return what lines turned about z sweep: `at` (n, 2, 2) are their ends (radius, height) from below upwards, with
    `normals` (radial, along z)."""

    def corners(lines: Floats) -> Floats:
        turned = [lines[:, :, :1] * np.append(a, a[0]) for a in (c, s)]
        places = np.stack([*turned, np.broadcast_to(lines[:, :, 1:], turned[0].shape)], axis=-1)
        (a, d), (b, e) = ((places[:, end, :-1], places[:, end, 1:]) for end in (0, 1))
        return np.stack([np.stack([a, d, e], axis=2), np.stack([a, e, b], axis=2)])

    positions, directions = corners(at), corners(normals)
    kept = np.stack([at[:, 0, 0] > 0.0, at[:, 1, 0] > 0.0])  # at the axis one of two has no area
    return positions[kept].reshape(-1, 3, 3), directions[kept].reshape(-1, 3, 3)


def _box(box: Box) -> Corners:
    """Return the twelve triangles of a box."""
    positions, normals = [], []
    for axis in range(3):
        for side in (-1.0, 1.0):
            normal = np.zeros(3)
            normal[axis] = side
            face = []
            for u, v in ((-1.0, -1.0), (side, -side), (1.0, 1.0), (-side, side)):
                corner = normal.copy()
                corner[(axis + 1) % 3], corner[(axis + 2) % 3] = u, v
                face.append(corner * box.half)
            positions += [[face[0], face[1], face[2]], [face[0], face[2], face[3]]]
            normals += [[normal] * 3] * 2
    return np.array(positions), np.array(normals)


def _mesh(mesh: Mesh) -> Corners:
    """Return the triangles of a mesh: a corner's normal is that of the faces there, by area, beyond no crease."""
    positions = mesh.vertices[mesh.triangles].astype(np.float64)
    u, v = positions[:, 1] - positions[:, 0], positions[:, 2] - positions[:, 0]
    areas = np.stack([u[:, i - 2] * v[:, i - 1] - u[:, i - 1] * v[:, i - 2] for i in range(3)], axis=1)
    faces = _unit(areas)
    _, place = np.unique(mesh.vertices, axis=0, return_inverse=True)
    corner = place[mesh.triangles].reshape(-1)
    order = np.argsort(corner, kind="stable")
    counts = np.bincount(corner)
    begins = np.cumsum(counts) - counts
    here = np.repeat(np.arange(len(corner)), counts[corner])
    first = np.repeat(np.cumsum(counts[corner]) - counts[corner], counts[corner])
    there = order[begins[corner[here]] + np.arange(len(here)) - first]
    one, other = faces[here // 3], faces[there // 3]
    smooth = one[:, 0] * other[:, 0] + one[:, 1] * other[:, 1] + one[:, 2] * other[:, 2] >= CREASE
    here, there = here[smooth], there[smooth]
    sums = [np.bincount(here, areas[there // 3, i], len(corner)) for i in range(3)]
    return positions, _unit(np.stack(sums, axis=1)).reshape(-1, 3, 3)


def _unit(vectors: Floats) -> Floats:
    """Return vectors (n, 3) with length 1; those without a length point up."""
    x, y, z = vectors.T
    length = np.sqrt(x * x + y * y + z * z)
    units = vectors / np.where(length > 0.0, length, 1.0)[:, np.newaxis]
    units[~(length > 0.0)] = (0.0, 0.0, 1.0)
    return units

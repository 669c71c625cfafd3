"""Distances of places from placed shapes, negative inside. Each place has the bits that it has alone.

Distances are element-wise, of places (3, n) in the frames of shapes with sizes (n,) or (3, n).
Sources: distance functions of solids, Hart, "Sphere tracing" (The Visual Computer, 1996); the place of a triangle that
is nearest, Ericson, *Real-Time Collision Detection*, section 5.1.5.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from foosim.world.matter.mesh import Mesh
from foosim.world.rays.boxes import MARGIN_M, Floats
from foosim.world.rays.shapes import Placed
from foosim.world.rays.solids import BOX, CYLINDER, SPHERE
from foosim.world.rays.triangles import Triangles
from foosim.world.scene import Box, Cylinder, Geometry, Hull, Sphere, Vector

PLACES_AT_ONCE: Final = 64
BLOCKS_AT_ONCE: Final = 32
"""The counts of places and of blocks of triangles that are compared at once."""
MESHES_KEPT: Final = 64
"""The count of latest meshes whose triangles are kept in order."""


def clear_of(placed: Placed, places: Floats, reach: Floats, passing: NDArray[np.int64]) -> Floats:
    """Return the distances of places (3, n) from the nearest surface (m), negative inside; inf beyond reach (n,).

    Inside of several shapes it is the greatest depth. Shapes of the thing `passing` (n,) do not count.
    """
    found = np.full(places.shape[1], np.inf)
    queries, shapes = placed.met(places - reach - MARGIN_M, places + reach + MARGIN_M)
    kept = placed.things[shapes] != passing[queries]
    queries, shapes = queries[kept], shapes[kept]
    forms = placed.forms
    kinds = forms.forms[shapes]
    local = places[:, queries] - placed.positions[:, shapes]
    distances = np.full(len(queries), np.inf)
    for form in forms.primitives:
        some = np.flatnonzero(kinds == form)
        if len(some):
            turned = local[:, some] if form == SPHERE else placed.local(shapes[some], local[:, some])
            distances[some] = _distances(form, turned, forms.half[:, shapes[some]])
    for triangles, having in forms.meshes:
        some = np.flatnonzero(having[shapes])
        if len(some):
            distances[some] = _to_triangles(placed.local(shapes[some], local[:, some]), triangles)
    np.minimum.at(found, queries, distances)
    return np.where(found <= reach, found, np.inf)


def _distances(form: int, places: Floats, half: Floats) -> Floats:
    if form == BOX:
        return _to_boxes(places, half)
    if form == SPHERE:
        return _to_spheres(places, half[0])
    if form == CYLINDER:
        return _to_cylinders(places, half[0], half[2])
    return _to_capsules(places, half[0], half[2])


def distance_to(geometry: Geometry, place: Vector) -> float:
    """Return the distance of a place in the frame of a geometry from its surface (m), negative inside."""
    column = np.array(place).reshape(3, 1)
    if isinstance(geometry, Box):
        found = _to_boxes(column, np.array(geometry.half).reshape(3, 1))
    elif isinstance(geometry, Sphere):
        found = _to_spheres(column, np.array([geometry.radius]))
    elif isinstance(geometry, Hull | Mesh):
        found = _to_triangles(column, _triangles_of(geometry.mesh if isinstance(geometry, Hull) else geometry))
    else:
        to_it = _to_cylinders if isinstance(geometry, Cylinder) else _to_capsules
        found = to_it(column, np.array([geometry.radius]), np.array([geometry.length / 2]))
    return float(found[0])


@lru_cache(maxsize=MESHES_KEPT)
def _triangles_of(mesh: Mesh) -> Triangles:
    return Triangles(mesh)


def _to_boxes(places: Floats, half: Floats) -> Floats:
    """Return the distances to boxes, centred, with half of their lengths (3, n)."""
    return _outside_or_deep(list(np.abs(places) - half))


def _to_spheres(places: Floats, radii: Floats) -> Floats:
    """Return the distances to spheres, centred."""
    x, y, z = places
    return _root(x * x + y * y + z * z) - radii


def _to_cylinders(places: Floats, radii: Floats, half_lengths: Floats) -> Floats:
    """Return the distances to cylinders, centred, whose axes are z."""
    x, y, z = places
    return _outside_or_deep([_root(x * x + y * y) - radii, np.abs(z) - half_lengths])


def _to_capsules(places: Floats, radii: Floats, half_lengths: Floats) -> Floats:
    """Return the distances to capsules, centred, whose axes are z."""
    x, y, z = places
    beyond = np.maximum(np.abs(z) - half_lengths, 0.0)
    return _root(x * x + y * y + beyond * beyond) - radii


def _to_triangles(places: Floats, triangles: Triangles) -> Floats:
    """Return the distances to a mesh; one that is closed has an inside."""
    nearest = np.full(places.shape[1], np.inf)
    for begin in range(0, places.shape[1], PLACES_AT_ONCE):
        part = slice(begin, begin + PLACES_AT_ONCE)
        for first in range(0, triangles.blocks, BLOCKS_AT_ONCE):
            corners = triangles.corners_of(slice(first, first + BLOCKS_AT_ONCE))
            squares = _squares_to_triangles(places[:, part, None], corners)
            nearest[part] = np.minimum(nearest[part], squares.min(axis=1))
    distances = _root(nearest)
    if triangles.is_closed:
        ways = np.zeros_like(places)
        ways[2] = 1.0
        lines, along = triangles.hits_of_many(places, ways)
        above = np.bincount(lines[along > 0.0], minlength=places.shape[1])
        distances = np.where(above % 2 == 1, -distances, distances)
    return distances


def _outside_or_deep(beyond: list[Floats]) -> Floats:
    """Return the distance of places from their distances beyond pairs of sides at right angles."""
    square, deepest = np.zeros_like(beyond[0]), beyond[0]
    for one in beyond:
        out = np.maximum(one, 0.0)
        square = square + out * out
        deepest = np.maximum(deepest, one)
    return np.where(deepest > 0.0, _root(square), deepest)


def _squares_to_triangles(places: Floats, corners: Floats) -> Floats:
    """Return the squares of the distances of places (3, n, 1) from triangles (coordinate, corner, m), shape (n, m)."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    found = _squares_to_sides(places, a, b)
    for one, other in ((b, c), (c, a)):
        found = np.minimum(found, _squares_to_sides(places, one, other))
    normal = _cross(b - a, c - a)
    size = _dot(normal, normal)
    is_above = np.ones(found.shape, np.bool_)
    for one, other in ((a, b), (b, c), (c, a)):
        inwards = _cross(normal, other - one)
        is_above &= _dot(inwards[:, None, :], places - one[:, None, :]) >= 0.0
    height = _dot(normal[:, None, :], places - a[:, None, :])
    flat = size == 0.0
    straight = height * height / np.where(flat, 1.0, size)
    return np.where(is_above & ~flat, np.minimum(found, straight), found)


def _squares_to_sides(places: Floats, one: Floats, other: Floats) -> Floats:
    """Return the squares of the distances of places (3, n, 1) from lines between two ends (3, m), shape (n, m)."""
    way = other - one
    square = _dot(way, way)
    from_one = places - one[:, None, :]
    share = _dot(from_one, way[:, None, :]) / np.where(square == 0.0, 1.0, square)
    rest = from_one - np.minimum(np.maximum(share, 0.0), 1.0) * way[:, None, :]
    return _dot(rest, rest)


def _dot(a: Floats, b: Floats) -> Floats:
    found: Floats = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return found


def _cross(a: Floats, b: Floats) -> Floats:
    return np.stack((a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]))


def _root(squares: Floats) -> Floats:
    found: Floats = np.sqrt(squares)
    return found

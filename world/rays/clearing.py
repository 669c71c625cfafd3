"""How far places are from placed shapes. Each place has the bits that it has alone."""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from foosim.world.matter.mesh import Mesh
from foosim.world.rays.boxes import MARGIN_M, Floats
from foosim.world.rays.distances import to_boxes, to_capsules, to_cylinders, to_spheres, to_triangles
from foosim.world.rays.shapes import Placed
from foosim.world.rays.solids import BOX, CYLINDER, SPHERE
from foosim.world.rays.triangles import Triangles
from foosim.world.scene import Box, Cylinder, Geometry, Hull, Sphere, Vector

MESHES_KEPT: Final = 64
"""Meshes whose triangles are kept in order, those that were asked for last."""


def clear_of(placed: Placed, places: Floats, reach: Floats, passing: NDArray[np.int64]) -> Floats:
    """Return how far places (3, n) are from the nearest surface (m), negative inside; inf beyond their reach (n,).

    Inside of several shapes it is the depth in that in which it is deepest. Those of the thing `passing` (n,) do not
    count.
    """
    found = np.full(places.shape[1], np.inf)
    asked, shapes = placed.met(places - reach - MARGIN_M, places + reach + MARGIN_M)
    kept = placed.things[shapes] != passing[asked]
    asked, shapes = asked[kept], shapes[kept]
    forms = placed.forms
    kinds = forms.forms[shapes]
    local = places[:, asked] - placed.positions[:, shapes]
    distances = np.full(len(asked), np.inf)
    for form in forms.primitives:
        some = np.flatnonzero(kinds == form)
        if len(some):
            turned = local[:, some] if form == SPHERE else placed.local(shapes[some], local[:, some])
            distances[some] = _distances(form, turned, forms.half[:, shapes[some]])
    for triangles, having in forms.meshes:
        some = np.flatnonzero(having[shapes])
        if len(some):
            distances[some] = to_triangles(placed.local(shapes[some], local[:, some]), triangles)
    np.minimum.at(found, asked, distances)
    return np.where(found <= reach, found, np.inf)


def _distances(form: int, places: Floats, half: Floats) -> Floats:
    if form == BOX:
        return to_boxes(places, half)
    if form == SPHERE:
        return to_spheres(places, half[0])
    if form == CYLINDER:
        return to_cylinders(places, half[0], half[2])
    return to_capsules(places, half[0], half[2])


def distance_to(geometry: Geometry, place: Vector) -> float:
    """Return how far a place in the frame of a geometry is from its surface (m), negative inside."""
    column = np.array(place).reshape(3, 1)
    if isinstance(geometry, Box):
        found = to_boxes(column, np.array(geometry.half).reshape(3, 1))
    elif isinstance(geometry, Sphere):
        found = to_spheres(column, np.array([geometry.radius]))
    elif isinstance(geometry, Hull | Mesh):
        found = to_triangles(column, _triangles_of(geometry.mesh if isinstance(geometry, Hull) else geometry))
    else:
        to_it = to_cylinders if isinstance(geometry, Cylinder) else to_capsules
        found = to_it(column, np.array([geometry.radius]), np.array([geometry.length / 2]))
    return float(found[0])


@lru_cache(maxsize=MESHES_KEPT)
def _triangles_of(mesh: Mesh) -> Triangles:
    return Triangles(mesh)

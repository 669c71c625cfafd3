"""How far places are from placed shapes. Each place has the bits that it has alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foosim.world.rays.boxes import MARGIN_M, Floats
from foosim.world.rays.distances import to_boxes, to_capsules, to_cylinders, to_spheres, to_triangles
from foosim.world.rays.shapes import Placed
from foosim.world.rays.solids import BOX, CYLINDER, SPHERE


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

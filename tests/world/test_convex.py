"""By how much convex bodies overlap: against closed forms, and against the least of many directions at drawn poses."""

from __future__ import annotations

from math import inf, pi, sqrt
from typing import Final

import numpy as np
import pytest
from numpy.typing import NDArray

from foosim.world.bodies.hull import convex_hull
from foosim.world.clearance.convex import Convex, Corners, convex_parts, overlap_of
from foosim.world.scene import (
    UPRIGHT,
    Box,
    Capsule,
    Cylinder,
    Hull,
    Quaternion,
    Shape,
    Sphere,
    Vector,
    from_rpy,
    rotate,
    turn,
)

SEED: Final = 11
CUBE: Final = Hull(convex_hull(np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 0.1))
GEOMETRIES: Final = (Box((0.1, 0.2, 0.3)), Sphere(0.2), Cylinder(0.1, 0.5), Capsule(0.1, 0.3), CUBE)
TOUCHING_M: Final = 1e-3
Geometry = Box | Sphere | Cylinder | Capsule | Hull


def shape(geometry: Geometry) -> Shape:
    return Shape(geometry, "", (0.0, 0.0, 0.0, 1.0))


def convex_of(one: Shape, position: Vector, orientation: Quaternion) -> Convex:
    (found,) = convex_parts(one, position, orientation, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    return found


def between(
    one: Geometry, other: Geometry, position: Vector, turned: Quaternion = UPRIGHT, tolerance_m: float = TOUCHING_M
) -> float:
    first = convex_of(shape(one), (0.0, 0.0, 0.0), UPRIGHT)
    return overlap_of(first, convex_of(shape(other), position, turned), tolerance_m)


SIDE: Final = Box((0.5, 0.5, 0.5))


@pytest.mark.parametrize(
    ("one", "other", "position", "depth"),
    [
        (SIDE, SIDE, (0.9, 0.2, 0.1), 0.1),
        (SIDE, SIDE, (0.0, 0.0, 0.0), 1.0),
        (Sphere(0.3), Sphere(0.2), (0.1, 0.2, 0.2), 0.5 - 0.3),
        (Sphere(0.3), Sphere(0.2), (0.0, 0.0, 0.0), 0.5),
        (SIDE, Sphere(0.2), (0.65, 0.1, 0.0), 0.05),
        (SIDE, Sphere(0.2), (0.6, 0.6, 0.0), 0.2 - 0.1 * sqrt(2.0)),
        (SIDE, Capsule(0.1, 1.0), (0.0, 0.0, 1.05), 0.05),
        (Box((50.0, 50.0, 0.5)), Cylinder(0.1, 0.4), (3.0, -20.0, 0.69), 0.01),
        (Box((50.0, 50.0, 0.5)), Sphere(0.1), (3.0, -20.0, 0.55), 0.05),
        (Box((5e3, 5e3, 0.1)), Cylinder(0.005, 0.01), (2e3, -4e3, 0.103), 0.002),
        (Box((5e3, 5e3, 0.1)), Box((0.002, 0.002, 0.002)), (2e3, -4e3, 0.1005), 0.0015),
        (Cylinder(0.1, 1.0), Cylinder(0.2, 1.0), (0.25, 0.0, 0.3), 0.05),
        (CUBE, SIDE, (0.0, 0.57, 0.0), 0.03),
        (CUBE, Sphere(0.1), (0.15, 0.0, 0.0), 0.05),
    ],
)
def test_closed_forms(one: Geometry, other: Geometry, position: Vector, depth: float) -> None:
    back = -position[0], -position[1], -position[2]
    assert between(one, other, position) == pytest.approx(depth, rel=0.01)
    assert between(other, one, back) == pytest.approx(depth, rel=0.01), "either way"


@pytest.mark.parametrize("gap", [0.0, 0.01, -0.0009])
@pytest.mark.parametrize("other", GEOMETRIES)
def test_what_touches_and_what_is_apart_does_not_overlap(other: Geometry, gap: float) -> None:
    half = {Box: 0.3, Sphere: 0.2, Cylinder: 0.25, Capsule: 0.25, Hull: 0.1}[type(other)]
    assert between(SIDE, other, (0.1, -0.2, 0.5 + half + gap)) == 0.0


def test_edges_across_each_other() -> None:
    """Two cubes turned by 45 degrees, one edge across the other: sqrt(2) of a half side from middle to edge."""
    lower, upper = turn((1.0, 0.0, 0.0), pi / 4), turn((0.0, 1.0, 0.0), pi / 4)
    one = convex_of(shape(SIDE), (0.0, 0.0, 0.0), lower)
    for lifted, depth in ((sqrt(2.0) - 0.05, 0.05), (sqrt(2.0) + 0.01, 0.0)):
        assert overlap_of(one, convex_of(shape(SIDE), (0.0, 0.0, lifted), upper), TOUCHING_M) == pytest.approx(
            depth, rel=0.01
        )


def test_a_triangle_is_flat() -> None:
    floor = Corners(np.array([[-5.0, -5.0, 0.0], [5.0, -5.0, 0.0], [0.0, 5.0, 0.0]]))
    for height, depth in ((0.5, 0.0), (0.4, 0.1), (0.0, 0.5), (-0.45, 0.05), (0.6, 0.0)):
        box = convex_of(shape(SIDE), (0.0, 0.0, height), UPRIGHT)
        assert overlap_of(box, floor, TOUCHING_M) == pytest.approx(depth, rel=0.01)


# --- the least of many directions ------------------------------------------------------------------------------------


def directions(count: int) -> NDArray[np.float64]:
    """Directions all over the sphere, shape (count, 3)."""
    found: NDArray[np.float64] = np.random.default_rng(SEED).normal(size=(count, 3))
    found /= np.sqrt((found * found).sum(axis=1))[:, None]
    return found


def reaches(geometry: Geometry, position: Vector, turned: Quaternion, ways: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far a body reaches along each direction from the origin, written down another time."""
    ex, ey, ez = (np.array(rotate(turned, axis)) for axis in ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0)))
    local = np.stack([(ways * axis).sum(axis=1) for axis in (ex, ey, ez)], axis=1)
    x, y, z = local.T
    if isinstance(geometry, Box):
        own = (np.abs(local) * np.array(geometry.half)).sum(axis=1)
    elif isinstance(geometry, Sphere):
        own = np.full(len(ways), geometry.radius)
    elif isinstance(geometry, Capsule):
        own = geometry.radius + np.abs(z) * geometry.length / 2
    elif isinstance(geometry, Cylinder):
        own = geometry.radius * np.sqrt(x * x + y * y) + np.abs(z) * geometry.length / 2
    else:
        own = (local[:, None, :] * geometry.mesh.vertices[None]).sum(axis=2).max(axis=1)
    found: NDArray[np.float64] = own + (ways * np.array(position)).sum(axis=1)
    return found


@pytest.mark.parametrize("one", GEOMETRIES)
@pytest.mark.parametrize("other", GEOMETRIES)
def test_no_direction_parts_them_by_less(one: Geometry, other: Geometry) -> None:
    """At drawn poses: what is found is no more than the least of 20,000 directions, and hardly less."""
    random, ways = np.random.default_rng([SEED, GEOMETRIES.index(one), GEOMETRIES.index(other)]), directions(20_000)
    counts = [0, 0]
    for _ in range(12):
        (x, y, z), (roll, pitch, yaw) = random.uniform(-0.35, 0.35, 3).tolist(), random.uniform(-3, 3, 3).tolist()
        position, turned = (x, y, z), from_rpy(roll, pitch, yaw)
        least = float(
            (reaches(one, (0.0, 0.0, 0.0), UPRIGHT, ways) + reaches(other, position, turned, -ways)).min(initial=inf)
        )
        found = between(one, other, position, turned)
        counts[found > 0.0] += 1
        if found == 0.0:
            assert least <= TOUCHING_M + 0.02, "20,000 directions are up to 2 degrees apart"
        else:
            assert found <= least * 1.001 and found >= least - 0.02, (found, least)
    print(f"seed {SEED}: {counts[1]} of 12 overlap")
    assert counts[1] > 0

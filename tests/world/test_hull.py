"""Convex hulls: closed, convex, around all points, with bounded corners, whatever the points are."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from foosim.common.errors import BadValue
from foosim.world.bodies.hull import CORNERS_MAX, convex_hull
from foosim.world.matter.mesh import Mesh
from foosim.world.mesh_files import is_closed

Points = NDArray[np.float64]
RANDOM = np.random.default_rng(11)
CUBE = np.array([[x, y, z] for x in (0, 0.3) for y in (0, 0.2) for z in (0, 1.0)])


def grid(steps: int) -> Points:
    return np.stack(np.meshgrid(*[np.linspace(0, 1, steps)] * 3), axis=-1).reshape(-1, 3)


def on_sphere(count: int) -> Points:
    points: Points = RANDOM.normal(size=(count, 3))
    points /= np.sqrt((points**2).sum(axis=1))[:, None]
    return points


def ring(count: int) -> Points:
    """A cylinder: many points in two planes, and on each line between them."""
    angles = np.linspace(0, 2 * np.pi, count, endpoint=False)
    return np.concatenate([np.stack((np.cos(angles), np.sin(angles), z + 0 * angles), axis=1) for z in (0, 0.5, 2)])


CLOUDS: dict[str, Points] = {
    "cube": CUBE,
    "grid": grid(12),
    "sphere": on_sphere(3000),
    "cloud": RANDOM.normal(size=(5000, 3)),
    "plate": RANDOM.random((800, 3)) * (1.0, 0.001, 0.5),
    "cylinder": ring(400),
    "needle": RANDOM.random((300, 3)) * (0.002, 1.0, 0.002),
    "twice": np.concatenate((CUBE, CUBE, CUBE + 1e-9)),
    "far": on_sphere(500) * 0.01 + (900.0, -900.0, 900.0),
}


def heights(mesh: Mesh, points: Points) -> Points:
    """How far outside of each face each point is, in m: (faces, points)."""
    a, b, c = (mesh.vertices[mesh.triangles[:, corner]] for corner in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.sqrt((normals**2).sum(axis=1))[:, None]
    found: Points = normals @ points.T - (normals * a).sum(axis=1)[:, None]
    return found


@pytest.mark.parametrize("name", CLOUDS)
def test_a_hull_is_closed_convex_and_around_all_points(name: str) -> None:
    points = CLOUDS[name]
    mesh = convex_hull(points)
    extent = float((points.max(axis=0) - points.min(axis=0)).max())
    assert len(mesh.vertices) <= CORNERS_MAX
    assert is_closed(mesh) and len(mesh.triangles) == 2 * len(mesh.vertices) - 4, "Euler: one surface without holes"
    assert heights(mesh, points).max() <= 3e-6 * extent
    assert heights(mesh, mesh.vertices).max() <= 3e-6 * extent
    assert heights(mesh, points.mean(axis=0)[None]).max() < 0.0, "triangles are seen from outside"


def test_a_hull_of_few_corners_is_exact() -> None:
    mesh = convex_hull(np.concatenate((CUBE, RANDOM.random((500, 3)) * (0.3, 0.2, 1.0))))
    assert sorted(map(tuple, mesh.vertices.tolist())) == sorted(map(tuple, CUBE.tolist()))


def test_a_reduced_hull_is_little_larger() -> None:
    points = on_sphere(4000)
    mesh = convex_hull(points, 64)
    assert len(mesh.vertices) <= 64
    assert np.sqrt((mesh.vertices**2).sum(axis=1)).max() < 1.25 and heights(mesh, points).max() <= 1e-5


@pytest.mark.parametrize("name", ["cloud", "grid"])
def test_the_order_of_points_changes_nothing(name: str) -> None:
    points = CLOUDS[name]
    assert convex_hull(points) == convex_hull(points[RANDOM.permutation(len(points))])


@pytest.mark.parametrize(
    ("points", "what"),
    [
        (np.zeros((9, 3)), "1 different corners: a convex hull has at least 4"),
        (CUBE[:3], "3 different corners"),
        (ring(50) * (1.0, 1.0, 0.0), "lie in a plane"),
        (np.linspace(0, 1, 20)[:, None] * (1.0, 2.0, 3.0), "lie in a plane"),
        (RANDOM.random((50, 3)) * (1.0, 1.0, 1e-5), "lie in a plane, or nearly"),
    ],
)
def test_points_without_a_volume_are_refused(points: Points, what: str) -> None:
    with pytest.raises(BadValue, match=what):
        convex_hull(points)

"""Masses and inertias against closed forms, numpy's eigenvectors and each other."""

from __future__ import annotations

from hashlib import blake2b
from itertools import permutations
from math import pi
from struct import pack
from typing import Final

import numpy as np
import pytest
from numpy.typing import NDArray

from foosim.common.keyed_random import draw_key, draw_words, unit_interval
from foosim.world.bodies import urdf, urdf_links
from foosim.world.bodies.hull import convex_hull
from foosim.world.bodies.inertia import (
    MassOf,
    Principal,
    Tensor,
    about,
    check_moments,
    combined,
    placed,
    principal_of,
    quaternion_of,
    solid,
    turned,
    without_rounding,
)
from foosim.world.scene import ORIGIN, UPRIGHT, Box, Capsule, Cylinder, Hull, Sphere, Vector, from_rpy, rotate, turn


def matrix(tensor: Tensor) -> NDArray[np.float64]:
    xx, xy, xz, yy, yz, zz = tensor
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def drawn_tensors(count: int) -> list[Tensor]:
    """Tensors of clouds of points, from needles to balls, of masses from grams to tons."""
    random = np.random.default_rng(5)
    found: list[Tensor] = []
    for _ in range(count):
        points = random.normal(size=(6, 3)) * 10.0 ** random.uniform(-3, 1, 3)
        inertia = 10.0 ** random.uniform(-3, 3) * sum(np.dot(p, p) * np.eye(3) - np.outer(p, p) for p in points)
        found.append(tuple(inertia[np.triu_indices(3)].tolist()))
    return found


def test_principal_moments_are_the_eigenvalues_and_the_axes_give_the_tensor_again() -> None:
    for tensor in drawn_tensors(400):
        moments, axes = principal_of(tensor)
        largest = max(moments)
        assert np.allclose(sorted(moments), np.linalg.eigh(matrix(tensor))[0], rtol=0, atol=1e-14 * largest)
        again = turned((moments[0], 0.0, 0.0, moments[1], 0.0, moments[2]), axes)
        assert np.allclose(again, tensor, rtol=0, atol=1e-14 * largest)
        assert sum(part * part for part in axes) == pytest.approx(1.0, abs=1e-15) and axes[3] >= 0.0


def test_a_diagonal_tensor_has_its_own_moments_unturned() -> None:
    assert principal_of((3.0, 0.0, 0.0, 1.0, 0.0, 2.0)) == ((3.0, 1.0, 2.0), UPRIGHT)
    assert principal_of((2.0, 0.0, 0.0, 2.0, 0.0, 2.0)) == ((2.0, 2.0, 2.0), UPRIGHT)


def test_equal_moments_with_products_of_inertia_are_distinguished() -> None:
    moments, axes = principal_of((2.0, 1.0, 0.0, 2.0, 0.0, 4.0))
    assert sorted(moments) == pytest.approx([1.0, 3.0, 4.0])
    assert np.allclose(turned((moments[0], 0.0, 0.0, moments[1], 0.0, moments[2]), axes), (2, 1, 0, 2, 0, 4))


SOLIDS = (
    (Box((0.5, 1.0, 1.5)), (2 * (4 + 9) / 12, 2 * (1 + 9) / 12, 2 * (1 + 4) / 12)),
    (Sphere(0.5), (0.2, 0.2, 0.2)),
    (Cylinder(0.5, 3.0), (2 * (0.75 + 9) / 12, 2 * (0.75 + 9) / 12, 0.25)),
)


@pytest.mark.parametrize(("geometry", "moments"), SOLIDS)
def test_solids_have_the_moments_of_handbooks(geometry: Box | Sphere | Cylinder, moments: Vector) -> None:
    mass, centre, (x, xy, xz, y, yz, z) = solid(geometry, 2.0)
    assert (mass, centre, xy, xz, yz) == (2.0, ORIGIN, 0.0, 0.0, 0.0)
    assert (x, y, z) == pytest.approx(moments, rel=1e-15)


def test_a_capsule_is_what_its_points_are() -> None:
    radius, length, step = 0.3, 0.8, 0.01
    across, along = (np.arange(-reach + step / 2, reach, step) for reach in (0.3, 0.7))
    x, y, z = (part.ravel() for part in np.meshgrid(across, across, along))
    beyond = np.maximum(abs(z) - length / 2, 0.0)
    inside = x * x + y * y + beyond * beyond <= radius * radius
    x, y, z = x[inside], y[inside], z[inside]
    _, _, (xx, _, _, yy, _, zz) = solid(Capsule(radius, length), 3.0)
    of_points = [3.0 * float(np.mean(part)) for part in (y * y + z * z, x * x + z * z, x * x + y * y)]
    assert (xx, yy, zz) == pytest.approx(of_points, rel=0.005)
    shortest = solid(Capsule(radius, 1e-9), 3.0).tensor
    assert shortest == pytest.approx(solid(Sphere(radius), 3.0).tensor, rel=1e-6), "without a length it is a sphere"


def test_a_hull_is_the_solid_that_it_bounds() -> None:
    corners = np.array([[x, y, z] for x in (1, 1.4) for y in (-0.3, 0.3) for z in (2, 3)])
    mass, centre, tensor = solid(Hull(convex_hull(corners)), 5.0)
    assert mass == 5.0 and centre == pytest.approx((1.2, 0.0, 2.5), abs=1e-14)
    assert tensor == pytest.approx(solid(Box((0.2, 0.3, 0.5)), 5.0).tensor, abs=1e-12)


def test_parts_make_the_whole_wherever_its_frame_is() -> None:
    """A box cut in three, turned: the parallel axes of Huygens and Steiner."""
    orientation = from_rpy(0.3, -1.1, 2.0)
    parts = [MassOf(1.0, (0.0, 0.0, z), solid(Box((0.1, 0.2, 0.5)), 1.0).tensor) for z in (-1.0, 0.0, 1.0)]
    whole = combined([placed(part, (4.0, 5.0, 6.0), orientation) for part in parts])
    expected = turned(solid(Box((0.1, 0.2, 1.5)), 3.0).tensor, orientation)
    assert whole.mass == 3.0 and whole.centre == pytest.approx((4.0, 5.0, 6.0))
    assert whole.tensor == pytest.approx(expected, abs=1e-13)
    assert combined([]).mass == 0.0 and combined(parts[:1]) == parts[0]


def test_away_from_the_centre_a_mass_resists_more() -> None:
    assert about((1.0, 0.0, 0.0, 1.0, 0.0, 1.0), 2.0, (3.0, 4.0, 0.0)) == (33.0, -24.0, 0.0, 19.0, 0.0, 51.0)
    quarter = turn((0.0, 0.0, 1.0), pi / 2)
    assert turned((1.0, 0.0, 0.0, 2.0, 0.0, 3.0), quarter) == pytest.approx((2.0, 0.0, 0.0, 1.0, 0.0, 3.0), abs=1e-15)


def test_a_thin_plate_whose_numbers_were_rounded_is_a_body() -> None:
    check_moments(1.0, (1.0, 1.0, 2.0))
    check_moments(1.0, (0.083, 0.083, 0.167))
    assert without_rounding((0.083, 0.167, 0.083)) == (0.083, 0.166, 0.083) and without_rounding((3, 4, 5)) == (3, 4, 5)


# --- the same bits everywhere ----------------------------------------------------------------------------------------

SEED: Final = 23
BITS: Final = "4639fbedc9a0fbac"
"""Digest of the inertias of `robot_of_boxes`, as computed by Jacobi rotations: on each machine, with each numpy."""


def robot_of_boxes() -> bytes:
    """Forty links whose inertias are drawn, neither diagonal nor about their origins, the first of them joined."""
    words = iter([word for number in range(400) for word in draw_words(draw_key(SEED, "boxes"), number)])

    def draw(low: float, high: float) -> str:
        return repr(low + (high - low) * unit_interval(next(words)))

    ball = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
    links, joints = [f'<link name="base">{ball}</link>'], []
    for number in range(40):
        xyz = " ".join(draw(-0.2, 0.2) for _ in range(3))
        moments = " ".join(f'i{axis * 2}="{draw(0.02, 0.03)}"' for axis in "xyz")
        products = " ".join(f'i{axes}="{draw(-0.004, 0.004)}"' for axes in ("xy", "xz", "yz"))
        mass = f'<origin xyz="{xyz}"/><mass value="{draw(0.5, 2.0)}"/><inertia {moments} {products}/>'
        links.append(f'<link name="l{number}"><inertial>{mass}</inertial></link>')
        joints.append(f'<joint name="j{number}" type="fixed"><parent link="base"/><child link="l{number}"/></joint>')
    return f'<robot name="boxes">{"".join((*links, *joints))}</robot>'.encode()


def bits_of_inertias() -> str:
    """Digest of moments and axes of each link, and of all of them as one body."""
    urdf._read.cache_clear()
    robot = urdf.read_urdf("boxes.urdf", {"boxes.urdf": robot_of_boxes()})
    whole = urdf.body_of(robot, "boxes", ORIGIN, UPRIGHT, fixed=False, surface="", speed_limit=1.0).links[0]
    numbers = [number for link in (*robot.links, whole) for number in (*link.inertia, *link.principal)]
    return blake2b(pack(f"<{len(numbers)}d", *numbers), digest_size=8).hexdigest()


def by_lapack(tensor: Tensor) -> Principal:
    """The same moments and axes as rotations give, in the same order and sense, but for the last bits."""
    ours = principal_of(tensor)
    values, vectors = np.linalg.eigh(matrix(tensor))
    order = min(permutations(range(3)), key=lambda order: abs(values[list(order)] - ours.moments).sum())
    axes = [rotate(ours.axes, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
    columns = [vectors[:, number] for number in order]
    columns = [np.copysign(1.0, (one * axis).sum()) * one for one, axis in zip(columns, axes, strict=True)]
    x, y, z = (tuple(column.tolist()) for column in columns)
    return Principal(tuple(values[list(order)].tolist()), quaternion_of((x, y, z)))


def test_inertias_have_the_same_bits_everywhere() -> None:
    assert bits_of_inertias() == BITS


def test_lapack_in_the_inertia_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """It gives the same inertias, to 14 digits: nothing but their bits tells."""
    for tensor in drawn_tensors(50):
        (moments, axes), ours = by_lapack(tensor), principal_of(tensor)
        assert moments == pytest.approx(ours.moments, abs=1e-13 * max(ours.moments))
        assert axes == pytest.approx(ours.axes, abs=1e-9)
    monkeypatch.setattr(urdf_links, "principal_of", by_lapack)
    assert bits_of_inertias() != BITS
    monkeypatch.setattr(urdf_links, "principal_of", principal_of)
    monkeypatch.setattr(urdf, "principal_of", by_lapack)
    assert bits_of_inertias() != BITS

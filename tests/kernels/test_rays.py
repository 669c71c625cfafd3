"""Rays by the kernel and by its twin in numpy: the same bits."""

from __future__ import annotations

import numpy as np
import pytest

from foosim.kernels import C
from foosim.world.rays import casting, shapes
from tests.world.test_rays import among, crowd, somewhere, vectors, ways

pytestmark = pytest.mark.skipif(C is None, reason="no C compiler was there when foosim was installed")


@pytest.mark.parametrize("seed", range(4))
def test_the_kernel_and_numpy_have_the_same_bits(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also of rays along axes, on surfaces, from inside, and of fans of any width."""
    rng = np.random.default_rng(seed)
    things = [*crowd(rng, 70, 3.0), *crowd(rng, 7, 0.0)]
    world = among(*things)
    starts, directions = vectors(rng, 3000, 4.0), ways(rng, 3000)
    axes = np.concatenate((np.eye(3), -np.eye(3)))
    directions[:600] = axes[rng.integers(0, 6, 600)]
    starts[:300] = np.round(starts[:300] * 2.0) / 2.0
    starts[300:400] = np.array([shape.position for shape in things])[rng.integers(0, len(things), 100)]
    for begin, length in ((1000, 40), (1040, 12), (1052, 361), (1500, 1)):
        starts[begin : begin + length] = somewhere(rng, 3.0)
    directions[1052:1413] = np.linspace(directions[1052], directions[1413], 361)
    directions /= np.sqrt((directions * directions).sum(axis=1))[:, None]
    ranges = rng.uniform(0.2, 12.0, 3000)
    ranges[1000:1500] = 9.0
    by_kernel = world.cast(starts, directions, ranges)
    fans = world.fans(starts[::60].T, directions.reshape(50, 60, 3).transpose(2, 0, 1), ranges[::60], np.full(50, -2))
    monkeypatch.setattr(casting, "C", None)
    by_numpy = world.cast(starts, directions, ranges)
    again = world.fans(starts[::60].T, directions.reshape(50, 60, 3).transpose(2, 0, 1), ranges[::60], np.full(50, -2))
    assert by_kernel.distances.tobytes() == by_numpy.distances.tobytes()
    assert (by_kernel.things == by_numpy.things).all()
    assert fans.tobytes() == again.tobytes()
    assert 900 < np.isfinite(by_numpy.distances).sum() < 2900 and (by_numpy.distances == 0.0).sum() > 50


def test_rays_without_a_length_meet_nothing_and_those_without_an_end_meet_what_long_ones_do() -> None:
    rng = np.random.default_rng(9)
    world = among(*crowd(rng, 70, 3.0))
    starts, directions = vectors(rng, 200, 4.0), ways(rng, 200)
    assert (world.cast(starts, directions, 0.0).distances == np.inf).all()
    endless, long = (world.cast(starts, directions, far).distances for far in (np.inf, 1000.0))
    assert (endless == long).all() and np.isfinite(long).sum() > 50


def test_directions_are_turned_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(10)
    turns, directions = rng.normal(size=(4, 30)), rng.normal(size=(30, 20, 3))
    by_kernel = shapes.rotated_each(turns, directions)
    monkeypatch.setattr(shapes, "C", None)
    assert by_kernel.tobytes() == shapes.rotated_each(turns, directions).tobytes()

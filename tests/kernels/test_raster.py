"""The nearest triangle at each pixel: numpy and C have equal bits, and order, bands and company change none."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from foosim.kernels import C, raster
from foosim.kernels.raster import NONE

WIDTH, HEIGHT = 67, 41
NEAR = 0.05
MATRIX = np.array([[33.5, -40.0, 0, 0], [20.5, 0, -40.0, 0], [1.0, 0, 0, 0], [0, 0, 0, 1.0]])
"""Of a camera at the origin that looks along x."""
PARALLEL = np.array([[0, -10.0, 0, 33.0], [0, 0, -10.0, 20.0], [0, 0, 0, 1.0], [-1.0, 0, 0, 0]])

Pictures = tuple[Any, Any]


def soup(seed: int) -> tuple[Any, Any, Any]:
    """Corners, triangles and ranges of triangles of all sizes: before, behind and around the camera, some alike."""
    rng = np.random.default_rng(seed)
    middles = rng.uniform((-1.0, -3.0, -2.0), (6.0, 3.0, 2.0), (90, 1, 3))
    corners = middles + rng.normal(size=(90, 3, 3)) * 10.0 ** rng.uniform(-2.0, 0.0, (90, 1, 1))
    corners[rng.random(90) < 0.03] *= 1e3
    corners[60:] = rng.permutation(corners[:60])[:30]
    triangles = rng.permutation(np.arange(270, dtype=np.int32).reshape(90, 3))
    ends = np.arange(10, 91, 10)
    ranges = np.stack([0 * ends, 0 * ends + 270, ends - 10, ends, rng.integers(0, 2, 9)], axis=1).astype(np.int32)
    return corners.reshape(-1, 3), triangles, ranges


def drawn(parts: tuple[Any, Any, Any], *bands: tuple[int, int], matrix: Any = MATRIX) -> Pictures:
    nearness, numbers = np.full((HEIGHT, WIDTH), -1e30, np.float32), np.full((HEIGHT, WIDTH), NONE, np.int32)
    for band in bands or [(0, HEIGHT)]:
        raster.raster(*parts, matrix, NEAR, band, nearness, numbers)
    return nearness, numbers


def equal(one: Pictures, other: Pictures) -> bool:
    return all(a.tobytes() == b.tobytes() for a, b in zip(one, other, strict=True))


@pytest.mark.skipif(C is None, reason="no C compiler")
@pytest.mark.parametrize("seed", range(12))
def test_numpy_is_c(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(raster, "PIXELS_AT_ONCE", 1 << 10)
    for matrix in (MATRIX, PARALLEL):
        one = drawn(soup(seed), matrix=matrix)
        with monkeypatch.context() as patched:
            patched.setattr(raster, "C", None)
            assert equal(one, drawn(soup(seed), matrix=matrix))
        assert len(np.unique(one[1])) > 5


def test_neither_order_nor_bands_change_a_bit() -> None:
    for seed in range(6):
        corners, triangles, ranges = soup(seed)
        whole = drawn((corners, triangles, ranges))
        shuffled = np.random.default_rng(seed).permutation(ranges)
        assert equal(whole, drawn((corners, triangles, shuffled), (30, HEIGHT), (0, 11), (11, 30)))


def test_triangles_side_by_side_cover_each_pixel_once() -> None:
    """Corners lie on centres of pixels and on edges of others, where a pixel belongs to one of its neighbours."""
    rng = np.random.default_rng(5)
    y, z = np.meshgrid(np.arange(0, 32, 4), np.arange(0, 32, 4))
    inner = (y > 0) & (y < 28) & (z > 0) & (z < 28)
    places = np.stack([0 * y, y, z], axis=-1) + inner[..., None] * (0, 1, 1) * rng.integers(-3, 4, (8, 8, 3)) / 2
    matrix = np.array([[0, 1.0, 0, 0.5], [0, 0, -1.0, 30.5], [0, 0, 0, 1.0], [0, 0, 0, 1.0]])
    count = np.zeros((HEIGHT, WIDTH), int)
    for row in range(7):
        for column in range(7):
            at = [row * 8 + column, row * 8 + column + 1, row * 8 + column + 9, row * 8 + column + 8]
            for triangle in ([at[0], at[1], at[2]], [at[0], at[2], at[3]]):
                parts = places.reshape(-1, 3), np.array([triangle], np.int32), np.array([[0, 64, 0, 1, 1]], np.int32)
                count += drawn(parts, matrix=matrix)[1] != NONE
    assert count.max() == 1
    assert count.sum() == 28 * 28


def test_a_plane_through_the_camera_s_feet_is_as_far_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """A floor of 2 km whose corners are behind the camera and millions of pixels beside the picture."""
    corners = np.array([[-1e3, -1e3, -0.02], [1e3, -1e3, -0.02], [1e3, 1e3, -0.02], [-1e3, 1e3, -0.02]])
    triangles, ranges = np.array([[0, 1, 2], [0, 2, 3]], np.int32), np.array([[0, 4, 0, 2, 0]], np.int32)
    for compiled in (C, None):
        monkeypatch.setattr(raster, "C", compiled)
        nearness, numbers = np.zeros((HEIGHT, WIDTH), np.float32), np.full((HEIGHT, WIDTH), NONE, np.int32)
        raster.raster(corners, triangles, ranges, MATRIX, 1e-3, (0, HEIGHT), nearness, numbers)
        down = (np.arange(HEIGHT) + 0.5 - 20.5) / 40.0
        below = down > 0.0
        assert (numbers[below] != NONE).all() and (numbers[down < 0.0] == NONE).all()
        # Within the step of 1/256 pixel that corners are rounded to.
        assert np.abs(0.02 * nearness[below] - down[below, None]).max() < 1 / 256 / 40

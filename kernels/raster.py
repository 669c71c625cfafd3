"""The nearest triangle at each pixel, in numpy and in C with equal bits.

A corner goes through the 4 rows of a matrix to x, y, w, z: its pixel is (x / w, y / w), rows downwards, its nearness
z / w. From there on pixels are integers of 1/256, so which centres a triangle covers has no rounding. The nearness is
a plane over the triangle in float64, rounded to float32 for the comparison; the lower number wins among equals. So no
order of triangles, no band of rows and no process changes a bit.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from foosim.kernels import C

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Corners = list[list[float]]

NONE: Final = -1
"""The number where no triangle is."""
GUARD: Final = 1048576.0
"""Pixels about the picture beyond which triangles are clipped: products of integers stay below 2^63."""
PIXELS_AT_ONCE: Final = 1 << 15
"""Their arrays stay in a cache."""


def raster(
    world: Floats,
    triangles: NDArray[np.int32],
    ranges: NDArray[np.int32],
    matrix: Floats,
    near: float,
    rows: tuple[int, int],
    nearness: NDArray[np.float32],
    numbers: NDArray[np.int32],
) -> None:
    """Draw triangles where they are nearer than what is there: into `nearness` and `numbers` (height, width).

    `world` (v, 3) are corners (m), `triangles` (t, 3) their numbers, counter-clockwise from outside. A row of `ranges`
    (n, 5) is a run of corners (first, end), the run of triangles that they are of, and whether those are seen from both
    sides. `matrix` is (4, 4); what has w < `near` is not drawn. `rows` are the first and the end of those drawn.
    """
    height, width = numbers.shape
    if C is not None:
        C.raster(world, triangles, ranges, matrix, near, width, height, *rows, nearness, numbers)
        return
    which = runs(ranges[:, 2], ranges[:, 3])
    both = np.repeat(ranges[:, 4] != 0, ranges[:, 3] - ranges[:, 2])
    x, y, z = world.T
    clip = np.stack([m[0] * x + m[1] * y + m[2] * z + m[3] for m in matrix])[:, triangles[which]]
    x, y, w, _ = clip
    out = (w < near).all(1) | (x < 0.0).all(1) | (y < 0.0).all(1)
    out |= (x > width * w).all(1) | (y > height * w).all(1)
    guard = GUARD * w
    plain = ((w >= near) & (np.abs(x) <= guard) & (np.abs(y) <= guard)).all(1)
    whole = np.flatnonzero(plain & ~out)
    of, found = [whole], [clip[:, whole]]
    for number in np.flatnonzero(~plain & ~out):
        polygon = _clipped(clip[:, number].T.tolist(), near)
        fan = [[polygon[0], *polygon[i : i + 2]] for i in range(1, len(polygon) - 1)]
        of.append(np.full(len(fan), number))
        found.append(np.array(fan).reshape(-1, 3, 4).transpose(2, 0, 1))
    x, y, w, z = np.concatenate(found, axis=1)
    which, both = which[np.concatenate(of)], both[np.concatenate(of)]
    d = 1.0 / w
    on_x, on_y = (np.floor(c * d * 256.0 + 0.5).astype(np.int64) for c in (x, y))
    _fill(on_x, on_y, z * d, both, which, rows, nearness, numbers)


def runs(begins: NDArray[np.integer], ends: NDArray[np.integer]) -> Ints:
    """Return the integers of runs (first, end), one after the other."""
    counts = ends.astype(np.int64) - begins
    return np.repeat(begins - (np.cumsum(counts) - counts), counts) + np.arange(counts.sum())


def _clipped(polygon: Corners, near: float) -> Corners:
    """Return a polygon (x, y, w, z) clipped by near and guard planes, always from the corner inside."""
    for plane in range(5):
        kept: Corners = []
        distances = [_inside(corner, plane, near) for corner in polygon]
        for i, p in enumerate(polygon):
            q, dp, dq = polygon[i + 1 - len(polygon)], distances[i], distances[i + 1 - len(polygon)]
            if dp >= 0.0:
                kept.append(p)
            if (dp >= 0.0) != (dq >= 0.0):
                if dp < 0.0:
                    p, q, dp, dq = q, p, dq, dp  # noqa: PLW2901
                k = dp / (dp - dq)
                kept.append([a + (b - a) * k for a, b in zip(p, q, strict=True)])
        polygon = kept
    return polygon


def _inside(corner: list[float], plane: int, near: float) -> float:
    x, y, w, _ = corner
    if plane == 0:
        return w - near
    far, at = GUARD * w, x if plane < 3 else y
    return far + at if plane % 2 else far - at


def _fill(
    x: Ints,
    y: Ints,
    near: Floats,
    both: NDArray[np.bool_],
    which: Ints,
    rows: tuple[int, int],
    nearness: NDArray[np.float32],
    numbers: NDArray[np.int32],
) -> None:
    """Draw triangles with corners (n, 3) in 1/256 pixels."""
    width = numbers.shape[1]
    area = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0])
    turned = area < 0
    for array in (x, y, near):
        array[turned, 1], array[turned, 2] = array[turned, 2], array[turned, 1]
    left = np.maximum((x.min(1) + 127) >> 8, 0)
    right = np.minimum((x.max(1) - 128) >> 8, width - 1)
    top = np.maximum((y.min(1) + 127) >> 8, rows[0])
    bottom = np.minimum((y.max(1) - 128) >> 8, rows[1] - 1)
    kept = (turned | (both & (area > 0))) & (left <= right) & (top <= bottom)
    x, y, near, which, area = x[kept], y[kept], near[kept], which[kept], np.abs(area[kept])
    left, right, top, bottom = left[kept], right[kept], top[kept], bottom[kept]

    inverse, z0 = 1.0 / area.astype(np.float64), near[:, 0]
    ax, ay, bx, by = ((c[:, i] - c[:, 0]).astype(np.float64) for i in (1, 2) for c in (x, y))
    z1, z2 = near[:, 1] - z0, near[:, 2] - z0
    slope_x, slope_y = (z1 * by - z2 * ay) * inverse * 256.0, (z2 * ax - z1 * bx) * inverse * 256.0
    from_x, from_y = (c[:, 0].astype(np.float64) / 256.0 - 0.5 for c in (x, y))

    of, row = np.repeat(np.arange(len(which)), bottom - top + 1), runs(top, bottom + 1)
    start, end = left[of], right[of]
    for i in range(3):
        j = (i + 1) % 3
        da, db = y[:, i] - y[:, j], x[:, j] - x[:, i]
        owns = (da > 0) | ((da == 0) & (db > 0))
        c = 128 * (da + db) - da * x[:, i] - db * y[:, i] - ~owns
        edge, a = (256 * db)[of] * row + c[of], (256 * da)[of]
        np.maximum(start, -(edge // np.where(a > 0, a, 1)), out=start, where=a > 0)
        np.minimum(end, edge // np.where(a < 0, -a, 1), out=end, where=a < 0)
        end[(a == 0) & (edge < 0)] = -1
    kept = start <= end
    of, row, start, end = of[kept], row[kept], start[kept], end[kept]
    base = z0[of] + slope_y[of] * (row.astype(np.float64) - from_y[of])
    slope_x, from_x, which = slope_x[of], from_x[of], which[of]

    counts = np.cumsum(end - start + 1)
    cuts = np.searchsorted(counts, np.arange(0, max(counts.max(initial=0), 1), PIXELS_AT_ONCE))
    for first, last in zip(cuts, [*cuts[1:], len(of)], strict=True):
        part = slice(first, last)
        span = np.repeat(np.arange(first, last), end[part] - start[part] + 1)
        column = runs(start[part], end[part] + 1)
        z = (base[span] + slope_x[span] * (column.astype(np.float64) - from_x[span])).astype(np.float32)
        _keep_nearest(row[span] * width + column, z, which[span], nearness.reshape(-1), numbers.reshape(-1))


def _keep_nearest(
    pixels: Ints, z: NDArray[np.float32], which: Ints, nearness: NDArray[np.float32], numbers: NDArray[np.int32]
) -> None:
    """Put triangles at pixels where they are nearer, or as near and of a lower number."""
    before = nearness[pixels]
    np.maximum.at(nearness, pixels, z)
    now = nearness[pixels]
    numbers[pixels[now > before]] = np.iinfo(np.int32).max
    best = z == now
    np.minimum.at(numbers, pixels[best], which[best].astype(np.int32))

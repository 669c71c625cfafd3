"""Which pixels shapes cover, seen from straight above. Outlines are in pixels: x to the right, y down.

A box is the sum of three segments, so what it covers are the places between three pairs of parallel lines. What is
round is a disc or a sphere moved along a segment: along the segment and beside it, two numbers say whether a place is
covered. A pixel is covered when its middle is.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, floor
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

Numbers: TypeAlias = NDArray[np.float64]
Places: TypeAlias = NDArray[np.intp]
"""Pixels by row * width + column."""


EDGE: Final = 1e-9
"""What is so little beyond the edge of a triangle, as a share of it, is covered: neighbours leave no gap."""


class Windows:
    """Windows of one size around some middles, (n, 2): the distances of their pixels' middles from these, and which
    pixels they are. They are moved into the picture, and none is larger, however close what it shows is."""

    def __init__(self, middles: Numbers, half: Numbers, width: int, height: int) -> None:
        """`half` is half of the size of a window in x and y."""
        columns = min(ceil(2 * float(half[0])) + 1, width)
        rows = min(ceil(2 * float(half[1])) + 1, height)
        left = np.clip(np.floor(middles[:, 0] - half[0]), 0, width - columns).astype(np.intp)
        top = np.clip(np.floor(middles[:, 1] - half[1]), 0, height - rows).astype(np.intp)
        self._column = left[:, None] + np.arange(columns)
        self._row = top[:, None] + np.arange(rows)
        self.dx: Numbers = (self._column + 0.5 - middles[:, :1])[:, None, :]
        self.dy: Numbers = (self._row + 0.5 - middles[:, 1:])[:, :, None]
        self._width = width

    def places(self, covered: NDArray[np.bool_]) -> tuple[NDArray[np.intp], Places]:
        """Return the covered pixels: the numbers of their shapes and of the pixels in the picture."""
        which, row, column = covered.nonzero()
        return which, self._row[which, row] * self._width + self._column[which, column]


def covered_by_boxes(windows: Windows, sides: Numbers) -> NDArray[np.bool_]:
    """Return which pixels are covered by boxes with these half sides, (n, 3, 2)."""
    covered: NDArray[np.bool_] | None = None
    for one in range(3):
        x, y = sides[:, one, 0], sides[:, one, 1]
        reach = sum(np.abs(x * sides[:, other, 1] - y * sides[:, other, 0]) for other in range(3) if other != one)
        between = (
            np.abs(x[:, None, None] * windows.dy - y[:, None, None] * windows.dx) <= np.asarray(reach)[:, None, None]
        )
        covered = between if covered is None else covered & between
    assert covered is not None
    return covered


def covered_by_rounds(
    windows: Windows, along: Numbers, length: Numbers, radius: Numbers, flat: Numbers
) -> NDArray[np.bool_]:
    """Return which pixels are covered by round shapes.

    `along` are unit vectors (n, 2), `length` half the segment's, seen from above; `flat` is how much of the radius an
    end rounds off along it: 1 of a sphere, and of a disc the sine of its tilt.
    """
    x, y = along[:, 0, None, None], along[:, 1, None, None]
    way = np.abs(x * windows.dx + y * windows.dy)
    aside = x * windows.dy - y * windows.dx
    left = radius[:, None, None] ** 2 - aside * aside
    covered: NDArray[np.bool_] = (left >= 0.0) & (
        way <= length[:, None, None] + flat[:, None, None] * np.sqrt(np.maximum(left, 0.0))
    )
    return covered


def covered_by_corners(corners: Numbers, width: int, height: int) -> Places:
    """Return the pixels that the convex hull of some corners, (n, 2), covers."""
    hull = hull_of(corners.tolist())
    if len(hull) < 3:
        return np.empty(0, np.intp)
    xs, ys = [x for x, _ in hull], [y for _, y in hull]
    left, right = max(floor(min(xs)), 0), min(ceil(max(xs)), width)
    top, bottom = max(floor(min(ys)), 0), min(ceil(max(ys)), height)
    if left >= right or top >= bottom:
        return np.empty(0, np.intp)
    x, y = np.arange(left, right) + 0.5, (np.arange(top, bottom) + 0.5)[:, None]
    covered = np.ones((bottom - top, right - left), np.bool_)
    for (ax, ay), (bx, by) in zip(hull, [*hull[1:], hull[0]], strict=True):
        covered &= (bx - ax) * (y - ay) - (by - ay) * (x - ax) >= 0.0
    row, column = covered.nonzero()
    return (row + top) * width + column + left


def surface_of(
    corners: Numbers, triangles: NDArray[np.int32], width: int, height: int
) -> tuple[Places, NDArray[np.float64]]:
    """Return the pixels that triangles (m, 3) cover, and the height of the highest triangle at the middle of each.

    `corners`, (n, 3), are in pixels and heights, m.
    """
    heights = np.full((height, width), -np.inf)
    size = (width, height)
    of_each = corners[triangles]
    first = np.clip(np.ceil(of_each[:, :, :2].min(axis=1) - 0.5), 0, size).astype(np.intp)
    end = np.clip(np.floor(of_each[:, :, :2].max(axis=1) - 0.5) + 1.0, 0, size).astype(np.intp)
    for one in np.flatnonzero((first < end).all(axis=1)):
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = of_each[one].tolist()
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if abs(area) < EDGE:
            continue  # upright, or without an area
        (left, top), (right, bottom) = first[one].tolist(), end[one].tolist()
        x, y = np.arange(left, right) + 0.5 - ax, (np.arange(top, bottom) + 0.5 - ay)[:, None]
        of_b = (x * (cy - ay) - y * (cx - ax)) / area
        of_c = (y * (bx - ax) - x * (by - ay)) / area
        is_covered = (of_b >= -EDGE) & (of_c >= -EDGE) & (of_b + of_c <= 1.0 + EDGE)
        found = np.where(is_covered, az + of_b * (bz - az) + of_c * (cz - az), -np.inf)
        window = heights[top:bottom, left:right]
        np.maximum(window, found, out=window)
    places = np.flatnonzero(heights > -np.inf)
    return places, heights.ravel()[places]


def hull_of(corners: Sequence[Sequence[float]]) -> list[tuple[float, float]]:
    """Return the convex hull of points, in the order in which x turns to y (Andrew's monotone chain, 1979)."""
    points = sorted({(x, y) for x, y in corners})
    if len(points) < 3:
        return points
    lower, upper = _chain(points), _chain(points[::-1])
    return [*lower[:-1], *upper[:-1]]


def _chain(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    chain: list[tuple[float, float]] = []
    for x, y in points:
        while len(chain) > 1:
            (ax, ay), (bx, by) = chain[-2], chain[-1]
            if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0.0:
                break
            chain.pop()
        chain.append((x, y))
    return chain

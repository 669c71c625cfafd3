"""Which pixels shapes cover, seen from straight above. Outlines are in pixels: x to the right, y down.

A box is the sum of three segments, so what it covers are the places between three pairs of parallel lines. What is
round is a disc or a sphere moved along a segment: along the segment and beside it, two numbers say whether a place is
covered. A pixel is covered when its middle is.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, floor
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Numbers: TypeAlias = NDArray[np.float64]
Places: TypeAlias = NDArray[np.intp]
"""Pixels by row * width + column."""


class Windows:
    """Windows of one size around some middles, (n, 2): the distances of their pixels' middles from these, and which
    pixels they are."""

    def __init__(self, middles: Numbers, half: Numbers, width: int, height: int) -> None:
        """`half` is half of the size of a window in x and y."""
        columns, rows = ceil(2 * float(half[0])) + 1, ceil(2 * float(half[1])) + 1
        left = np.floor(middles[:, 0] - half[0]).astype(np.intp)
        top = np.floor(middles[:, 1] - half[1]).astype(np.intp)
        self._column = left[:, None] + np.arange(columns)
        self._row = top[:, None] + np.arange(rows)
        self.dx: Numbers = (self._column + 0.5 - middles[:, :1])[:, None, :]
        self.dy: Numbers = (self._row + 0.5 - middles[:, 1:])[:, :, None]
        inside_x = (self._column >= 0) & (self._column < width)
        inside_y = (self._row >= 0) & (self._row < height)
        self._width = width
        self._is_whole = bool(inside_x.all() and inside_y.all())
        self._inside = None if self._is_whole else inside_y[:, :, None] & inside_x[:, None, :]

    def places(self, covered: NDArray[np.bool_]) -> tuple[NDArray[np.intp], Places]:
        """Return the covered pixels of the picture: whose each is, and which it is."""
        if self._inside is not None:
            covered = covered & self._inside
        which, row, column = covered.nonzero()
        return which, self._row[which, row] * self._width + self._column[which, column]


def covered_by_boxes(windows: Windows, sides: Numbers) -> NDArray[np.bool_]:
    """Return which pixels boxes cover whose half sides are these, (n, 3, 2)."""
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
    """Return which pixels are covered by what is round.

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

"""Shadows: a picture from the sun, of how near to it the first thing is."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from foosim.kernels.raster import Floats
from foosim.rendering.light import Floats32
from foosim.rendering.model import SUN
from foosim.rendering.view import View
from foosim.world.scene import Vector

SIZE: Final = 1024
"""Columns and rows of the picture from the sun."""
RIGHT: Final[Vector] = (0.6, -0.8, 0.0)
DOWN: Final[Vector] = (-0.8 * SUN[2], -0.6 * SUN[2], 0.48)
"""Directions of its columns and rows, at right angles to the sun's."""
SMALL_M: Final = 4.0
"""A world within this distance of its middle has its shadows everywhere."""
REACH_M: Final = 8.0
"""In any other they are this far around a place in front of the camera, and that is on a grid of `GRID_M`."""
GRID_M: Final = 2.0
LEAST: Final = np.float32(0.15)


def sun_view(middle: Vector, reach: float) -> View:
    """Return the view from the sun of what is within `reach` of a place (m, world frame)."""
    scale = 0.5 * SIZE / reach
    rows = []
    for axis in (RIGHT, DOWN):
        row = [scale * a for a in axis]
        rows += [*row, 0.5 * SIZE - (row[0] * middle[0] + row[1] * middle[1] + row[2] * middle[2])]
    return View((*rows, 0.0, 0.0, 0.0, 1.0, *SUN, 0.0), (), 1.0 / scale, 0.0, -1e30, SIZE, SIZE)


def sun_over(view: View, bounds: tuple[Vector, float], far: float) -> View:
    """Return the view from the sun whose shadows are seen in a view, of a world within `bounds`, middle and radius."""
    if bounds[1] <= SMALL_M:
        return sun_view(*bounds)
    reach = min(far, REACH_M)
    m = view.matrix
    ahead = [view.rays[i] + 0.5 * reach * m[8 + i] for i in range(3)]
    x, y, z = np.floor(np.array(ahead) / GRID_M + 0.5) * GRID_M
    return sun_view((float(x), float(y), float(z)), reach)


def hidden(
    view: View,
    sun: View,
    shadows: NDArray[np.float32],
    facing: Floats32,
    depth: Floats32,
    columns: Floats32,
    rows: Floats32,
) -> Floats32:
    """Return the share of the sun that is hidden from what is seen at pixels, at this depth (m) along the axis.

    `shadows` is the nearness of the view `sun`.
    """
    eye, first, across, down = np.array(view.rays).reshape(4, 3)
    places = []
    for row in (sun.matrix[0:4], sun.matrix[4:8], sun.matrix[12:16]):
        start, a, b = (np.float32(_along(row, way)) for way in (first, across, down))
        places.append(np.float32(_along(row, eye) + row[3]) + depth * (start + a * columns + b * rows))
    x, y, z = np.stack(places)
    # A surface aslant to the sun has more of its height within a pixel of the sun's picture.
    z = z + np.float32(1.5 * sun.pixel) / np.maximum(facing, LEAST)
    left, top = np.floor(x - np.float32(0.5)), np.floor(y - np.float32(0.5))
    right, below = x - np.float32(0.5) - left, y - np.float32(0.5) - top
    limit = np.float32(SIZE - 2)
    is_in = (left >= 0.0) & (left <= limit) & (top >= 0.0) & (top <= limit)
    place = np.where(is_in, top, 0.0).astype(np.int32) * SIZE + np.where(is_in, left, 0.0).astype(np.int32)
    shadows = shadows.reshape(-1)
    one = np.float32(1.0)
    share = np.zeros(len(x), np.float32)
    for step, weight in enumerate(
        ((one - right) * (one - below), right * (one - below), (one - right) * below, right * below)
    ):
        share += weight * (shadows[place + (step // 2 * SIZE + step % 2)] > z)
    return np.where(is_in, share, np.float32(0.0))


def _along(row: tuple[float, ...], way: Floats) -> float:
    return float(row[0] * way[0] + row[1] * way[1] + row[2] * way[2])

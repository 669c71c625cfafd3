"""Light and sky: a sun that is far away, light from everywhere, and what is seen where nothing is.

What a surface of a colour looks like depends on its facing alone, the cosine between its normal and the sun. Between
the corners of a triangle the facing is the ratio of two planes over the picture, which perspective makes of it.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from foosim.kernels.raster import Floats, Ints
from foosim.rendering.view import View

Floats32 = NDArray[np.float32]
Picture = NDArray[np.uint8]
"""Red, green, blue and one byte unused, by pixel in a row."""

AROUND: Final = np.float32(0.52)
TILT: Final = np.float32(0.12)
"""How much more of the light around reaches what faces the sun."""
DIRECT: Final = np.float32(0.5)
HORIZON: Final = np.array([206, 216, 228], np.float32)
ZENITH: Final = np.array([116, 156, 210], np.float32)
BELOW: Final = np.array([128, 130, 132], np.float32)
DOWN: Final = -0.01
"""The part along z of directions, 1 along the axis, that are below the horizon with any rounding."""


def coloured(colours: Floats32, facing: Floats32, hidden: Floats32 | None = None) -> Picture:
    """Return what surfaces of these colours (n, 3) look like; `hidden` (n,) is the share of the sun that is hidden."""
    sun = DIRECT * np.maximum(facing, np.float32(0.0))
    if hidden is not None:
        sun *= np.float32(1.0) - hidden
    light = AROUND + TILT * facing + sun
    made = np.zeros((len(colours), 4), np.uint8)
    for channel in range(3):
        made[:, channel] = np.minimum(colours[:, channel] * light + np.float32(0.5), np.float32(255.0))
    return made


def facing_at(corners: Floats, facings: Floats, which: Ints, columns: Floats32, rows: Floats32) -> Floats32:
    """Return how pixels face the sun. `corners` (t, 3, 3) are x, y, w of the corners of triangles (the pixel is
    (x / w, y / w)), `facings` (t, 3) theirs, `which` (n,) the triangle that is at a pixel's place (n,)."""
    planes = np.zeros((6, len(corners)))
    for i in range(3):
        (xj, yj, wj), (xk, yk, wk) = corners[:, i - 2].T, corners[:, i - 1].T
        for n, part in enumerate((yj * wk - wj * yk, wj * xk - xj * wk, xj * yk - yj * xk)):
            planes[n] += part * facings[:, i]
            planes[3 + n] += part
    a, b, c, d, e, f = planes.astype(np.float32)
    above = a[which] * columns + b[which] * rows + c[which]
    below = np.abs(d[which] * columns + e[which] * rows + f[which])
    # From behind a surface faces the other way: there both planes have the other sign.
    return np.clip(-above / np.maximum(below, np.float32(1e-30)), np.float32(-1.0), np.float32(1.0))


def sky(view: View) -> NDArray[np.uint32]:
    """Return what is seen of a view where nothing is, (height, width), each a `Picture`'s four bytes: (1,) where
    all is below the horizon."""
    _, first, across, down = np.array(view.rays).reshape(4, 3)
    columns, rows = np.arange(view.width) + 0.5, np.arange(view.height)[:, np.newaxis] + 0.5
    by_column, by_row = (first[2] + across[2] * columns).astype(np.float32), (down[2] * rows).astype(np.float32)
    if by_column.max() + by_row.max() < DOWN:
        return SKY[:1]
    up = by_column + by_row
    # Directions by column and by row are at right angles to the axis, along which all are 1 long.
    aside, below = columns - 0.5 * view.width, rows - 0.5 * view.height
    square = np.float32(view.pixel) * np.float32(view.pixel)
    length = (aside * aside).astype(np.float32) + (below * below).astype(np.float32)
    height = up / np.sqrt(length * square + np.float32(1.0))
    return np.asarray(SKY.take((height * np.float32(256.0) + np.float32(256.0)).astype(np.int16), mode="clip"))


_SHARES: Final = np.arange(257, dtype=np.float32)[:, np.newaxis] / np.float32(256.0)
_COLOURS: Final = np.zeros((513, 4), np.uint8)
_COLOURS[256:, :3] = HORIZON + (ZENITH - HORIZON) * _SHARES + np.float32(0.5)
_COLOURS[:256, :3] = BELOW
SKY: Final = _COLOURS.view(np.uint32).reshape(-1)
"""The colours of directions by (1 + their part along z) * 256."""

"""A view: where points of the world are in a picture, and the direction that is seen at a pixel."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foosim.common import exact_math
from foosim.kernels.raster import Floats
from foosim.rendering.model import rotations
from foosim.world.scene import Quaternion, Vector


class View(NamedTuple):
    """`matrix` has the rows x, y, w, z of the kernel. `rays` are the eye (m), the direction at column 0 and row 0, and
    its change by column and by row: 1 along the axis; `pixel` is the length of a change. Nothing is seen that is nearer
    than `near` or whose nearness is `start` or less."""

    matrix: tuple[float, ...]
    rays: tuple[float, ...]
    pixel: float
    near: float
    start: float
    width: int
    height: int


def focal_length(fov: float, width: int) -> float:
    """Return the focal length in pixels of a horizontal angle of view."""
    return 0.5 * width / exact_math.tan(0.5 * fov)


def view_of(
    position: Vector, orientation: Quaternion, focal: float, width: int, height: int, near: float, far: float
) -> View:
    """Return the view of a camera at a pose, whose focal length is in pixels."""
    m = rotations(np.array(orientation, np.float64)).tolist()
    ahead, left, up = m[0::3], m[1::3], m[2::3]
    cx, cy = 0.5 * width, 0.5 * height
    rows = []
    for along, across, scale in ((cx, left, focal), (cy, up, focal), (1.0, up, 0.0)):
        row = [along * a - scale * b for a, b in zip(ahead, across, strict=True)]
        rows += [*row, -(row[0] * position[0] + row[1] * position[1] + row[2] * position[2])]
    corner = [a + (cx * b + cy * c) / focal for a, b, c in zip(ahead, left, up, strict=True)]
    rays = (*position, *corner, *(-b / focal for b in left), *(-c / focal for c in up))
    return View((*rows, 0.0, 0.0, 0.0, 1.0), rays, 1.0 / focal, near, 1.0 / far, width, height)


def in_view(view: View, centres: Floats, radii: Floats) -> NDArray[np.bool_]:
    """Return which spheres (n, 3), (n,) touch the view."""
    x, y, z = centres.T
    rows = np.array(view.matrix).reshape(4, 4)
    w = rows[2]
    planes = [rows[0], view.width * w - rows[0], rows[1], view.height * w - rows[1]]
    planes += [w - (0.0, 0.0, 0.0, view.near), rows[3] - view.start * w]
    seen = np.ones(len(centres), np.bool_)
    for a, b, c, d in planes:
        seen &= a * x + b * y + c * z + d >= -radii * np.sqrt(a * a + b * b + c * c)
    return seen

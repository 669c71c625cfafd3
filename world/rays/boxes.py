"""Axis-aligned boxes around things, and the boxes that a line meets: candidates for an exact look."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foosim.world.scene import Vector

Floats: TypeAlias = NDArray[np.float64]

MARGIN_M: Final = 1e-6
"""The margin of boxes of candidates (m): far more than rounding, far less than any thing."""
STEP_MIN: Final = 1e-30
"""The least part of a direction for boxes of candidates: no division overflows."""


def boxes_around(
    lows: Sequence[Vector] | Floats, highs: Sequence[Vector] | Floats, margin_m: float = MARGIN_M
) -> Floats:
    """Return boxes (m of them) for `boxes_met_by`, shape (2, 3, m), with a margin."""
    boxes = np.array([lows, highs], dtype=np.float64).reshape(2, -1, 3)
    boxes[0] -= margin_m
    boxes[1] += margin_m
    return np.ascontiguousarray(boxes.transpose(0, 2, 1))


def boxes_met_by(boxes: Floats, line: tuple[Vector, Vector]) -> list[int]:
    """Return the boxes (2, 3, m) that a line meets.

    These are candidates: a box that a line misses by up to a margin may be among them.
    """
    first, last = between_sides(boxes, *as_columns(line[0], [b - a for a, b in zip(*line, strict=True)]))
    met: list[int] = (np.maximum(first, -MARGIN_M) <= np.minimum(last, 1.0 + MARGIN_M)).nonzero()[0].tolist()
    return met


def as_columns(start: Vector, way: Sequence[float]) -> tuple[Floats, Floats]:
    """Return a start and a way as columns, with parts of the way large enough to divide by."""
    steps = [STEP_MIN if abs(part) < STEP_MIN else part for part in way]
    return np.array(start)[:, None], np.array(steps)[:, None]


def between_sides(boxes: Floats, start: Floats, step: Floats) -> tuple[Floats, Floats]:
    """Return the span of each box (2, 3, m) on a line, as multiples of `step` from `start` (columns)."""
    sides = (boxes - start) / step
    first = np.maximum.reduce(np.minimum(sides[0], sides[1]))
    last = np.minimum.reduce(np.maximum(sides[0], sides[1]))
    return first, last

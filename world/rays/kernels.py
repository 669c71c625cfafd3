"""Spans of many straight lines inside of boxes, spheres, cylinders and capsules, each in the frame of its shape.

These are the functions of `spans` for arrays, with the same bits. Starts and
unit ways have the shape (3, n), sizes (n,) or (3, n). A span that is empty has its end before its beginning.
"""

from __future__ import annotations

import numpy as np

from foosim.world.rays.boxes import Floats

Spans = tuple[Floats, Floats]
"""The places at which lines enter and leave a shape (m); inf and -inf for a miss."""


def box_spans(starts: Floats, ways: Floats, half: Floats) -> Spans:
    """Return where lines are inside of boxes, centred, with half of their lengths (3, n)."""
    one, other = (-half - starts) / ways, (half - starts) / ways
    near, far = np.minimum(one, other), np.maximum(one, other)
    flat = ways == 0.0
    if flat.any():
        inside = (-half < starts) & (starts < half)
        near = np.where(flat, np.where(inside, -np.inf, np.inf), near)
        far = np.where(flat, np.where(inside, np.inf, -np.inf), far)
    enter, leave = np.maximum(np.maximum(near[0], near[1]), near[2]), np.minimum(np.minimum(far[0], far[1]), far[2])
    return _or_missed(enter < leave, enter, leave)


def sphere_spans(starts: Floats, ways: Floats, radii: Floats) -> Spans:
    """Return where lines are inside of spheres, centred."""
    (x, y, z), (dx, dy, dz) = starts, ways
    middle = -(x * dx + y * dy + z * dz)
    x, y, z = x + middle * dx, y + middle * dy, z + middle * dz
    rest = radii * radii - (x * x + y * y + z * z)
    half = np.sqrt(np.maximum(rest, 0.0))
    return _or_missed(rest > 0.0, middle - half, middle + half)


def cylinder_spans(starts: Floats, ways: Floats, radii: Floats, half_lengths: Floats) -> Spans:
    """Return where lines are inside of cylinders, centred, whose axes are z."""
    (x, y, z), (dx, dy, dz) = starts, ways
    across = dx * dx + dy * dy
    upright = across == 0.0
    is_some_upright = bool(upright.any())
    divisor = np.where(upright, 1.0, across) if is_some_upright else across
    middle = -(x * dx + y * dy) / divisor
    x, y = x + middle * dx, y + middle * dy
    rest = radii * radii - (x * x + y * y)
    half = np.sqrt(np.maximum(rest, 0.0) / divisor)
    inside = rest > 0.0
    enter, leave = middle - half, middle + half
    if is_some_upright:
        enter, leave = np.where(upright, -np.inf, enter), np.where(upright, np.inf, leave)
    level = dz == 0.0
    if level.any():
        inside &= ~level | ((-half_lengths < z) & (z < half_lengths))
    if not level.all():
        one, other = (-half_lengths - z) / dz, (half_lengths - z) / dz
        enter = np.maximum(enter, np.where(level, -np.inf, np.minimum(one, other)))
        leave = np.minimum(leave, np.where(level, np.inf, np.maximum(one, other)))
    return _or_missed(inside & (enter < leave), enter, leave)


def capsule_spans(starts: Floats, ways: Floats, radii: Floats, half_lengths: Floats) -> Spans:
    """Return where lines are inside of capsules, centred, whose axes are z."""
    enter, leave = cylinder_spans(starts, ways, radii, half_lengths)
    x, y, z = starts
    for ends in (-half_lengths, half_lengths):
        first, last = sphere_spans(np.stack((x, y, z - ends)), ways, radii)
        enter, leave = np.minimum(enter, first), np.maximum(leave, last)
    return enter, leave


def _or_missed(is_hit: np.ndarray[tuple[int, ...], np.dtype[np.bool_]], enter: Floats, leave: Floats) -> Spans:
    return np.where(is_hit, enter, np.inf), np.where(is_hit, leave, -np.inf)

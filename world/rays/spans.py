"""Spans of a straight line inside of a box, a sphere, a cylinder or a capsule, in the frame of that shape.

A line is a start and a unit direction; places on it are metres from the start. A line that touches a face, an edge or
a corner is not inside. All of it is + - * / and `sqrt` on plain floats; `kernels` has the same for arrays, with the
same bits. Sources: slabs of a box, Kay and Kajiya, "Ray tracing complex scenes" (SIGGRAPH 1986); spheres and cylinders
by the point nearest to the axis (Haines et al., "Precision improvements for ray/sphere intersection", Ray Tracing Gems,
2019). Neighbours: `triangles`, for meshes, and `solids`, which puts shapes into the world.
"""

from __future__ import annotations

from math import inf, sqrt

from foosim.world.scene import Vector

Span = tuple[float, float]
"""The places at which a line enters and leaves a shape (m)."""


def box_span(start: Vector, way: Vector, half: Vector) -> Span | None:
    """Return where a line is inside of a box, centred, with half of its lengths."""
    (x, y, z), (dx, dy, dz), (side_x, side_y, side_z) = start, way, half
    # Written out for each axis, as a loop over them costs several times as much.
    enter, leave = -inf, inf
    if dx != 0.0:
        enter, leave = (-side_x - x) / dx, (side_x - x) / dx
        if dx < 0.0:
            enter, leave = leave, enter
    elif not -side_x < x < side_x:
        return None
    if dy != 0.0:
        one, other = (-side_y - y) / dy, (side_y - y) / dy
        if dy < 0.0:
            one, other = other, one
        enter = one if one > enter else enter  # three times as fast as max
        leave = other if other < leave else leave
    elif not -side_y < y < side_y:
        return None
    if enter >= leave:
        return None
    if dz != 0.0:
        one, other = (-side_z - z) / dz, (side_z - z) / dz
        if dz < 0.0:
            one, other = other, one
        enter = one if one > enter else enter
        leave = other if other < leave else leave
    elif not -side_z < z < side_z:
        return None
    return (enter, leave) if enter < leave else None


def sphere_span(start: Vector, way: Vector, radius: float) -> Span | None:
    """Return where a line is inside of a sphere, centred."""
    x, y, z = start
    dx, dy, dz = way
    middle = -(x * dx + y * dy + z * dz)
    x, y, z = x + middle * dx, y + middle * dy, z + middle * dz
    rest = radius * radius - (x * x + y * y + z * z)
    if rest <= 0.0:
        return None
    half = sqrt(rest)
    return middle - half, middle + half


def cylinder_span(start: Vector, way: Vector, radius: float, half_length: float) -> Span | None:
    """Return where a line is inside of a cylinder, centred, whose axis is z."""
    x, y, z = start
    dx, dy, dz = way
    across = dx * dx + dy * dy
    enter, leave = -inf, inf
    if across == 0.0:
        if x * x + y * y >= radius * radius:
            return None
    else:
        middle = -(x * dx + y * dy) / across
        x, y = x + middle * dx, y + middle * dy
        rest = radius * radius - (x * x + y * y)
        if rest <= 0.0:
            return None
        half = sqrt(rest / across)
        enter, leave = middle - half, middle + half
    if dz == 0.0:
        return (enter, leave) if -half_length < z < half_length else None
    one, other = (-half_length - z) / dz, (half_length - z) / dz
    if one > other:
        one, other = other, one
    enter, leave = max(enter, one), min(leave, other)
    return (enter, leave) if enter < leave else None


def capsule_span(start: Vector, way: Vector, radius: float, half_length: float) -> Span | None:
    """Return where a line is inside of a capsule, centred, whose axis is z: of a cylinder and the spheres at its ends.

    A capsule is convex, so these spans overlap or touch.
    """
    x, y, z = start
    spans = [cylinder_span(start, way, radius, half_length)]
    spans += [sphere_span((x, y, z - end), way, radius) for end in (-half_length, half_length)]
    found = [span for span in spans if span is not None]
    return (min(enter for enter, _ in found), max(leave for _, leave in found)) if found else None

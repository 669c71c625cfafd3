"""Checks that a football table's scenery leaves room for rods, swinging figures and the kick-off.

That takes geometry, so it is looked at when all single fields are right. A rod's tube and each of its figures sweep a
cylinder about the rod's axis, over the whole stroke. Bodies are compared as convex sets: points of the one are brought
onto the other and back (alternating projections, Cheney and Goldstein 1959), which ends at the two points that are
nearest to each other, or earlier, at a plane between the two.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import hypot, sqrt
from typing import Final

from foosim.common.finding import Finding
from foosim.world.matter.mesh import Mesh
from foosim.world.models.rod import ALONG_Y, RodRobot, figure_ys, line_x_m
from foosim.world.parameters.table import table_of
from foosim.world.scene import Box, Cylinder, Quaternion, Shape, Vector, rotate, shape_box
from foosim.world.scenery import scenery_shape
from foosim.world.spec import WorldSpec

TOUCH_M: Final = 0.0005
"""Things that overlap by less count as touching."""
ROUNDS: Final = 400

Nearest = Callable[[Vector], Vector]
"""Returns the point of a convex set that is nearest to a point (m, world frame)."""
Reach = Callable[[Vector], float]
"""Returns how far a convex set reaches along a vector: the greatest scalar product of the two."""


@dataclass(frozen=True, slots=True)
class _Swept:
    """A moving body: its bounding box, and its points."""

    what: str
    low: Vector
    high: Vector
    nearest: Nearest


def clearance_findings(spec: WorldSpec) -> Iterator[Finding]:
    """Yield the scenery of a table that its bodies pass through; meshes count once their files are there."""
    if not spec.scenery:
        return
    swept = [*_swept(spec)]
    for name, thing in spec.scenery.items():
        mesh = spec.mesh_of(name)
        if thing.shape == "mesh" and mesh is None:
            continue
        shape = scenery_shape(name, thing, mesh)
        low, high = shape_box(shape)
        for body in swept:
            if not _boxes_meet(low, high, body.low, body.high):
                continue
            if any(_meet(*part, body.nearest, shape.position) for part in _parts(shape, body)):
                what = f"{body.what} passes through it: valid is a place outside of {_extent(body)}"
                where = ", ".join(f"{value:g} m" for value in thing.position)
                yield Finding(("scenery", name, "x"), what, where)
                break


def _extent(body: _Swept) -> str:
    spans = zip("xyz", body.low, body.high, strict=True)
    return ", ".join(f"{axis} {round(1e3 * low, 1):g} to {round(1e3 * high, 1):g} mm" for axis, low, high in spans)


def _swept(spec: WorldSpec) -> Iterator[_Swept]:
    """Yield the space of the ball at the kick-off spot, and of each rod with its figures."""
    table = table_of(spec)
    ball, rod = table.ball.radius, table.rod
    yield _Swept(
        "the ball at the kick-off spot",
        (-ball, -ball, 0.0),
        (ball, ball, 2.0 * ball),
        _in_sphere((0.0, 0.0, ball), ball - TOUCH_M),
    )
    feet = hypot(rod.foot.length / 2, rod.foot_radius)
    top = rod.foot.height + rod.body.height - rod.foot_radius
    reach = max(feet, hypot(rod.body.length / 2, top), hypot(rod.body.length / 2, rod.foot_radius - rod.foot.height))
    wide = max(rod.foot.width, rod.body.width) / 2
    for name, robot in spec.robots.items():
        if not isinstance(robot, RodRobot):
            continue
        line = table.lines[robot.line]
        x, half = line_x_m(spec, robot), rod.length / 2 + line.half_stroke
        yield _turned(f"the rod {name}", x, rod.axis_height, rod.radius, (-half, half))
        for y in figure_ys(line):
            sides = y - wide - line.half_stroke, y + wide + line.half_stroke
            yield _turned(f"a figure of {name}", x, rod.axis_height, reach, sides)


def _turned(what: str, x: float, z: float, radius: float, sides: tuple[float, float]) -> _Swept:
    """Return a cylinder about a rod's axis, between two places along it."""
    middle, length = (x, (sides[0] + sides[1]) / 2, z), sides[1] - sides[0]
    low, high = (x - radius, sides[0], z - radius), (x + radius, sides[1], z + radius)
    return _Swept(what, low, high, _in_cylinder(middle, ALONG_Y, radius - TOUCH_M, length / 2 - TOUCH_M))


def _parts(shape: Shape, body: _Swept) -> Iterator[tuple[Nearest, Reach]]:
    """Yield the convex sets that a shape consists of; of a mesh the triangles near the body."""
    geometry, place, orientation = shape.geometry, shape.position, shape.orientation
    if isinstance(geometry, Box):
        yield _in_box(place, orientation, geometry.half), _reach_of_box(place, orientation, geometry.half)
    elif isinstance(geometry, Cylinder):
        size = geometry.radius, geometry.length / 2
        yield _in_cylinder(place, orientation, *size), _reach_of_cylinder(place, orientation, *size)
    elif isinstance(geometry, Mesh):
        from foosim.world.clearance.convex import placed_points  # brings numpy, which no other table needs

        corners = placed_points(geometry, place, orientation)[geometry.triangles]
        is_near = (corners.min(axis=1) < body.high) & (body.low < corners.max(axis=1))
        for triangle in corners[is_near.all(axis=1)].tolist():
            yield _in_triangle(*triangle), _reach_of_triangle(*triangle)


def _boxes_meet(low: Vector, high: Vector, other_low: Vector, other_high: Vector) -> bool:
    return all(low[n] < other_high[n] and other_low[n] < high[n] for n in range(3))


def _meet(one: Nearest, reach: Reach, other: Nearest, begin: Vector) -> bool:
    """Whether two convex sets, the first of which reaches so far, have a point in common."""
    point = begin
    for _ in range(ROUNDS):
        here = one(point)
        there = other(here)
        gap = _minus(there, here)
        if _dot(gap, gap) < 1e-14:
            return True
        # All of the other is beyond the plane through its nearest point across the gap: is all of the one before it?
        if reach(gap) < _dot(there, gap):
            return False
        point = there
    return False


def _in_sphere(middle: Vector, radius: float) -> Nearest:
    def nearest(point: Vector) -> Vector:
        way = _minus(point, middle)
        far = sqrt(_dot(way, way))
        return point if far <= radius else _plus(middle, way, radius / far)

    return nearest


def _in_box(middle: Vector, orientation: Quaternion, half: Vector) -> Nearest:
    back = _conjugate(orientation)

    def nearest(point: Vector) -> Vector:
        x, y, z = rotate(back, _minus(point, middle))
        inside = _within(x, half[0]), _within(y, half[1]), _within(z, half[2])
        return _moved(middle, orientation, inside)

    return nearest


def _in_cylinder(middle: Vector, orientation: Quaternion, radius: float, half: float) -> Nearest:
    back = _conjugate(orientation)

    def nearest(point: Vector) -> Vector:
        x, y, z = rotate(back, _minus(point, middle))
        far = hypot(x, y)
        share = 1.0 if far <= radius else radius / far
        return _moved(middle, orientation, (x * share, y * share, _within(z, half)))

    return nearest


def _in_triangle(a: Vector, b: Vector, c: Vector) -> Nearest:
    """The nearest point of a triangle, by the region that the point is in (Ericson, Real-Time Collision Detection)."""
    ab, ac = _minus(b, a), _minus(c, a)

    def nearest(point: Vector) -> Vector:
        ap, bp, cp = _minus(point, a), _minus(point, b), _minus(point, c)
        d1, d2, d3, d4, d5, d6 = (_dot(side, way) for way in (ap, bp, cp) for side in (ab, ac))
        if d1 <= 0.0 and d2 <= 0.0:
            return a
        if d3 >= 0.0 and d4 <= d3:
            return b
        if d6 >= 0.0 and d5 <= d6:
            return c
        vc, vb, va = d1 * d4 - d3 * d2, d5 * d2 - d1 * d6, d3 * d6 - d5 * d4
        if vc <= 0.0 <= d1 and d3 <= 0.0:
            return _plus(a, ab, d1 / (d1 - d3))
        if vb <= 0.0 <= d2 and d6 <= 0.0:
            return _plus(a, ac, d2 / (d2 - d6))
        if va <= 0.0 and d4 >= d3 and d5 >= d6:
            return _plus(b, _minus(c, b), (d4 - d3) / ((d4 - d3) + (d5 - d6)))
        whole = va + vb + vc
        return _plus(_plus(a, ab, vb / whole), ac, vc / whole)

    return nearest


def _reach_of_box(middle: Vector, orientation: Quaternion, half: Vector) -> Reach:
    back = _conjugate(orientation)

    def reach(way: Vector) -> float:
        x, y, z = rotate(back, way)
        return _dot(middle, way) + abs(x) * half[0] + abs(y) * half[1] + abs(z) * half[2]

    return reach


def _reach_of_cylinder(middle: Vector, orientation: Quaternion, radius: float, half: float) -> Reach:
    back = _conjugate(orientation)

    def reach(way: Vector) -> float:
        x, y, z = rotate(back, way)
        return _dot(middle, way) + radius * hypot(x, y) + half * abs(z)

    return reach


def _reach_of_triangle(a: Vector, b: Vector, c: Vector) -> Reach:
    return lambda way: max(_dot(a, way), _dot(b, way), _dot(c, way))


def _within(value: float, half: float) -> float:
    return min(max(value, -half), half)


def _minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _plus(a: Vector, b: Vector, share: float) -> Vector:
    return a[0] + share * b[0], a[1] + share * b[1], a[2] + share * b[2]


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _conjugate(orientation: Quaternion) -> Quaternion:
    x, y, z, w = orientation
    return -x, -y, -z, w


def _moved(middle: Vector, orientation: Quaternion, point: Vector) -> Vector:
    x, y, z = rotate(orientation, point)
    return middle[0] + x, middle[1] + y, middle[2] + z

"""Checks that a football table's scenery leaves room for rods, swinging figures and the kick-off.

This takes geometry, so it is done when all single fields are valid. A rod's tube and each of its figures sweep a
cylinder about the rod's axis, over the whole stroke.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from foosim.common.finding import Finding
from foosim.library.table.rod import ALONG_Y, RodRobot, figure_ys, line_x_m
from foosim.library.table.settings import rod_reach, table_of
from foosim.world.clearance.convex import Solid, convex_parts, overlap_of
from foosim.world.scene import UPRIGHT, Cylinder, Sphere, Vector, shape_box
from foosim.world.scenery import scenery_shape
from foosim.world.spec import WorldSpec

TOUCH_M: Final = 0.0005
"""Things that overlap by less count as touching."""


@dataclass(frozen=True, slots=True)
class _Swept:
    """A moving body: its bounding box, and its shape inside of that."""

    what: str
    low: Vector
    high: Vector
    solid: Solid


def clearance_findings(spec: WorldSpec) -> Iterator[Finding]:
    """Yield the scenery of a table that its bodies pass through; meshes count once their files are there."""
    swept = [*_swept(spec)]
    for name, thing in spec.scenery.items():
        mesh = spec.mesh_of(name)
        if thing.shape == "mesh" and mesh is None:
            continue
        shape = scenery_shape(name, thing, mesh)
        low, high = shape_box(shape)
        for body in swept:
            if not all(low[axis] < body.high[axis] and body.low[axis] < high[axis] for axis in range(3)):
                continue
            parts = convex_parts(shape, shape.position, shape.orientation, body.low, body.high)
            if any(overlap_of(part, body.solid, TOUCH_M) > 0.0 for part in parts):
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
        Solid(Sphere(ball), (0.0, 0.0, ball), UPRIGHT),
    )
    reach = rod_reach(rod)
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
    return _Swept(what, low, high, Solid(Cylinder(radius, length), middle, ALONG_Y))

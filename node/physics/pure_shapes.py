"""Shapes that touch a sphere in the pure engine: the scenery's boxes and cylinders, a shaft's cylinder and boxes.

Distances are from the sphere's centre to the nearest point of a box (Ericson, "Real-Time Collision Detection", section
5.1.3) or cylinder; inside of one, to the nearest face.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import cos, sin, sqrt
from typing import Final

from foosim.node.physics.pure_bodies import FreeSphere, Shaft
from foosim.world.matter.physics import Contact
from foosim.world.scene import UPRIGHT, Body, Box, Cylinder, Shape, Vector, rotate, shape_box

CELL_M: Final = 0.05
"""Side of the cells, in plan, for which the scenery near a sphere is kept."""
Touch = tuple[float, Vector, Contact]
"""Depth (m, positive where they overlap), normal towards the sphere (unit, world frame), pair."""


def distance_to_box(x: float, y: float, z: float, half: Vector) -> tuple[float, float, float, float]:
    """Return distance and outward normal from a box, centred and upright, to a point; negative inside."""
    hx, hy, hz = half
    ax, ay, az = abs(x) - hx, abs(y) - hy, abs(z) - hz
    if ax <= 0.0 and ay <= 0.0:
        if az > 0.0 or (az >= ax and az >= ay):
            return az, 0.0, 0.0, 1.0 if z > 0.0 else -1.0
    elif ax > 0.0 and ay <= 0.0 and az <= 0.0:
        return ax, 1.0 if x > 0.0 else -1.0, 0.0, 0.0
    elif ay > 0.0 and ax <= 0.0 and az <= 0.0:
        return ay, 0.0, 1.0 if y > 0.0 else -1.0, 0.0
    if ax <= 0.0 and ay <= 0.0:
        if ax >= ay:
            return ax, 1.0 if x > 0.0 else -1.0, 0.0, 0.0
        return ay, 0.0, 1.0 if y > 0.0 else -1.0, 0.0
    ex = 0.0 if ax <= 0.0 else ax if x > 0.0 else -ax
    ey = 0.0 if ay <= 0.0 else ay if y > 0.0 else -ay
    ez = 0.0 if az <= 0.0 else az if z > 0.0 else -az
    distance = sqrt(ex * ex + ey * ey + ez * ez)
    return distance, ex / distance, ey / distance, ez / distance


def distance_to_cylinder(x: float, y: float, z: float, half: Vector) -> tuple[float, float, float, float]:
    """Return distance and outward normal from a cylinder, centred on the z axis, to a point; negative inside.

    `half` is its radius twice, and half of its length.
    """
    from_axis = sqrt(x * x + y * y)
    out, over = from_axis - half[0], abs(z) - half[2]
    up = 1.0 if z > 0.0 else -1.0
    # On the axis every direction is as near as any other.
    nx, ny = (x / from_axis, y / from_axis) if from_axis > 0.0 else (1.0, 0.0)
    if out > 0.0 and over > 0.0:
        distance = sqrt(out * out + over * over)
        return distance, out / distance * nx, out / distance * ny, over / distance * up
    return (over, 0.0, 0.0, up) if over >= out else (out, nx, ny, 0.0)


class Still:
    """One box or cylinder of the scenery, upright or tilted."""

    __slots__ = ("axes", "distance", "half", "high", "low", "middle", "pair")

    def __init__(self, shape: Shape, surfaces: Mapping[str, Contact]) -> None:
        geometry = shape.geometry
        assert isinstance(geometry, Box | Cylinder), shape
        if isinstance(geometry, Box):
            self.half, self.distance = geometry.half, distance_to_box
        else:
            self.half, self.distance = (geometry.radius, geometry.radius, geometry.length / 2), distance_to_cylinder
        self.middle, self.pair = shape.position, surfaces[shape.surface]
        self.low, self.high = shape_box(shape)
        turned = shape.orientation
        self.axes: tuple[Vector, Vector, Vector] | None = None
        if turned != UPRIGHT:
            self.axes = (
                rotate(turned, (1.0, 0.0, 0.0)),
                rotate(turned, (0.0, 1.0, 0.0)),
                rotate(turned, (0.0, 0.0, 1.0)),
            )

    def contact(self, sphere: FreeSphere) -> Touch:
        """Return the contact with a sphere."""
        mx, my, mz = self.middle
        x, y, z = sphere.x - mx, sphere.y - my, sphere.z - mz
        if self.axes is None:
            distance, nx, ny, nz = self.distance(x, y, z, self.half)
            return sphere.radius - distance, (nx, ny, nz), self.pair
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = self.axes
        distance, p, q, r = self.distance(
            x * ax + y * ay + z * az, x * bx + y * by + z * bz, x * cx + y * cy + z * cz, self.half
        )
        normal = (p * ax + q * bx + r * cx, p * ay + q * by + r * cy, p * az + q * bz + r * cz)
        return sphere.radius - distance, normal, self.pair


class Scenery:
    """All boxes and cylinders of the scenery, found by the place of a sphere of some radius."""

    def __init__(self, things: Sequence[Still], radius: float) -> None:
        self._things = tuple(things)
        self._radius = radius
        self._cells: dict[tuple[float, float], tuple[Still, ...]] = {}

    def near(self, x: float, y: float) -> tuple[Still, ...]:
        """Return the things that a sphere with its centre over this spot could touch."""
        key = x // CELL_M, y // CELL_M
        things = self._cells.get(key)
        if things is None:
            things = self._cells[key] = self._near(key[0] * CELL_M, key[1] * CELL_M)
        return things

    def _near(self, x: float, y: float) -> tuple[Still, ...]:
        reach, far = self._radius + 1e-6, self._radius + CELL_M + 1e-6
        return tuple(
            thing
            for thing in self._things
            if thing.low[0] - far <= x <= thing.high[0] + reach and thing.low[1] - far <= y <= thing.high[1] + reach
        )


class ShaftShapes:
    """The shapes of one shaft: a cylinder on the axis, and boxes that turn with it."""

    __slots__ = ("_boxes", "_core", "_core_pair", "_half_length", "_reach")

    def __init__(self, body: Body, surfaces: Mapping[str, Contact]) -> None:
        sliding, turning = body.links
        (shape,) = sliding.shapes
        core = shape.geometry
        assert isinstance(core, Cylinder), f"the pure engine has no shaft whose core is the {core} of {body.name}"
        self._core, self._half_length = core.radius, core.length / 2
        self._core_pair = surfaces[shape.surface]
        self._boxes = []
        reach = core.radius
        for shape in turning.shapes:
            assert isinstance(shape.geometry, Box), f"the pure engine turns no {shape.geometry}, as {body.name} has"
            half, (x, y, z) = shape.geometry.half, shape.position
            self._boxes.append((x, y, z, half, surfaces[shape.surface]))
            reach = max(reach, sqrt((abs(x) + half[0]) ** 2 + (abs(z) + half[2]) ** 2))
        self._reach = reach

    @property
    def reach(self) -> float:
        """Greatest distance of a shape from the axis."""
        return self._reach

    def link_of(self, pair: Contact) -> int:
        """Return the index of the link that has a contact with such a surface."""
        return 0 if pair is self._core_pair else 1

    def contact(self, sphere: FreeSphere, shaft: Shaft) -> Touch | None:
        """Return the deepest contact of a sphere with the shaft, or None where they do not touch."""
        dx, dz = sphere.x - shaft.x, sphere.z - shaft.z
        square = dx * dx + dz * dz
        radius = sphere.radius
        far = self._reach + radius
        if square >= far * far:
            return None
        best, normal, pair = 0.0, (0.0, 0.0, 0.0), self._core_pair
        dy = sphere.y - shaft.slide
        near = self._core + radius
        if square < near * near and square > 0.0 and abs(dy) <= self._half_length:
            distance = sqrt(square)
            best, normal = near - distance, (dx / distance, 0.0, dz / distance)
        s, c = sin(shaft.angle), cos(shaft.angle)
        x, z = c * dx - s * dz, s * dx + c * dz
        for px, py, pz, half, surface in self._boxes:
            y = dy - py
            if abs(y) < half[1] + radius:
                distance, nx, ny, nz = distance_to_box(x - px, y, z - pz, half)
                if radius - distance > best:
                    best, pair = radius - distance, surface
                    normal = (c * nx + s * nz, ny, c * nz - s * nx)
        return (best, normal, pair) if best > 0.0 else None

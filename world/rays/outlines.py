"""Clearance of discs on a floor: shapes seen from above, one test at a time.

An upright box is a rectangle; a sphere, an upright cylinder and an upright capsule are circles; tilted shapes,
hulls and meshes are the rectangles around them. Only + - * / and comparisons decide. Neighbour: `clearing`,
for many places among shapes as they are in space.
"""

from __future__ import annotations

from dataclasses import dataclass

from foosim.world.scene import Box, Capsule, Cylinder, Shape, Sphere, rotate, shape_box


@dataclass(frozen=True, slots=True)
class Rectangle:
    """Its middle, the unit vector along its first side, and half of both sides (m)."""

    x: float
    y: float
    along_x: float
    along_y: float
    half_along: float
    half_across: float

    def is_clear(self, x: float, y: float, radius: float) -> bool:
        """Whether a circle does not overlap it; touching is clear."""
        east, north = x - self.x, y - self.y
        along = abs(east * self.along_x + north * self.along_y) - self.half_along
        across = abs(north * self.along_x - east * self.along_y) - self.half_across
        if along >= radius or across >= radius:
            return True
        if along <= 0.0 or across <= 0.0:
            return False
        return along * along + across * across >= radius * radius


@dataclass(frozen=True, slots=True)
class Circle:
    """Its middle and radius (m)."""

    x: float
    y: float
    radius: float

    def is_clear(self, x: float, y: float, radius: float) -> bool:
        """Whether a circle does not overlap it; touching is clear."""
        east, north, least = x - self.x, y - self.y, self.radius + radius
        return east * east + north * north >= least * least


Outline = Rectangle | Circle


def outline(shape: Shape) -> Outline:
    """Return a shape in the world as seen from above."""
    x, y, _ = shape.position
    is_upright = shape.orientation[0] == 0.0 and shape.orientation[1] == 0.0
    geometry = shape.geometry
    if isinstance(geometry, Sphere) or (is_upright and isinstance(geometry, Cylinder | Capsule)):
        return Circle(x, y, geometry.radius)
    if is_upright and isinstance(geometry, Box):
        along_x, along_y, _ = rotate(shape.orientation, (1.0, 0.0, 0.0))
        return Rectangle(x, y, along_x, along_y, geometry.half[0], geometry.half[1])
    low, high = shape_box(shape)
    middle = (low[0] + high[0]) / 2, (low[1] + high[1]) / 2
    return Rectangle(*middle, 1.0, 0.0, (high[0] - low[0]) / 2, (high[1] - low[1]) / 2)

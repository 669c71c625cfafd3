"""Obstacles of rovers, seen from above: rectangles and circles.

An upright box is a rectangle, an upright cylinder and a base station are circles; whatever is tilted, and a mesh, is
the rectangle around it. What is higher than a rover with its antenna, or below the floor, is none. The walls of the
hall are obstacles like all others, so that nothing leaves it. Only + - * / and comparisons decide what is free.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from foosim.world.fixed_scenery import fixed_shapes
from foosim.world.models.station import StationRobot
from foosim.world.parameters.hall import Hall, hall_of
from foosim.world.scene import Box, Cylinder, Shape, rotate, shape_box
from foosim.world.scenery import scenery_shape
from foosim.world.spec import WorldSpec


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


Obstacle = Rectangle | Circle


def obstacles_of(spec: WorldSpec) -> tuple[Obstacle, ...]:
    """Return the obstacles of the deployment's rovers: walls, stations, scenery."""
    return tuple(thing for _, thing in named_obstacles(spec))


def named_obstacles(spec: WorldSpec) -> Iterator[tuple[str, Obstacle]]:
    """Yield obstacles with their descriptions; a mesh counts if its file was given."""
    hall = hall_of(spec)
    for shape in fixed_shapes(spec):
        if is_in_the_way(shape, hall):
            yield f"a wall of the {shape.name}", obstacle(shape)
    for name, robot in sorted(spec.robots.items()):
        if isinstance(robot, StationRobot):
            yield f"the station {name}", Circle(robot.x, robot.y, hall.station.radius)
    for name, thing in sorted(spec.scenery.items()):
        mesh = spec.mesh_of(name)
        if thing.shape == "mesh" and mesh is None:
            continue
        shape = scenery_shape(name, thing, mesh)
        if is_in_the_way(shape, hall):
            yield f"scenery.{name}", obstacle(shape)


def is_in_the_way(shape: Shape, hall: Hall) -> bool:
    """Whether a shape of the scenery is as high as a rover reaches, and above the floor."""
    low, high = shape_box(shape)
    return low[2] < max(hall.rover.height, hall.rover.antenna_height) and high[2] > 0.0


def obstacle(shape: Shape) -> Obstacle:
    """Return a shape of the scenery as it is seen from above."""
    x, y, _ = shape.position
    is_upright = shape.orientation[0] == 0.0 and shape.orientation[1] == 0.0
    geometry = shape.geometry
    if is_upright and isinstance(geometry, Cylinder):
        return Circle(x, y, geometry.radius)
    if is_upright and isinstance(geometry, Box):
        along_x, along_y, _ = rotate(shape.orientation, (1.0, 0.0, 0.0))
        return Rectangle(x, y, along_x, along_y, geometry.half[0], geometry.half[1])
    low, high = shape_box(shape)
    middle = (low[0] + high[0]) / 2, (low[1] + high[1]) / 2
    return Rectangle(*middle, 1.0, 0.0, (high[0] - low[0]) / 2, (high[1] - low[1]) / 2)

"""Obstacles of rovers: outlines of walls, stations and scenery, seen from above (`rays.outlines`), with names.

A base station is a circle. What is higher than a rover with its antenna, or below the floor, is none. The walls of the
hall are obstacles like all others, so that nothing leaves it.
"""

from __future__ import annotations

from collections.abc import Iterator

from foosim.world.fixed_scenery import fixed_shapes
from foosim.world.models.station import StationRobot
from foosim.world.parameters.hall import Hall, hall_of
from foosim.world.rays.outlines import Circle, Outline, outline
from foosim.world.scene import Shape, shape_box
from foosim.world.scenery import scenery_shape
from foosim.world.spec import WorldSpec


def obstacles_of(spec: WorldSpec) -> tuple[Outline, ...]:
    """Return the obstacles of the deployment's rovers: walls, stations, scenery."""
    return tuple(thing for _, thing in named_obstacles(spec))


def named_obstacles(spec: WorldSpec) -> Iterator[tuple[str, Outline]]:
    """Yield obstacles with their descriptions; a mesh counts if its file was given."""
    hall = hall_of(spec)
    for shape in fixed_shapes(spec):
        if is_in_the_way(shape, hall):
            yield f"a wall of the {shape.name}", outline(shape)
    for name, robot in sorted(spec.robots.items()):
        if isinstance(robot, StationRobot):
            yield f"the station {name}", Circle(robot.x, robot.y, hall.station.radius)
    for name, thing in sorted(spec.scenery.items()):
        mesh = spec.mesh_of(name)
        if thing.shape == "mesh" and mesh is None:
            continue
        shape = scenery_shape(name, thing, mesh)
        if is_in_the_way(shape, hall):
            yield f"scenery.{name}", outline(shape)


def is_in_the_way(shape: Shape, hall: Hall) -> bool:
    """Whether a shape of the scenery is as high as a rover reaches, and above the floor."""
    low, high = shape_box(shape)
    return low[2] < max(hall.rover.height, hall.rover.antenna_height) and high[2] > 0.0

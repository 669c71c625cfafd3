"""Obstacles of rovers: outlines of walls, stations and scenery, seen from above (`rays.outlines`), with names; and
checks that rovers start, and stations are, inside the hall and outside of these.

A base station is a circle. Shapes higher than a rover with its antenna, or below the floor, are no obstacles. The walls
of the hall are obstacles like all others, so that nothing leaves it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain
from math import floor
from operator import itemgetter

from foosim.common.finding import Finding
from foosim.library.mobile.hall_settings import Hall, hall_of
from foosim.library.mobile.rover import RoverRobot
from foosim.library.mobile.station import StationRobot
from foosim.world.fixed_scenery import fixed_shapes
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


def start_findings(spec: WorldSpec) -> Iterator[Finding]:
    """Yield the rovers and stations that are in an obstacle, in one another or outside of the hall.

    Meshes count once their files are there.
    """
    hall = hall_of(spec)
    taken = list(named_obstacles(spec))
    for name, robot in spec.robots.items():
        if isinstance(robot, StationRobot):
            circle = robot.x, robot.y, hall.station.radius
            others = [entry for entry in taken if entry[0] != f"the station {name}"]
            yield from _misplaced(spec, name, "the station stands", circle, others)
    rovers = _Rovers(hall.rover.radius)
    for name, robot in spec.robots.items():
        if isinstance(robot, RoverRobot):
            circle = robot.x, robot.y, hall.rover.radius
            yield from _misplaced(spec, name, "the rover starts", circle, chain(taken, rovers.near(robot.x, robot.y)))
            rovers.add(name, robot.x, robot.y)


class _Rovers:
    """The starts of rovers, by squares of a grid, so that each is compared with near ones only."""

    def __init__(self, radius: float) -> None:
        self._radius = radius
        self._squares: dict[tuple[int, int], list[tuple[int, str, Circle]]] = {}
        self._count = 0

    def near(self, x: float, y: float) -> Iterator[tuple[str, Outline]]:
        """Yield the obstacles that a rover at a place may overlap, in the order of their addition."""
        east, north = self._square(x, y)
        around = ((east + i, north + j) for i in (-1, 0, 1) for j in (-1, 0, 1))
        found = sorted((entry for square in around for entry in self._squares.get(square, ())), key=itemgetter(0))
        yield from ((f"the rover {name}", circle) for _, name, circle in found)

    def add(self, name: str, x: float, y: float) -> None:
        """Add a rover at a place."""
        entry = self._count, name, Circle(x, y, self._radius)
        self._squares.setdefault(self._square(x, y), []).append(entry)
        self._count += 1

    def _square(self, x: float, y: float) -> tuple[int, int]:
        side = 2.0 * self._radius
        return floor(x / side), floor(y / side)


def _misplaced(
    spec: WorldSpec,
    name: str,
    subject: str,
    circle: tuple[float, float, float],
    taken: Iterable[tuple[str, Outline]],
) -> Iterator[Finding]:
    """Yield the problem of a robot's place, as a circle (m): the first thing that it overlaps."""
    x, y, _ = circle
    half_x, half_y = hall_of(spec).length / 2, hall_of(spec).width / 2
    met = next((f"in {what}" for what, thing in taken if not thing.is_clear(*circle)), None)
    if met is None and (abs(x) > half_x or abs(y) > half_y):
        met = f"outside of the hall: valid are x from {-half_x:g} to {half_x:g} m, y from {-half_y:g} to {half_y:g} m"
    if met is not None:
        yield Finding(("robots", name, "x"), f"{subject} {met}", f"{x:g} m, {y:g} m")

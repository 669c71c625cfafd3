"""A hall as a scene: floor, walls, rovers, base stations. A pure function of the deployment and the layout."""

from __future__ import annotations

from typing import Final, Literal

from foosim.world.kits.hall import Hall, Rover, Station
from foosim.world.layout import Layout
from foosim.world.materials import CONCRETE, METAL, PLASTIC
from foosim.world.robots.rover import RoverRobot, StationRobot
from foosim.world.scene import ORIGIN, Body, Box, Colour, Cylinder, Link, Scene, Shape, Vector
from foosim.world.spec import WorldSpec

GREY: Final[Colour] = (0.62, 0.62, 0.60, 1.0)
PALE: Final[Colour] = (0.80, 0.80, 0.78, 1.0)
ORANGE: Final[Colour] = (0.95, 0.50, 0.10, 1.0)
DARK: Final[Colour] = (0.15, 0.15, 0.18, 1.0)
GREEN: Final[Colour] = (0.15, 0.60, 0.30, 1.0)
FLOOR_THICKNESS_M: Final = 0.2
MAST_RADIUS_M: Final = 0.01


def hall_scene(spec: WorldSpec, layout: Layout) -> Scene:
    """Return the scene of a layout's robots in the deployment's hall."""
    hall = spec.hall
    bodies = {}
    for entity in layout.entities:
        robot = spec.robots[entity.name]
        if isinstance(robot, RoverRobot):
            bodies[entity.name] = _rover_body(hall.rover, entity.name)
        elif isinstance(robot, StationRobot):
            bodies[entity.name] = _station_body(hall.station, entity.name, robot)
    return Scene(bodies, (*hall_scenery(hall), *spec.scenery_shapes()))


def hall_scenery(hall: Hall) -> tuple[Shape, ...]:
    """Return the floor, which reaches under the walls, and the four walls around it."""
    x, y, thick, top = hall.length / 2, hall.width / 2, hall.walls.thickness, hall.walls.height
    long, wide = Box((x + thick, thick / 2, top / 2)), Box((thick / 2, y, top / 2))
    floor = Box((x + thick, y + thick, FLOOR_THICKNESS_M / 2))
    placed: list[tuple[Box, str, Colour, Vector]] = [(floor, "floor", GREY, (0.0, 0.0, -FLOOR_THICKNESS_M / 2))]
    placed += [(long, "walls", PALE, (0.0, side * (y + thick / 2), top / 2)) for side in (-1.0, 1.0)]
    placed += [(wide, "walls", PALE, (side * (x + thick / 2), 0.0, top / 2)) for side in (-1.0, 1.0)]
    return tuple(
        Shape(box, surface, colour, place, radio=CONCRETE, name="hall") for box, surface, colour, place in placed
    )


def _rover_body(rover: Rover, name: str) -> Body:
    """Return a rover: a round hull, a mark ahead, and the antenna's mast where it is higher than the hull."""
    middle = (0.0, 0.0, rover.height / 2)
    hull = Shape(Cylinder(rover.radius, rover.height), "rover", ORANGE, middle, radio=METAL)
    mark = Box((rover.radius / 4, rover.radius / 8, rover.height / 16))
    ahead = Shape(mark, "rover", DARK, (rover.radius / 2, 0.0, rover.height + rover.height / 16), radio=PLASTIC)
    shapes = (hull, ahead, *_mast(rover.height, rover.antenna_height, "rover"))
    return _body(name, "rover", ORIGIN, "free", shapes, rover.antenna_height)


def _station_body(station: Station, name: str, robot: StationRobot) -> Body:
    middle = (0.0, 0.0, station.height / 2)
    hull = Shape(Cylinder(station.radius, station.height), "station", GREEN, middle, radio=METAL)
    shapes = (hull, *_mast(station.height, station.antenna_height, "station"))
    return _body(name, "station", (robot.x, robot.y, 0.0), "fixed", shapes, station.antenna_height)


def _body(
    name: str, model: str, at: Vector, joint: Literal["free", "fixed"], shapes: tuple[Shape, ...], antenna_m: float
) -> Body:
    """Return a body of one link. It has no mass: no engine moves it."""
    link = Link(name, joint, shapes, 0.0, ORIGIN)
    return Body(name, model, at, (link,), (0.0, 0.0, antenna_m))


def _mast(bottom: float, top: float, surface: str) -> tuple[Shape, ...]:
    if top <= bottom:
        return ()
    mast = Cylinder(MAST_RADIUS_M, top - bottom)
    return (Shape(mast, surface, DARK, (0.0, 0.0, (top + bottom) / 2), radio=PLASTIC),)

"""The football table as a scene: floor, walls, goals, corner ramps, rods with figures, balls.

A pure function of the deployment and the layout. All rods slide along world +y and turn about world +y, at angle 0 the
feet hang straight down.
"""

from __future__ import annotations

from math import sqrt
from typing import Final

from foosim.world import materials
from foosim.world.islands import line_x_m
from foosim.world.kits.table import Line, Table
from foosim.world.layout import Layout
from foosim.world.robots.foosball_rod import RodRobot
from foosim.world.scene import Body, Box, Colour, Cylinder, Link, Quaternion, Scene, Shape, Sphere, Vector
from foosim.world.spec import WorldSpec

GREEN: Final[Colour] = (0.16, 0.45, 0.24, 1.0)
DARK_GREEN: Final[Colour] = (0.13, 0.38, 0.20, 1.0)
WOOD: Final[Colour] = (0.45, 0.30, 0.18, 1.0)
GREY: Final[Colour] = (0.35, 0.35, 0.38, 1.0)
STEEL: Final[Colour] = (0.75, 0.75, 0.78, 1.0)
ORANGE: Final[Colour] = (1.0, 0.5, 0.0, 1.0)
"""A white ball would be confused with highlights on the rods."""
TEAM_COLOURS: Final[dict[str, Colour]] = {"red": (0.80, 0.10, 0.10, 1.0), "blue": (0.10, 0.20, 0.80, 1.0)}

ALONG_Y: Final[Quaternion] = (-sqrt(0.5), 0.0, 0.0, sqrt(0.5))
"""Turns a cylinder's axis from z to y."""
Y_AXIS: Final[Vector] = (0.0, 1.0, 0.0)

TABLE: Final = "table"
"""What its floor, walls, goals and ramps are called, all together, where waves cross them."""

_COS_EIGHTH: Final = sqrt((1.0 + sqrt(0.5)) / 2.0)
_SIN_EIGHTH: Final = sqrt((1.0 - sqrt(0.5)) / 2.0)
_TO_CORNER: Final[dict[tuple[float, float], tuple[float, float]]] = {
    (1.0, 1.0): (_SIN_EIGHTH, _COS_EIGHTH),
    (-1.0, 1.0): (_COS_EIGHTH, _SIN_EIGHTH),
    (-1.0, -1.0): (-_COS_EIGHTH, _SIN_EIGHTH),
    (1.0, -1.0): (-_SIN_EIGHTH, _COS_EIGHTH),
}
"""Sine and cosine of half the angle from +x to each corner (45, 135, 225 - 360 and 315 - 360 degrees)."""


def table_scene(spec: WorldSpec, layout: Layout) -> Scene:
    """Return the scene of a layout's bodies on the deployment's table."""
    table = spec.table
    bodies = {}
    for entity in layout.entities:
        if entity.model == "ball":
            bodies[entity.name] = ball_body(table, entity.name)
        elif entity.model == "rod":
            robot = spec.robots[entity.name]
            assert isinstance(robot, RodRobot)
            bodies[entity.name] = _rod_body(table, entity.name, robot, line_x_m(spec, robot))
    return Scene(bodies, (*table_scenery(table), *spec.scenery_shapes()))


def ball_body(table: Table, name: str) -> Body:
    """Return a ball: a solid sphere, I = 2/5 m r^2."""
    ball = table.ball
    inertia = 0.4 * ball.mass * ball.radius * ball.radius
    shape = Shape(Sphere(ball.radius), "ball", ORANGE, radio=materials.PLASTIC)
    return Body(name, "ball", (0.0, 0.0, 0.0), (Link(name, "free", (shape,), ball.mass, (inertia, inertia, inertia)),))


def _rod_body(table: Table, name: str, robot: RodRobot, x: float) -> Body:
    """Return a rod: a carriage that slides, and on it what turns.

    The tube's shape is the carriage's: it has a surface of its own, a link has one, and a further link costs a fifth
    of a step. So a ball that flies against the tube does not feel it spin; the tube's inertia turns with the figures.
    """
    rod, line = table.rod, table.lines[robot.line]
    tube = Shape(Cylinder(rod.radius, rod.length), "rods", STEEL, orientation=ALONG_Y, radio=materials.METAL)
    thin = rod.carriage_mass * rod.length * rod.length / 12.0
    mass, centre, inertia = _spin_mass(table, line)
    slide = Link(
        name=f"{name}/slide",
        joint="prismatic",
        shapes=(tube,),
        mass=rod.carriage_mass,
        inertia=(thin, rod.carriage_mass * rod.radius * rod.radius, thin),
        axis=Y_AXIS,
        limits=(-line.half_stroke, line.half_stroke),
    )
    figures = _figures(table, line, TEAM_COLOURS[robot.team])
    spin = Link(f"{name}/spin", "revolute", figures, mass, inertia, (0.0, 0.0, centre), Y_AXIS)
    return Body(name, "rod", (x, 0.0, rod.axis_height), (slide, spin))


def figure_ys(line: Line) -> list[float]:
    """Return where a line's figures stand along their rod, from its middle."""
    return [(index - (line.figures - 1) / 2.0) * line.pitch for index in range(line.figures)]


def _figures(table: Table, line: Line, colour: Colour) -> tuple[Shape, ...]:
    """Return foot and body of each figure; the body stands on the foot."""
    rod = table.rod
    foot = Box((rod.foot.length / 2, rod.foot.width / 2, rod.foot.height / 2))
    body = Box((rod.body.length / 2, rod.body.width / 2, rod.body.height / 2))
    foot_z = rod.foot.height / 2 - rod.foot_radius
    body_z = rod.foot.height + rod.body.height / 2 - rod.foot_radius
    shapes = []
    for y in figure_ys(line):
        shapes.append(Shape(foot, "figures", colour, (0.0, y, foot_z), radio=materials.PLASTIC))
        shapes.append(Shape(body, "figures", colour, (0.0, y, body_z), radio=materials.PLASTIC))
    return tuple(shapes)


def _spin_mass(table: Table, line: Line) -> tuple[float, float, Vector]:
    """Return mass, height of the centre of mass over the axis, and inertia about that centre of what turns.

    Parts: a hollow cylinder on the axis, and for each figure a solid box as tall as foot and body and as long and wide
    as the body, whose centre of mass hangs below the axis; all moved by the parallel axis theorem.
    """
    rod = table.rod
    below = rod.figure_com_below_axis
    count = line.figures
    mass = rod.mass + count * rod.figure_mass
    centre = -count * rod.figure_mass * below / mass
    radii = rod.radius * rod.radius + rod.inner_radius * rod.inner_radius
    long, wide, tall = rod.body.length, rod.body.width, rod.foot.height + rod.body.height
    squares = sum(y * y for y in figure_ys(line))
    tube_across = rod.mass * (radii / 4.0 + rod.length * rod.length / 12.0)
    figure_x = (wide * wide + tall * tall) / 12.0 + below * below
    figure_y = (long * long + tall * tall) / 12.0 + below * below
    figure_z = (long * long + wide * wide) / 12.0
    shift = mass * centre * centre
    return (
        mass,
        centre,
        (
            tube_across + rod.figure_mass * (count * figure_x + squares) - shift,
            rod.mass * radii / 2.0 + rod.figure_mass * count * figure_y - shift,
            tube_across + rod.figure_mass * (count * figure_z + squares),
        ),
    )


def spin_inertia(link: Link) -> float:
    """Return the moment of inertia of a turning link about its joint's axis (y), in kg m2."""
    x, _, z = link.centre_of_mass
    return link.inertia[1] + link.mass * (x * x + z * z)


def table_scenery(table: Table) -> tuple[Shape, ...]:
    """Return what the table itself has that never moves; boxes only, since a concave mesh lets fast balls through."""
    return (_floor(table), *_side_walls(table), *_end_walls(table), *_goals(table), *_ramps(table))


def _box(low: Vector, high: Vector, surface: str, colour: Colour) -> Shape:
    half = ((high[0] - low[0]) / 2, (high[1] - low[1]) / 2, (high[2] - low[2]) / 2)
    middle = ((high[0] + low[0]) / 2, (high[1] + low[1]) / 2, (high[2] + low[2]) / 2)
    return Shape(Box(half), surface, colour, middle, radio=materials.WOOD, name=TABLE)


def _mirrored(low: Vector, high: Vector, surface: str, colour: Colour) -> tuple[Shape, Shape]:
    """Return a box at positive x and its mirror image at negative x."""
    return (
        _box(low, high, surface, colour),
        _box((-high[0], low[1], low[2]), (-low[0], high[1], high[2]), surface, colour),
    )


def _floor(table: Table) -> Shape:
    """Return the floor: it reaches under the walls and the goals' pockets."""
    x = table.field.length / 2 + 2 * table.walls.thickness + table.goal.depth
    y = table.field.width / 2 + table.walls.thickness
    return _box((-x, -y, -table.floor.thickness), (x, y, 0.0), "floor", GREEN)


def _side_walls(table: Table) -> tuple[Shape, ...]:
    x = table.field.length / 2 + table.walls.thickness
    inner, outer, top = table.field.width / 2, table.field.width / 2 + table.walls.thickness, table.walls.height
    return (
        _box((-x, inner, 0.0), (x, outer, top), "walls", WOOD),
        _box((-x, -outer, 0.0), (x, -inner, top), "walls", WOOD),
    )


def _end_walls(table: Table) -> tuple[Shape, ...]:
    """Return the end walls, each in three parts: beside the goal on either side, and above it."""
    inner, top, goal = table.field.length / 2, table.walls.height, table.goal
    outer, y, post = inner + table.walls.thickness, table.field.width / 2, goal.width / 2
    walls = [
        *_mirrored((inner, post, 0.0), (outer, y, top), "walls", WOOD),
        *_mirrored((inner, -y, 0.0), (outer, -post, top), "walls", WOOD),
    ]
    if top > goal.height:
        walls += _mirrored((inner, -post, goal.height), (outer, post, top), "walls", WOOD)
    return tuple(walls)


def _goals(table: Table) -> tuple[Shape, ...]:
    """Return the pockets behind the goals' openings: two sides, a back and a roof each; the floor is the table's."""
    thick, goal = table.walls.thickness, table.goal
    front, post = table.field.length / 2 + thick, goal.width / 2
    back, roof = front + goal.depth, goal.height + thick
    return (
        *_mirrored((front, post, 0.0), (back, post + thick, roof), "goal", GREY),
        *_mirrored((front, -post - thick, 0.0), (back, -post, roof), "goal", GREY),
        *_mirrored((back, -post - thick, 0.0), (back + thick, post + thick, roof), "goal", GREY),
        *_mirrored((front, -post, goal.height), (back, post, roof), "goal", GREY),
    )


def _ramps(table: Table) -> tuple[Shape, ...]:
    """Return a tilted box in each corner whose upper face rises from the floor to the corner, within both walls."""
    if table.ramps.height == 0.0 or table.ramps.leg == 0.0:
        return ()
    return tuple(_ramp(table, side_x, side_y) for side_x, side_y in _TO_CORNER)


def _ramp(table: Table, side_x: float, side_y: float) -> Shape:
    """Return one ramp: its local x climbs towards the corner, its local z is the face's normal."""
    height, leg, thick = table.ramps.height, table.ramps.leg, table.floor.thickness
    run = leg * sqrt(0.5)
    slope = sqrt(run * run + height * height)
    rise, level = height / slope, run / slope
    half_cos = sqrt((1.0 + level) / 2.0)
    half_sin = rise / (2.0 * half_cos)
    turn_sin, turn_cos = _TO_CORNER[side_x, side_y]
    orientation = (turn_sin * half_sin, -turn_cos * half_sin, turn_sin * half_cos, turn_cos * half_cos)
    outwards = slope / 2.0 * level + thick / 2.0 * rise - run
    middle = (
        side_x * (table.field.length / 2 + outwards * sqrt(0.5)),
        side_y * (table.field.width / 2 + outwards * sqrt(0.5)),
        slope / 2.0 * rise - thick / 2.0 * level,
    )
    box = Box((slope / 2.0, run, thick / 2.0))
    return Shape(box, "ramps", DARK_GREEN, middle, orientation, materials.WOOD, TABLE)

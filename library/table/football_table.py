"""The football table's scenery: floor, walls, goals, corner ramps, strips along the side walls."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import ceil, sqrt
from typing import Final

from foosim.library.table.settings import TABLE, Floor, Goal, Playfield, Ramps, Strips, Table, Walls
from foosim.world.component_types.registry import scene
from foosim.world.component_types.settings import SceneSettings
from foosim.world.matter import materials
from foosim.world.scene import Box, Colour, Cylinder, Geometry, Shape, Vector, moved, rotate

GREEN: Final[Colour] = (0.16, 0.45, 0.24, 1.0)
DARK_GREEN: Final[Colour] = (0.13, 0.38, 0.20, 1.0)
WOOD: Final[Colour] = (0.45, 0.30, 0.18, 1.0)
GREY: Final[Colour] = (0.35, 0.35, 0.38, 1.0)
WHITE: Final[Colour] = (0.93, 0.93, 0.93, 1.0)
LINE_M: Final = 0.0002
"""How far a line is above what it is drawn on: visible to a camera, and less than a depth is accurate."""

_COS_EIGHTH: Final = sqrt((1.0 + sqrt(0.5)) / 2.0)
_SIN_EIGHTH: Final = sqrt((1.0 - sqrt(0.5)) / 2.0)
_TO_CORNER: Final[dict[tuple[float, float], tuple[float, float]]] = {
    (1.0, 1.0): (_SIN_EIGHTH, _COS_EIGHTH),
    (-1.0, 1.0): (_COS_EIGHTH, _SIN_EIGHTH),
    (-1.0, -1.0): (-_COS_EIGHTH, _SIN_EIGHTH),
    (1.0, -1.0): (-_SIN_EIGHTH, _COS_EIGHTH),
}
"""Sine and cosine of half the angle from +x to each corner (45, 135, 225 - 360 and 315 - 360 degrees)."""


class FootballTableSettings(SceneSettings):
    """The table without rods and balls."""

    field: Playfield
    floor: Floor
    walls: Walls
    goal: Goal
    ramps: Ramps
    strips: Strips | None = None


@scene("football_table", FootballTableSettings)
def table_scenery(table: Table | FootballTableSettings) -> tuple[Shape, ...]:
    """Floor, walls, goals, ramps and strips; boxes only, since a concave mesh lets fast balls through.

    Where these reach under or behind others, they are drawn otherwise: as a cabinet with a field in it.
    """
    floor = replace(_floor(table), visuals=(*_field(table), *_lines(table)))
    walls = (*_cabinet(table, _side_walls(table)), *_end_walls(table))
    return (floor, *walls, *_goals(table), *_ramps(table), *_strips(table))


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


def _floor(table: Table | FootballTableSettings) -> Shape:
    """Return the floor: it reaches under the walls and the goals' pockets."""
    x = table.field.length / 2 + 2 * table.walls.thickness + table.goal.depth
    y = table.field.width / 2 + table.walls.thickness
    return _box((-x, -y, -table.floor.thickness), (x, y, 0.0), "floor", GREEN)


def _field(table: Table | FootballTableSettings) -> Iterator[Shape]:
    """Yield the field between the walls, and the floors of the goals."""
    x, y, thick, post = table.field.length / 2, table.field.width / 2, table.floor.thickness, table.goal.width / 2
    yield _box((-x, -y, -thick), (x, y, 0.0), "floor", GREEN)
    yield from _mirrored((x, -post, -thick), (_back(table), post, 0.0), "floor", GREY)


def _lines(table: Table | FootballTableSettings) -> Iterator[Shape]:
    """Yield halfway line, circle, spots and goal areas: flat shapes, each a little above those before."""
    length, width = table.field.length, table.field.width
    thin, circle, spot = 0.004 * length, 0.14 * width, 0.008 * length
    for radius, level, colour in ((circle, 1, WHITE), (circle - thin, 2, GREEN), (spot, 3, WHITE)):
        yield _flat(Cylinder(radius, 2.0 * level * LINE_M), 0.0, 0.0, colour)
    yield _flat(Box((thin / 2, width / 2, 3.0 * LINE_M)), 0.0, 0.0, WHITE)
    y, depth = min(0.75 * table.goal.width, width / 2 - table.ramps.leg), 0.1 * length
    for side in (-1.0, 1.0):
        front = side * (length / 2 - depth)
        yield _flat(Cylinder(spot, 2.0 * LINE_M), side * 0.25 * length, 0.0, WHITE)
        yield _flat(Box((thin / 2, y, LINE_M)), front, 0.0, WHITE)
        for edge in (-y, y):
            yield _flat(Box((depth / 2, thin / 2, LINE_M)), side * (length - depth) / 2, edge, WHITE)


def _flat(geometry: Geometry, x: float, y: float, colour: Colour) -> Shape:
    return Shape(geometry, "floor", colour, (x, y, 0.0), name=TABLE)


def _back(table: Table | FootballTableSettings) -> float:
    """Return the x of the insides of the goals' backs."""
    return table.field.length / 2 + table.walls.thickness + table.goal.depth


def _cabinet(table: Table | FootballTableSettings, walls: tuple[Shape, ...]) -> Iterator[Shape]:
    """Yield the side walls, drawn down to the floor's lower face and on around the goals, with a deck above these."""
    thick, inner = table.walls.thickness, table.field.width / 2
    outer, back, under = table.field.length / 2 + thick, _back(table) + 1.2 * thick, -table.floor.thickness
    top = max(table.walls.height, table.goal.height + 1.5 * thick)
    for wall, side in zip(walls, (1.0, -1.0), strict=True):
        y, end = side * (inner + thick / 2), side * back
        low, high = sorted((end, end - side * thick))
        west, east = sorted((end, side * outer))
        visuals = (
            _box((-back, y - thick / 2, under), (back, y + thick / 2, table.walls.height), "walls", WOOD),
            _box((low, -inner, under), (high, inner, top), "walls", WOOD),
            _box((west, -inner, top - thick / 2), (east, inner, top), "walls", WOOD),
        )
        yield replace(wall, visuals=visuals)


def _side_walls(table: Table | FootballTableSettings) -> tuple[Shape, ...]:
    x = table.field.length / 2 + table.walls.thickness
    inner, outer, top = table.field.width / 2, table.field.width / 2 + table.walls.thickness, table.walls.height
    return (
        _box((-x, inner, 0.0), (x, outer, top), "walls", WOOD),
        _box((-x, -outer, 0.0), (x, -inner, top), "walls", WOOD),
    )


def _end_walls(table: Table | FootballTableSettings) -> tuple[Shape, ...]:
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


def _goals(table: Table | FootballTableSettings) -> tuple[Shape, ...]:
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


def _ramps(table: Table | FootballTableSettings) -> tuple[Shape, ...]:
    """Return a tilted box in each corner whose upper face rises from the floor to the corner, within both walls."""
    if table.ramps.height == 0.0 or table.ramps.leg == 0.0:
        return ()
    ramps = [_ramp(table, side_x, side_y) for side_x, side_y in _TO_CORNER]
    return tuple(replace(ramp, visuals=tuple(_between_walls(table, ramp))) for ramp in ramps)


def _ramp(table: Table | FootballTableSettings, side_x: float, side_y: float) -> Shape:
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


def _between_walls(table: Table | FootballTableSettings, ramp: Shape) -> Iterator[Shape]:
    """Yield a ramp in boxes that become narrower towards the corner, so that all of them end within the walls."""
    assert isinstance(ramp.geometry, Box)
    half, run, deep = ramp.geometry.half
    count = ceil(run / table.walls.thickness)
    for number in range(count):
        width, x = run * (count - number) / count, half * ((2 * number + 1) / count - 1.0)
        middle = moved(ramp.position, rotate(ramp.orientation, (x, 0.0, deep / 2)), 1.0)
        yield replace(ramp, geometry=Box((half / count, width, deep / 2)), position=middle)


def _strips(table: Table | FootballTableSettings) -> tuple[Shape, ...]:
    """Return a tilted box along each side wall whose upper face rises from the floor to the wall."""
    return () if table.strips is None else tuple(_strip(table, table.strips, side) for side in (1.0, -1.0))


def _strip(table: Table | FootballTableSettings, strips: Strips, side: float) -> Shape:
    """Return one strip: its local y climbs towards the wall at y of this sign, its local z is the face's normal."""
    thick = table.floor.thickness
    slope = sqrt(strips.width * strips.width + strips.height * strips.height)
    rise, level = strips.height / slope, strips.width / slope
    half_cos = sqrt((1.0 + level) / 2.0)
    half_sin = rise / (2.0 * half_cos)
    middle = (
        0.0,
        side * (table.field.width / 2 - strips.width / 2 + thick / 2.0 * rise),
        strips.height / 2.0 - thick / 2.0 * level,
    )
    box = Box((table.field.length / 2, slope / 2.0, thick / 2.0))
    return Shape(box, "ramps", DARK_GREEN, middle, (side * half_sin, 0.0, 0.0, half_cos), materials.WOOD, TABLE)

"""A motorised rod of the football table with its figures, which slides and turns about one axis."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import sqrt
from typing import Final

from foosim.library.table.rod_drives import RodVoltageSettings
from foosim.library.table.settings import Line, LineName, Table, Team, table_of
from foosim.world.component_types.descriptions import CONTACTS, JOINTS, TOUCHES
from foosim.world.component_types.registry import model
from foosim.world.component_types.settings import RobotSettings
from foosim.world.components.base import Model
from foosim.world.components.view import Mounting, WritableView
from foosim.world.matter.materials import METAL, PLASTIC
from foosim.world.scene import Body, Box, Colour, Cylinder, Link, Quaternion, Shape, Sphere, Vector
from foosim.world.spec import WorldSpec

RUBBER: Final[Colour] = (0.08, 0.08, 0.08, 1.0)
SKIN: Final[Colour] = (0.85, 0.62, 0.47, 1.0)
WHITE: Final[Colour] = (0.93, 0.93, 0.93, 1.0)
STEEL: Final[Colour] = (0.75, 0.75, 0.78, 1.0)
TEAM_COLOURS: Final[dict[str, Colour]] = {"red": (0.80, 0.10, 0.10, 1.0), "blue": (0.10, 0.20, 0.80, 1.0)}
ALONG_Y: Final[Quaternion] = (-sqrt(0.5), 0.0, 0.0, sqrt(0.5))
"""Turns a cylinder's axis from z to y."""
Y_AXIS: Final[Vector] = (0.0, 1.0, 0.0)

SPEED_FACTOR: Final = 1.5
"""A rod's declared speed limit is this many times its drive's: a ball may push it faster than its motor does."""
STOP_DEPTH_M: Final = 0.01
"""How far a rod may be beyond its stroke: joint stops give way a little."""


class RodRobot(RobotSettings):
    """A motorised rod with its figures. Its usual actuator is `position`, of the kind `rod_position`."""

    team: Team
    line: LineName


def line_x_m(spec: WorldSpec, robot: RodRobot) -> float:
    """Return the x of a rod's axis in the world frame: red's own goal is at negative x, blue's lines are mirrored."""
    x = table_of(spec).lines[robot.line].x
    return x if robot.team == "red" else -x


@model(
    "rod",
    RodRobot,
    slots={
        **dict.fromkeys(JOINTS, 2),
        "quarantined": 1,
        "down": 1,
        **CONTACTS,
        "refused": 1,
        "unmoved": 1,
    },
    on_demand=TOUCHES,
    is_rigid=True,
    couples=False,
    kit="table",
    actuators={"position": {"kind": "rod_position"}},
    units={"joint_positions": ("m", "rad"), "joint_velocities": ("m/s", "rad/s"), "joint_efforts": ("N", "N m")},
)
class Rod(Model):
    """A rod: a carriage that slides along world +y, and on it what turns about +y; at 0 the feet hang straight down."""

    def __init__(self, settings: RodRobot, at: Mounting) -> None:
        self._settings, self._at = settings, at
        self._table = table_of(at.spec)
        self._slide, self._speed = at.slot("joint_positions").at, at.slot("joint_velocities").at
        drive, tick_s = self._table.drive, at.spec.tick_ns / 1e9
        self._slide_max = self._table.lines[settings.line].half_stroke + STOP_DEPTH_M
        self._slide_speed_max = drive.slide.speed * SPEED_FACTOR
        self._spin_speed_max = drive.spin.speed * SPEED_FACTOR
        self._slide_reach_m, self._spin_reach_rad = self._slide_speed_max * tick_s, self._spin_speed_max * tick_s

    def body(self) -> Body:
        """Return carriage and figures.

        The tube's shape is the carriage's: it has a surface of its own, a link has one, and a further link costs a
        fifth of a step. So a ball that flies against the tube does not feel it spin; the tube's inertia turns with the
        figures.
        """
        table, name = self._table, self._at.robot.name
        rod, line = table.rod, table.lines[self._settings.line]
        tube = Shape(Cylinder(rod.radius, rod.length), "rods", STEEL, orientation=ALONG_Y, radio=METAL)
        thin = rod.carriage_mass * rod.length * rod.length / 12.0
        mass, centre, (across, about, upwards) = _spin_mass(table, line)
        actuators = [its for _, its in sorted(self._settings.actuators.items())]
        motors = [its for its in actuators if isinstance(its, RodVoltageSettings)]
        along, around = sum([its.slide.rotor for its in motors], 0.0), sum([its.spin.rotor for its in motors], 0.0)
        slide = Link(
            name=f"{name}/slide",
            joint="prismatic",
            shapes=(tube,),
            mass=rod.carriage_mass + along,
            inertia=(thin, rod.carriage_mass * rod.radius * rod.radius, thin),
            axis=Y_AXIS,
            limits=(-line.half_stroke, line.half_stroke),
            visuals=(tube, *_grips(table, -1.0 if self._settings.team == "red" else 1.0)),
        )
        colour = TEAM_COLOURS[self._settings.team]
        figures = _figures(table, line, colour)
        inertia = across, about + around, upwards
        spin = Link(f"{name}/spin", "continuous", figures, mass, inertia, (0.0, 0.0, centre), Y_AXIS, parent=0)
        spin = replace(spin, visuals=tuple(_drawn_figures(table, line, colour)))
        x = line_x_m(self._at.spec, self._settings)
        return Body(name, "rod", (x, 0.0, rod.axis_height), (slide, spin))

    def place(self, view: WritableView) -> None:
        """Centre it, figures down."""
        view.write(self._at.slot("contacts"), 0.0, 0.0, -1.0)

    def is_plausible(self, numbers: Sequence[float], before: Sequence[float]) -> bool:
        """Whether it is within its stroke, its speed limits and its reach."""
        slide, speed = self._slide, self._speed
        return (
            -self._slide_max <= numbers[slide] <= self._slide_max
            and abs(numbers[slide] - before[slide]) <= self._slide_reach_m
            and abs(numbers[slide + 1] - before[slide + 1]) <= self._spin_reach_rad
            and -self._slide_speed_max <= numbers[speed] <= self._slide_speed_max
            and -self._spin_speed_max <= numbers[speed + 1] <= self._spin_speed_max
        )


def figure_ys(line: Line) -> list[float]:
    """Return the places of a line's figures along their rod, from its middle."""
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
        shapes.append(Shape(foot, "figures", colour, (0.0, y, foot_z), radio=PLASTIC))
        shapes.append(Shape(body, "figures", colour, (0.0, y, body_z), radio=PLASTIC))
    return tuple(shapes)


def _grips(table: Table, side: float) -> Iterator[Shape]:
    """Yield the grip at the end of a rod at y of this sign, and the cap at the other end."""
    rod = table.rod
    for way, radius, long in ((side, 2.0 * rod.radius, 0.1 * rod.length), (-side, 1.3 * rod.radius, 0.01 * rod.length)):
        yield Shape(Cylinder(radius, long), "rods", RUBBER, (0.0, way * (rod.length - long) / 2, 0.0), ALONG_Y)


def _drawn_figures(table: Table, line: Line, colour: Colour) -> Iterator[Shape]:
    """Yield what figures look like: feet, legs, a body around the rod, and a head above it."""
    rod = table.rod
    long, wide, tall = rod.body.length / 2, rod.body.width / 2, rod.body.height
    head = 0.8 * min(long, wide)
    low = rod.foot.height - rod.foot_radius
    for y in figure_ys(line):
        foot = Box((rod.foot.length / 2, rod.foot.width / 2, rod.foot.height / 2))
        yield Shape(foot, "figures", colour, (0.0, y, low - rod.foot.height / 2))
        yield Shape(Box((0.7 * long, 0.7 * wide, 0.2 * tall)), "figures", WHITE, (0.0, y, low + 0.2 * tall))
        yield Shape(Box((long, wide, 0.27 * tall)), "figures", colour, (0.0, y, low + 0.65 * tall))
        yield Shape(Sphere(head), "figures", SKIN, (0.0, y, max(low + tall - head, rod.radius + 0.7 * head)))


def _spin_mass(table: Table, line: Line) -> tuple[float, float, Vector]:
    """Return mass, height of the centre of mass over the axis, and inertia about that centre of what turns.

    Parts: a hollow cylinder on the axis, and for each figure a solid box as tall as foot and body and as long and wide
    as the body, whose centre of mass hangs below the axis; all moved by the parallel axis theorem.
    """
    rod = table.rod
    below = rod.figure_com_below_axis
    count = line.figures
    mass = rod.tube_mass + count * rod.figure_mass
    centre = -count * rod.figure_mass * below / mass
    radii = rod.radius * rod.radius + rod.inner_radius * rod.inner_radius
    long, wide, tall = rod.body.length, rod.body.width, rod.foot.height + rod.body.height
    squares = sum(y * y for y in figure_ys(line))
    tube_across = rod.tube_mass * (radii / 4.0 + rod.length * rod.length / 12.0)
    figure_x = (wide * wide + tall * tall) / 12.0 + below * below
    figure_y = (long * long + tall * tall) / 12.0 + below * below
    figure_z = (long * long + wide * wide) / 12.0
    shift = mass * centre * centre
    return (
        mass,
        centre,
        (
            tube_across + rod.figure_mass * (count * figure_x + squares) - shift,
            rod.tube_mass * radii / 2.0 + rod.figure_mass * count * figure_y - shift,
            tube_across + rod.figure_mass * (count * figure_z + squares),
        ),
    )

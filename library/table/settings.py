"""The world parameters of the football table: `table:` of a deployment.

Frame of reference: x along the field from red's goal (-x) to blue's (+x), y across it, z up, the origin on the floor in
the middle. Every value is in SI units here. Sources of the numbers are in deploy/table.yaml.
"""

from itertools import pairwise
from math import hypot, pi
from typing import Annotated, Final, Literal

from pydantic import Field

from foosim.common import units
from foosim.common.spec_base import (
    Acceleration,
    AngularAcceleration,
    Coefficient,
    Force,
    Gain,
    Gravity,
    Length,
    LengthOrNone,
    Mass,
    Position,
    Restitution,
    RuleTime,
    SpecBase,
    Speed,
    Spin,
    Torque,
)
from foosim.common.units import Quantity
from foosim.world.scene import PRIMITIVES_MAX
from foosim.world.spec import WorldSpec

TABLE: Final = "table"
STEEL_DENSITY: Final = 7850.0
"""kg/m3, of carbon steel (EN 10025: 7,850)."""
MatchTime = Annotated[int, Quantity(units.TIME, "1 s", "1000 h")]
LineName = Literal["goal", "defence", "midfield", "attack"]
LINE_NAMES: Final[tuple[LineName, ...]] = ("goal", "defence", "midfield", "attack")
Team = Literal["red", "blue"]
TEAMS: Final[tuple[Team, ...]] = ("red", "blue")


class Playfield(SpecBase):
    """The playing field between the walls: length along x, width along y."""

    length: Length
    width: Length


class Floor(SpecBase):
    """The floor under the field; its upper face is z = 0."""

    thickness: Length


class Walls(SpecBase):
    """The walls around the field: height above the floor, thickness outwards."""

    height: Length
    thickness: Length


class Goal(SpecBase):
    """Either goal: an opening in the middle of an end wall, with a pocket behind it."""

    width: Length
    height: Length
    depth: Length


class Ramps(SpecBase):
    """The four corner ramps: right triangles in plan, both legs `leg` long, rising to `height` in the corner."""

    height: LengthOrNone
    leg: LengthOrNone


class Strips(SpecBase):
    """Strips along both side walls, `width` wide, that rise from the floor to `height` at the wall."""

    height: Length
    width: Length


class Surface(SpecBase):
    """What the ball feels of a surface: values of the pair, rolling friction as a length."""

    restitution: Restitution
    friction: Coefficient
    rolling_friction: LengthOrNone


class BallSurface(SpecBase):
    """What a ball feels of another ball. Not 0: engines take a pair's values as products of both sides'."""

    restitution: Annotated[float, Field(ge=0.01, le=1)]
    friction: Annotated[float, Field(ge=0.01, le=10)]


class Surfaces(SpecBase):
    """The ball against each kind of body, and against another ball. Strips are as the ramps."""

    floor: Surface
    walls: Surface
    goal: Surface
    ramps: Surface
    figures: Surface
    rods: Surface
    balls: BallSurface


class Ball(SpecBase):
    """A solid sphere. Its speed limit, a promise of the model, bounds how far it can get in a tick."""

    radius: Length
    mass: Mass
    speed_limit: Annotated[float, Quantity(units.SPEED, "1 m/s", "100 m/s")]


class Box(SpecBase):
    """A box: length along x, width along y, height along z, of a figure that hangs straight down."""

    length: Length
    width: Length
    height: Length


class Rod(SpecBase):
    """A rod with its figures. The spin inertia is computed from these parts.

    An `inner_radius` of 0 makes it a solid one. Without `mass` the tube is of steel.
    """

    radius: Length
    inner_radius: LengthOrNone
    length: Length
    axis_height: Length
    mass: Mass | None = None
    carriage_mass: Mass
    figure_mass: Mass
    figure_com_below_axis: LengthOrNone
    foot_radius: Length
    foot: Box
    body: Box

    @property
    def tube_mass(self) -> float:
        """The mass of the tube, without carriage and figures (kg)."""
        if self.mass is not None:
            return self.mass
        section = pi * (self.radius * self.radius - self.inner_radius * self.inner_radius)
        return STEEL_DENSITY * section * self.length


FIGURES_MAX: Final = PRIMITIVES_MAX // 2
"""Figures of a rod: foot and body of each are boxes of one link."""


class Line(SpecBase):
    """One of a team's four lines: the place of its rod for red (blue's is mirrored) and its parts."""

    x: Position
    figures: Annotated[int, Field(ge=1, le=FIGURES_MAX)]
    pitch: LengthOrNone
    half_stroke: Length


class SlideAxis(SpecBase):
    """A rod's motor along y: target speed = gain (1/s) x error, within +-speed, at no more than the force.

    Nor more than accelerates the rod by `acceleration` without a load, where that is given.
    """

    speed: Speed
    force: Force
    acceleration: Acceleration | None = None
    gain: Gain


class SpinAxis(SpecBase):
    """A rod's motor around y: target speed = gain (1/s) x error, within +-speed, at no more than the torque.

    Nor more than accelerates the rod by `acceleration` without a load, where that is given.
    """

    speed: Spin
    torque: Torque
    acceleration: AngularAcceleration | None = None
    gain: Gain


class Drive(SpecBase):
    """The limits of a rod's drives, and the gains of position drives."""

    slide: SlideAxis
    spin: SpinAxis


class Match(SpecBase):
    """When a match ends: after `duration` with a ball in play or with `goals` of a team, whichever is first.

    Without `duration` there is no limit of time, without `goals` none of goals.
    """

    duration_ns: MatchTime | None = Field(default=None, alias="duration")
    goals: Annotated[int, Field(ge=1, le=1000)] | None = None


class Rules(SpecBase):
    """When and where the ball is kicked off, when it counts as dead, when a match ends, and where the world ends.

    `kickoff` is where the ball rolls after a goal: towards the team that `conceded` it, or to either side, `drawn`, as
    it does after all else. `dead_ball` is where a dead ball comes back: at the kick-off `spot`, or midway between the
    two `lines` where it lay, from where it rolls away from the nearer goal. Without `match` play has no end.
    """

    kickoff: Literal["drawn", "conceded"] = "drawn"
    kickoff_speed: Speed
    kickoff_delay_ns: RuleTime = Field(alias="kickoff_delay")
    dead_ball: Literal["spot", "lines"] = "spot"
    dead_ball_speed: Speed
    dead_ball_after_ns: RuleTime = Field(alias="dead_ball_after")
    off_table_after_ns: RuleTime = Field(alias="off_table_after")
    out_margin: Length
    match: Match | None = None


class Table(SpecBase):
    """The whole table: its parts, materials, drives and rules."""

    gravity: Gravity
    field: Playfield
    floor: Floor
    walls: Walls
    goal: Goal
    ramps: Ramps
    strips: Strips | None = None
    surfaces: Surfaces
    ball: Ball
    spare_balls: Annotated[int, Field(ge=0, le=63)] = 0
    """Further balls that a run can add."""
    rod: Rod
    lines: dict[LineName, Line]
    drive: Drive
    rules: Rules
    contact_erp: Annotated[float, Field(ge=0, le=1)]
    solver_iterations: Annotated[int, Field(ge=1, le=1000)]


def rod_reach(rod: Rod) -> float:
    """Return how far any part of a figure is from its rod's axis (m)."""
    feet = hypot(rod.foot.length / 2, rod.foot_radius)
    top = rod.foot.height + rod.body.height - rod.foot_radius
    return max(feet, hypot(rod.body.length / 2, top), hypot(rod.body.length / 2, rod.foot_radius - rod.foot.height))


def places_between_lines(table: Table) -> tuple[tuple[float, float], ...]:
    """Return the places midway between neighbouring lines of both teams that no figure reaches, where a ball can lie.

    Each is its x, and how far from the middle a ball lies on the level floor there at most (m), clear of walls, ramps
    and strips.
    """
    ball, rod = table.ball.radius, table.rod
    axes = sorted(side * line.x for line in table.lines.values() for side in (1.0, -1.0))
    above = rod.axis_height - ball
    places = []
    for left, right in pairwise(axes):
        x = (left + right) / 2
        level = table.field.length / 2 - abs(x) + table.field.width / 2 - table.ramps.leg
        y = min(table.field.width / 2 - (table.strips.width if table.strips else 0.0), level) - ball
        if hypot((right - left) / 2, above) > rod_reach(rod) + ball and y >= 0.0:
            places.append((x, y))
    return tuple(places)


def table_of(spec: WorldSpec) -> Table:
    """Return the table of a world that has one."""
    return spec.section(TABLE, Table)

"""The world parameters of the football table: `table:` of a deployment.

Frame of reference: x along the field from red's goal (-x) to blue's (+x), y across it, z up, the origin on the floor in
the middle. Every value is in SI units here. Sources of the numbers are in deploy/table.yaml.
"""

from typing import Annotated, Final, Literal

from pydantic import Field

from foosim.common import units
from foosim.common.spec_base import (
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
from foosim.world.spec import WorldSpec

TABLE: Final = "table"
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
    """The ball against each kind of body, and against another ball."""

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
    """A rod with its figures. The spin inertia is computed from these parts."""

    radius: Length
    inner_radius: LengthOrNone
    length: Length
    axis_height: Length
    mass: Mass
    carriage_mass: Mass
    figure_mass: Mass
    figure_com_below_axis: LengthOrNone
    foot_radius: Length
    foot: Box
    body: Box


class Line(SpecBase):
    """One of a team's four lines: where its rod stands for red (blue's is mirrored) and what is on it."""

    x: Position
    figures: Annotated[int, Field(ge=1, le=11)]
    pitch: LengthOrNone
    half_stroke: Length


class SlideAxis(SpecBase):
    """A rod's motor along y: target speed = gain (1/s) x error, within +-speed, at no more than the force."""

    speed: Speed
    force: Force
    gain: Gain


class SpinAxis(SpecBase):
    """A rod's motor around y: target speed = gain (1/s) x error, within +-speed, at no more than the torque."""

    speed: Spin
    torque: Torque
    gain: Gain


class Drive(SpecBase):
    """The position drive that every rod has."""

    slide: SlideAxis
    spin: SpinAxis


class Rules(SpecBase):
    """When the ball is kicked off, when it counts as dead, and where the world ends."""

    kickoff_speed: Speed
    kickoff_delay_ns: RuleTime = Field(alias="kickoff_delay")
    dead_ball_speed: Speed
    dead_ball_after_ns: RuleTime = Field(alias="dead_ball_after")
    off_table_after_ns: RuleTime = Field(alias="off_table_after")
    out_margin: Length


class Table(SpecBase):
    """The whole table: what is built, what it is made of, what drives it, which rules hold."""

    gravity: Gravity
    field: Playfield
    floor: Floor
    walls: Walls
    goal: Goal
    ramps: Ramps
    surfaces: Surfaces
    ball: Ball
    rod: Rod
    lines: dict[LineName, Line]
    drive: Drive
    rules: Rules
    contact_erp: Annotated[float, Field(ge=0, le=1)]
    solver_iterations: Annotated[int, Field(ge=1, le=1000)]


def table_of(spec: WorldSpec) -> Table:
    """Return the table of a world that has one."""
    return spec.section(TABLE, Table)

"""The world parameters of the football table, as they stand under `table:` of a deployment.

Frame of reference: x along the field from red's goal (-x) to blue's (+x), y across it, z up, the origin on the floor in
the middle. Every value is in SI units here. Where a number comes from stands beside it in deploy/table.yaml.
Neighbours: deployment.py, which holds one `Table`; the engines and `scene`, which build the world from it.
"""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from foosim.protocol import units
from foosim.protocol.names import LineName
from foosim.protocol.units import Quantity

Gravity = Annotated[float, Quantity(units.ACCELERATION, "0 m/s2", "100 m/s2")]
Length = Annotated[float, Quantity(units.LENGTH, "0.1 mm", "10 m")]
LengthOrNone = Annotated[float, Quantity(units.LENGTH, "0 m", "10 m")]
Position = Annotated[float, Quantity(units.LENGTH, "-10 m", "10 m")]
Mass = Annotated[float, Quantity(units.MASS, "1 mg", "100 kg")]
Speed = Annotated[float, Quantity(units.SPEED, "0 m/s", "100 m/s")]
Spin = Annotated[float, Quantity(units.SPIN, "0 rad/s", "1000 rad/s")]
Force = Annotated[float, Quantity(units.FORCE, "0 N", "10 kN")]
Torque = Annotated[float, Quantity(units.TORQUE, "0 N m", "1000 N m")]
Gain = Annotated[float, Field(ge=0, le=10_000)]
Coefficient = Annotated[float, Field(ge=0, le=10)]
Restitution = Annotated[float, Field(ge=0, le=1)]
RuleTime = Annotated[int, Quantity(units.TIME, "0 s", "1 h")]


class Part(BaseModel):
    """Base of all models of the deployment: unknown keys are refused, types are not guessed, values do not change.

    A model's validator is built when it is first used: each process would otherwise build some eighty that are parts of
    the deployment's, when it starts.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False, defer_build=True)


class Playfield(Part):
    """The playing field between the walls: length along x, width along y."""

    length: Length
    width: Length


class Floor(Part):
    """The floor under the field; its upper face is z = 0."""

    thickness: Length


class Walls(Part):
    """The walls around the field: height above the floor, thickness outwards."""

    height: Length
    thickness: Length


class Goal(Part):
    """Either goal: an opening in the middle of an end wall, with a pocket behind it."""

    width: Length
    height: Length
    depth: Length


class Ramps(Part):
    """The four corner ramps: right triangles in plan, both legs `leg` long, rising to `height` in the corner."""

    height: LengthOrNone
    leg: LengthOrNone


class Surface(Part):
    """What the ball feels of a surface: values of the pair, rolling friction as a length."""

    restitution: Restitution
    friction: Coefficient
    rolling_friction: LengthOrNone


class BallSurface(Part):
    """What a ball feels of another ball. Not 0: engines take a pair's values as products of both sides'."""

    restitution: Annotated[float, Field(ge=0.01, le=1)]
    friction: Annotated[float, Field(ge=0.01, le=10)]


class Surfaces(Part):
    """The ball against each kind of body, and against another ball."""

    floor: Surface
    walls: Surface
    goal: Surface
    ramps: Surface
    figures: Surface
    rods: Surface
    balls: BallSurface


class Ball(Part):
    """A solid sphere. Its speed limit, a promise of the model, bounds how far it can get in a tick."""

    radius: Length
    mass: Mass
    speed_limit: Annotated[float, Quantity(units.SPEED, "1 m/s", "100 m/s")]


class Box(Part):
    """A box: length along x, width along y, height along z, of a figure that hangs straight down."""

    length: Length
    width: Length
    height: Length


class Rod(Part):
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


class Line(Part):
    """One of a team's four lines: where its rod stands for red (blue's is mirrored) and what is on it."""

    x: Position
    figures: Annotated[int, Field(ge=1, le=11)]
    pitch: LengthOrNone
    half_stroke: Length


class SlideAxis(Part):
    """A rod's motor along y: wanted speed = gain (1/s) x error, within +-speed, at no more than the force."""

    speed: Speed
    force: Force
    gain: Gain


class SpinAxis(Part):
    """A rod's motor around y: wanted speed = gain (1/s) x error, within +-speed, at no more than the torque."""

    speed: Spin
    torque: Torque
    gain: Gain


class Drive(Part):
    """The position drive that every rod has."""

    slide: SlideAxis
    spin: SpinAxis


class Rules(Part):
    """When the ball is kicked off, when it counts as dead, and where the world ends."""

    kickoff_speed: Speed
    kickoff_delay_ns: RuleTime = Field(alias="kickoff_delay")
    dead_ball_speed: Speed
    dead_ball_after_ns: RuleTime = Field(alias="dead_ball_after")
    off_table_after_ns: RuleTime = Field(alias="off_table_after")
    out_margin: Length


class Table(Part):
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

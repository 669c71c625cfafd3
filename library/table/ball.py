"""The ball of a football table, a free solid sphere, and the sensor of its position, as of an overhead camera."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Final

from msgspec import Struct

from foosim.common.errors import BadValue
from foosim.library.table.settings import table_of
from foosim.world.component_types.descriptions import BODY, CONTACTS
from foosim.world.component_types.quantities import Metres
from foosim.world.component_types.registry import model, sensor
from foosim.world.component_types.settings import RobotSettings, SensorSettings
from foosim.world.components.base import Model, Sensor
from foosim.world.components.view import Mounting, View, WritableView
from foosim.world.matter.materials import PLASTIC
from foosim.world.scene import ORIGIN, Body, Colour, Link, Shape, Sphere, Vector

WHITE: Final[Colour] = (1.0, 1.0, 0.98, 1.0)


@model(
    "ball",
    RobotSettings,
    slots={**BODY, "quarantined": 1, **CONTACTS},
    is_robot=False,
    is_rigid=True,
    couples=False,
    kit="table",
)
class Ball(Model):
    """A ball: a solid sphere, I = 2/5 m r^2."""

    def __init__(self, settings: None, at: Mounting) -> None:
        table = self._table = table_of(at.spec)
        self._name = at.robot.name
        self._at = at
        self._position = at.slot("position").at
        self._velocity = at.slot("linear_velocity").at
        margin = table.rules.out_margin
        self._x_max = table.field.length / 2 + margin
        self._y_max = table.field.width / 2 + margin
        self._z_min, self._z_max = -margin, table.walls.height + margin
        self._speed_max = table.ball.speed_limit
        self._reach_m = table.ball.speed_limit * (at.spec.tick_ns / 1e9)

    def body(self) -> Body:
        """Return the sphere."""
        ball = self._table.ball
        inertia = 0.4 * ball.mass * ball.radius * ball.radius
        shape = Shape(Sphere(ball.radius), "ball", WHITE, radio=PLASTIC)
        link = Link(self._name, "free", (shape,), ball.mass, (inertia, inertia, inertia))
        return Body(self._name, "ball", ORIGIN, (link,), speed_limit=ball.speed_limit)

    def place(self, view: WritableView) -> None:
        """Lay it on the kick-off spot, at rest."""
        self.place_at(view, (0.0, 0.0, self._table.ball.radius))

    def place_at(self, view: WritableView, position: Vector, velocity: Vector = ORIGIN) -> None:
        """Set it to a place (m) with a velocity (m/s) and without spin, and out of quarantine."""
        at = self._at
        view.write(at.slot("position"), *position)
        view.write(at.slot("orientation"), 0.0, 0.0, 0.0, 1.0)
        view.write(at.slot("linear_velocity"), *velocity)
        view.write(at.slot("angular_velocity"), *ORIGIN)
        view.write(at.slot("quarantined"), 0.0)
        view.write(at.slot("contacts"), 0.0, 0.0, -1.0)

    def check_place(self, position: Vector) -> None:
        """Raise BadValue for a place outside of the table."""
        table = self._table
        x, y, z = bounds = (table.field.length / 2, table.field.width / 2, table.walls.height)
        if any(abs(value) > bound for value, bound in zip(position, bounds, strict=True)) or position[2] <= 0.0:
            valid = f"valid are x up to {x:g} m and y up to {y:g} m from the middle, z above 0 m up to {z:g} m"
            raise BadValue(f"a place outside of the table: {valid}", ", ".join(f"{value:g} m" for value in position))

    def excite(self, view: WritableView) -> None:
        """Kick it, for the run that compares engines."""
        view.write(self._at.slot("linear_velocity"), 1.0, 0.3, 0.0)

    def is_plausible(self, numbers: Sequence[float], before: Sequence[float]) -> bool:
        """Whether it is over the table, within its speed limit and its reach."""
        start, velocity = self._position, self._velocity
        x, y, z = numbers[start : start + 3]
        vx, vy, vz = numbers[velocity : velocity + 3]
        dx, dy, dz = x - before[start], y - before[start + 1], z - before[start + 2]
        return (
            abs(x) <= self._x_max
            and abs(y) <= self._y_max
            and self._z_min <= z <= self._z_max
            and vx * vx + vy * vy + vz * vz <= self._speed_max * self._speed_max
            and dx * dx + dy * dy + dz * dz <= self._reach_m * self._reach_m
        )

    def out_of_bounds(self, numbers: Sequence[float]) -> str:
        """Return that it is out of the table or too fast, unless it is in quarantine."""
        if numbers[self._at.slot("quarantined").at] > 0.0:
            return ""
        x, y, _ = numbers[self._position : self._position + 3]
        speed = sum(value * value for value in numbers[self._velocity : self._velocity + 3])
        inside = abs(x) <= self._x_max and abs(y) <= self._y_max and speed <= self._speed_max * self._speed_max
        return "" if inside else "is out of its bounds"


class BallSettings(SensorSettings):
    """Reads the ball's position."""


class BallPosition(Struct, frozen=True):
    """Where the ball is: `x`, `y`, `z` in the world frame (origin on the floor in the middle, z up)."""

    x: Metres
    y: Metres
    z: Metres

    groups: ClassVar = {"position": ("x", "y", "z")}


@sensor("ball", BallSettings, BallPosition, kit="table")
class BallTracker(Sensor):
    """The ball's position in the world frame."""

    def __init__(self, settings: BallSettings, at: Mounting) -> None:
        self._start = at.layout["ball"].offsets["position"]

    def sample(self, view: View) -> BallPosition:
        return BallPosition(*view.numbers[self._start : self._start + 3])

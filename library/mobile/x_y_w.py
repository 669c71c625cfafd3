"""Velocity of a base that moves in any direction: in its own frame, and about its axis."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

from foosim.common.exact_math import hypot
from foosim.library.mobile.holonomic import HolonomicRobot
from foosim.world.component_types.quantities import MetresPerSecond
from foosim.world.component_types.registry import actuator
from foosim.world.component_types.settings import ActuatorSettings
from foosim.world.components.base import SetPointActuator, slot
from foosim.world.components.view import Mounting, View, WritableView


class XYWSettings(ActuatorSettings):
    """Drives a holonomic base; the limits are those of its model."""


class Velocity(Struct, frozen=True):
    """The velocity of a base in its own frame, `x` ahead and `y` to the left, and how fast it turns to the left."""

    x: MetresPerSecond
    y: MetresPerSecond
    angular: Annotated[float, Meta(extra={"unit": "rad/s"})]


@actuator("x_y_w", XYWSettings, Velocity, needs=("base_velocity",))
class VelocityActuator(SetPointActuator):
    """The drive of a base, which keeps the velocity of the last command."""

    _set_point = slot(3)

    def __init__(self, settings: XYWSettings, at: Mounting) -> None:
        robot = at.spec.robots[at.robot.name]
        assert isinstance(robot, HolonomicRobot), f"{at.robot.name} is no base of the model holonomic"
        self._speed, self._turn_rate = robot.speed, robot.turn_rate
        self._acceleration, self._turning = robot.acceleration, robot.acceleration / robot.radius

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return the least and greatest speed in either direction (m/s) and turn rate (rad/s)."""
        speed, rate = self._speed, self._turn_rate
        return {"x": (-speed, speed), "y": (-speed, speed), "angular": (-rate, rate)}

    def within(self, command: Velocity) -> Velocity:
        """Return the requested velocity, shortened to the greatest speed of the base."""
        x, y, most = command.x, command.y, self._speed
        if x * x + y * y <= most * most:
            return command
        share = most / hypot(x, y)
        return Velocity(x * share, y * share, command.angular)

    def excite(self, view: WritableView) -> None:
        """Go askew in a curve, for the run that compares engines."""
        view.write(self._set_point, 0.5 * self._speed, 0.3 * self._speed, 0.3 * self._turn_rate)

    def command(self, view: View) -> tuple[tuple[float, float], ...]:
        """Return (target, greatest acceleration) of the speeds ahead, to the left, and turning left, in SI units."""
        x, y, angular = view.read(self._set_point)
        return (x, self._acceleration), (y, self._acceleration), (angular, self._turning)

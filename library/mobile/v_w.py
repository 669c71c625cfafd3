"""A robot on two wheels by its speed and how fast it turns.

The wheels' set-points are v - w track / 2 and v + w track / 2 (Siegwart, Nourbakhsh, Scaramuzza, *Introduction to
Autonomous Mobile Robots*, section 3.2). Where a wheel would be faster than it can be, both are slower by one factor:
the robot moves along the requested arc.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

from msgspec import Meta, Struct

from foosim.library.mobile.wheels import wheels_of
from foosim.world.component_types.quantities import MetresPerSecond
from foosim.world.component_types.registry import actuator
from foosim.world.component_types.settings import ActuatorSettings
from foosim.world.components.base import SetPointActuator, slot
from foosim.world.components.entities import Motors
from foosim.world.components.view import Mounting, View, WritableView

if TYPE_CHECKING:  # only processes that compute ticks need numpy
    from foosim.library.mobile.set_points import MotionSetPoints


class VWSettings(ActuatorSettings):
    """Drives a robot on two wheels by speed and turn rate; the limits are those of its model."""


class Motion(Struct, frozen=True):
    """The speed ahead, and how fast the robot turns to the left."""

    linear: MetresPerSecond
    angular: Annotated[float, Meta(extra={"unit": "rad/s"})]


@actuator("v_w", VWSettings, Motion, needs=("wheel_speeds",))
class MotionActuator(SetPointActuator):
    """The two wheels of a robot, as one motion."""

    _set_point = slot(2)

    def __init__(self, settings: VWSettings, at: Mounting) -> None:
        """Raises BadValue for a model without wheels."""
        self._wheels = wheels_of(at.spec, at.layout, at.robot)
        self._at, self._half_track = self._set_point.at, self._wheels.track / 2.0

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return the least and greatest speed (m/s) and turn rate (rad/s)."""
        speed, rate = self._wheels.speed, self._wheels.turn_rate
        return {"linear": (-speed, speed), "angular": (-rate, rate)}

    def excite(self, view: WritableView) -> None:
        """Drive in a curve, for the run that compares engines."""
        view.write(self._set_point, 0.5 * self._wheels.speed, 0.3 * self._wheels.turn_rate)

    def command(self, view: View) -> Motors:
        """Return the set-points of the motors of the left and the right wheel (`Wheels.set_points`)."""
        linear, aside = view.numbers[self._at], view.numbers[self._at + 1] * self._half_track
        left, right = linear - aside, linear + aside
        most = self._wheels.speed
        fastest = max(abs(left), abs(right))
        if fastest > most:
            share = most / fastest
            left, right = left * share, right * share
        return self._wheels.set_points(left, right, view)

    @staticmethod
    def together(actuators: Sequence[MotionActuator]) -> MotionSetPoints:
        """Return these as one; their robots move by kinematics."""
        from foosim.library.mobile.set_points import MotionSetPoints

        return MotionSetPoints([one._set_point for one in actuators], [one._wheels for one in actuators])

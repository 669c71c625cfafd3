"""The drive of two wheels: the rims of both approach their set-points of speed as fast as the motors accelerate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from msgspec import Struct

from foosim.library.mobile.wheels import wheels_of
from foosim.world.component_types.quantities import MetresPerSecond
from foosim.world.component_types.registry import actuator
from foosim.world.component_types.settings import ActuatorSettings
from foosim.world.components.base import SetPointActuator, slot
from foosim.world.components.entities import Motors
from foosim.world.components.view import Mounting, View, WritableView

if TYPE_CHECKING:  # only processes that compute ticks need numpy
    from foosim.library.mobile.set_points import WheelSetPoints


class WheelSpeedsSettings(ActuatorSettings):
    """Turns the two wheels of a robot; speed and acceleration are those of its model."""


class Drive(Struct, frozen=True):
    """The set-points of both wheels; both positive is ahead, a faster right one turns left."""

    left: MetresPerSecond
    right: MetresPerSecond


@actuator("wheel_speeds", WheelSpeedsSettings, Drive, needs=("wheel_speeds",))
class DriveActuator(SetPointActuator):
    """The two wheels of a robot."""

    _set_point = slot(2)

    def __init__(self, settings: WheelSpeedsSettings, at: Mounting) -> None:
        """Raises BadValue for a model without wheels."""
        self._wheels = wheels_of(at.spec, at.layout, at.robot)
        self._speed = self._wheels.speed

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return the least and greatest speed of each wheel (m/s)."""
        return {"left": (-self._speed, self._speed), "right": (-self._speed, self._speed)}

    def excite(self, view: WritableView) -> None:
        """Drive in a curve, for the run that compares engines."""
        view.write(self._set_point, 0.3 + 0.01 * (self._set_point.at % 7), 0.4)

    def command(self, view: View) -> Motors:
        """Return the set-points of the motors of the left and the right wheel (`Wheels.set_points`)."""
        left, right = view.read(self._set_point)
        return self._wheels.set_points(left, right, view)

    @staticmethod
    def together(actuators: Sequence[DriveActuator]) -> WheelSetPoints:
        """Return these as one; their robots move by kinematics."""
        from foosim.library.mobile.set_points import WheelSetPoints

        return WheelSetPoints([one._set_point for one in actuators], [one._wheels for one in actuators])

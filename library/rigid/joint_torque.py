"""Joints with efforts: forces of joints that slide, torques of joints that turn."""

from __future__ import annotations

from msgspec import Struct

from foosim.library.rigid.joints import Efforts, JointActuator, JointSettings
from foosim.world.component_types.registry import actuator
from foosim.world.components.entities import Motors
from foosim.world.components.view import View, WritableView


class JointTorqueSettings(JointSettings):
    """Applies efforts to joints, at most the effort of each."""


class JointEfforts(Struct, frozen=True):
    """The efforts of joints, in their order (N or N m)."""

    efforts: Efforts


@actuator("joint_torque", JointTorqueSettings, JointEfforts, joints="joints")
class JointTorqueActuator(JointActuator):
    """Motors that apply the efforts of the last command, up to the greatest speeds of their joints."""

    def bounds(self) -> tuple[tuple[float, float], ...]:
        """Return the least and the greatest effort of each joint."""
        return tuple((-force, force) for force in self.group.forces)

    def hold(self, view: WritableView) -> None:
        """Let the joints go."""
        view.write(self.set_point, *[0.0] * self.set_point.size)

    def excite(self, view: WritableView) -> None:
        """Push each joint a little, for the run that compares engines."""
        view.write(self.set_point, *[min(0.01, force) for force in self.group.forces])

    def command(self, view: View) -> Motors:
        """Return of each motor its greatest speed in the direction of the effort, and the effort.

        So a joint is driven with the effort until it is as fast as its motor can be.
        """
        efforts = view.read(self.set_point)
        return tuple(
            [
                (speed if effort > 0.0 else -speed, abs(effort))
                for effort, speed in zip(efforts, self.group.speeds, strict=True)
            ]
        )

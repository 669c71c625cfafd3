"""Joints with efforts: forces of joints that slide, torques of joints that turn."""

from __future__ import annotations

from msgspec import Struct

from foosim.library.rigid.joints import Efforts, JointGroup, JointSettings, set_points
from foosim.world.component_types.registry import actuator
from foosim.world.components.base import Actuator
from foosim.world.components.entities import Motors
from foosim.world.components.view import Mounting, View, WritableView


class JointTorqueSettings(JointSettings):
    """Applies efforts to joints, at most the effort of each."""


class JointEfforts(Struct, frozen=True):
    """The efforts of joints, in their order (N or N m)."""

    efforts: Efforts


@actuator(
    "joint_torque", JointTorqueSettings, JointEfforts, slots=set_points, needs=("joint_positions",), joints="joints"
)
class JointTorqueActuator(Actuator):
    """Motors that apply the efforts of the last command, up to the greatest speeds of their joints."""

    def __init__(self, settings: JointTorqueSettings, at: Mounting) -> None:
        self._group = JointGroup(settings, at)

    @staticmethod
    def check(settings: JointTorqueSettings, at: Mounting) -> None:
        """Raise IncompatibleComponent for a joint that the robot does not have."""
        JointGroup(settings, at)

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return no bounds that are common to all joints: each has its own."""
        return {}

    def bounds(self) -> tuple[tuple[float, float], ...]:
        """Return the least and the greatest effort of each joint."""
        return tuple((-force, force) for force in self._group.forces)

    def names(self) -> tuple[str, ...]:
        """Return the names of the numbers of a command: the links on the joints."""
        return self._group.names

    def accept(self, command: JointEfforts, view: WritableView) -> bool:
        """Take the efforts of all joints."""
        view.write(self._group.set_point, *command.efforts)
        return True

    def hold(self, view: WritableView) -> None:
        """Let the joints go."""
        view.write(self._group.set_point, *[0.0] * self._group.set_point.size)

    def excite(self, view: WritableView) -> None:
        """Push each joint a little, for the run that compares engines."""
        view.write(self._group.set_point, *[min(0.01, force) for force in self._group.forces])

    def command(self, view: View) -> Motors:
        """Return of each motor its greatest speed in the direction of the effort, and the effort.

        So a joint is driven with the effort until it is as fast as its motor can be.
        """
        efforts = view.read(self._group.set_point)
        return tuple(
            [
                (speed if effort > 0.0 else -speed, abs(effort))
                for effort, speed in zip(efforts, self._group.speeds, strict=True)
            ]
        )

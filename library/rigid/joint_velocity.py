"""Joints at speeds, as by motors with speed controllers."""

from __future__ import annotations

from msgspec import Struct

from foosim.library.rigid.joints import JointGroup, JointSettings, Velocities, set_points
from foosim.world.component_types.registry import actuator
from foosim.world.components.base import Actuator
from foosim.world.components.entities import Motors
from foosim.world.components.view import Mounting, View, WritableView


class JointVelocitySettings(JointSettings):
    """Moves joints at speeds, with at most the effort of each joint."""


class JointVelocities(Struct, frozen=True):
    """The set-points of the speeds of joints, in their order (m/s or rad/s)."""

    velocities: Velocities


@actuator(
    "joint_velocity",
    JointVelocitySettings,
    JointVelocities,
    slots=set_points,
    needs=("joint_positions",),
    joints="joints",
)
class JointVelocityActuator(Actuator):
    """Motors that keep the speeds of the last command."""

    def __init__(self, settings: JointVelocitySettings, at: Mounting) -> None:
        self._group = JointGroup(settings, at)

    @staticmethod
    def check(settings: JointVelocitySettings, at: Mounting) -> None:
        """Raise IncompatibleComponent for a joint that the robot does not have."""
        JointGroup(settings, at)

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return no bounds that are common to all joints: each has its own."""
        return {}

    def bounds(self) -> tuple[tuple[float, float], ...]:
        """Return the least and the greatest speed of each joint."""
        return tuple((-speed, speed) for speed in self._group.speeds)

    def names(self) -> tuple[str, ...]:
        """Return the names of the numbers of a command: the links on the joints."""
        return self._group.names

    def accept(self, command: JointVelocities, view: WritableView) -> bool:
        """Take the speeds of all joints."""
        view.write(self._group.set_point, *command.velocities)
        return True

    def hold(self, view: WritableView) -> None:
        """Stop the joints."""
        view.write(self._group.set_point, *[0.0] * self._group.set_point.size)

    def excite(self, view: WritableView) -> None:
        """Turn each joint a little, for the run that compares engines."""
        view.write(self._group.set_point, *[0.2] * self._group.set_point.size)

    def command(self, view: View) -> Motors:
        """Return speed and greatest force of each motor."""
        wanted = view.read(self._group.set_point)
        return tuple(zip(wanted, self._group.forces, strict=True))

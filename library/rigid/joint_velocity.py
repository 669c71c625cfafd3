"""Joints at speeds, as by motors with speed controllers."""

from __future__ import annotations

from msgspec import Struct

from foosim.library.rigid.joints import JointActuator, JointSettings, Velocities
from foosim.world.component_types.registry import actuator
from foosim.world.components.entities import Motors
from foosim.world.components.view import View, WritableView


class JointVelocitySettings(JointSettings):
    """Moves joints at speeds, with at most the effort of each joint."""


class JointVelocities(Struct, frozen=True):
    """The set-points of the speeds of joints, in their order (m/s or rad/s)."""

    velocities: Velocities


@actuator("joint_velocity", JointVelocitySettings, JointVelocities, joints="joints")
class JointVelocityActuator(JointActuator):
    """Motors that keep the speeds of the last command."""

    def bounds(self) -> tuple[tuple[float, float], ...]:
        """Return the least and the greatest speed of each joint."""
        return tuple((-speed, speed) for speed in self.group.speeds)

    def hold(self, view: WritableView) -> None:
        """Stop the joints."""
        view.write(self.set_point, *[0.0] * self.set_point.size)

    def excite(self, view: WritableView) -> None:
        """Turn each joint a little, for the run that compares engines."""
        view.write(self.set_point, *[0.2] * self.set_point.size)

    def command(self, view: View) -> Motors:
        """Return speed and greatest force of each motor."""
        wanted = view.read(self.set_point)
        return tuple(zip(wanted, self.group.forces, strict=True))

"""Joints with efforts: forces of joints that slide, torques of joints that turn."""

from __future__ import annotations

from msgspec import Struct

from foosim.world.components.drives import Motor
from foosim.world.components.misfit import Misfit
from foosim.world.components.view import Mounting, View, WritableView
from foosim.world.forms.registry import actuator
from foosim.world.parameters.joints import JointGroup, JointSettings, Many, set_points


class JointTorqueSettings(JointSettings):
    """Applies efforts to joints, at most the effort of each."""


class JointEfforts(Struct, frozen=True):
    """The efforts of joints, in their order (N or N m)."""

    efforts: Many


@actuator("joint_torque", JointTorqueSettings, JointEfforts, slots=set_points, needs=("joint_positions",))
class JointTorqueActuator:
    """Motors that apply the last efforts that they were told, throughout each tick."""

    def __init__(self, settings: JointTorqueSettings, at: Mounting) -> None:
        self._group = JointGroup(settings, at)
        self.joints = self._group.indices

    @staticmethod
    def check(settings: JointTorqueSettings, at: Mounting) -> None:
        """Raise Misfit for a joint that the robot does not have, and a robot whose motors have speeds alone."""
        JointGroup(settings, at)
        if not at.robot.kind.couples:
            raise Misfit(("kind",), f"the motors of a {at.robot.model} have speeds alone", settings.kind)

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return no bounds that are common to all joints: each has its own."""
        return {}

    def accept(self, command: JointEfforts, view: WritableView) -> bool:
        """Take the efforts of all joints; one above its joint's greatest refuses them."""
        forces = self._group.forces
        return self._group.take(command.efforts, [-force for force in forces], forces, view)

    def hold(self, view: WritableView) -> None:
        """Let the joints go."""
        view.write(self._group.set_point, *[0.0] * self._group.set_point.size)

    def stir(self, view: WritableView) -> None:
        """Push each joint a little, for the small run that tells engines apart."""
        view.write(self._group.set_point, *[min(0.01, force) for force in self._group.forces])

    def command(self, view: View) -> tuple[Motor, ...]:
        """Return the effort of each motor, which keeps no speed."""
        return tuple([Motor(0.0, 0.0, effort) for effort in view.read(self._group.set_point)])

"""Joints to positions: a proportional loop from set-points to the speeds of the joints' motors."""

from __future__ import annotations

from msgspec import Struct

from foosim.library.rigid.joints import JointGroup, JointLoopSettings, Positions, loop_points
from foosim.world.component_types.registry import actuator
from foosim.world.components.base import Actuator
from foosim.world.components.entities import Motors
from foosim.world.components.view import Mounting, View, WritableView


class JointPositionSettings(JointLoopSettings):
    """Moves joints to positions: the speed of each is `gain` times its error, at most that of the joint.

    The loop runs once a tick, so the gain is at most the inverse of a tick: a greater one overshoots.
    """


class JointPositions(Struct, frozen=True):
    """The set-points of joints, in their order (m or rad)."""

    positions: Positions


@actuator(
    "joint_position",
    JointPositionSettings,
    JointPositions,
    slots=loop_points,
    needs=("joint_positions",),
    joints="joints",
)
class JointPositionActuator(Actuator):
    """A proportional loop: speed = gain x (set-point - position); the motor has at most the effort of the joint."""

    def __init__(self, settings: JointPositionSettings, at: Mounting) -> None:
        self._group = JointGroup(settings, at)
        self._gain = settings.gain

    @staticmethod
    def check(settings: JointPositionSettings, at: Mounting) -> None:
        """Raise IncompatibleComponent for a joint that the robot does not have."""
        JointGroup(settings, at)

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return no bounds that are common to all joints: each has its own."""
        return {}

    def bounds(self) -> tuple[tuple[float, float], ...]:
        """Return the least and the greatest position of each joint."""
        return tuple(zip(self._group.lows, self._group.highs, strict=True))

    def names(self) -> tuple[str, ...]:
        """Return the names of the numbers of a command: the links on the joints."""
        return self._group.names

    def accept(self, command: JointPositions, view: WritableView) -> bool:
        """Take the set-points of all joints."""
        view.write(self._group.set_point, *command.positions)
        return True

    def hold(self, view: WritableView) -> None:
        """Make the present positions the set-points."""
        view.write(self._group.set_point, *self._group.positions(view))

    def excite(self, view: WritableView) -> None:
        """Move each joint by a little, for the run that compares engines."""
        view.write(self._group.set_point, *[position + 0.2 for position in self._group.positions(view)])

    def command(self, view: View) -> Motors:
        """Return speed and greatest force of each motor."""
        return self._group.towards(view.read(self._group.set_point), view, self._gain)

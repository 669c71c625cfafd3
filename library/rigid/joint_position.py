"""Joints to positions: a proportional loop from set-points to the speeds of the joints' motors."""

from __future__ import annotations

from msgspec import Struct

from foosim.library.rigid.joints import JointActuator, JointLoopSettings, Positions
from foosim.world.component_types.registry import actuator
from foosim.world.components.entities import Motors
from foosim.world.components.view import Mounting, View


class JointPositionSettings(JointLoopSettings):
    """Moves joints to positions: the speed of each is `gain` times its error, at most that of the joint.

    The loop runs once a tick, so the gain is at most the inverse of a tick: a greater one overshoots.
    """


class JointPositions(Struct, frozen=True):
    """The set-points of joints, in their order (m or rad)."""

    positions: Positions


@actuator("joint_position", JointPositionSettings, JointPositions, joints="joints")
class JointPositionActuator(JointActuator):
    """A proportional loop: speed = gain x (set-point - position); the motor has at most the effort of the joint."""

    def __init__(self, settings: JointPositionSettings, at: Mounting) -> None:
        super().__init__(settings, at)
        self._gain = settings.gain

    def bounds(self) -> tuple[tuple[float, float], ...]:
        """Return the least and the greatest position of each joint."""
        return tuple(zip(self.group.lows, self.group.highs, strict=True))

    def command(self, view: View) -> Motors:
        """Return speed and greatest force of each motor."""
        return self.group.towards(view.read(self.set_point), view, self._gain)

"""Poses to which the rule `teleported` of the world puts a robot at once."""

from __future__ import annotations

from msgspec import Struct

from foosim.common.exact_math import PI
from foosim.world.component_types.quantities import Metres, Radians
from foosim.world.component_types.registry import actuator
from foosim.world.component_types.settings import ActuatorSettings
from foosim.world.components.base import Actuator, slot
from foosim.world.components.entities import Motors
from foosim.world.components.view import View, WritableView
from foosim.world.placing import FAR_M


class TeleportSettings(ActuatorSettings):
    """Takes poses for the rule `teleported` of the world."""


class UprightPose(Struct, frozen=True):
    """A place in the world, and the heading there, from +x towards +y."""

    x: Metres
    y: Metres
    z: Metres
    yaw: Radians


@actuator("teleport", TeleportSettings, UprightPose, moves=False)
class Teleport(Actuator):
    """Keeps the pose of the last command, and counts the commands."""

    target, count = slot(4), slot()

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return the least and greatest of each coordinate (m) and of the yaw (rad)."""
        return dict.fromkeys("xyz", (-FAR_M, FAR_M)) | {"yaw": (-2.0 * PI, 2.0 * PI)}

    def accept(self, command: UprightPose, view: WritableView) -> bool:
        """Take a pose."""
        view.write(self.target, command.x, command.y, command.z, command.yaw)
        view.write(self.count, view.numbers[self.count.at] + 1.0)
        return True

    def excite(self, view: WritableView) -> None:
        """Take a pose, for the run that compares engines."""
        self.accept(UprightPose(1.0, 1.0, 0.0, 0.5), view)

    def command(self, view: View) -> Motors:
        """Return nothing: it commands no motor."""
        return ()

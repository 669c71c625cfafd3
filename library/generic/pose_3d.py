"""Position and orientation of a place on a robot."""

from __future__ import annotations

from typing import ClassVar

from msgspec import Struct

from foosim.world.component_types.quantities import Metres, QuaternionPart
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.mounted import MountedSensor
from foosim.world.components.view import View
from foosim.world.placing import FIRST_LINK, MountedAt


class Pose3dSettings(SensorSettings):
    """Where a place on a robot is, and how it is turned: `at` is that place, in the frame of a link."""

    at: MountedAt = FIRST_LINK


class Pose3d(Struct, frozen=True):
    """A pose in the world frame: `x`, `y`, `z`, and the unit quaternion from the mount's frame to the world's."""

    x: Metres
    y: Metres
    z: Metres
    qx: QuaternionPart
    qy: QuaternionPart
    qz: QuaternionPart
    qw: QuaternionPart

    groups: ClassVar = {"position": ("x", "y", "z"), "orientation": ("qx", "qy", "qz", "qw")}


@sensor("pose_3d", Pose3dSettings, Pose3d, shown_as="foxglove.PoseInFrame")
class PoseTracker3d(MountedSensor):
    """Position and orientation of the mount in the world frame."""

    def sample(self, view: View) -> Pose3d:
        position, orientation = self.mount.pose(view.numbers)
        return Pose3d(*position, *orientation)

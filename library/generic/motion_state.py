"""Pose and velocity of a place on a robot in one reading."""

from __future__ import annotations

from typing import ClassVar

from foosim.library.generic.pose_3d import Pose3d, Pose3dSettings
from foosim.world.component_types.quantities import MetresPerSecond, RadiansPerSecond
from foosim.world.component_types.registry import sensor
from foosim.world.components.mounted import Mounted, MountedSensor
from foosim.world.components.view import Mounting, View


class MotionStateSettings(Pose3dSettings):
    """Where a place on a robot is, and how it moves: `at` is that place, in the frame of a link."""


class MotionState(Pose3d, frozen=True):
    """Pose and velocity in the world frame: a pose as that of `pose_3d`, the velocity of the place, and how fast the
    mount turns about the axes of the world."""

    vx: MetresPerSecond
    vy: MetresPerSecond
    vz: MetresPerSecond
    wx: RadiansPerSecond
    wy: RadiansPerSecond
    wz: RadiansPerSecond

    groups: ClassVar = Pose3d.groups | {"linear": ("vx", "vy", "vz"), "angular": ("wx", "wy", "wz")}


@sensor("motion_state", MotionStateSettings, MotionState)
class MotionStateSensor(MountedSensor):
    """Pose and velocity of the mount in the world frame."""

    @staticmethod
    def check(settings: MotionStateSettings, at: Mounting) -> None:
        """Raise IncompatibleComponent for a robot whose motion at that place is unknown."""
        Mounted(at, settings.at).check_twist()

    def sample(self, view: View) -> MotionState:
        position, orientation = self.mount.pose(view.numbers)
        linear, angular = self.mount.twist(view.numbers)
        return MotionState(*position, *orientation, *linear, *angular)

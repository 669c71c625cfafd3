"""How far a place on a robot has come since the start, and since the reading before."""

from __future__ import annotations

from typing import ClassVar

from foosim.library.generic.pose_3d import Pose3d, Pose3dSettings
from foosim.world.component_types.quantities import Metres, QuaternionPart
from foosim.world.component_types.registry import sensor
from foosim.world.components.base import slot
from foosim.world.components.mounted import MountedSensor
from foosim.world.components.view import WritableView
from foosim.world.scene import conjugate, moved, multiply, rotate


class TravelSettings(Pose3dSettings):
    """Integrated odometry without errors: `at` is its place, in the frame of a link; modifiers add errors."""


class Travel(Pose3d, frozen=True):
    """A pose in the frame of the mount at the first reading, and `last_`, that of the reading before."""

    last_x: Metres
    last_y: Metres
    last_z: Metres
    last_qx: QuaternionPart
    last_qy: QuaternionPart
    last_qz: QuaternionPart
    last_qw: QuaternionPart

    groups: ClassVar = Pose3d.groups | {"last_position": ("last_x", "last_y", "last_z")}


@sensor("travel", TravelSettings, Travel)
class TravelSensor(MountedSensor):
    """Keeps the pose (m, quaternion) of the first reading, and of the one before, in the world frame."""

    has_begun, begun, last = slot(), slot(7), slot(7)

    def sample(self, view: WritableView) -> Travel:
        position, orientation = self.mount.pose(view.numbers)
        now = (*position, *orientation)
        is_first = view.numbers[self.has_begun.at] == 0.0
        (x, y, z, a, b, c, d), last = (now, now) if is_first else (view.read(self.begun), view.read(self.last))
        if is_first:
            view.write(self.has_begun, 1.0)
            view.write(self.begun, *now)
        view.write(self.last, *now)
        start, back = (x, y, z), conjugate((a, b, c, d))
        poses = ((moved((i, j, k), start, -1.0), (p, q, r, s)) for i, j, k, p, q, r, s in (now, last))
        return Travel(*[number for way, turned in poses for number in (*rotate(back, way), *multiply(back, turned))])

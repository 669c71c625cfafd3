"""An inertial measurement unit: accelerometer and gyroscope at a place on a robot.

An accelerometer measures the specific force f = a - g, its acceleration less that of free fall, in its own axes; one at
rest shows the gravity upwards (Groves, Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems,
2013, section 2.4.7). Here a is the mean since the reading before: the velocity of the mount less that at the frame of
that reading, divided by the time between, as units report that integrate between their readings. At the rate of the
ticks that is the difference over one tick. The velocity is that of the mount, so the lever arm from the centre of mass
is in it, with its centripetal and its tangential part. The axes are those of the mount at the reading.
"""

from __future__ import annotations

from typing import ClassVar

from msgspec import Struct

from foosim.world.assembly.sections import gravity_of
from foosim.world.component_types.quantities import MetresPerSecondSquared, RadiansPerSecond
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.base import slot
from foosim.world.components.mounted import Mounted, MountedSensor
from foosim.world.components.view import Mounting, WritableView
from foosim.world.placing import FIRST_LINK, MountedAt
from foosim.world.scene import rotate


class ImuSettings(SensorSettings):
    """Measures specific force and angular rate at a place on a robot: `at` is that place, in the frame of a link.

    The acceleration is the mean since the reading before; in the first reading it is 0.
    """

    at: MountedAt = FIRST_LINK


class Inertial(Struct, frozen=True):
    """What the mount feels, in its own axes: the specific force `fx`, `fy`, `fz`, and how fast it turns about them."""

    fx: MetresPerSecondSquared
    fy: MetresPerSecondSquared
    fz: MetresPerSecondSquared
    wx: RadiansPerSecond
    wy: RadiansPerSecond
    wz: RadiansPerSecond

    groups: ClassVar = {"specific_force": ("fx", "fy", "fz"), "angular_rate": ("wx", "wy", "wz")}


@sensor("imu", ImuSettings, Inertial)
class Imu(MountedSensor):
    """Specific force and angular rate at the mount, in its axes.

    `velocity` is that of the mount at the reading before (m/s, world frame), `last_tick` the tick of that one counted
    from 1, 0 before the first.
    """

    velocity, last_tick = slot(3), slot()

    def __init__(self, settings: ImuSettings, at: Mounting) -> None:
        super().__init__(settings, at)
        self._gravity = gravity_of(at.spec)
        self._tick_s = at.spec.tick_ns / 1e9

    @staticmethod
    def check(settings: ImuSettings, at: Mounting) -> None:
        """Raise IncompatibleComponent for a robot whose motion at that place is unknown."""
        Mounted(at, settings.at).check_twist()

    def sample(self, view: WritableView) -> Inertial:
        (vx, vy, vz), angular = self.mount.twist(view.numbers)
        ax, ay, az = 0.0, 0.0, 0.0
        ticks = view.tick + 1.0 - view.numbers[self.last_tick.at]
        if 0.0 < ticks <= view.tick:
            time_s = ticks * self._tick_s
            ux, uy, uz = view.read(self.velocity)
            ax, ay, az = (vx - ux) / time_s, (vy - uy) / time_s, (vz - uz) / time_s
        view.write(self.velocity, vx, vy, vz)
        view.write(self.last_tick, view.tick + 1.0)
        _, (x, y, z, w) = self.mount.pose(view.numbers)
        to_mount = -x, -y, -z, w
        return Inertial(*rotate(to_mount, (ax, ay, az + self._gravity)), *rotate(to_mount, angular))

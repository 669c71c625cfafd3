"""An accelerometer without gravity: how a place on a robot moves, by the differences of its readings."""

from __future__ import annotations

from math import sqrt
from typing import ClassVar

from msgspec import Struct

from foosim.library.generic.imu import Imu, ImuSettings
from foosim.world.component_types.quantities import Metres, MetresPerSecond, MetresPerSecondSquared
from foosim.world.component_types.registry import sensor
from foosim.world.components.base import slot
from foosim.world.components.view import WritableView
from foosim.world.scene import conjugate, dot, moved, rotate


class AccelerometerSettings(ImuSettings):
    """Measures distance, velocity and acceleration at a place on a robot: `at` is that place, in the frame of a link.

    Distance and acceleration are since the reading before; in the first reading they are 0.
    """


class Acceleration(Struct, frozen=True):
    """How far the mount has moved, its velocity, and its mean acceleration, without that of free fall, in its axes."""

    distance: Metres
    vx: MetresPerSecond
    vy: MetresPerSecond
    vz: MetresPerSecond
    ax: MetresPerSecondSquared
    ay: MetresPerSecondSquared
    az: MetresPerSecondSquared

    groups: ClassVar = {"velocity": ("vx", "vy", "vz"), "acceleration": ("ax", "ay", "az")}


@sensor("accelerometer", AccelerometerSettings, Acceleration)
class Accelerometer(Imu):
    """As the IMU measures it, less gravity. `place` is that of the mount at the reading before (m, world frame)."""

    place = slot(3)

    def sample(self, view: WritableView) -> Acceleration:  # type: ignore[override]
        position, orientation = self.mount.pose(view.numbers)
        x, y, z = position if view.numbers[self.last_tick.at] == 0.0 else view.read(self.place)
        view.write(self.place, *position)
        way, back = moved(position, (x, y, z), -1.0), conjugate(orientation)
        felt = super().sample(view)
        linear, _ = self.mount.twist(view.numbers)
        acceleration = moved((felt.fx, felt.fy, felt.fz), rotate(back, (0.0, 0.0, self._gravity)), -1.0)
        return Acceleration(sqrt(dot(way, way)), *rotate(back, linear), *acceleration)

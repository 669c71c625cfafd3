"""How fast a place on a robot moves, and how fast it turns."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from msgspec import Meta, Struct

from foosim.world.component_types.quantities import MetresPerSecond
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.mounted import MountedSensor
from foosim.world.components.view import Mounting, View
from foosim.world.placing import FIRST_LINK, MountedAt
from foosim.world.scene import rotate

RadiansPerSecond = Annotated[float, Meta(extra={"unit": "rad/s"})]


class VelocitySettings(SensorSettings):
    """How fast the mount of the sensor moves and turns, in the `frame` of the mount itself or of the world."""

    at: MountedAt = FIRST_LINK
    frame: Literal["own", "world"] = "own"


class Velocity(Struct, frozen=True):
    """The velocity of a place, and the turn rate of its link about each axis."""

    x: MetresPerSecond
    y: MetresPerSecond
    z: MetresPerSecond
    angular_x: RadiansPerSecond
    angular_y: RadiansPerSecond
    angular_z: RadiansPerSecond

    groups: ClassVar = {"linear": ("x", "y", "z"), "angular": ("angular_x", "angular_y", "angular_z")}


@sensor("velocity", VelocitySettings, Velocity, needs=("position", "orientation", "linear_velocity"))
class VelocitySensor(MountedSensor):
    """Velocity and turn rate of the mount over the ground, with the slip of the wheels."""

    def __init__(self, settings: VelocitySettings, at: Mounting) -> None:
        super().__init__(settings, at)
        self._is_own = settings.frame == "own"

    def sample(self, view: View) -> Velocity:
        linear, angular = self.mount.twist(view.numbers)
        if self._is_own:
            _, (x, y, z, w) = self.mount.pose(view.numbers)
            back = (-x, -y, -z, w)
            linear, angular = rotate(back, linear), rotate(back, angular)
        return Velocity(*linear, *angular)

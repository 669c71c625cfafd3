"""The place of a mount on Earth, as by a receiver of satellite navigation."""

from __future__ import annotations

from math import pi
from typing import ClassVar, Final

from msgspec import Struct

from foosim.world.component_types.quantities import Degrees, Metres
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.mounted import MountedSensor
from foosim.world.components.view import IncompatibleComponent, Mounting, View
from foosim.world.earth import Geodesy
from foosim.world.placing import FIRST_LINK, MountedAt

DEGREES: Final = 180.0 / pi


class GpsSettings(SensorSettings):
    """Where a place on a robot is on Earth: `at` is that of the antenna, in the frame of a link.

    The deployment's `origin` is the place of its world on Earth.
    """

    at: MountedAt = FIRST_LINK


class GlobalPosition(Struct, frozen=True):
    """A place on Earth (WGS 84): `latitude` north and `longitude` east in degrees, `altitude` above the ellipsoid."""

    latitude: Degrees
    longitude: Degrees
    altitude: Metres

    groups: ClassVar = {"horizontal": ("latitude", "longitude")}


@sensor("gps", GpsSettings, GlobalPosition, shown_as="foxglove.LocationFix")
class Gps(MountedSensor):
    """Latitude, longitude and altitude of the mount."""

    def __init__(self, settings: GpsSettings, at: Mounting) -> None:
        super().__init__(settings, at)
        assert at.spec.origin is not None, "checked with the deployment"
        self._geodesy = Geodesy(at.spec.origin)

    @staticmethod
    def check(settings: GpsSettings, at: Mounting) -> None:
        """Raise IncompatibleComponent in a world without an origin on Earth."""
        if at.spec.origin is None:
            what = "in a world that is nowhere on Earth: the deployment needs origin: {latitude: ..., longitude: ...}"
            raise IncompatibleComponent(("kind",), what, settings.kind)

    def sample(self, view: View) -> GlobalPosition:
        position, _ = self.mount.pose(view.numbers)
        latitude, longitude, altitude = self._geodesy.geodetic(position)
        return GlobalPosition(latitude * DEGREES, longitude * DEGREES, altitude)

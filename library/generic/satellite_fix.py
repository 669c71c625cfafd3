"""Place and velocity on Earth, as by a receiver of satellite navigation with Doppler."""

from __future__ import annotations

from typing import ClassVar

from msgspec import Struct

from foosim.common.exact_math import sincos
from foosim.library.generic.gps import Gps, GpsSettings
from foosim.world.component_types.quantities import Degrees, Metres, MetresPerSecond
from foosim.world.component_types.registry import sensor
from foosim.world.components.mounted import Mounted
from foosim.world.components.view import Mounting, View


class SatelliteFixSettings(GpsSettings):
    """Where a place on a robot is on Earth, and how it moves there: `at` is the antenna's, in the frame of a link."""


class Fix(Struct, frozen=True):
    """A place on Earth (WGS 84): `latitude` north and `longitude` east in degrees, `altitude` above the ellipsoid; and
    the velocity to the east and the north at the world's origin, and up."""

    latitude: Degrees
    longitude: Degrees
    altitude: Metres
    east: MetresPerSecond
    north: MetresPerSecond
    up: MetresPerSecond

    groups: ClassVar = {"horizontal": ("latitude", "longitude"), "velocity": ("east", "north", "up")}


@sensor("satellite_fix", SatelliteFixSettings, Fix)
class SatelliteFix(Gps):
    """Latitude, longitude and altitude of the mount, and its velocity."""

    def __init__(self, settings: SatelliteFixSettings, at: Mounting) -> None:
        super().__init__(settings, at)
        assert at.spec.origin is not None, "checked with the deployment"
        self._ahead = sincos(at.spec.origin.heading)

    @staticmethod
    def check(settings: SatelliteFixSettings, at: Mounting) -> None:  # type: ignore[override]
        """Raise IncompatibleComponent in a world without an origin, and for a robot whose motion is unknown."""
        Gps.check(settings, at)
        Mounted(at, settings.at).check_twist()

    def sample(self, view: View) -> Fix:  # type: ignore[override]
        place = super().sample(view)
        (x, y, up), _ = self.mount.twist(view.numbers)
        east, north = self._ahead
        return Fix(place.latitude, place.longitude, place.altitude, x * east - y * north, x * north + y * east, up)

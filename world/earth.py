"""A world's place on Earth: places in its frame of reference as latitude, longitude and altitude, and back.

The ellipsoid is that of WGS 84 (NGA.STND.0036, 2014). Angles are in rad; altitudes are in m above the ellipsoid.
"""

from __future__ import annotations

from math import sqrt
from typing import Annotated, Final

from foosim.common import units
from foosim.common.exact_math import atan2, hypot, sincos
from foosim.common.spec_base import SpecBase, default
from foosim.common.units import Quantity

SEMI_MAJOR_M: Final = 6378137.0
FLATTENING: Final = 1.0 / 298.257223563
SEMI_MINOR_M: Final = SEMI_MAJOR_M * (1.0 - FLATTENING)
ECCENTRICITY2: Final = FLATTENING * (2.0 - FLATTENING)
"""The square of the first eccentricity; that of the second one is this by 1 - ECCENTRICITY2."""
ROUNDS: Final = 2
"""Rounds of Bowring's formula: up to 1000 km of height one is right to 5 mm, two to the last digits of a float."""

Point = tuple[float, float, float]
Latitude = Annotated[float, Quantity(units.ANGLE, "-90 deg", "90 deg")]
Longitude = Annotated[float, Quantity(units.ANGLE, "-180 deg", "180 deg")]
Altitude = Annotated[float, Quantity(units.LENGTH, "-11 km", "100 km")]
Bearing = Annotated[float, Quantity(units.ANGLE, "-360 deg", "360 deg")]


class EarthOrigin(SpecBase):
    """The world's origin on Earth (WGS 84), and the direction of its x axis: `heading`, clockwise from north.

    The world's z is up at the origin. With the usual heading of 90 deg x is east and y is north.
    """

    latitude: Latitude
    longitude: Longitude
    altitude: Altitude = default("0 m")
    heading: Bearing = default("90 deg")


class Geodesy:
    """Places of a world with an origin on Earth."""

    def __init__(self, origin: EarthOrigin) -> None:
        self._origin = to_ecef((origin.latitude, origin.longitude, origin.altitude))
        (sin_lat, cos_lat), (sin_lon, cos_lon) = sincos(origin.latitude), sincos(origin.longitude)
        east = -sin_lon, cos_lon, 0.0
        north = -sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat
        ahead, aside = sincos(origin.heading)
        self._axes = (
            _sum(east, ahead, north, aside),
            _sum(east, -aside, north, ahead),
            (cos_lat * cos_lon, cos_lat * sin_lon, sin_lat),
        )
        """The world's x, y and z in the Earth's frame."""

    def geodetic(self, place: Point) -> Point:
        """Return latitude, longitude (rad) and altitude (m) of a place of the world (m)."""
        x, y, z = place
        ex, ey, ez = self._axes
        ox, oy, oz = self._origin
        return to_geodetic(
            (
                ox + (x * ex[0] + y * ey[0] + z * ez[0]),
                oy + (x * ex[1] + y * ey[1] + z * ez[1]),
                oz + (x * ex[2] + y * ey[2] + z * ez[2]),
            )
        )

    def place(self, geodetic: Point) -> Point:
        """Return the place (m, world frame) of a latitude, longitude (rad) and altitude (m)."""
        at = to_ecef(geodetic)
        dx, dy, dz = at[0] - self._origin[0], at[1] - self._origin[1], at[2] - self._origin[2]
        x, y, z = (axis[0] * dx + axis[1] * dy + axis[2] * dz for axis in self._axes)
        return x, y, z


def to_ecef(geodetic: Point) -> Point:
    """Return a place in the Earth's frame (m): its origin is in the Earth's middle, x at latitude and longitude 0, z
    north. From latitude, longitude (rad) and altitude (m)."""
    latitude, longitude, altitude = geodetic
    (sin_lat, cos_lat), (sin_lon, cos_lon) = sincos(latitude), sincos(longitude)
    across = SEMI_MAJOR_M / sqrt(1.0 - ECCENTRICITY2 * sin_lat * sin_lat)
    flat = (across + altitude) * cos_lat
    return flat * cos_lon, flat * sin_lon, (across * (1.0 - ECCENTRICITY2) + altitude) * sin_lat


def to_geodetic(ecef: Point) -> Point:
    """Return latitude, longitude (rad) and altitude (m) of a place in the Earth's frame (m), as `to_ecef` has it.

    Bowring's formula (Survey Review 23, 1976), repeated with the reduced latitude that it gave; the altitude as he has
    it in Survey Review 28 (1985), which holds at the poles, too.
    """
    x, y, z = ecef
    flat = hypot(x, y)
    second = ECCENTRICITY2 / (1.0 - ECCENTRICITY2) * SEMI_MINOR_M
    reduced = atan2(z * SEMI_MAJOR_M, flat * SEMI_MINOR_M)
    latitude = 0.0
    for _ in range(ROUNDS):
        s, c = sincos(reduced)
        latitude = atan2(z + second * (s * s * s), flat - ECCENTRICITY2 * SEMI_MAJOR_M * (c * c * c))
        s, c = sincos(latitude)
        reduced = atan2((1.0 - FLATTENING) * s, c)
    s, c = sincos(latitude)
    altitude = flat * c + z * s - SEMI_MAJOR_M * sqrt(1.0 - ECCENTRICITY2 * s * s)
    return latitude, atan2(y, x), altitude


def _sum(a: Point, by: float, b: Point, other: float) -> Point:
    return a[0] * by + b[0] * other, a[1] * by + b[1] * other, a[2] * by + b[2] * other

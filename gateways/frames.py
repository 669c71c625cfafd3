"""MORSE's frames of reference on the fields of a component, as its `alter` has them, and Euler angles.

A gateway's `alter` lists them by name, in the order in which they are applied, to readings as to commands:

    alter: {cat.gps: [UTM 1000 2000 0, NED], cat.heading: [NED]}

Those of places change `x`, `y` and `z`; UTM adds offsets (m). The deployment's `origin` is the place of its world on
Earth, and says where north is. NED changes `yaw`, `pitch` and `roll` of a Gyroscope; `NED_legacy` exchanges yaw and
roll, as MORSE does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import asin, atan2, pi
from typing import Any, Final, NamedTuple

from foosim.common.errors import BadValue, UnknownName
from foosim.common.exact_math import hypot, sincos
from foosim.world.earth import EarthOrigin, Geodesy, to_ecef, to_geodetic

Fields = dict[str, Any]
Point = tuple[float, float, float]
Change = Callable[[Point], Point]
DEGREES: Final = 180.0 / pi
FEET: Final = 3.2808399
"""MORSE's feet in a metre."""
PLACED: Final = ("Pose", "GPS", "Destination", "Waypoint", "Teleport", "RotorcraftWaypoint")
TURNED: Final = ("Gyroscope",)


class Alteration(NamedTuple):
    """A change of three fields, and its inverse."""

    names: tuple[str, str, str]
    leaving: Change
    coming: Change

    def apply(self, fields: Fields, change: Change) -> Fields:
        """Return fields with the three changed."""
        a, b, c = (float(fields[name]) for name in self.names)
        return fields | dict(zip(self.names, change((a, b, c)), strict=True))


def alterations(written: Sequence[str], morse: str, origin: EarthOrigin | None) -> list[Alteration]:
    """Return those of a component of a class of MORSE. Raises BadValue, with the valid choices."""
    return [_alteration(one, morse, origin) for one in written]


def _alteration(written: str, morse: str, origin: EarthOrigin | None) -> Alteration:
    name, *offsets = written.split()
    if name not in (*OF_PLACES, *ON_EARTH, "UTM"):
        raise UnknownName("unknown frame", name, (*OF_PLACES, *ON_EARTH, "UTM"))
    if morse not in (*PLACED, *(TURNED if name in OF_ANGLES else ())):
        raise BadValue(f"{name} is for {', '.join(PLACED)}, and NED for {', '.join(TURNED)}; not for the class", morse)
    if len(offsets) != (3 if name == "UTM" else 0):
        raise BadValue("UTM has three offsets in m, as UTM 1000 2000 0, others have none", written)
    if morse in TURNED:
        return Alteration(("yaw", "pitch", "roll"), *OF_ANGLES[name])
    if name == "UTM":
        x, y, z = map(float, offsets)
        return Alteration(
            ("x", "y", "z"), lambda p: (p[0] + x, p[1] + y, p[2] + z), lambda p: (p[0] - x, p[1] - y, p[2] - z)
        )
    if name in OF_PLACES:
        return Alteration(("x", "y", "z"), *OF_PLACES[name])
    if origin is None:
        raise BadValue("in a world without an origin on Earth: add origin: {latitude: ..., longitude: ...}", name)
    (leaving, coming), geodesy = ON_EARTH[name], Geodesy(origin)
    return Alteration(("x", "y", "z"), lambda p: leaving(geodesy.geodetic(p)), lambda p: geodesy.place(coming(p)))


def euler(orientation: tuple[float, float, float, float]) -> Point:
    """Return yaw, pitch and roll of an orientation (x, y, z, w)."""
    x, y, z, w = orientation
    pitch = asin(min(1.0, max(-1.0, 2.0 * (w * y - z * x))))
    yaw = atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return yaw, pitch, atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))


def _to_geocentric(place: Point) -> Point:
    x, y, z = to_ecef(place)
    across = hypot(x, y)
    return place[1] * DEGREES, atan2(z, across) * DEGREES, hypot(across, z)


def _from_geocentric(place: Point) -> Point:
    (north, across), (side, ahead) = sincos(place[1] / DEGREES), sincos(place[0] / DEGREES)
    return to_geodetic((place[2] * across * ahead, place[2] * across * side, place[2] * north))


def _ned(place: Point) -> Point:
    return place[1], place[0], -place[2]


def _ned_angles(angles: Point) -> Point:
    return pi / 2.0 - angles[0], -angles[1], angles[2]


Both = tuple[Change, Change]
ON_EARTH: Final[dict[str, Both]] = {
    "ECEF": (to_ecef, to_geodetic),
    "geodetic": (
        lambda p: (p[1] * DEGREES, p[0] * DEGREES, p[2]),
        lambda p: (p[1] / DEGREES, p[0] / DEGREES, p[2]),
    ),
    "geocentric": (_to_geocentric, _from_geocentric),
}
"""From latitude, longitude (rad) and altitude (m), and back; longitude and latitude in degrees, in this order."""
OF_PLACES: Final[dict[str, Both]] = {
    "NED": (_ned, _ned),
    "NED_legacy": (_ned, _ned),
    "feet": (lambda p: (p[0] * FEET, p[1] * FEET, p[2] * FEET), lambda p: (p[0] / FEET, p[1] / FEET, p[2] / FEET)),
}
OF_ANGLES: Final[dict[str, Both]] = {
    "NED": (_ned_angles, _ned_angles),
    "NED_legacy": (lambda p: (p[2], -p[1], pi / 2.0 - p[0]), lambda p: (pi / 2.0 - p[2], -p[1], p[0])),
}

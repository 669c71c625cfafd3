"""MORSE's frames of reference on the fields of a component, as its `alter` has them: of what leaves and what comes in.

A gateway's `alter` lists them by name; they are applied in that order, to readings as to commands. Those of places
change `x`, `y` and `z`, those of angles `yaw`, `pitch` and `roll`:

    alter: {cat.gps: [UTM, NED], cat.heading: [NED]}

The deployment's `origin` is the place of its world on Earth, and says where north is.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import pi
from typing import Any, Final

from foosim.common.errors import BadValue, UnknownName
from foosim.common.exact_math import asin, atan2, hypot, sincos
from foosim.world.earth import EarthOrigin, Geodesy, to_ecef, to_geodetic

Fields = dict[str, Any]
Point = tuple[float, float, float]
Change = Callable[[Point], Point]
DEGREES: Final = 180.0 / pi
FEET: Final = 3.2808399
"""MORSE's feet in a metre."""
PLACES: Final = ("x", "y", "z")
ANGLES: Final = ("yaw", "pitch", "roll")
PLACED: Final = ("Pose", "GPS", "Destination", "Waypoint", "Teleport", "RotorcraftWaypoint")
TURNED: Final = ("Gyroscope", "Orientation")
OFFSETS: Final = frozenset(PLACES)


@dataclass(frozen=True, slots=True)
class Alteration:
    """A change of three fields, and its inverse."""

    names: tuple[str, str, str]
    leaving: Change
    coming: Change

    def out(self, fields: Fields) -> Fields:
        """Return the fields of a reading, changed."""
        return self._changed(fields, self.leaving)

    def into(self, fields: Fields) -> Fields:
        """Return the fields of a command in the world's frame."""
        return self._changed(fields, self.coming)

    def _changed(self, fields: Fields, change: Change) -> Fields:
        a, b, c = (float(fields[name]) for name in self.names)
        return {**fields, **dict(zip(self.names, change((a, b, c)), strict=True))}


def alterations(written: Sequence[str | Mapping[str, Any]], morse: str, origin: EarthOrigin | None) -> list[Alteration]:
    """Return those of a component of a class of MORSE. Raises BadValue, with the valid choices.

    `{UTM: {x: 1000, y: 2000, z: 0}}` has the offsets (m) that it adds.
    """
    return [_alteration(one, morse, origin) for one in written]


def _alteration(written: str | Mapping[str, Any], morse: str, origin: EarthOrigin | None) -> Alteration:
    name, about = (written, None) if isinstance(written, str) else next(iter(written.items()), ("", None))
    if name not in NAMES:
        raise UnknownName("unknown frame", name, NAMES)
    names, classes = (ANGLES, TURNED) if morse in TURNED and name in OF_ANGLES else (PLACES, PLACED)
    if morse not in classes:
        valid = (*PLACED, *(TURNED if name in OF_ANGLES else ()))
        raise BadValue(f"{name} is for components of the classes {', '.join(valid)}", morse)
    if name == "UTM":
        return Alteration(names, *_offset(about))
    if about is not None:
        raise BadValue(f"{name} has no settings", about)
    if name in ON_EARTH:
        if origin is None:
            raise BadValue("in a world without an origin on Earth: add origin: {latitude: ..., longitude: ...}", name)
        return Alteration(names, *_on_earth(name, Geodesy(origin)))
    return Alteration(names, *(OF_ANGLES[name] if names is ANGLES else OF_PLACES[name]))


def euler(orientation: tuple[float, float, float, float]) -> Point:
    """Return yaw, pitch and roll of an orientation (x, y, z, w)."""
    x, y, z, w = orientation
    pitch = asin(min(1.0, max(-1.0, 2.0 * (w * y - z * x))))
    yaw = atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return yaw, pitch, atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))


def _offset(about: object) -> tuple[Change, Change]:
    if not isinstance(about, Mapping) or not OFFSETS.issuperset(about):
        raise BadValue("UTM needs its offsets in m: {UTM: {x: 1000, y: 2000, z: 0}}", about)
    x, y, z = (float(about.get(name, 0.0)) for name in PLACES)
    return (lambda p: (p[0] + x, p[1] + y, p[2] + z)), (lambda p: (p[0] - x, p[1] - y, p[2] - z))


def _on_earth(name: str, geodesy: Geodesy) -> tuple[Change, Change]:
    """Return the changes from places of the world, through latitude, longitude (rad) and altitude (m)."""
    leaving, coming = ON_EARTH[name]
    return (lambda place: leaving(geodesy.geodetic(place))), (lambda place: geodesy.place(coming(place)))


def _in_degrees(place: Point) -> Point:
    return place[1] * DEGREES, place[0] * DEGREES, place[2]


def _from_degrees(place: Point) -> Point:
    return place[1] / DEGREES, place[0] / DEGREES, place[2]


def _to_geocentric(place: Point) -> Point:
    x, y, z = to_ecef(place)
    across = hypot(x, y)
    return place[1] * DEGREES, atan2(z, across) * DEGREES, hypot(across, z)


def _from_geocentric(place: Point) -> Point:
    (north, across), (side, ahead) = sincos(place[1] / DEGREES), sincos(place[0] / DEGREES)
    return to_geodetic((place[2] * across * ahead, place[2] * across * side, place[2] * north))


def _ned(place: Point) -> Point:
    return place[1], place[0], -place[2]


Both = tuple[Change, Change]
ON_EARTH: Final[dict[str, Both]] = {
    "ECEF": (to_ecef, to_geodetic),
    "geodetic": (_in_degrees, _from_degrees),
    "geocentric": (_to_geocentric, _from_geocentric),
}
"""Longitude and latitude are in degrees, in this order."""
OF_PLACES: Final[dict[str, Both]] = {
    "NED": (_ned, _ned),
    "NED_legacy": (_ned, _ned),
    "feet": (
        lambda p: (p[0] * FEET, p[1] * FEET, p[2] * FEET),
        lambda p: (p[0] / FEET, p[1] / FEET, p[2] / FEET),
    ),
}
OF_ANGLES: Final[dict[str, Both]] = {
    "NED": (lambda p: (pi / 2 - p[0], -p[1], p[2]), lambda p: (pi / 2 - p[0], -p[1], p[2])),
    "NED_legacy": (lambda p: (p[2], -p[1], pi / 2 - p[0]), lambda p: (pi / 2 - p[2], -p[1], p[0])),
}
"""Of yaw, pitch and roll. MORSE exchanges roll and yaw, as `NED_legacy` does."""
NAMES: Final = ("UTM", *ON_EARTH, *OF_PLACES)

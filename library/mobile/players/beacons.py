"""Payloads of the radio messages between patrolling rovers and their base: small, and checked on reception.

A damaged payload, or a foreign one on the same channel, decodes to None. Numbers are little-endian.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from functools import lru_cache
from math import isfinite
from typing import Final, NamedTuple

BEACON: Final = "beacon"
TELEMETRY: Final = "telemetry"
FLEET: Final = "fleet"
"""Channels: from rover to rovers, from rover to base, from base to rovers."""

VISITS_MAX: Final = 4
DECODED_KEPT: Final = 256
_TENTHS_MAX: Final = 65535
_HEAD = struct.Struct("<BfffHHBB")
_SEEN = struct.Struct("<ff")
_VISIT = struct.Struct("<HH")
_HAS_SEEN: Final = 0x80
_TELEMETRY = struct.Struct("<BffBfBHH")
_ENTRY = struct.Struct("<BHHH")


class Beacon(NamedTuple):
    """Where a rover is (m, rad), between which spots of the roadmap, its charge (a share), a seen thing outside of
    the map (m), and the visited spots, each with its age (s)."""

    number: int
    x: float
    y: float
    heading: float
    here: int
    goal: int
    charge: float
    seen: tuple[float, float] | None
    visits: tuple[tuple[int, float], ...]


class Telemetry(NamedTuple):
    """A rover's report to its base: where it is (m), its charge (a share), how far it has driven (m), how many others
    it hears, and between which spots it is."""

    number: int
    x: float
    y: float
    charge: float
    driven: float
    hears: int
    here: int
    goal: int


class Entry(NamedTuple):
    """The base's entry for one rover: between which spots it was, and the age of that report (s)."""

    number: int
    here: int
    goal: int
    age: float


def encode_beacon(beacon: Beacon) -> bytes:
    """Return a beacon's bytes: 19, 8 more with something seen, and 4 a visit."""
    seen = b"" if beacon.seen is None else _SEEN.pack(*beacon.seen)
    flags = len(beacon.visits) | (_HAS_SEEN if seen else 0)
    where = beacon.number, beacon.x, beacon.y, beacon.heading, beacon.here, beacon.goal
    visits = b"".join(_VISIT.pack(spot, _tenths(age)) for spot, age in beacon.visits)
    return _HEAD.pack(*where, _percent(beacon.charge), flags) + seen + visits


def decode_beacon(payload: object, rovers: int, spots: int) -> Beacon | None:
    """Return the beacon in a payload, given the numbers of rovers and of spots on the map; None for an invalid one."""
    return _decoded(payload, rovers, spots) if isinstance(payload, bytes) else None


@lru_cache(maxsize=DECODED_KEPT)
def _decoded(payload: bytes, rovers: int, spots: int) -> Beacon | None:
    """Return what `decode_beacon` does: all players of a process hear the same beacons."""
    if len(payload) < _HEAD.size:
        return None
    number, x, y, heading, here, goal, percent, flags = _HEAD.unpack_from(payload)
    at, count = _HEAD.size, flags & ~_HAS_SEEN
    seen: tuple[float, float] | None = None
    if flags & _HAS_SEEN and len(payload) >= at + _SEEN.size:
        seen = _SEEN.unpack_from(payload, at)
        at += _SEEN.size
    if count > VISITS_MAX or len(payload) != at + count * _VISIT.size:
        return None
    visits = tuple((spot, tenths / 10) for spot, tenths in _VISIT.iter_unpack(payload[at:]))
    named = (here, goal, *(spot for spot, _ in visits))
    numbers = (x, y, heading, *(seen or ()))
    if number >= rovers or max(named) >= spots or not all(map(isfinite, numbers)):
        return None
    return Beacon(number, x, y, heading, here, goal, percent / 100, seen, visits)


def encode_telemetry(telemetry: Telemetry) -> bytes:
    """Return the 19 bytes of a rover's telemetry."""
    number, x, y, charge, driven, hears, here, goal = telemetry
    return _TELEMETRY.pack(number, x, y, _percent(charge), driven, min(hears, 255), here, goal)


def decode_telemetry(payload: object, rovers: int, spots: int) -> Telemetry | None:
    """Return a rover's telemetry, given the numbers of rovers and spots; None for an invalid payload."""
    if not isinstance(payload, bytes) or len(payload) != _TELEMETRY.size:
        return None
    number, x, y, percent, driven, hears, here, goal = _TELEMETRY.unpack(payload)
    if number >= rovers or max(here, goal) >= spots or not all(map(isfinite, (x, y, driven))):
        return None
    return Telemetry(number, x, y, percent / 100, driven, hears, here, goal)


def encode_fleet(entries: Sequence[Entry]) -> bytes:
    """Return the bytes of the base's entries: 7 a rover."""
    return b"".join(_ENTRY.pack(entry.number, entry.here, entry.goal, _tenths(entry.age)) for entry in entries)


def decode_fleet(payload: object, rovers: int, spots: int) -> list[Entry] | None:
    """Return the base's entries, given the numbers of rovers and spots; None for an invalid payload."""
    if not isinstance(payload, bytes) or len(payload) % _ENTRY.size or len(payload) > rovers * _ENTRY.size:
        return None
    entries = [Entry(number, here, goal, tenths / 10) for number, here, goal, tenths in _ENTRY.iter_unpack(payload)]
    fits = all(entry.number < rovers and max(entry.here, entry.goal) < spots for entry in entries)
    return entries if fits else None


def _percent(share: float) -> int:
    return min(max(round(100 * share), 0), 100)


def _tenths(seconds: float) -> int:
    return min(max(round(10 * seconds), 0), _TENTHS_MAX)

"""How a radio's signal gets from one place to another: path loss, walls, shadowing; the noise there, and the ratio.

Levels are rounded to hundredths of a dB, so that verdicts compare integers and the last bit of a mathematical library
decides nothing.
"""

from __future__ import annotations

from dataclasses import replace
from math import sqrt
from typing import Final

from foosim.common.keyed_random import draw_key, draw_words
from foosim.deployment.network.radios import Radio
from foosim.vhub.line_of_sight.occlusion import UNKNOWN, Crossing, Trace
from foosim.vhub.line_of_sight.placement import World
from foosim.vhub.radio.materials import slab_loss_db
from foosim.vhub.radio.noise import centi, noise_dbm
from foosim.vhub.radio.path_loss import (
    ENVIRONMENTS,
    Environment,
    Itu1238,
    LogDistance,
    path_loss_db,
    range_m,
    vehicle_blockage_db,
)
from foosim.vhub.radio.shadowing import Shadowing
from foosim.world.matter.materials import RadioMaterial
from foosim.world.scene import Vector

OLDER_MAX: Final = 1024
"""At this count of remembered former places all are forgotten."""
BLOCKED: Final = "blocked"
OUT_OF_RANGE: Final = "out_of_range"
NEVER_CDB: Final = 10**6
"""A loss that no signal exceeds."""
LOSS_MAX_DB: Final = 400
"""Losses above this count as equal when bounding reach."""


def _distance_m(a: Vector, b: Vector) -> float:
    (ax, ay, az), (bx, by, bz) = a, b
    dx, dy, dz = ax - bx, ay - by, az - bz
    return sqrt(dx * dx + dy * dy + dz * dz)


def _is_behind(a: Vector, b: Vector) -> bool:
    """Return a > b, from coordinate to coordinate: compiled by mypyc, only `==` of tuples is as fast."""
    (ax, ay, az), (bx, by, bz) = a, b
    if ax != bx:
        return ax > bx
    return ay > by if ay != by else az > bz


class Path:
    """A signal's way between two places, levels in 0.01 dB. `cause` is why nothing gets through, or empty."""

    __slots__ = ("cause", "distance_mm", "loss_cdb", "shadowing_cdb", "walls", "walls_cdb")

    def __init__(
        self, distance_mm: int, walls: tuple[str, ...], walls_cdb: int, loss_cdb: int, shadowing_cdb: int, cause: str
    ) -> None:
        self.distance_mm, self.walls, self.walls_cdb = distance_mm, walls, walls_cdb
        self.loss_cdb = loss_cdb
        """With walls and shadowing."""
        self.shadowing_cdb, self.cause = shadowing_cdb, cause


NOWHERE: Final = Path(0, (), 0, 0, 0, OUT_OF_RANGE)
"""Before anything is known of the ends."""


class Place:
    """Where an antenna is, or was (m, world frame), the body that it is on, and what is known of shadowing there."""

    __slots__ = ("at", "before", "body", "is_known", "of_los", "of_nlos", "share_cdb", "turns")

    def __init__(self, body: str, at: Vector) -> None:
        self.body, self.at = body, at
        self.turns = -1
        """The number of the newest frame in which the antenna is there."""
        self.before: Place | None = None
        """Where it was before it came there: what was sent from there may still be on air."""
        self.is_known = False
        self.of_los = self.of_nlos = 0.0
        """The fields of shadowing with and without line of sight, where they are known."""
        self.share_cdb = -1.0
        """What shadowing adds at most to a loss for this end's part; below 0 until it is computed."""


class _Way:
    """What is remembered of a pair of bodies: the last path, and what it came from."""

    __slots__ = (
        *("a", "b", "bounds_a", "bounds_b", "crossings", "ends", "least_cdb", "most_cdb", "path", "trace", "turns"),
    )

    def __init__(self, ends: frozenset[str]) -> None:
        self.ends = ends
        self.turns = -1
        """The number of the frame that the path is of."""
        self.a = self.b = UNKNOWN
        """Places of the path."""
        self.trace = Trace()
        self.crossings: tuple[Crossing, ...] = ()
        self.path = NOWHERE
        self.bounds_a = self.bounds_b = UNKNOWN
        """Places of the bounds of the loss."""
        self.least_cdb = self.most_cdb = 0


def crossing_db(crossing: Crossing, frequency_hz: float) -> float:
    """Return what a thing in the way takes from a signal."""
    material: RadioMaterial = crossing.material
    if material.loss_db is not None:
        return material.loss_db
    assert material.is_ is not None, "a material or a loss"
    thickness_m = crossing.chord_m if material.thickness_m is None else material.thickness_m
    return slab_loss_db(material.is_, thickness_m, frequency_hz)


def environment_of(settings: Radio) -> Environment:
    """Return the environment of a radio with the figures that it writes."""
    written, path_loss = ENVIRONMENTS[settings.path_loss.environment], settings.path_loss
    if isinstance(written, LogDistance) and path_loss.environment == "log_distance":
        written = replace(written, exponent=path_loss.exponent, reference_loss_db=path_loss.reference_db)
    if isinstance(written, Itu1238):
        written = replace(written, site=path_loss.site, floors=path_loss.floors)
    return written


class Propagation:
    """One radio's signals in one world. `key` is that of the field of its shadowing."""

    def __init__(self, settings: Radio, world: World, key: bytes) -> None:
        self.settings = settings
        self.world = world
        self._frequency_hz: float = settings.frequency_hz
        self._key = key
        self._environment = environment_of(settings)
        shadowing, path_loss = settings.shadowing, settings.path_loss
        environment = self._environment
        sigmas = (environment.sigma_los, environment.sigma_nlos) if shadowing.on else (0.0, 0.0)
        if shadowing.sigma_db is not None:
            sigmas = shadowing.sigma_db, shadowing.sigma_db
        distances = environment.d_corr_los, environment.d_corr_nlos
        if shadowing.correlation_m is not None:
            distances = shadowing.correlation_m, shadowing.correlation_m
        self._los = Shadowing(key, sigmas[0], distances[0])
        self._nlos = Shadowing(key, sigmas[1], distances[1])
        self._range_m, self._strict = path_loss.range_m, path_loss.strict_los
        self._is_limited = environment.has_nlos_curve and not self._strict and self._range_m is None
        """Whether there is a loss that no walls exceed."""
        x, y, z = settings.antenna.mount
        self._mount = x, y, z
        self.noise_cdbm = centi(noise_dbm(settings.bandwidth_hz, settings.noise_figure_db))
        self.power_cdbm = centi(settings.tx_power_dbm + settings.antenna.gain_dbi)
        self.gain_cdb = centi(settings.antenna.gain_dbi)
        self.sense_cdbm = centi(settings.sense_dbm)
        self._places: dict[str, Place] = {}
        """The newest of each endpoint."""
        self._older: dict[tuple[str, Vector], Place] = {}
        """Where senders were whose transmissions are still on air."""
        self._ways: dict[tuple[str, str], _Way] = {}
        self._reaches = [-1.0] * (LOSS_MAX_DB + 1)
        """The square of the distance (m2) within which walls and distance take at most the index in dB; below 0 until
        it is computed."""

    def place(self, endpoint: str) -> Place:
        """Return where an endpoint's antenna is."""
        turns, found = self.world.turns, self._places.get(endpoint)
        if found is not None and found.turns == turns:
            return found
        at = self.world.antenna(endpoint, self._mount)
        if found is None or found.at != at:
            place = Place(self.world.body(endpoint), at)
            place.before = found
            if found is not None:
                found.before = None
            found = self._places[endpoint] = place
        found.turns = turns
        return found

    def place_at(self, endpoint: str, at: Vector) -> Place:
        """Return where an endpoint's antenna is, or was."""
        found = self.place(endpoint)
        if found.at == at:
            return found
        before = found.before
        if before is not None and before.at == at:
            return before
        older = self._older.get((endpoint, at))
        if older is None:
            if len(self._older) >= OLDER_MAX:
                self._older.clear()
            older = self._older[endpoint, at] = Place(found.body, at)
        return older

    def path(self, one: Place, other: Place) -> Path:
        """Return the way between the places of two antennas.

        It is worked out anew where an end or what is between has moved.
        """
        if _is_behind(one.at, other.at):
            one, other = other, one
        a, b, turns, way = one.at, other.at, self.world.turns, self._way(one, other)
        has_moved = way.a != a or way.b != b
        if has_moved or way.turns != turns:
            if self._range_m is not None and _distance_m(a, b) > self._range_m:
                return Path(round(_distance_m(a, b) * 1000.0), (), 0, 0, 0, OUT_OF_RANGE)
            crossings = self.world.crossings(a, b, way.ends, way.trace)
            if has_moved or crossings != way.crossings:
                way.a, way.b, way.crossings = a, b, crossings
                way.path = self._find(one, other, crossings, way.ends)
            way.turns = turns
        return way.path

    def hears(self, one: Place, other: Place, power_cdbm: int) -> bool:
        """Whether a station at the other place senses a signal sent with a power at the one.

        The path decides; where walls cannot change the result, they are not searched.
        """
        sensed_cdb = power_cdbm + self.gain_cdb - self.sense_cdbm
        if self._is_limited and self._is_near(one, other, sensed_cdb):
            return True
        if _is_behind(one.at, other.at):
            one, other = other, one
        way = self._way(one, other)
        if way.bounds_a != one.at or way.bounds_b != other.at:
            way.bounds_a, way.bounds_b = one.at, other.at
            way.least_cdb, way.most_cdb = self._least_and_most(one, other)
        if sensed_cdb < way.least_cdb:
            return False
        if sensed_cdb >= way.most_cdb:
            return True
        path = self.path(one, other)
        return not path.cause and path.loss_cdb <= sensed_cdb

    def _way(self, one: Place, other: Place) -> _Way:
        """Return what is remembered of two places' bodies, the lesser place first."""
        key = one.body, other.body
        found = self._ways.get(key)
        if found is None:
            found = self._ways[key] = _Way(frozenset(key))
        return found

    def taken_db(self, crossing: Crossing, a: Vector, b: Vector, ends: frozenset[str]) -> float:
        """Return what a thing takes from a signal between two places, the antennas of two bodies.

        Among vehicles one in the way blocks as vehicles do: by one draw for the three, whenever they meet like that.
        """
        if self._environment.has_vehicles:
            height_m = self.world.vehicle_height_m(crossing.name)
            if height_m is not None:
                seed = int.from_bytes(self._key[:8], "little")
                word = draw_words(draw_key(seed, "vehicle", *sorted(ends), crossing.name), 0)[0]
                return vehicle_blockage_db(_distance_m(a, b), a[2], b[2], height_m, word)
        return crossing_db(crossing, self._frequency_hz)

    def _is_near(self, one: Place, other: Place, loss_cdb: int) -> bool:
        """Whether it is sure, by a bound that costs little, that no more is lost between two places than that."""
        left_db = int((loss_cdb - self._share_cdb(one) - self._share_cdb(other)) // 100.0)
        if left_db < 0:
            return False
        left_db = min(left_db, LOSS_MAX_DB)
        square = self._reaches[left_db]
        if square < 0.0:
            reach_m = range_m(self._environment, left_db, self._frequency_hz, 0.0, 0.0, nlos=True)
            square = self._reaches[left_db] = reach_m * reach_m
        (ax, ay, az), (bx, by, bz) = one.at, other.at
        dx, dy, dz = ax - bx, ay - by, az - bz
        return dx * dx + dy * dy + dz * dz < square

    def _share_cdb(self, place: Place) -> float:
        """Return what shadowing adds at most to a loss for one end's part, and 0.01 dB for all that is rounded."""
        if place.share_cdb < 0.0:
            self._look_around(place)
            most_db = max(self._los.most_db(place.of_los), self._nlos.most_db(place.of_nlos))
            place.share_cdb = 1.0 + 100.0 * most_db
        return place.share_cdb

    def _look_around(self, place: Place) -> None:
        """Have the fields of shadowing at a place."""
        if not place.is_known:
            place.is_known = True
            x, y, _ = place.at
            place.of_los = self._los.field(x, y) if self._los.sigma_db != 0.0 else 0.0
            place.of_nlos = self._nlos.field(x, y) if self._nlos.sigma_db != 0.0 else 0.0

    def _shadow_db(self, one: Place, other: Place, *, is_nlos: bool) -> float:
        """Return the shadowing between two places, with line of sight or without."""
        self._look_around(one)
        self._look_around(other)
        (ax, ay, _), (bx, by, _) = one.at, other.at
        dx, dy = ax - bx, ay - by
        apart_m = sqrt(dx * dx + dy * dy)
        if is_nlos:
            return self._nlos.between_db(one.of_nlos, other.of_nlos, apart_m)
        return self._los.between_db(one.of_los, other.of_los, apart_m)

    def _least_and_most(self, one: Place, other: Place) -> tuple[int, int]:
        """Return the least and the greatest loss between two places, whatever stands between them."""
        a, b = one.at, other.at
        distance_m = _distance_m(a, b)
        if self._range_m is not None and distance_m > self._range_m:
            return NEVER_CDB, NEVER_CDB
        environment, heights, frequency_hz = self._environment, (a[2], b[2]), self._frequency_hz
        los_db, nlos_db = environment.both_db(distance_m, frequency_hz, heights)
        shadow_db = self._shadow_db(one, other, is_nlos=False)
        least_cdb = centi(los_db + shadow_db)
        if self._strict or not environment.has_nlos_curve:
            return least_cdb, NEVER_CDB
        behind_cdb = centi(nlos_db + self._shadow_db(one, other, is_nlos=True))
        least_cdb = min(least_cdb, behind_cdb)
        return least_cdb, max(centi(nlos_db + shadow_db), behind_cdb)

    def _find(self, one: Place, other: Place, crossings: tuple[Crossing, ...], ends: frozenset[str]) -> Path:
        a, b, frequency_hz = one.at, other.at, self._frequency_hz
        distance_m = _distance_m(a, b)
        distance_mm = round(distance_m * 1000.0)
        walls = tuple([crossing.name for crossing in crossings])
        walls_db = 0.0
        for crossing in crossings:
            walls_db += self.taken_db(crossing, a, b, ends)
        if crossings and self._strict:
            return Path(distance_mm, walls, centi(walls_db), 0, 0, BLOCKED)
        loss_db, is_nlos = path_loss_db(
            self._environment, distance_m, frequency_hz, a[2], b[2], walls_db, bool(crossings)
        )
        shadow_db = self._shadow_db(one, other, is_nlos=is_nlos)
        return Path(distance_mm, walls, centi(walls_db), centi(loss_db + shadow_db), centi(shadow_db), "")

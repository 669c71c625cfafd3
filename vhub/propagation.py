"""How a radio's signal gets from one place to another: path loss, walls, shadowing; the noise there, and the ratio.

Levels are rounded to hundredths of a dB, so that verdicts compare integers and the last bit of a mathematical library
decides nothing. Neighbours: `radio` (the formulas), `world` (places and walls), `budget` (one link), `air` (others).
"""

from __future__ import annotations

from dataclasses import replace
from math import inf, sqrt
from typing import Final, NamedTuple

from foosim.protocol.draws import draw_key, draw_words
from foosim.protocol.radio_materials import RadioMaterial
from foosim.protocol.radios import Radio
from foosim.protocol.scene import Vector
from foosim.vhub.geometry import Crossing
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
from foosim.vhub.radio.shadowing import shadowing_db, shadowing_max_db
from foosim.vhub.world import World

BLOCKED: Final = "blocked"
OUT_OF_RANGE: Final = "out_of_range"
NEVER_CDB: Final = 10**6
"""A loss that nothing gets over."""
PLACES_KEPT: Final = 4096
"""Places, and pairs of places, of which the bounds of the loss are remembered, at least."""


def _distance_m(a: Vector, b: Vector) -> float:
    dx, dy, dz = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return sqrt(dx * dx + dy * dy + dz * dz)


class Path(NamedTuple):
    """A signal's way between two places, levels in 0.01 dB. `cause` says that nothing gets through, and why."""

    distance_mm: int
    walls: tuple[str, ...]
    walls_cdb: int
    loss_cdb: int
    """With walls and shadowing."""
    shadowing_cdb: int
    cause: str


UNKNOWN: Vector = (inf, inf, inf)
NOWHERE: Final = Path(0, (), 0, 0, 0, OUT_OF_RANGE)
"""Before anything is known of the ends."""


class _Way:
    """The last path between two bodies, and what it came from: the frame's number, both places, what was between."""

    __slots__ = ("a", "b", "crossings", "ends", "path", "turns")

    def __init__(self, ends: frozenset[str]) -> None:
        self.ends = ends
        self.turns = -1
        self.a = self.b = UNKNOWN
        self.crossings: tuple[Crossing, ...] = ()
        self.path = NOWHERE


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
        self._key = key
        self._environment = environment_of(settings)
        shadowing, path_loss = settings.shadowing, settings.path_loss
        environment = self._environment
        sigmas = (environment.sigma_los, environment.sigma_nlos) if shadowing.on else (0.0, 0.0)
        self._sigmas = sigmas if shadowing.sigma_db is None else (shadowing.sigma_db, shadowing.sigma_db)
        distances = environment.d_corr_los, environment.d_corr_nlos
        self._correlations = distances if shadowing.correlation_m is None else (shadowing.correlation_m,) * 2
        self._range_m, self._strict = path_loss.range_m, path_loss.strict_los
        self._is_limited = environment.has_nlos_curve and not self._strict and self._range_m is None
        """Whether there is a loss that no walls exceed."""
        x, y, z = settings.antenna.mount
        self._mount = x, y, z
        self.noise_cdbm = centi(noise_dbm(settings.bandwidth_hz, settings.noise_figure_db))
        self.power_cdbm = centi(settings.tx_power_dbm + settings.antenna.gain_dbi)
        self.gain_cdb = centi(settings.antenna.gain_dbi)
        self.sense_cdbm = centi(settings.sense_dbm)
        self._turns = -1
        self._antennas: dict[str, Vector] = {}
        self._ways: dict[tuple[str, str], _Way] = {}
        self._bounds: dict[tuple[Vector, Vector], tuple[int, int]] = {}
        self._shares: dict[Vector, float] = {}
        """Of places: what shadowing may add to a loss for their part, in 0.01 dB."""
        self._reaches: dict[int, float] = {}
        """The square of the distance (m2) within which walls and distance take no more than so many dB."""

    def antenna(self, endpoint: str) -> Vector:
        """Return where an endpoint's antenna is."""
        if self._turns != self.world.turns:
            self._turns = self.world.turns
            self._antennas.clear()
            for remembered in (self._bounds, self._shares):
                if len(remembered) > PLACES_KEPT:
                    remembered.clear()
        found = self._antennas.get(endpoint)
        if found is None:
            found = self._antennas[endpoint] = self.world.antenna(endpoint, self._mount)
        return found

    def path(self, a: Vector, b: Vector, source: str, destination: str) -> Path:
        """Return the way between two places at which the antennas of two endpoints are, or were.

        It is worked out anew where an end or what is between has moved.
        """
        one, other = self.world.body(source), self.world.body(destination)
        if a > b:
            a, b, one, other = b, a, other, one
        key = one, other
        turns, way = self.world.turns, self._ways.get(key)
        if way is None:
            way = self._ways[key] = _Way(frozenset(key))
        has_moved = way.a != a or way.b != b
        if has_moved or way.turns != turns:
            if self._range_m is not None and _distance_m(a, b) > self._range_m:
                return Path(round(_distance_m(a, b) * 1000.0), (), 0, 0, 0, OUT_OF_RANGE)
            crossings = self.world.crossings(a, b, way.ends)
            if has_moved or crossings != way.crossings:
                way.a, way.b, way.crossings, way.path = a, b, crossings, self._find(a, b, crossings, way.ends)
            way.turns = turns
        return way.path

    def hears(self, a: Vector, b: Vector, source: str, destination: str, power_cdbm: int) -> bool:
        """Whether who is at `b` senses what is sent with a power at `a`.

        That is what the path says; where walls cannot change it, it is known without looking for them.
        """
        sensed_cdb = power_cdbm + self.gain_cdb - self.sense_cdbm
        if self._is_limited and self._is_near(a, b, sensed_cdb):
            return True
        key = a, b
        found = self._bounds.get(key)
        if found is None:
            found = self._bounds[key] = self._least_and_most(*sorted((a, b)))
        least_cdb, most_cdb = found
        if sensed_cdb < least_cdb:
            return False
        if sensed_cdb >= most_cdb:
            return True
        path = self.path(a, b, source, destination)
        return not path.cause and path.loss_cdb <= sensed_cdb

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
        return crossing_db(crossing, self.settings.frequency_hz)

    def _is_near(self, a: Vector, b: Vector, loss_cdb: int) -> bool:
        """Whether it is sure, by a bound that costs little, that no more is lost between two places than that."""
        share, other = self._shares.get(a), self._shares.get(b)
        if share is None:
            share = self._shares[a] = self._share_cdb(a)
        if other is None:
            other = self._shares[b] = self._share_cdb(b)
        left_db = int((loss_cdb - share - other) // 100.0)
        square = self._reaches.get(left_db)
        if square is None:
            reach_m = range_m(self._environment, left_db, self.settings.frequency_hz, 0.0, 0.0, nlos=True)
            square = self._reaches[left_db] = reach_m * reach_m
        dx, dy, dz = a[0] - b[0], a[1] - b[1], a[2] - b[2]
        return dx * dx + dy * dy + dz * dz < square

    def _share_cdb(self, place: Vector) -> float:
        """Return what shadowing adds at most to a loss for one end's part, and 0.01 dB for all that is rounded."""
        curves = zip(self._sigmas, self._correlations, strict=True)
        return 1.0 + 100.0 * max(shadowing_max_db(self._key, place, sigma, d_corr) for sigma, d_corr in curves)

    def _least_and_most(self, a: Vector, b: Vector) -> tuple[int, int]:
        """Return the least and the greatest loss between two places, whatever stands between them."""
        distance_m = _distance_m(a, b)
        if self._range_m is not None and distance_m > self._range_m:
            return NEVER_CDB, NEVER_CDB
        environment, heights, frequency_hz = self._environment, (a[2], b[2]), self.settings.frequency_hz
        los_db, nlos_db = environment.both_db(distance_m, frequency_hz, heights)
        shadow_db = shadowing_db(self._key, a, b, self._sigmas[0], self._correlations[0])
        least_cdb = centi(los_db + shadow_db)
        if self._strict or not environment.has_nlos_curve:
            return least_cdb, NEVER_CDB
        behind_cdb = centi(nlos_db + shadowing_db(self._key, a, b, self._sigmas[1], self._correlations[1]))
        least_cdb = min(least_cdb, behind_cdb)
        return least_cdb, max(centi(nlos_db + shadow_db), behind_cdb)

    def _find(self, a: Vector, b: Vector, crossings: tuple[Crossing, ...], ends: frozenset[str]) -> Path:
        distance_m, frequency_hz = _distance_m(a, b), self.settings.frequency_hz
        distance_mm = round(distance_m * 1000.0)
        walls = tuple([crossing.name for crossing in crossings])
        walls_db = 0.0
        for crossing in crossings:
            walls_db += self.taken_db(crossing, a, b, ends)
        if crossings and self._strict:
            return Path(distance_mm, walls, centi(walls_db), 0, 0, BLOCKED)
        heights = a[2], b[2]
        loss_db, is_nlos = path_loss_db(
            self._environment, distance_m, frequency_hz, *heights, walls_db, bool(crossings)
        )
        shadow_db = shadowing_db(self._key, a, b, self._sigmas[is_nlos], self._correlations[is_nlos])
        return Path(distance_mm, walls, centi(walls_db), centi(loss_db + shadow_db), centi(shadow_db), "")

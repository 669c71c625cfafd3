"""Path loss by environment, and the one rule for obstacles: min(line of sight + walls, no line of sight).

The curve without line of sight is the floor that multipath sets: without it three concrete walls or one steel box would
cut a link off that in reality goes round them; with it alone, materials would not matter. Distances are the antennas'
in three dimensions, at least 1 m; frequencies in Hz; heights in m above the ground.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import exp, inf, log, log10, pi, sqrt
from types import MappingProxyType
from typing import Final, Literal

from foosim.common.keyed_random import gaussian

LIGHT_M_S: Final = 299_792_458.0
DISTANCE_MIN_M: Final = 1.0
RANGE_MAX_M: Final = 1e7
Heights = tuple[float, float]
"""Of the transmitter's and the receiver's antenna above the ground, m."""
Site = Literal["home", "office", "shop"]


def free_space_db(distance_m: float, frequency_hz: float) -> float:
    """Return Friis' loss between isotropic antennas, 20 lg(4 pi d f / c)."""
    return 20.0 * log10(4.0 * pi * distance_m * frequency_hz / LIGHT_M_S)


@dataclass(frozen=True)
class Environment:
    """The surroundings of a radio: how much a signal loses with and without line of sight, and how much that varies.

    `sigma_*` are the standard deviations of shadowing in dB, `d_corr_*` the distances in m over which it decays to 1/e.
    """

    source: str
    sigma_los: float = 0.0
    sigma_nlos: float = 0.0
    d_corr_los: float = 10.0
    d_corr_nlos: float = 10.0
    has_vehicles: bool = False
    """Whether a vehicle in between takes away what it does between vehicles (`vehicle_blockage_db`)."""

    @property
    def has_nlos_curve(self) -> bool:
        """Whether it has a curve of its own without line of sight; else nothing limits what walls take away."""
        return True

    def los_db(self, distance_m: float, frequency_hz: float, heights_m: Heights) -> float:
        """Return the loss in dB with line of sight."""
        raise AssertionError("each environment has its own")

    def both_db(self, distance_m: float, frequency_hz: float, heights_m: Heights) -> tuple[float, float]:
        """Return the losses in dB with line of sight, and without: never less than with it, nor more than on the
        ground."""
        los_db = self.los_db(distance_m, frequency_hz, heights_m)
        return los_db, los_db

    def nlos_db(self, distance_m: float, frequency_hz: float, heights_m: Heights) -> float:
        """Return the loss in dB without line of sight."""
        return self.both_db(distance_m, frequency_hz, heights_m)[1]


@dataclass(frozen=True)
class Curve:
    """loss = offset + slope lg(distance / m) + frequency_slope lg(frequency / GHz), in dB."""

    offset: float
    slope: float
    frequency_slope: float

    def __call__(self, distance_m: float, frequency_hz: float) -> float:
        lg_d = log10(distance_m) if distance_m > DISTANCE_MIN_M else 0.0
        return self.offset + self.slope * lg_d + self.frequency_slope * log10(frequency_hz * 1e-9)


@dataclass(frozen=True, kw_only=True)
class TwoCurves(Environment):
    """A straight line over lg d for each condition, as 3GPP fits them."""

    los: Curve
    nlos: Curve

    def los_db(self, distance_m: float, frequency_hz: float, heights_m: Heights) -> float:
        return self.los(distance_m, frequency_hz)

    def both_db(self, distance_m: float, frequency_hz: float, heights_m: Heights) -> tuple[float, float]:
        los_db = self.los(distance_m, frequency_hz)
        return los_db, max(los_db, self.nlos(distance_m, frequency_hz))


@dataclass(frozen=True, kw_only=True)
class UrbanCell(TwoCurves):
    """A street or a town under a base station: beyond the breakpoint the line-of-sight curve falls with 40 lg d.

    The higher antenna is the base station's. The breakpoint is 4 (h_1 - 1 m)(h_2 - 1 m) f / c; antennas below 1.5 m
    count as at 1.5 m, where the formula's range begins. `far_weight` is the factor of the term that joins the two
    halves; `height_slope` is what a terminal gains, in dB per metre above 1.5 m, without line of sight.
    """

    far_weight: float
    height_slope: float

    def los_db(self, distance_m: float, frequency_hz: float, heights_m: Heights) -> float:
        distance_m = max(distance_m, DISTANCE_MIN_M)
        low, high = sorted((max(heights_m[0], 1.5), max(heights_m[1], 1.5)))
        breakpoint_m = 4.0 * (high - 1.0) * (low - 1.0) * frequency_hz / LIGHT_M_S
        square = breakpoint_m * breakpoint_m + (high - low) * (high - low)
        if distance_m * distance_m <= square:
            return self.los(distance_m, frequency_hz)
        far = self.los.offset + 40.0 * log10(distance_m) + self.los.frequency_slope * log10(frequency_hz * 1e-9)
        return far - self.far_weight * log10(square)

    def both_db(self, distance_m: float, frequency_hz: float, heights_m: Heights) -> tuple[float, float]:
        gain = self.height_slope * (max(min(heights_m), 1.5) - 1.5)
        los_db = self.los_db(distance_m, frequency_hz, heights_m)
        return los_db, max(los_db, self.nlos(distance_m, frequency_hz) - gain)


class OneCurve(Environment):
    """An environment whose curve is the same with and without line of sight."""

    @property
    def has_nlos_curve(self) -> bool:
        return False


class FreeSpace(OneCurve):
    """Friis."""

    def los_db(self, distance_m: float, frequency_hz: float, heights_m: Heights) -> float:
        return free_space_db(max(distance_m, DISTANCE_MIN_M), frequency_hz)


@dataclass(frozen=True, kw_only=True)
class LogDistance(OneCurve):
    """L0 + 10 n lg(d / d0). Without a reference loss L0 it is free space's at d0 and the radio's frequency."""

    exponent: float = 3.0
    reference_loss_db: float | None = None
    reference_distance_m: float = 1.0

    def los_db(self, distance_m: float, frequency_hz: float, heights_m: Heights) -> float:
        reference_db = self.reference_loss_db
        if reference_db is None:
            reference_db = free_space_db(self.reference_distance_m, frequency_hz)
        ratio = max(distance_m, DISTANCE_MIN_M) / self.reference_distance_m
        return reference_db + 10.0 * self.exponent * log10(max(ratio, 1.0))


class TwoRay(OneCurve):
    """The direct ray and the one that the ground reflects: d^4 beyond 4 pi h_t h_r / lambda, where it joins Friis.

    An antenna counts as at least 0.1 m above the ground: at 0 the two rays would cancel everywhere.
    """

    def los_db(self, distance_m: float, frequency_hz: float, heights_m: Heights) -> float:
        distance_m = max(distance_m, DISTANCE_MIN_M)
        product = max(heights_m[0], 0.1) * max(heights_m[1], 0.1)
        if distance_m <= 4.0 * pi * product * frequency_hz / LIGHT_M_S:
            return free_space_db(distance_m, frequency_hz)
        return 40.0 * log10(distance_m) - 20.0 * log10(product)


SITES: Final[Mapping[Site, tuple[float, float, float]]] = MappingProxyType(
    {"home": (28.0, 4.0, 4.0), "office": (30.0, 15.0, 4.0), "shop": (22.0, 6.0, 3.0)}
)
"""Of ITU-R P.1238: the distance's coefficient N, the loss of the first floor, that of each further one, dB."""


@dataclass(frozen=True, kw_only=True)
class Itu1238(OneCurve):
    """20 lg(f / MHz) + N lg d + L_f(floors) - 28: within a building, through `floors` of its floors."""

    site: Site = "office"
    floors: int = 0

    def los_db(self, distance_m: float, frequency_hz: float, heights_m: Heights) -> float:
        slope, first_db, further_db = SITES[self.site]
        floors_db = first_db + further_db * (self.floors - 1) if self.floors > 0 else 0.0
        return 20.0 * log10(frequency_hz * 1e-6) + slope * log10(max(distance_m, DISTANCE_MIN_M)) + floors_db - 28.0


def path_loss_db(
    environment: Environment,
    distance_m: float,
    frequency_hz: float,
    tx_height_m: float,
    rx_height_m: float,
    walls_db: float,
    has_hit: bool,
) -> tuple[float, bool]:
    """Return the loss in dB and whether the curve without line of sight decided it.

    No ray hit: line of sight. Otherwise min(line of sight + walls, no line of sight); an environment with one curve has
    no such limit. The second value chooses `sigma_*` and `d_corr_*`: through a pane of glass the direct ray still
    dominates, and the shadowing is that of line of sight.
    """
    heights_m = (tx_height_m, rx_height_m)
    if not has_hit:
        return environment.los_db(distance_m, frequency_hz, heights_m), False
    los_db, nlos_db = environment.both_db(distance_m, frequency_hz, heights_m)
    if environment.has_nlos_curve and nlos_db < los_db + walls_db:
        return nlos_db, True
    return los_db + walls_db, False


def range_m(
    environment: Environment,
    loss_db: float,
    frequency_hz: float,
    tx_height_m: float,
    rx_height_m: float,
    nlos: bool = False,
) -> float:
    """Return the greatest distance in m at which the loss is not above `loss_db`.

    0 when it is above it at 1 m; infinity when it is not above it at 10,000 km. Every curve rises with the distance.
    """
    heights_m = (tx_height_m, rx_height_m)
    curve = environment.nlos_db if nlos else environment.los_db
    if curve(DISTANCE_MIN_M, frequency_hz, heights_m) > loss_db:
        return 0.0
    low, high = DISTANCE_MIN_M, RANGE_MAX_M
    if curve(high, frequency_hz, heights_m) <= loss_db:
        return inf
    for _ in range(100):
        middle = sqrt(low * high)
        if curve(middle, frequency_hz, heights_m) <= loss_db:
            low = middle
        else:
            high = middle
    return low


def vehicle_blockage_db(
    distance_m: float, tx_height_m: float, rx_height_m: float, blocker_height_m: float, word: int
) -> float:
    """Return what a vehicle between two vehicles takes away, in dB, to be added to the loss with line of sight.

    Nothing when both antennas are above it; else a log-normal number of mean 9 dB and standard deviation 4.5 dB (both
    below its height) or 5 and 4 (one below), the mean plus max(0, 15 lg d - 41). `word` is the draw: one for a pair and
    a blocker, not one for each packet. Source: 3GPP TR 37.885, 6.2.1. A car is 1.6 m high, a lorry 3 m.
    """
    if min(tx_height_m, rx_height_m) > blocker_height_m:
        return 0.0
    mean, deviation = (9.0, 4.5) if max(tx_height_m, rx_height_m) < blocker_height_m else (5.0, 4.0)
    mean += max(0.0, 15.0 * log10(max(distance_m, DISTANCE_MIN_M)) - 41.0)
    ratio = deviation / mean
    variance = log(1.0 + ratio * ratio)
    return exp(log(mean) - variance / 2.0 + sqrt(variance) * gaussian(word))


_TR38901: Final = "3GPP TR 38.901 table 7.4.1-1"
_V2V_NLOS: Final = Curve(36.85, 30.0, 18.9)

ENVIRONMENTS: Final[Mapping[str, Environment]] = MappingProxyType(
    {
        "indoor": TwoCurves(
            f"{_TR38901}, indoor office; 0.5 to 100 GHz, 1 to 150 m",
            *(3.0, 8.03, 10.0, 6.0),
            los=Curve(32.4, 17.3, 20.0),
            nlos=Curve(17.3, 38.3, 24.9),
        ),
        "v2v_urban": TwoCurves(
            "3GPP TR 37.885 table 6.2.1-1, urban grid",
            *(3.0, 4.0, 10.0, 13.0),
            los=Curve(38.77, 16.7, 18.2),
            nlos=_V2V_NLOS,
            has_vehicles=True,
        ),
        "v2v_highway": TwoCurves(
            "3GPP TR 37.885 table 6.2.1-1, highway; correlation distances as ns-3 has them (25 m in line of sight in"
            " the report, unverified)",
            *(3.0, 4.0, 10.0, 13.0),
            los=Curve(32.4, 20.0, 20.0),
            nlos=_V2V_NLOS,
            has_vehicles=True,
        ),
        "urban_micro": UrbanCell(
            f"{_TR38901}, urban micro (street canyon)",
            *(4.0, 7.82, 10.0, 13.0),
            los=Curve(32.4, 21.0, 20.0),
            nlos=Curve(22.4, 35.3, 21.3),
            far_weight=9.5,
            height_slope=0.3,
        ),
        "urban_macro": UrbanCell(
            f"{_TR38901}, urban macro, effective environment height 1 m",
            *(4.0, 6.0, 37.0, 50.0),
            los=Curve(28.0, 22.0, 20.0),
            nlos=Curve(13.54, 39.08, 20.0),
            far_weight=9.0,
            height_slope=0.6,
        ),
        "log_distance": LogDistance("Log-distance law; exponent 3 as in ns-3"),
        "two_ray": TwoRay("Two-ray ground reflection, Friis before the crossover distance"),
        "itu_1238": Itu1238("ITU-R P.1238, coefficients of ns-3's model"),
        "lora": LogDistance(
            "Log-distance law at 868 MHz, shadowing and correlation distance of the ns-3 module lorawan",
            *(4.0, 4.0, 110.0, 110.0),
            exponent=3.76,
            reference_loss_db=7.7,
        ),
        "free_space": FreeSpace("Friis"),
    }
)

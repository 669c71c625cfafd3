"""Path loss (T18): every formula against its text worked out here, the rule for obstacles, P.2040's table, ranges."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import inf, log, log10, pi, sqrt
from typing import Final

import pytest

from foosim.common.keyed_random import draw_key, draw_words
from foosim.vhub.radio.materials import MATERIALS, slab_loss_db
from foosim.vhub.radio.path_loss import (
    ENVIRONMENTS,
    Itu1238,
    LogDistance,
    path_loss_db,
    range_m,
    vehicle_blockage_db,
)
from tests.links.proof import Proof
from tests.links.statistics import ks_normal, mean_and_deviation

C: Final = 299_792_458.0
Formula = Callable[[float, float], float]
"""Of distance in m and frequency in GHz."""


def friis(d: float, f: float) -> float:
    return -10 * log10((C / (f * 1e9)) ** 2 / (16 * pi**2 * d**2))


def lines(offset: float, slope: float, of_f: float) -> Formula:
    return lambda d, f: offset + log10(d**slope) + log10(f**of_f)


# The curves that are straight lines over lg d: with line of sight, and without, before "never less than with it".
CURVES: Final[dict[str, tuple[Formula, Formula]]] = {
    "indoor": (lines(32.4, 17.3, 20), lines(17.3, 38.3, 24.9)),
    "v2v_urban": (lines(38.77, 16.7, 18.2), lines(36.85, 30, 18.9)),
    "v2v_highway": (lines(32.4, 20, 20), lines(36.85, 30, 18.9)),
    "lora": (lines(7.7, 37.6, 0), lines(7.7, 37.6, 0)),
    "free_space": (friis, friis),
    "log_distance": (lambda d, f: friis(1, f) + 30 * log10(d), lambda d, f: friis(1, f) + 30 * log10(d)),
    "itu_1238": (lambda d, f: 20 * log10(1000 * f) + 30 * log10(d) - 28,) * 2,
}
POINTS: Final = [(1.0, 2.437), (4.0, 5.25), (37.0, 0.868), (120.0, 5.9), (900.0, 2.0)]


@pytest.mark.parametrize("name", CURVES)
def test_straight_curves(proof: Proof, name: str) -> None:
    environment, (los, nlos) = ENVIRONMENTS[name], CURVES[name]
    off = []
    for d, f in POINTS:
        off.append(abs(environment.los_db(d, f * 1e9, (1.5, 1.5)) - los(d, f)))
        off.append(abs(environment.nlos_db(d, f * 1e9, (1.5, 1.5)) - max(los(d, f), nlos(d, f))))
    proof.below("T18", f"{name}: dB off its formula, with and without line of sight", max(off), 1e-9, len(off))
    for _, f in POINTS:
        assert environment.los_db(0.01, f * 1e9, (1.5, 1.5)) == environment.los_db(1.0, f * 1e9, (1.5, 1.5))


CELLS: Final = {
    "urban_micro": (32.4, 21, 9.5, 22.4, 35.3, 21.3, 0.3),
    "urban_macro": (28, 22, 9, 13.54, 39.08, 20, 0.6),
}


@pytest.mark.parametrize("name", CELLS)
@pytest.mark.parametrize("distance_m", [10.0, 60.0, 250.0, 800.0, 4000.0])
@pytest.mark.parametrize("heights", [(10.0, 1.5), (2.0, 25.0), (5.0, 5.0)])
def test_cells_with_a_breakpoint(proof: Proof, name: str, distance_m: float, heights: tuple[float, float]) -> None:
    """Before the breakpoint PL1, beyond it PL2, which joins it; compared in the plane, as the standard says."""
    offset, slope, weight, nlos, nlos_slope, nlos_f, of_h = CELLS[name]
    f = 2.0
    high, low = max(heights), min(heights)
    far = 4 * (high - 1) * (low - 1) * f * 1e9 / C
    if distance_m**2 - (high - low) ** 2 <= far**2:
        los = offset + slope * log10(distance_m) + 20 * log10(f)
    else:
        los = offset + 40 * log10(distance_m) + 20 * log10(f) - weight * log10(far**2 + (high - low) ** 2)
    without = nlos + nlos_slope * log10(distance_m) + nlos_f * log10(f) - of_h * (low - 1.5)
    off = abs(ENVIRONMENTS[name].los_db(distance_m, 2e9, heights) - los)
    off = max(off, abs(ENVIRONMENTS[name].nlos_db(distance_m, 2e9, heights) - max(los, without)))
    proof.below("T18", f"{name}, {distance_m:g} m, {high:g} m and {low:g} m high: dB off its formula", off, 1e-9, 2)


def test_two_rays(proof: Proof) -> None:
    """Friis up to 4 pi h h / lambda, then -10 lg(h^2 h^2 / d^4); where they meet they agree."""
    two = ENVIRONMENTS["two_ray"]
    crossover = 4 * pi * 1.5 * 2.0 * 5.9e9 / C
    expected = {d: friis(d, 5.9) for d in (1.0, 100.0, 0.999 * crossover)}
    expected |= {d: -10 * log10(1.5**2 * 2.0**2 / d**4) for d in (1.001 * crossover, 2000.0, 9000.0)}
    off = max(abs(two.los_db(d, 5.9e9, (1.5, 2.0)) - loss_db) for d, loss_db in expected.items())
    proof.below("T18", "two_ray: dB off its formula", off, 1e-9, len(expected))
    assert two.los_db(1.001 * crossover, 5.9e9, (1.5, 2.0)) == pytest.approx(friis(crossover, 5.9), abs=0.05)


def test_log_distance_as_configured(proof: Proof) -> None:
    at_1_m = ENVIRONMENTS["log_distance"].los_db(1.0, 5.15e9, (1.0, 1.0))
    proof.within("T28", "log_distance at 1 m and 5.15 GHz: dB, ns-3's", at_1_m, 46.68, 0.01, 1)
    configured = LogDistance("", exponent=2.2, reference_loss_db=40.0, reference_distance_m=2.0)
    assert configured.los_db(20.0, 2.4e9, (1.0, 1.0)) == pytest.approx(62.0)
    assert configured.los_db(1.5, 2.4e9, (1.0, 1.0)) == 40.0


@pytest.mark.parametrize(
    ("site", "n", "floors_db"),
    [("home", 28, (0, 4, 8, 12)), ("office", 30, (0, 15, 19, 23)), ("shop", 22, (0, 6, 9, 12))],
)
def test_floors_of_a_building(site: str, n: int, floors_db: tuple[int, ...]) -> None:
    for floors, floor_db in enumerate(floors_db):
        itu = Itu1238("", site=site, floors=floors)  # type: ignore[arg-type]
        expected = 20 * log10(2400) + n * log10(25) + floor_db - 28
        assert itu.los_db(25.0, 2.4e9, (1.0, 1.0)) == pytest.approx(expected)


# --- obstacles -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_the_rule_for_obstacles(name: str) -> None:
    environment = ENVIRONMENTS[name]
    los, nlos = environment.los_db(40.0, 2.4e9, (1.0, 2.0)), environment.nlos_db(40.0, 2.4e9, (1.0, 2.0))
    assert path_loss_db(environment, 40.0, 2.4e9, 1.0, 2.0, 99.0, False) == (los, False), "walls that no ray hits"
    thin, thick = 0.1, 60.0
    assert path_loss_db(environment, 40.0, 2.4e9, 1.0, 2.0, thin, True) == (los + thin, False)
    assert path_loss_db(environment, 40.0, 2.4e9, 1.0, 2.0, 0.0, True) == (los, False)
    limited = environment.has_nlos_curve
    assert limited == (nlos > los)
    assert path_loss_db(environment, 40.0, 2.4e9, 1.0, 2.0, thick, True) == (
        (nlos, True) if limited else (los + thick, False)
    )


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_farther_is_never_louder_and_a_wall_never_helps(name: str) -> None:
    environment = ENVIRONMENTS[name]
    for walls_db, has_hit in ((0.0, False), (0.0, True), (8.0, True), (300.0, True)):
        losses = [path_loss_db(environment, 1.05**k, 5.9e9, 1.2, 3.0, walls_db, has_hit)[0] for k in range(-10, 200)]
        assert all(near <= far + 1e-9 for near, far in pairwise(losses))
        clear = [path_loss_db(environment, 1.05**k, 5.9e9, 1.2, 3.0, 0.0, False)[0] for k in range(-10, 200)]
        assert all(without <= loss for without, loss in zip(clear, losses, strict=True))


@pytest.mark.parametrize("name", ENVIRONMENTS)
@pytest.mark.parametrize("nlos", [False, True])
def test_range_is_where_the_loss_is(name: str, nlos: bool) -> None:
    environment = ENVIRONMENTS[name]
    curve = environment.nlos_db if nlos else environment.los_db
    for loss_db in (70.0, 95.0, 120.0):
        reach = range_m(environment, loss_db, 2.4e9, 1.0, 2.0, nlos)
        assert curve(reach, 2.4e9, (1.0, 2.0)) <= loss_db < curve(reach * 1.000_001, 2.4e9, (1.0, 2.0)) + 1e-5
    assert range_m(environment, 1.0, 2.4e9, 1.0, 2.0, nlos) == 0.0
    assert range_m(environment, 1e4, 2.4e9, 1.0, 2.0, nlos) == inf


@pytest.mark.parametrize(
    ("distance_m", "heights", "blocker_m", "mean", "deviation"),
    [
        (50.0, (1.5, 1.5), 3.0, 9.0, 4.5),
        (50.0, (1.5, 2.0), 1.6, 5.0, 4.0),
        (900.0, (1.0, 1.2), 1.6, 9.0 + 15 * log10(900) - 41, 4.5),
    ],
)
def test_a_vehicle_in_between(
    proof: Proof, distance_m: float, heights: tuple[float, float], blocker_m: float, mean: float, deviation: float
) -> None:
    key, count = draw_key(proof.seed, "vehicle"), proof.size(4_000, 100_000)
    drawn = [vehicle_blockage_db(distance_m, *heights, blocker_m, draw_words(key, n)[0]) for n in range(count)]
    found, spread = mean_and_deviation(drawn)
    what = f"TR 37.885, a vehicle of {blocker_m:g} m at {distance_m:g} m"
    assert min(drawn) > 0.0 and spread == pytest.approx(deviation, rel=0.06)
    proof.ratio("T18", f"{what}: mean dB", found, mean, 0.03, count)
    squared = log10(1 + (deviation / mean) ** 2) * log(10)
    law = (log(mean) - squared / 2) / log(10), sqrt(squared) / log(10)
    proof.likely("T18", f"{what}: log-normal, Kolmogorov", ks_normal([log10(x) for x in drawn], *law), count)


def test_antennas_above_the_vehicle_see_over_it() -> None:
    assert vehicle_blockage_db(50.0, 3.1, 3.5, 3.0, 2**63) == 0.0


# --- materials -------------------------------------------------------------------------------------------------------


TABLE: Final = {  # dB at 0.868, 2.44, 5.25 and 5.9 GHz, worked out from P.2040's coefficients, two digits
    ("concrete", 0.1): (4.8, 8.1, 13, 15),
    ("concrete", 0.2): (7.5, 15, 26, 28),
    ("concrete", 0.3): (10, 21, 38, 41),
    ("brick", 0.1): (2.6, 3.2, 3.1, 3.5),
    ("brick", 0.2): (5.0, 5.8, 5.9, 6.5),
    ("plasterboard", 0.013): (0.3, 1.1, 1.0, 0.8),
    ("plasterboard", 0.026): (0.8, 1.2, 2.0, 1.8),
    ("wood", 0.03): (0.4, 0.7, 1.4, 1.4),
    ("wood", 0.05): (0.7, 0.9, 2.0, 2.0),
    ("glass", 0.006): (0.4, 1.9, 3.3, 3.2),
    ("glass", 0.012): (1.2, 3.3, 0.5, 1.6),
    ("chipboard", 0.03): (1.3, 1.7, 2.9, 2.9),
}


@pytest.mark.parametrize(("material", "thickness_m"), TABLE)
def test_slabs_of_p2040(proof: Proof, material: str, thickness_m: float) -> None:
    for f, expected in zip((0.868, 2.44, 5.25, 5.9), TABLE[material, thickness_m], strict=True):
        tolerance = 0.0501 if expected < 10 else 0.501
        what = f"P.2040, {100 * thickness_m:g} cm of {material} at {f:g} GHz: dB, to two digits"
        proof.within("T18", what, slab_loss_db(material, thickness_m, f * 1e9), expected, tolerance, 1)


def multiple_echoes(material: str, thickness_m: float, f_ghz: float) -> float:
    """The same slab as the sum of what gets through at once and after 2, 4, ... reflections inside."""
    known = MATERIALS[material]
    eta = complex(known.a * f_ghz**known.b, -known.c * f_ghz**known.d / (2 * pi * f_ghz * 1e9 * 8.8541878e-12))
    n = eta**0.5
    inward, outward, inside = 2 / (1 + n), 2 * n / (1 + n), (n - 1) / (n + 1)
    once = 2.718281828459045 ** (-2j * pi * f_ghz * 1e9 / C * n * thickness_m)
    through = sum(inward * outward * once * (inside * once) ** (2 * echo) for echo in range(60))
    return -20 * log10(abs(through))


@pytest.mark.parametrize("material", [name for name in MATERIALS if name != "metal"])
def test_a_slab_is_the_sum_of_its_echoes(proof: Proof, material: str) -> None:
    """Another derivation with Fresnel's coefficients and the vacuum's permittivity."""
    off = []
    for thickness_m, f_ghz in ((0.004, 2.4), (0.05, 5.9), (0.15, 0.868), (0.012, 5.25)):
        expected = multiple_echoes(material, thickness_m, f_ghz)
        off.append(abs(slab_loss_db(material, thickness_m, f_ghz * 1e9) - expected))
    proof.below("T18", f"P.2040, {material}: dB off the sum of its echoes", max(off), 0.02, len(off))


def test_thicker_walls_of_what_absorbs_take_more() -> None:
    assert slab_loss_db("metal", 0.001, 2.4e9) == slab_loss_db("metal", 5.0, 60e9) == 60.0, "it is capped"
    for material in ("concrete", "wet_ground", "plywood"):
        losses = [slab_loss_db(material, 0.05 * k, 5.9e9) for k in range(1, 200)]
        assert all(thin < thick for thin, thick in pairwise(losses)) and losses[-1] > 300.0
    for material in MATERIALS:
        assert slab_loss_db(material, 0.0, 2.4e9) == pytest.approx(0.0, abs=1e-9)
        assert all(slab_loss_db(material, 0.001 * k, 2.4e9) >= 0.0 for k in range(100))


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_nothing_is_lost_beyond_what_is_lost_between_antennas_on_the_ground(name: str) -> None:
    environment = ENVIRONMENTS[name]
    for distance_m, f_ghz in [*POINTS, (0.1, 5.25), (5_000.0, 2.0), (20_000.0, 0.868)]:
        most_db = environment.nlos_db(distance_m, f_ghz * 1e9, (0.0, 0.0))
        for heights_m in [(0.0, 0.0), (0.2, 1.0), (1.5, 3.0), (2.0, 25.0), (30.0, 30.0)]:
            los_db, nlos_db = environment.both_db(distance_m, f_ghz * 1e9, heights_m)
            assert los_db == environment.los_db(distance_m, f_ghz * 1e9, heights_m)
            assert los_db <= nlos_db <= most_db + 1e-9

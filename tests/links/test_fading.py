"""Fading: each kind has its law, its mean is 1, and a gain is a function of link and block."""

from __future__ import annotations

from itertools import pairwise
from math import exp, pi, sqrt

import pytest

from foosim.common.keyed_random import draw_key
from foosim.vhub.radio.fading import (
    ONE,
    Kind,
    block_of,
    fading_db,
    gain_quantiles,
    nakagami_m,
)
from tests.links.statistics import ALPHA, correlation, ks, ks_exponential, mean_and_deviation

KEY = draw_key(1, "fading", "a", "b")
COUNT = 10_000


def gains(kind: Kind, parameter: float = 0.0, count: int = COUNT) -> list[float]:
    return [10 ** (fading_db(KEY, block, kind, parameter) / 10) for block in range(count)]


def rician_density(gain: float, k: float) -> float:
    """(1 + K) e^(-K - (1 + K) g) I0(2 sqrt(K (1 + K) g)), Bessel's function by its series."""
    argument = (1 + k) * gain * k
    term = bessel = 1.0
    for n in range(1, 80):
        term *= argument / (n * n)
        bessel += term
    return (1 + k) * exp(-k - (1 + k) * gain) * bessel


def cumulated(k: float) -> list[float]:
    """The distribution function at 0, 0.005, ... by Simpson's rule."""
    found = [0.0]
    for cell in range(2_000):
        x = cell * 0.005
        middle = 4 * rician_density(x + 0.0025, k)
        found.append(found[-1] + 0.005 / 6 * (rician_density(x, k) + middle + rician_density(x + 0.005, k)))
    return found


def test_rayleigh_is_exponential_in_power() -> None:
    assert ks_exponential(gains("rayleigh"), 1.0) > ALPHA


@pytest.mark.parametrize("k_db", [0.0, 8.0])
def test_rician_has_its_density(k_db: float) -> None:
    k = 10 ** (k_db / 10)
    table = cumulated(k)
    assert table[-1] == pytest.approx(1.0, abs=1e-4)

    def cdf(gain: float) -> float:
        cell, rest = divmod(min(gain, 9.99) / 0.005, 1.0)
        return table[int(cell)] + rest * (table[int(cell) + 1] - table[int(cell)])

    drawn = gains("rician", k_db)
    assert ks(drawn, cdf) > ALPHA
    mean, deviation = mean_and_deviation(drawn)
    assert mean == pytest.approx(1.0, abs=0.03)
    assert deviation == pytest.approx(sqrt(1 + 2 * k) / (1 + k), rel=0.05)


def erlang_cdf(m: int, gain: float) -> float:
    term = total = 1.0
    for n in range(1, m):
        term *= m * gain / n
        total += term
    return 1.0 - exp(-m * gain) * total


@pytest.mark.parametrize("m", [1, 2, 5])
def test_nakagami_with_a_whole_m_is_erlangs(m: int) -> None:
    assert ks(gains("nakagami", float(m)), lambda gain: erlang_cdf(m, gain)) > ALPHA


def test_nakagami_with_a_half_is_the_square_of_a_normal_number() -> None:
    """m = 1/2: chi-squared with one degree of freedom; its median is 0.454936."""
    table = gain_quantiles("nakagami", 0.5)
    assert table[2048] / ONE == pytest.approx(0.454936, abs=1e-6)
    assert table[1] / ONE == pytest.approx(pi / 2 / 4096**2, rel=0.01)


@pytest.mark.parametrize("m", [0.75, 1.5])
def test_moments_of_nakagami(m: float) -> None:
    mean, deviation = mean_and_deviation(gains("nakagami", m))
    assert mean == pytest.approx(1.0, abs=0.05)
    assert deviation == pytest.approx(1 / sqrt(m), rel=0.06)


@pytest.mark.parametrize(
    ("kind", "parameter", "variance"),
    [("rayleigh", 0.0, 1.0), ("rician", 8.0, 13.6191 / 53.4252), ("nakagami", 1.5, 2 / 3), ("nakagami", 0.75, 4 / 3)],
)
def test_moments_of_the_tables(kind: Kind, parameter: float, variance: float) -> None:
    table = gain_quantiles(kind, parameter)
    assert len(table) == 4097 and all(low <= high for low, high in pairwise(table))
    mean = sum(low + high for low, high in pairwise(table)) / 2 / 4096 / ONE
    square = sum(low * low + low * high + high * high for low, high in pairwise(table)) / 3 / 4096 / ONE**2
    assert mean == pytest.approx(1.0, abs=0.001)
    assert square - mean * mean == pytest.approx(variance, rel=0.015)


def test_a_gain_is_a_function_of_link_and_block() -> None:
    forward = [fading_db(KEY, block, "rayleigh") for block in range(100)]
    assert [fading_db(KEY, block, "rayleigh") for block in reversed(range(100))] == forward[::-1]
    assert fading_db(draw_key(1, "fading", "b", "a"), 0, "rayleigh") != forward[0]
    linear = gains("rayleigh", count=4_000)
    assert abs(correlation(linear[:-1], linear[1:])) < 3.29 / sqrt(4_000)


def test_none_is_none_and_no_fade_is_without_end() -> None:
    assert fading_db(KEY, 3, "none") == 0.0
    deepest = min(fading_db(KEY, block, "nakagami", 0.5) for block in range(COUNT))
    assert -120.0 < deepest < -60.0


def test_blocks_of_time() -> None:
    coherence = 52_000_000
    assert [block_of(t, coherence) for t in (0, coherence - 1, coherence, 10 * coherence + 5)] == [0, 0, 1, 10]


def test_m_by_distance() -> None:
    assert [nakagami_m(d) for d in (1.0, 79.9, 80.0, 250.0)] == [1.5, 1.5, 0.75, 0.75]


def test_tables_are_the_same_in_every_version() -> None:
    """A capture's fates follow from them."""
    assert fading_db(KEY, 0, "rayleigh") == pytest.approx(2.2070694196331173, abs=1e-12)
    assert gain_quantiles("rician", 8.0)[2048] == 932508478
    assert gain_quantiles("nakagami", 1.5)[::1024] == (78094, 404177634, 788657961, 1369448312, 10254237490)

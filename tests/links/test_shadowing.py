"""Shadowing (T20): normal, correlated over distance, the same both ways, on every visit, in any order.

Fading: each kind has its law with a mean of 1, and a gain is a function of link and block.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import cos, exp, hypot, pi, sin, sqrt
from typing import Any, Final

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from foosim.common.keyed_random import draw_key, draw_words, unit_interval
from foosim.vhub.radio import shadowing
from foosim.vhub.radio.fading import CELLS, ONE, TAIL, Kind, fading_db, gain_quantiles, nakagami_m
from foosim.vhub.radio.shadowing import Shadowing
from tests.links.proof import Proof
from tests.links.statistics import ALPHA, correlation, ks_normal, mean_and_deviation

KEY = draw_key(1, "shadowing")
D_CORR = 10.0
SITES = 10_000


@lru_cache
def made(key: bytes, sigma_db: float, d_corr_m: float) -> Shadowing:
    return Shadowing(key, sigma_db, d_corr_m)


def shadowing_db(key: bytes, a: Sequence[float], b: Sequence[float], sigma_db: float, d_corr_m: float) -> float:
    """Between two places in m, of which x and y count."""
    of = made(key, sigma_db, d_corr_m)
    return of.between_db(of.field(*a[:2]), of.field(*b[:2]), hypot(a[0] - b[0], a[1] - b[1]))


def field(key: bytes, x_m: float, y_m: float, d_corr_m: float) -> float:
    return made(key, 1.0, d_corr_m).field(x_m, y_m)


def places(count: int, span_m: float, seed: int = 1) -> list[tuple[float, float]]:
    key = draw_key(seed, "places")
    drawn = [draw_words(key, n) for n in range(count)]
    return [(span_m * (unit_interval(w[0]) - 0.5), span_m * (unit_interval(w[1]) - 0.5)) for w in drawn]


def test_it_is_normal_over_independent_sites(proof: Proof) -> None:
    """Kolmogorov's test over links between 10,000 places that are far apart."""
    n = proof.size(SITES, 5 * SITES)
    ends, key = places(n, 1e7, proof.seed), draw_key(proof.seed, "shadowing")
    values = [shadowing_db(key, a, b, 4.0, D_CORR) for a, b in zip(ends[::2], ends[1::2], strict=True)]
    proof.likely("T20", "normal over independent links: Kolmogorov", ks_normal(values, 0.0, 4.0), len(values))


@pytest.mark.parametrize("apart_m", [0.0, 0.3 * D_CORR, D_CORR, 3 * D_CORR])
def test_its_deviation_does_not_depend_on_the_length_of_the_link(proof: Proof, apart_m: float) -> None:
    """Both ends of a short link stand in the same shadow: their sum would be wider than that of a long one."""
    n, key = proof.size(2_000, 20_000), draw_key(proof.seed, "shadowing")
    values = [shadowing_db(key, (x, y), (x + apart_m, y), 4.0, D_CORR) for x, y in places(n, 1e7, proof.seed)]
    mean, deviation = mean_and_deviation(values)
    what = f"links of {apart_m / D_CORR:g} correlation distances: "
    proof.normal("T20", what + "mean", mean / 4.0 * sqrt(n), n)
    proof.ratio("T20", what + "deviation", deviation, 4.0, 0.05, n)


def test_correlation_over_distance(proof: Proof) -> None:
    """Along straight lines of 10,000 correlation distances in all, at lags of 0.25 to 3 of them: within 0.05."""
    products = dict.fromkeys((1, 2, 3, 4, 6, 8, 10, 12), 0.0)
    squares, count, key = 0.0, 0, draw_key(proof.seed, "shadowing")
    lines = proof.size(10, 50)
    for line in range(lines):
        turn = 2 * pi * line / lines + 0.1
        step_x, step_y = D_CORR / 4 * cos(turn), D_CORR / 4 * sin(turn)
        along = [field(key, 1e5 * line + k * step_x, 0.37 * line + k * step_y, D_CORR) for k in range(4_000)]
        for lag in products:
            products[lag] += sum(a * b for a, b in zip(along[:-lag], along[lag:], strict=True)) * 4_000 / (4_000 - lag)
        squares += sum(a * a for a in along)
        count += len(along)
    proof.within("T20", "variance along lines", squares / count, 1.0, 0.05, count)
    for lag, product in products.items():
        what = f"autocorrelation at {lag / 4:g} correlation distances"
        proof.within("T20", what, product / count, exp(-lag / 4), 0.05, count)


def test_links_that_share_an_end_correlate_by_half(proof: Proof) -> None:
    n, key = proof.size(1_500, 15_000), draw_key(proof.seed, "shadowing")
    hub, one, other = (places(n, 1e7, proof.seed + place) for place in (1, 2, 3))
    first = [shadowing_db(key, a, b, 1.0, D_CORR) for a, b in zip(hub, one, strict=True)]
    second = [shadowing_db(key, a, b, 1.0, D_CORR) for a, b in zip(hub, other, strict=True)]
    apart = [shadowing_db(key, a, b, 1.0, D_CORR) for a, b in zip(one, other[1:] + other[:1], strict=True)]
    proof.within("T20", "correlation of links that share an end", correlation(first, second), 0.5, 0.05, n)
    alone = correlation(first, apart[1:] + apart[:1])
    proof.within("T20", "correlation of links that share none", alone, 0.0, 0.05, n)


@given(
    a=st.tuples(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6), st.floats(-50, 50)),
    b=st.tuples(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6), st.floats(-50, 50)),
    sigma=st.floats(0.1, 12.0),
    d_corr=st.floats(1.0, 200.0),
)
def test_it_is_the_same_both_ways_to_the_last_bit(
    a: tuple[float, float, float], b: tuple[float, float, float], sigma: float, d_corr: float
) -> None:
    there = shadowing_db(KEY, a, b, sigma, d_corr)
    assert there == shadowing_db(KEY, b, a, sigma, d_corr)
    assert there == shadowing_db(KEY, (a[0], a[1], 0.0), b, sigma, d_corr), "the height does not enter"
    assert abs(there) < 12 * sigma
    shares = (made(KEY, sigma, d_corr).most_db(field(KEY, *place[:2], d_corr)) for place in (a, b))
    assert there <= sum(shares) + 1e-9, "no more than the shares of both ends"


def test_it_is_the_same_on_every_visit_in_any_order(proof: Proof) -> None:
    of = draw_key(proof.seed, "shadowing")
    links = [(a, b) for a in places(15, 60.0, proof.seed) for b in places(15, 60.0, proof.seed + 1)]

    def asked(order: list[int]) -> list[float]:
        for cache in (made, shadowing._node):
            cache.cache_clear()
        found = {n: shadowing_db(of, *links[n], 8.03, 6.0) for n in order}
        return [found[n] for n in sorted(found)]

    forward = asked(list(range(len(links))))
    orders = list(reversed(range(len(links)))), sorted(range(len(links)), key=lambda n: draw_words(KEY, n))
    again = [asked(order) for order in orders] + [[shadowing_db(of, *link, 8.03, 6.0) for link in links]]
    other = sum(value != first for values in again for value, first in zip(values, forward, strict=True))
    proof.exact("T20", "values that differ on another visit, in any order", other, 0, len(again) * len(links))
    back = [shadowing_db(of, b, a, 8.03, 6.0) for a, b in links]
    other = sum(value != first for value, first in zip(back, forward, strict=True))
    proof.exact("T20", "values that differ from b to a", other, 0, len(links))
    assert [shadowing_db(draw_key(proof.seed + 1, "shadowing"), *link, 8.03, 6.0) for link in links] != forward


def test_it_is_continuous() -> None:
    """Across the borders of cells, of all three lattices, on either side of 0."""
    for x in (-28.0, -10.0, -2.5, 0.0, 2.5, 10.0, 28.0, 70.0):
        for y in (-7.5, 0.0, 3.3):
            assert field(KEY, x - 1e-9, y, D_CORR) == pytest.approx(field(KEY, x, y, D_CORR), abs=1e-6)
            assert field(KEY, y, x - 1e-9, D_CORR) == pytest.approx(field(KEY, y, x, D_CORR), abs=1e-6)


def test_values_are_the_same_in_every_version() -> None:
    """A capture's fates follow from them."""
    assert shadowing_db(KEY, (1.5, -2.0, 0.4), (12.0, 7.0, 2.0), 3.0, 10.0) == pytest.approx(
        2.406614773540525, abs=1e-12
    )


PAIR: Final = draw_key(1, "fading", "a", "b")
COUNT: Final = 10_000


def rician(k_db: float) -> Any:
    """Of the power of a steady ray with K times the scattered power: noncentral chi-squared with two degrees."""
    k = 10 ** (k_db / 10)
    return stats.ncx2(2, 2 * k, scale=1 / (2 * (1 + k)))


LAWS: Final[dict[tuple[Kind, float], Any]] = {
    ("rayleigh", 0.0): stats.expon(),
    **{("rician", k_db): rician(k_db) for k_db in (-40.0, 0.0, 8.0, 20.0)},
    **{("nakagami", m): stats.gamma(m, scale=1 / m) for m in (0.5, 0.75, 1.0, 1.5, 5.0, 100.0)},
}


def gains(kind: Kind, parameter: float) -> list[float]:
    return [10 ** (fading_db(PAIR, block, kind, parameter) / 10) for block in range(COUNT)]


@pytest.mark.parametrize(("kind", "parameter"), LAWS)
def test_a_kind_has_its_law(kind: Kind, parameter: float) -> None:
    """Its table has the law's quantiles, and draws come of the law."""
    law, table = LAWS[kind, parameter], gain_quantiles(kind, parameter)
    shares = np.clip(np.arange(CELLS + 1) / CELLS, TAIL, 1 - TAIL)
    assert np.array(table) / ONE == pytest.approx(law.ppf(shares), rel=1e-6, abs=2 / ONE)
    assert law.mean() == pytest.approx(1.0) and stats.ks_1samp(gains(kind, parameter), law.cdf).pvalue > ALPHA


def test_a_gain_is_a_function_of_link_and_block() -> None:
    forward = [fading_db(PAIR, block, "rayleigh") for block in range(100)]
    assert [fading_db(PAIR, block, "rayleigh") for block in reversed(range(100))] == forward[::-1]
    assert fading_db(draw_key(1, "fading", "b", "a"), 0, "rayleigh") != forward[0]
    linear = gains("rayleigh", 0.0)
    assert abs(correlation(linear[:-1], linear[1:])) < 3.29 / sqrt(COUNT)
    assert fading_db(PAIR, 3, "none") == 0.0
    assert [nakagami_m(d) for d in (1.0, 79.9, 80.0, 250.0)] == [1.5, 1.5, 0.75, 0.75]


def test_tables_are_the_same_in_every_version() -> None:
    """A capture's fates follow from them."""
    assert fading_db(PAIR, 0, "rayleigh") == pytest.approx(2.2070694196331173, abs=1e-12)
    assert gain_quantiles("rician", 8.0)[2048] == 932508478
    assert gain_quantiles("nakagami", 1.5)[::1024] == (78094, 404177634, 788657961, 1369448312, 10254237490)

"""Quantiles of jitter: against closed forms and printed tables, and interpolated in whole nanoseconds."""

from __future__ import annotations

import ast
import inspect
from itertools import pairwise
from math import exp, log, log1p, sqrt
from statistics import NormalDist
from typing import Final

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foosim.common.keyed_random import Slot, draw_key, draw_words
from foosim.deployment.network.impairments import ParetoJitter
from foosim.vhub.network import jitter, series_math
from foosim.vhub.network.jitter import (
    CELLS,
    HALF_CELLS,
    HALVES,
    TAIL_CELL,
    _lomax_scale,
    gamma_quantiles_ns,
    interpolate_ns,
    moments_ns,
    quantiles_ns,
)

S: Final = 1_000_000_000
TAIL: Final = 1.0 - 2.0**-20
COUNT: Final = 20_000


def share(cell: int) -> float:
    return min(max(cell / CELLS, 2.0**-20), TAIL)


def moments(quantiles: tuple[int, ...]) -> tuple[float, float]:
    """Mean and standard deviation of what draws give: a straight line between words, the closer the higher they are."""
    words = [cell << 52 for cell in range(TAIL_CELL)]
    words += [2**64 - 2**bits + (place << bits - 8) for bits in range(60, 11, -1) for place in range(128)]
    drawn = [interpolate_ns(quantiles, word) for word in (*words, 2**64 - 1)]
    assert all(low <= high for low, high in pairwise(drawn)), "more luck is never less delay"
    shares = [(after - word) / 2**64 for word, after in pairwise((*words, 2**64))]
    mean = sum(share * (low + high) / 2 for share, (low, high) in zip(shares, pairwise(drawn), strict=True))
    square = sum(
        share * (low * low + low * high + high * high) / 3
        for share, (low, high) in zip(shares, pairwise(drawn), strict=True)
    )
    return mean, sqrt(square - mean * mean)


def test_as_wide_as_its_mean_it_is_exponential() -> None:
    """Shape 1: the quantile is -ln(1 - p)."""
    quantiles = gamma_quantiles_ns(S, S)
    for cell in range(CELLS):
        assert quantiles[cell] == pytest.approx(-log1p(-share(cell)) * S, abs=1.0, rel=1e-9)
    assert quantiles[CELLS] == pytest.approx(-log1p(-TAIL) * S, rel=1e-7)


@pytest.mark.parametrize("stages", [4, 9, 16, 100])
def test_with_a_whole_shape_it_is_erlangs_distribution(stages: int) -> None:
    """P(n, x) = 1 - e^-x (1 + x + ... + x^(n-1) / (n-1)!): a sum that shares nothing with the series in the code."""
    mean = 60 * S
    quantiles = gamma_quantiles_ns(mean, mean // round(sqrt(stages)))
    assert mean % round(sqrt(stages)) == 0
    for cell in range(0, CELLS + 1, 16):
        x = quantiles[cell] / mean * stages
        term = total = 1.0
        for n in range(1, stages):
            term *= x / n
            total += term
        assert 1.0 - exp(-x) * total == pytest.approx(share(cell), abs=1e-9), cell


PRINTED: Final = {  # Abramowitz and Stegun, table 26.8: chi-squared with nu degrees of freedom
    1: {0.5: 0.454936, 0.75: 1.32330},
    2: {0.25: 0.575364, 0.5: 1.38629, 0.75: 2.77259},
    5: {0.25: 2.67460, 0.5: 4.35146, 0.75: 6.62568},
    10: {0.25: 6.73720, 0.5: 9.34182, 0.75: 12.5489},
    30: {0.25: 24.4776, 0.5: 29.3360, 0.75: 34.7998},
}


@pytest.mark.parametrize("freedom", PRINTED)
def test_it_agrees_with_printed_tables(freedom: int) -> None:
    """Chi-squared with nu degrees of freedom is gamma with mean nu and variance 2 nu."""
    quantiles = gamma_quantiles_ns(freedom * S, round(sqrt(2 * freedom) * S))
    for p, value in PRINTED[freedom].items():
        assert quantiles[round(p * CELLS)] / S == pytest.approx(value, rel=5e-6)


@pytest.mark.parametrize("mean_ns", [1_000, 300_000, 60 * S])
@pytest.mark.parametrize("ratio", [0.01, 0.03, 0.1, 0.5, 1.0, 2.0, 3.0])
def test_mean_and_spread_are_what_is_configured(mean_ns: int, ratio: float) -> None:
    """From the narrowest to the widest that a deployment may have; wide ones have a finer tail."""
    sd_ns = round(mean_ns * ratio)
    quantiles = gamma_quantiles_ns(mean_ns, sd_ns)
    assert quantiles[0] >= 0 and all(low <= high for low, high in pairwise(quantiles))
    mean, sd = moments(quantiles)
    found_mean, found_sd = moments_ns(quantiles)
    assert found_mean == pytest.approx(mean, rel=1e-4, abs=1.0) and found_sd == pytest.approx(sd, rel=1e-3, abs=1.0)
    assert mean == pytest.approx(mean_ns, rel=0.0005, abs=0.6)
    assert sd == pytest.approx(sd_ns, rel=0.005, abs=1.0)


def test_a_narrow_one_is_nearly_normal() -> None:
    quantiles = gamma_quantiles_ns(S, S // 100)
    for cell in (512, 2048, 3584):
        normal = NormalDist(1.0, 0.01).inv_cdf(cell / CELLS)
        assert quantiles[cell] / S == pytest.approx(normal, abs=1e-4)


def test_it_scales() -> None:
    one, thousand = gamma_quantiles_ns(300_000, 200_000), gamma_quantiles_ns(300_000_000, 200_000_000)
    assert all(abs(1000 * low - high) <= 501 for low, high in zip(one, thousand, strict=True))


# --- interpolation ---------------------------------------------------------------------------------------------------


@settings(max_examples=300)
@given(word=st.integers(0, 2**64 - 1))
def test_interpolation_is_linear_within_the_cell_and_whole(word: int) -> None:
    quantiles = gamma_quantiles_ns(300_000, 300_000)
    cell, rest = divmod(word, 2**52)
    low, high = quantiles[cell], quantiles[cell + 1]
    value = interpolate_ns(quantiles, word)
    assert type(value) is int and low <= value <= high
    assert value == low + (high - low) * rest // 2**52


def test_the_ends_of_a_cell_are_its_quantiles() -> None:
    quantiles = gamma_quantiles_ns(300_000, 300_000)
    for cell in (0, 1, 2047, CELLS - 1):
        assert interpolate_ns(quantiles, cell << 52) == quantiles[cell]
        last = interpolate_ns(quantiles, (cell + 1 << 52) - 1)
        assert quantiles[cell + 1] - 1 <= last <= quantiles[cell + 1]
    assert interpolate_ns(quantiles, 2**64 - 1) <= quantiles[CELLS]


def test_a_heavy_tail_is_finer_the_rarer_it_is() -> None:
    """Each quantile where its probability is, whole and linear between; rarer than 2^-52 there is nothing."""
    law = ParetoJitter.model_validate({"shape": "pareto", "mean": "1 us", "alpha": 1.2, "max": "60 s"})
    quantiles = quantiles_ns(law)
    assert len(quantiles) == TAIL_CELL + HALVES * HALF_CELLS + 1
    for cell in (0, 1, TAIL_CELL - 1, TAIL_CELL):
        assert interpolate_ns(quantiles, cell << 52) == pytest.approx(quantiles[cell], abs=1)
    for half in range(HALVES):
        whole = 2 ** (60 - half)
        for place in (0, 1, 40, 63):
            at = TAIL_CELL + half * HALF_CELLS + place
            step = whole // 2 // HALF_CELLS
            word = 2**64 - 1 - (whole - place * step) + (place == 0)
            assert quantiles[at] <= interpolate_ns(quantiles, word) <= quantiles[at] + quantiles[at + 1] // step + 1
            middle = interpolate_ns(quantiles, word + step // 2)
            assert middle == pytest.approx((quantiles[at] + quantiles[at + 1]) / 2, rel=0.02, abs=1)
    assert interpolate_ns(quantiles, 2**64 - 1) == quantiles[-1] == 60 * S


@pytest.mark.parametrize(
    ("mean", "alpha", "top"),
    [
        ("1 us", 1.2, "60 s"),
        ("1 us", 2.5, "60 s"),
        ("2 ms", 1.05, "60 s"),
        ("2 ms", 1.2, "10 s"),
        ("2 ms", 2.0, "3 s"),
        ("1 s", 1.5, "3 s"),
        ("1 s", 5.0, "60 s"),
    ],
)
def test_a_pareto_law_cut_anywhere_has_its_moments(mean: str, alpha: float, top: str) -> None:
    """Against the integrals of the cut law, with tails from nearly none to nearly no mean."""
    law = ParetoJitter.model_validate({"shape": "pareto", "mean": mean, "alpha": alpha, "max": top})
    found_mean, found = moments_ns(quantiles_ns(law))
    scale = _lomax_scale(law.mean_ns, alpha, law.max_ns)
    u = 1 + law.max_ns / scale
    by_two = log(u) if alpha == 2.0 else (u ** (2 - alpha) - 1) / (2 - alpha)
    square = 2 * scale * scale * (by_two - (1 - u ** (1 - alpha)) / (alpha - 1))
    assert found_mean == pytest.approx(law.mean_ns, rel=1e-3)
    assert found == pytest.approx(sqrt(square - law.mean_ns**2), rel=2e-3)


def test_drawn_jitter_has_the_distribution() -> None:
    """Chi-squared over 64 cells of equal probability, 99.9 %, and the mean within 3.29 standard errors."""
    quantiles, key = gamma_quantiles_ns(300_000, 300_000), draw_key(1, "link", "a", "b")
    drawn = [interpolate_ns(quantiles, draw_words(key, number)[Slot.JITTER]) for number in range(COUNT)]
    counts = [0] * 64
    for value in drawn:
        counts[min(63, int((1.0 - exp(-value / 300_000)) * 64))] += 1
    assert sum((count - COUNT / 64) ** 2 / (COUNT / 64) for count in counts) < 103.44
    assert abs(sum(drawn) / COUNT - 300_000) < 3.29 * 300_000 / sqrt(COUNT)


def test_nothing_of_the_mathematical_library_decides() -> None:
    """Its last bits differ between machines: only exact operations (and splitting a float) may be used."""
    trees = [ast.parse(inspect.getsource(module)) for module in (jitter, series_math)]
    used = {node.attr for tree in trees for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
    assert used & set(dir(__import__("math"))) == {"frexp", "inf", "sqrt"}
    assert "**" not in inspect.getsource(jitter._Gamma) and "pow" not in used


def test_tables_are_the_same_in_every_version() -> None:
    """A capture's delays follow from them."""
    quantiles = gamma_quantiles_ns(300_000, 300_000)
    assert [quantiles[cell] for cell in (1, 1024, 2048, 3072, 4095, 4096)] == [
        73,
        86305,
        207944,
        415888,
        2495330,
        4158883,
    ]

"""Quantiles of jitter: those of the law over all shapes, interpolated in whole nanoseconds, with exact operations."""

from __future__ import annotations

import ast
import inspect
from itertools import pairwise
from math import log1p, sqrt
from typing import Any, Final

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from foosim.vhub.network import jitter, series_math
from foosim.vhub.network.jitter import _ANY_JITTER as ANY_JITTER
from foosim.vhub.network.jitter import (
    CELLS,
    FIRST,
    GAMMA_HALVES,
    HALF_CELLS,
    HALVES,
    TAIL_CELL,
    gamma_quantiles_ns,
    interpolate_ns,
    moments_ns,
    quantiles_ns,
)

S: Final = 1_000_000_000


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


def aboves(quantiles: tuple[int, ...]) -> list[float]:
    """The probability of more than each quantile: even cells, or ever finer ones in a heavy tail."""
    if len(quantiles) == CELLS + 1:
        return [1 - FIRST, *(1 - cell / CELLS for cell in range(1, CELLS)), FIRST]
    halves = (len(quantiles) - 1 - TAIL_CELL) // HALF_CELLS
    fine = [2.0 ** -(4 + half) * (1 - place / 2 / HALF_CELLS) for half in range(halves) for place in range(HALF_CELLS)]
    return [1 - FIRST, *(1 - cell / CELLS for cell in range(1, TAIL_CELL)), *fine, 2.0 ** -(4 + halves)]


def gamma(mean_ns: int, sd_ns: int) -> Any:
    return stats.gamma((mean_ns / sd_ns) ** 2, scale=sd_ns**2 / mean_ns)


@pytest.mark.parametrize("mean_ns", [1_000, 300_000, 60 * S])
@pytest.mark.parametrize("ratio", [0.01, 0.1, 0.5, 1.0, 2.0, 3.0])
def test_a_gamma_table_has_the_quantiles_and_the_moments_of_its_law(mean_ns: int, ratio: float) -> None:
    """From the narrowest to the widest that a deployment may have; wide ones have a finer tail."""
    sd_ns = round(mean_ns * ratio)
    quantiles, law = gamma_quantiles_ns(mean_ns, sd_ns), gamma(mean_ns, sd_ns)
    assert len(quantiles) == (CELLS + 1 if ratio <= 1 else TAIL_CELL + GAMMA_HALVES * HALF_CELLS + 1)
    assert quantiles == pytest.approx(law.isf(aboves(quantiles)), rel=2e-5, abs=1.0)
    (mean, sd), (found_mean, found_sd) = moments(quantiles), moments_ns(quantiles)
    assert found_mean == pytest.approx(mean, rel=1e-4, abs=1.0) and found_sd == pytest.approx(sd, rel=1e-3, abs=1.0)
    assert mean == pytest.approx(mean_ns, rel=0.0005, abs=0.6) and sd == pytest.approx(sd_ns, rel=0.005, abs=1.0)


def lomax(mean: float, alpha: float, top: float) -> Any:
    """A Lomax law whose mean, cut at `top`, is `mean`."""
    low, high = 0.0, 1e6 * top
    for _ in range(300):
        scale = (low + high) / 2
        found = scale / (alpha - 1) * -np.expm1((1 - alpha) * log1p(top / scale))
        low, high = (scale, high) if found < mean else (low, scale)
    return stats.lomax(alpha, scale=scale)


LAWS: Final[dict[str, tuple[dict[str, Any], Any, float, float]]] = {
    "uniform": ({"width": "4 ms"}, stats.uniform(0, 4), 0.0, 4.0),
    "lognormal": (
        {"mean": "4 ms", "sd": "1 ms"}, stats.lognorm(sqrt(log1p(1 / 16)), scale=4 / sqrt(1 + 1 / 16)), 0.0, 1e9,
    ),
    "shifted_exp": ({"min": "2 ms", "mean": "5 ms"}, stats.expon(scale=5), 2.0, 1e9),
    **{
        f"pareto {alpha}, {top:g} ms": (
            {"mean": f"{mean} ms", "alpha": alpha, "max": f"{top} ms"}, lomax(mean, alpha, top), 0.0, top,
        )
        for mean, alpha, top in ((2, 1.05, 60_000), (2, 1.2, 10_000), (2, 2.0, 3_000), (1_000, 1.5, 3_000), (2, 20, 12))
    },
}  # fmt: skip
"""As written, with the law in ms, and what it is cut to."""


@pytest.mark.parametrize("name", LAWS)
def test_a_heavy_tailed_table_has_the_quantiles_of_its_law(name: str) -> None:
    settings, law, least, most = LAWS[name]
    quantiles = quantiles_ns(ANY_JITTER.validate_python({"shape": name.split(maxsplit=1)[0], **settings}))
    assert len(quantiles) == TAIL_CELL + HALVES * HALF_CELLS + 1
    expected = np.clip(law.isf(aboves(quantiles)), least, most) * 1e6
    assert quantiles == pytest.approx(expected, rel=0.02, abs=1.0)
    sure = None if name != "lognormal" else -15 * HALF_CELLS  # rarer than 2^-37 a normal number has few bits
    assert quantiles[:sure] == pytest.approx(expected[:sure], rel=1e-6, abs=1.0)


@given(word=st.one_of(st.integers(0, 2**64 - 1), st.integers(0, 2**60).map(lambda rest: 2**64 - 1 - rest)))
def test_interpolation_is_linear_within_its_cell_and_whole(word: int) -> None:
    """Of even cells and of those of a heavy tail, each half of which has as many."""
    for quantiles in (gamma_quantiles_ns(300_000, 300_000), gamma_quantiles_ns(300_000, 900_000)):
        value, above = interpolate_ns(quantiles, word), 2**64 - 1 - word
        place = CELLS - 1 - (above >> 52), word & (1 << 52) - 1, 52
        if len(quantiles) > CELLS + 1 and above < 1 << 60:
            bits = above.bit_length()
            cell, rest = divmod((1 << bits) - above, 1 << max(0, bits - 7)) if bits > 7 else (0, 0)
            place = TAIL_CELL + (60 - bits) * HALF_CELLS + cell, rest, bits - 7
        at, rest, size = place
        if at >= len(quantiles) - 1:
            assert value == quantiles[-1]
        else:
            assert type(value) is int and value == quantiles[at] + ((quantiles[at + 1] - quantiles[at]) * rest >> size)


def test_nothing_of_the_mathematical_library_decides() -> None:
    """Its last bits differ between machines: only exact operations (and splitting a float) may be used."""
    trees = [ast.parse(inspect.getsource(module)) for module in (jitter, series_math)]
    used = {node.attr for tree in trees for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
    assert used & set(dir(__import__("math"))) == {"frexp", "inf", "sqrt"}
    assert "**" not in inspect.getsource(jitter._Gamma) and "pow" not in used


def test_tables_are_the_same_in_every_version() -> None:
    """A capture's delays follow from them."""
    found = [gamma_quantiles_ns(300_000, 300_000)[cell] for cell in (1, 1024, 2048, 3072, 4095, 4096)]
    assert found == [73, 86305, 207944, 415888, 2495330, 4158883]

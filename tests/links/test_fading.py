"""Fading: each kind has its law with a mean of 1, and a gain is a function of link and block."""

from __future__ import annotations

from math import sqrt
from typing import Any, Final

import numpy as np
import pytest
from scipy import stats

from foosim.common.keyed_random import draw_key
from foosim.vhub.radio.fading import CELLS, ONE, TAIL, Kind, fading_db, gain_quantiles, nakagami_m
from tests.links.statistics import ALPHA, correlation

KEY: Final = draw_key(1, "fading", "a", "b")
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
    return [10 ** (fading_db(KEY, block, kind, parameter) / 10) for block in range(COUNT)]


@pytest.mark.parametrize(("kind", "parameter"), LAWS)
def test_a_kind_has_its_law(kind: Kind, parameter: float) -> None:
    """Its table has the law's quantiles, and draws come of the law."""
    law, table = LAWS[kind, parameter], gain_quantiles(kind, parameter)
    shares = np.clip(np.arange(CELLS + 1) / CELLS, TAIL, 1 - TAIL)
    assert np.array(table) / ONE == pytest.approx(law.ppf(shares), rel=1e-6, abs=2 / ONE)
    assert law.mean() == pytest.approx(1.0) and stats.ks_1samp(gains(kind, parameter), law.cdf).pvalue > ALPHA


def test_a_gain_is_a_function_of_link_and_block() -> None:
    forward = [fading_db(KEY, block, "rayleigh") for block in range(100)]
    assert [fading_db(KEY, block, "rayleigh") for block in reversed(range(100))] == forward[::-1]
    assert fading_db(draw_key(1, "fading", "b", "a"), 0, "rayleigh") != forward[0]
    linear = gains("rayleigh", 0.0)
    assert abs(correlation(linear[:-1], linear[1:])) < 3.29 / sqrt(COUNT)
    assert fading_db(KEY, 3, "none") == 0.0
    assert [nakagami_m(d) for d in (1.0, 79.9, 80.0, 250.0)] == [1.5, 1.5, 0.75, 0.75]


def test_tables_are_the_same_in_every_version() -> None:
    """A capture's fates follow from them."""
    assert fading_db(KEY, 0, "rayleigh") == pytest.approx(2.2070694196331173, abs=1e-12)
    assert gain_quantiles("rician", 8.0)[2048] == 932508478
    assert gain_quantiles("nakagami", 1.5)[::1024] == (78094, 404177634, 788657961, 1369448312, 10254237490)

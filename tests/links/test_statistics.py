"""The tests' own statistics: against printed critical values, and that they refuse what is wrong."""

from __future__ import annotations

from math import log, sqrt

import pytest

from foosim.common.keyed_random import draw_key, draw_words, gaussian, unit_interval
from tests.links.proof import FAILS, SKIPPED, Proof
from tests.links.statistics import (
    ALPHA,
    Z_ALPHA,
    binomial_z,
    chi_square,
    chi_square_p,
    correlation,
    ks_exponential,
    ks_normal,
    ks_p,
    ks_two_samples,
    ks_uniform,
    mean_and_deviation,
    normal_p,
)

WORDS = [draw_words(draw_key(5, "statistics"), counter) for counter in range(3_000)]
UNIFORM = [unit_interval(words[0]) for words in WORDS]
NORMAL = [gaussian(words[1]) for words in WORDS]


def test_printed_critical_values() -> None:
    assert normal_p(1.959964) == pytest.approx(0.05, abs=1e-6)
    assert normal_p(Z_ALPHA) == pytest.approx(ALPHA, rel=0.01)
    assert ks_p(1.3581 / sqrt(1e6), 1_000_000) == pytest.approx(0.05, rel=2e-3)
    assert ks_p(0.00616, 100_000) == pytest.approx(ALPHA, rel=0.02)
    for freedom, value, p in ((3, 16.27, 1e-3), (10, 18.307, 0.05), (63, 103.44, 1e-3), (255, 330.52, 1e-3)):
        assert chi_square_p(value, freedom) == pytest.approx(p, abs=3e-4)


def test_right_laws_pass_and_wrong_ones_do_not() -> None:
    exponential = [-log(1.0 - u) for u in UNIFORM]
    assert ks_uniform(UNIFORM) > ALPHA and ks_normal(NORMAL) > ALPHA and ks_exponential(exponential, 1.0) > ALPHA
    assert ks_uniform([u * 0.95 for u in UNIFORM]) < ALPHA
    assert ks_normal(NORMAL, deviation=1.2) < ALPHA and ks_normal(NORMAL, mean=0.1) < ALPHA
    assert ks_exponential(exponential, 1.1) < ALPHA
    assert ks_two_samples(NORMAL[:1500], NORMAL[1500:]) > ALPHA
    assert ks_two_samples(NORMAL, [1.2 * x for x in reversed(NORMAL)]) < ALPHA


def test_counts() -> None:
    faces = [0] * 6
    for u in UNIFORM:
        faces[int(u * 6)] += 1
    assert chi_square(faces, [500.0] * 6) > ALPHA
    assert chi_square([faces[0] + 120, faces[1] - 120, *faces[2:]], [500.0] * 6) < ALPHA
    assert chi_square([50, 48, 1, 1], [49.0, 49.0, 1.0, 1.0]) > 0.5, "few expected: merged"
    assert binomial_z(600, 1000, 0.5) == pytest.approx(100 / sqrt(250))


def test_moments() -> None:
    assert mean_and_deviation([1.0, 2.0, 3.0]) == (2.0, 1.0)
    assert correlation([1.0, 2.0, 3.0], [2.0, 4.0, 7.0]) == pytest.approx(0.9933, abs=1e-4)
    assert abs(correlation(UNIFORM, NORMAL)) < Z_ALPHA / sqrt(len(UNIFORM))


def test_what_cannot_be_made_here_leaves_a_row() -> None:
    proof = Proof(1, is_full=True)
    with pytest.raises(pytest.skip.Exception, match="no netem"):
        proof.skip("T27", "delay", "no netem here")
    with pytest.raises(AssertionError, match=r"T19 share: figure 0.6, accepted is 0.5 within 0.05"):
        proof.within("T19", "share", 0.6, 0.5, 0.05, 7)
    assert proof.rows == [
        ("T27", "delay", "", "skipped: no netem here", "", 0, SKIPPED),
        ("T19", "share", "figure", "0.6", "0.5 within 0.05", 7, FAILS),
    ]

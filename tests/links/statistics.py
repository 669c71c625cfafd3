"""Statistics of samples against laws, as p-values: what the tests of the network accept at ALPHA with fixed seeds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import sqrt
from typing import Final

import numpy as np
from scipy import stats

ALPHA: Final = 1e-3
"""Of one assertion. Seeds are fixed, so that a test either always holds or never."""
Z_ALPHA: Final = 3.29
"""A standard normal number is beyond it, on either side, with ALPHA."""


def mean_and_deviation(sample: Sequence[float]) -> tuple[float, float]:
    """Return the mean and the standard deviation (with n - 1)."""
    return float(np.mean(sample)), float(np.std(sample, ddof=1))


def correlation(one: Sequence[float], other: Sequence[float]) -> float:
    """Return Pearson's coefficient of two samples of the same length."""
    return float(np.corrcoef(one, other)[0, 1])


def binomial_z(hits: int, trials: int, probability: float) -> float:
    """Return by how many standard deviations a count of independent events is off its expectation."""
    return (hits - trials * probability) / sqrt(trials * probability * (1.0 - probability))


def ks(sample: Sequence[float], cdf: Callable[[float], float]) -> float:
    """Return the p-value of Kolmogorov's test of a sample against a continuous law."""
    return float(stats.ks_1samp(sample, np.vectorize(cdf)).pvalue)


def ks_exponential(sample: Sequence[float], mean: float) -> float:
    """Return the p-value of Kolmogorov's test against the exponential law of a mean."""
    return float(stats.ks_1samp(sample, stats.expon(scale=mean).cdf).pvalue)


def ks_normal(sample: Sequence[float], mean: float = 0.0, deviation: float = 1.0) -> float:
    """Return the p-value of Kolmogorov's test against a normal law."""
    return float(stats.ks_1samp(sample, stats.norm(mean, deviation).cdf).pvalue)


def chi_square(observed: Sequence[int], expected: Sequence[float]) -> float:
    """Return the p-value of Pearson's test of counts; neighbours are merged until 5 are expected in each class."""
    classes = [[0.0, 0.0]]
    for count, due in zip(observed, expected, strict=True):
        if classes[-1][1] >= 5.0:
            classes.append([0.0, 0.0])
        classes[-1][0] += count
        classes[-1][1] += due
    if len(classes) > 1 and classes[-1][1] < 5.0:
        last = classes.pop()
        classes[-1] = [classes[-1][0] + last[0], classes[-1][1] + last[1]]
    assert len(classes) >= 2, "too few counts for a test"
    statistic = sum((count - due) ** 2 / due for count, due in classes)
    return float(stats.chi2.sf(statistic, len(classes) - 1))


def binomial_p(hits: int, trials: int, probability: float) -> float:
    """Return how probable a count at least as far out is: twice the lesser tail of the binomial law."""
    law = stats.binom(trials, probability)
    return float(min(1.0, 2.0 * min(law.cdf(hits), law.sf(hits - 1))))


def contingency(table: Sequence[Sequence[int]]) -> float:
    """Return the p-value of Pearson's test of independence of rows and columns."""
    return float(stats.chi2_contingency(table, correction=False).pvalue)

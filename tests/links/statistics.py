"""Statistics of samples against laws, as p-values: what the tests of the network accept at ALPHA with fixed seeds.

Sources: Kolmogorov's series with Stephens' correction for finite samples (1970), Wilson and Hilferty's cube root for
chi-squared (1931), Hoel's normal score of a binomial count.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from math import erf, erfc, exp, expm1, lgamma, log, log1p, sqrt
from typing import Final

ALPHA: Final = 1e-3
"""Of one assertion. Seeds are fixed, so that a test either always holds or never."""
Z_ALPHA: Final = 3.29
"""A standard normal number is beyond it, on either side, with ALPHA."""


def normal_cdf(x: float) -> float:
    """Return the distribution function of the standard normal law."""
    return 0.5 * (1.0 + erf(x / sqrt(2.0)))


def normal_p(z: float) -> float:
    """Return how probable a standard normal number at least as far from 0 is, on either side."""
    return erfc(abs(z) / sqrt(2.0))


def mean_and_deviation(sample: Sequence[float]) -> tuple[float, float]:
    """Return the mean and the standard deviation (with n - 1)."""
    mean = sum(sample) / len(sample)
    return mean, sqrt(sum((x - mean) * (x - mean) for x in sample) / (len(sample) - 1))


def correlation(one: Sequence[float], other: Sequence[float]) -> float:
    """Return Pearson's coefficient of two samples of the same length."""
    (mean_one, deviation_one), (mean_other, deviation_other) = mean_and_deviation(one), mean_and_deviation(other)
    products = sum((x - mean_one) * (y - mean_other) for x, y in zip(one, other, strict=True))
    return products / ((len(one) - 1) * deviation_one * deviation_other)


def binomial_z(hits: int, trials: int, probability: float) -> float:
    """Return by how many standard deviations a count of independent events is off its expectation."""
    return (hits - trials * probability) / sqrt(trials * probability * (1.0 - probability))


def ks_distance(sample: Iterable[float], cdf: Callable[[float], float]) -> float:
    """Return Kolmogorov's D: the greatest distance of the sample's distribution function from a continuous law's."""
    ordered = sorted(sample)
    n = len(ordered)
    below = [cdf(x) for x in ordered]
    return max(max((rank + 1) / n - p, p - rank / n) for rank, p in enumerate(below))


def ks_p(distance: float, n: int) -> float:
    """Return how probable a distance at least as great is, for n independent numbers of the law."""
    x = (sqrt(n) + 0.12 + 0.11 / sqrt(n)) * distance
    if x < 0.3:
        return 1.0
    total = sum((1.0 if k % 2 else -1.0) * exp(-2.0 * k * k * x * x) for k in range(1, 101))
    return min(max(2.0 * total, 0.0), 1.0)


def ks(sample: Sequence[float], cdf: Callable[[float], float]) -> float:
    """Return the p-value of Kolmogorov's test of a sample against a continuous law."""
    return ks_p(ks_distance(sample, cdf), len(sample))


def ks_exponential(sample: Sequence[float], mean: float) -> float:
    """Return the p-value of Kolmogorov's test against the exponential law of a mean."""
    return ks(sample, lambda x: -expm1(-x / mean) if x > 0.0 else 0.0)


def ks_normal(sample: Sequence[float], mean: float = 0.0, deviation: float = 1.0) -> float:
    """Return the p-value of Kolmogorov's test against a normal law."""
    return ks(sample, lambda x: normal_cdf((x - mean) / deviation))


def ks_uniform(sample: Sequence[float], low: float = 0.0, high: float = 1.0) -> float:
    """Return the p-value of Kolmogorov's test against the uniform law between two bounds."""
    return ks(sample, lambda x: min(max((x - low) / (high - low), 0.0), 1.0))


def ks_two_samples(one: Sequence[float], other: Sequence[float]) -> float:
    """Return the p-value of Smirnov's test: do two samples come of the same law?"""
    marked = sorted([(x, 1.0 / len(one)) for x in one] + [(x, -1.0 / len(other)) for x in other])
    distance = step = 0.0
    for (x, rise), (following, _) in pairwise([*marked, (float("inf"), 0.0)]):
        step += rise
        if following > x:
            distance = max(distance, abs(step))
    n = len(one) * len(other) / (len(one) + len(other))
    return ks_p(distance, max(round(n), 1))


def chi_square_p(statistic: float, freedom: int) -> float:
    """Return how probable a value at least as great is; from 3 on by Wilson and Hilferty's cube root, within 3e-4."""
    if freedom == 1:
        return normal_p(sqrt(statistic))
    if freedom == 2:
        return exp(-statistic / 2.0)
    spread = 2.0 / (9.0 * freedom)
    z = ((statistic / freedom) ** (1.0 / 3.0) - (1.0 - spread)) / sqrt(spread)
    return 0.5 * erfc(z / sqrt(2.0))


def chi_square(observed: Sequence[int], expected: Sequence[float], estimated: int = 0) -> float:
    """Return the p-value of Pearson's test of counts; neighbours are merged until 5 are expected in each class.

    `estimated` is how many parameters of the law were taken from the sample.
    """
    assert len(observed) == len(expected)
    classes: list[tuple[float, float]] = []
    seen = due = 0.0
    for count, expectation in zip(observed, expected, strict=True):
        seen += count
        due += expectation
        if due >= 5.0:
            classes.append((seen, due))
            seen = due = 0.0
    if classes and (seen or due):
        last_seen, last_due = classes.pop()
        classes.append((last_seen + seen, last_due + due))
    assert len(classes) >= 2, "too few counts for a test"
    statistic = sum((count - expectation) ** 2 / expectation for count, expectation in classes)
    return chi_square_p(statistic, len(classes) - 1 - estimated)


def binomial_p(hits: int, trials: int, probability: float) -> float:
    """Return how probable a count at least as far out is, exactly: twice the lesser tail of the binomial law."""
    log_odds = log(probability) - log1p(-probability)

    def log_mass(k: int) -> float:
        ways = lgamma(trials + 1) - lgamma(k + 1) - lgamma(trials - k + 1)
        return ways + k * log_odds + trials * log1p(-probability)

    def tail(step: int) -> float:
        total, k = 0.0, hits
        while 0 <= k <= trials:
            mass = exp(log_mass(k))
            total += mass
            if mass < 1e-18 * total or (mass == 0.0 and (k - trials * probability) * step > 0.0):
                break
            k += step
        return total

    return min(1.0, 2.0 * min(tail(1), tail(-1)))


def contingency(table: Sequence[Sequence[int]]) -> float:
    """Return the p-value of Pearson's test of independence of rows and columns."""
    rows, columns = [sum(row) for row in table], [sum(column) for column in zip(*table, strict=True)]
    total = sum(rows)
    expected = [[row * column / total for column in columns] for row in rows]
    statistic = sum(
        (count - due) ** 2 / due
        for counts, dues in zip(table, expected, strict=True)
        for count, due in zip(counts, dues, strict=True)
    )
    return chi_square_p(statistic, (len(rows) - 1) * (len(columns) - 1))


def gamma_cdf(shape: float, x: float) -> float:
    """Return the regularised incomplete gamma function P(shape, x): its series (Abramowitz and Stegun, 6.5.29)."""
    if x <= 0.0:
        return 0.0
    if x > 200.0 + 10.0 * shape:
        return 1.0
    term = total = 1.0 / shape
    n = shape
    while term > 1e-16 * total:
        n += 1.0
        term *= x / n
        total += term
    return min(1.0, total * exp(shape * log(x) - x - lgamma(shape)))

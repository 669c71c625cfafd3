"""Estimates with their intervals of 95 %.

Sources: E. B. Wilson, J. Am. Stat. Assoc. 22 (1927) for shares; Student's t for means, its distribution by the finite
series of Abramowitz and Stegun 26.7.3 and 26.7.4; for counts in a time the score interval of a Poisson rate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from math import atan, cos, pi, sin, sqrt
from typing import Final

Z: Final = 1.959963984540054
"""The normal distribution's quantile of 97.5 %."""
LEVEL: Final = 0.975
BISECTIONS: Final = 80


@dataclass(frozen=True, slots=True)
class Interval:
    """An estimate with its 95 % interval, whose bounds are None for too few values."""

    value: float
    low: float | None
    high: float | None


def share(count: int, of: int) -> Interval:
    """Return a share and its Wilson interval."""
    p, square = count / of, Z * Z
    centre = (p + square / (2 * of)) / (1 + square / of)
    half = Z * sqrt(p * (1 - p) / of + square / (4 * of * of)) / (1 + square / of)
    return Interval(p, max(centre - half, 0.0), min(centre + half, 1.0))


def mean(values: Sequence[float]) -> Interval:
    """Return a mean and its interval by Student's t."""
    count = len(values)
    found = sum(values) / count
    if count < 2:
        return Interval(found, None, None)
    deviation = sqrt(sum((value - found) ** 2 for value in values) / (count - 1))
    half = t_quantile(count - 1) * deviation / sqrt(count)
    return Interval(found, found - half, found + half)


def rate(count: int, time: float) -> Interval:
    """Return a count per unit of time and its score interval."""
    if time <= 0.0:
        return Interval(0.0, None, None)
    centre, half = count + Z * Z / 2, Z * sqrt(count + Z * Z / 4)
    return Interval(count / time, max(centre - half, 0.0) / time, (centre + half) / time)


@cache
def t_quantile(freedom: int) -> float:
    """Return Student's t of 97.5 % for a number of degrees of freedom."""
    low, high = 0.0, 20.0
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        low, high = (middle, high) if _t_within(middle, freedom) < 2 * LEVEL - 1 else (low, middle)
    return high


def _t_within(t: float, freedom: int) -> float:
    """Return the probability that |Student's t| is at most `t`."""
    angle = atan(t / sqrt(freedom))
    square = cos(angle) ** 2
    odd = freedom % 2
    term = total = cos(angle) if odd else 1.0
    for number in range(3 if odd else 2, freedom - 1, 2):
        term *= square * (number - 1) / number
        total += term
    if not odd:
        return sin(angle) * total
    return 2 / pi * (angle + (sin(angle) * total if freedom > 1 else 0.0))


def bars_of(found: Sequence[Interval]) -> tuple[list[float], tuple[list[float], list[float]]]:
    """Return the values, and how far their intervals reach below and above them: 0 without bounds."""
    below = [0.0 if one.low is None else one.value - one.low for one in found]
    above = [0.0 if one.high is None else one.high - one.value for one in found]
    return [one.value for one in found], (below, above)

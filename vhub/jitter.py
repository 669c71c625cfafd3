"""Quantiles of jitter: a table of 4,096 per shape, built by a fixed routine and interpolated to whole nanoseconds.

The routine uses only + - x / of IEEE doubles (its own exponential and logarithm), so that the table is the same on
every machine, whatever its mathematical library. Source of the series: Abramowitz and Stegun, Handbook of Mathematical
Functions, 6.5.29 (incomplete gamma) and 6.1.41 (Stirling's series of ln gamma).
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Final

CELLS: Final = 4096
_LN2: Final = 0.6931471805599453
_LN_2PI: Final = 1.8378770664093453


def _ln(x: float) -> float:
    """Natural logarithm by x = m 2^e and the series of 2 artanh((m - 1) / (m + 1))."""
    mantissa, exponent = math.frexp(x)
    t = (mantissa - 1.0) / (mantissa + 1.0)
    square, term, total, n = t * t, t, 0.0, 1
    while abs(term) > 1e-18:
        total += term / n
        term *= square
        n += 2
    return 2.0 * total + exponent * _LN2


def _exp(x: float) -> float:
    """Exponential by Taylor's series after halving the argument and squaring the result."""
    halvings = 0
    while abs(x) > 0.25:
        x /= 2.0
        halvings += 1
    term, total, n = 1.0, 1.0, 1
    while abs(term) > 1e-18:
        term *= x / n
        total += term
        n += 1
    for _ in range(halvings):
        total *= total
    return total


def _ln_gamma(a: float) -> float:
    """ln Gamma(a), a > 0: the recurrence up to 10, then Stirling's series."""
    shift = 0.0
    while a < 10.0:
        shift += _ln(a)
        a += 1.0
    inverse = 1.0 / a
    square = inverse * inverse
    series = inverse * (1 / 12 - square * (1 / 360 - square * (1 / 1260 - square * (1 / 1680))))
    return (a - 0.5) * _ln(a) - a + 0.5 * _LN_2PI + series - shift


class _Gamma:
    """The regularised lower incomplete gamma function P(a, x) of one shape, and its inverse for ascending p."""

    def __init__(self, a: float) -> None:
        self.a = a
        self._ln_gamma = _ln_gamma(a)
        self._density = 0.0
        """At the last x that was looked at."""

    def _power(self, x: float) -> float:
        """x^a e^-x / Gamma(a): the factor that P and the density share."""
        return _exp(self.a * _ln(x) - x - self._ln_gamma)

    def quantile(self, p: float, low: float, rise: float) -> float:
        """The x >= `low` with P(a, x) = p, where P(a, low) = p - `rise`: Newton's iteration inside a bracket.

        A step shorter than 1e-8 x is the last one: it leaves an error of about its square.
        """
        high = math.inf
        x = self._guess(low, rise)
        for _ in range(200):
            below, density = self._at(x)
            low, high = (x, high) if below < p else (low, x)
            step = (p - below) / density if density > 0.0 else math.inf
            if abs(step) <= 1e-8 * x:
                return x + step
            if low < x + step < high:
                x += step
            else:
                x = 2.0 * x if high == math.inf else low + (high - low) / 2.0
        return x

    def _guess(self, low: float, rise: float) -> float:
        """Where P has risen by `rise` above its value at `low`, by the first two terms of its Taylor series there."""
        if low == 0.0 or self._density == 0.0:
            return self.a
        step = rise / self._density
        bend = (self.a - 1.0) / low - 1.0
        return low + step * max(0.5, 1.0 - 0.5 * bend * step)

    def _at(self, x: float) -> tuple[float, float]:
        """P(a, x) by its series, and the density at x."""
        term = total = 1.0 / self.a
        n = self.a
        while term > 1e-17 * total:
            n += 1.0
            term *= x / n
            total += term
        power = self._power(x)
        self._density = power / x
        return total * power, self._density


@lru_cache(maxsize=256)
def gamma_quantiles_ns(mean_ns: int, sd_ns: int) -> tuple[int, ...]:
    """Return CELLS + 1 quantiles, in ns, of a gamma distribution; the ends are those at 2^-20 and at 1 - 2^-20.

    A first one at 0 would give narrow distributions a tail that they have not.
    """
    assert mean_ns > 0 and sd_ns > 0
    shape = (mean_ns / sd_ns) * (mean_ns / sd_ns)
    scale_ns = sd_ns * (sd_ns / mean_ns)
    quantiles = []
    gamma = _Gamma(shape)
    x = p = 0.0
    for above in (2.0**-20, *(cell / CELLS for cell in range(1, CELLS)), 1.0 - 2.0**-20):
        x = gamma.quantile(above, x, above - p)
        p = above
        quantiles.append(round(x * scale_ns))
    return tuple(quantiles)


def interpolate_ns(quantiles_ns: tuple[int, ...], word: int) -> int:
    """Return the quantile at word / 2^64, linear within its cell, in integer arithmetic."""
    cell = word >> 52
    low = quantiles_ns[cell]
    return low + (((quantiles_ns[cell + 1] - low) * (word & 0xFFFFFFFFFFFFF)) >> 52)

"""Logarithm, exponential and gamma function by series: what tables and times of the network are computed with.

Their last bits decide delays and fates of captured packets, so they never change. They use IEEE arithmetic alone and
are the same on every machine. They are slow and, for large arguments, less accurate than `foosim.common.exact_math`,
which everything else uses. Sources: Abramowitz and Stegun, Handbook of Mathematical Functions, 4.1.27 (logarithm),
4.2.1 (exponential), 6.1.41 (Stirling's series of ln gamma).
"""

from __future__ import annotations

import math
from typing import Final

LN2: Final = 0.6931471805599453
LN_2PI: Final = 1.8378770664093453


def ln(x: float) -> float:
    """Natural logarithm by x = m 2^e and the series of 2 artanh((m - 1) / (m + 1))."""
    mantissa, exponent = math.frexp(x)
    t = (mantissa - 1.0) / (mantissa + 1.0)
    square, term, total, n = t * t, t, 0.0, 1
    while abs(term) > 1e-18:
        total += term / n
        term *= square
        n += 2
    return 2.0 * total + exponent * LN2


def exp(x: float) -> float:
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


def ln_gamma(a: float) -> float:
    """ln Gamma(a), a > 0: the recurrence up to 10, then Stirling's series."""
    shift = 0.0
    while a < 10.0:
        shift += ln(a)
        a += 1.0
    inverse = 1.0 / a
    square = inverse * inverse
    series = inverse * (1 / 12 - square * (1 / 360 - square * (1 / 1260 - square * (1 / 1680))))
    return (a - 0.5) * ln(a) - a + 0.5 * LN_2PI + series - shift


def power(base: float, exponent: float) -> float:
    """Return base ** exponent, base > 0."""
    return exp(exponent * ln(base))


def exponential_ns(mean_ns: int, word: int) -> int:
    """Return an exponential number with this mean from a draw, in whole ns."""
    return int(-mean_ns * ln(((word >> 12) + 0.5) * 2.0**-52))

"""`exp`, `log` and `sincos` of `foosim.common.exact_math` for arrays, element by element: the same bits, whatever the
array.

Each is the same operations in the same order as its single form, where that branches by selecting. Of numpy only what
IEEE 754 defines to the last bit is used: + - * / and square roots, comparisons, selections, whole numbers and taking
floats apart. Its own `exp`, `sin` and the like differ between processors and lengths; sums and products of matrices
depend on the order.

Arguments are arrays of floats of any shape, results new arrays of that shape.
Errors and limits are those of the single forms; no argument raises, or warns where numpy is set as usual.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from foosim.common import exact_math as single
from foosim.common.exact_math import (
    ANGLE_FAR,
    EXP_LEAST,
    EXP_MOST,
    LN2_HIGH,
    LN2_LOW,
    NEAREST,
)

Floats: TypeAlias = NDArray[np.float64]


def _floats(x: Floats) -> Floats:
    """Return float64: of whole numbers or float32 the operations would be others."""
    return np.asarray(x, np.float64)


def exp(x: Floats) -> Floats:
    """Return e to the power x."""
    x = _floats(x)
    inside = (x >= EXP_LEAST) & (x <= EXP_MOST)
    if inside.all():
        return _exp_inside(x)
    outside = np.where(x > EXP_MOST, np.inf, np.where(x < EXP_LEAST, 0.0, np.nan))
    return np.where(inside, _exp_inside(np.where(inside, x, 0.0)), outside)


def _exp_inside(x: Floats) -> Floats:
    exponent = x * single.PER_LN2 + NEAREST - NEAREST
    high = x - exponent * LN2_HIGH
    low = exponent * LN2_LOW
    r = high - low
    z = r * r
    c = r - z * (single.EXP1 + z * (single.EXP2 + z * (single.EXP3 + z * (single.EXP4 + z * single.EXP5))))
    value = 1.0 - ((low - r * c / (2.0 - c)) - high)
    whole = exponent.astype(np.int64)
    half = whole >> 1
    return value * _power_of_two(half) * _power_of_two(whole - half)


def _power_of_two(exponent: NDArray[np.int64]) -> Floats:
    """Return 2^exponent from -1022 to 1023, by the bits of a float."""
    return ((exponent + 1023) << 52).view(np.float64)


def log(x: Floats) -> Floats:
    """Return the natural logarithm of x: -inf of zero, nan of a negative x."""
    x = _floats(x)
    inside = (x > 0.0) & (x < np.inf)
    if inside.all():
        return _log_inside(x)
    outside = np.where(x == 0.0, -np.inf, np.where(x > 0.0, np.inf, np.nan))
    return np.where(inside, _log_inside(np.where(inside, x, 1.0)), outside)


def _log_inside(x: Floats) -> Floats:
    mantissa, exponent = np.frexp(x)
    below = mantissa < single.SQRT_HALF
    mantissa = np.where(below, mantissa + mantissa, mantissa)
    whole = (exponent - below).astype(np.float64)
    f = mantissa - 1.0
    s = f / (2.0 + f)
    z = s * s
    series = single.LOG4 + z * (single.LOG5 + z * (single.LOG6 + z * single.LOG7))
    series = z * (single.LOG1 + z * (single.LOG2 + z * (single.LOG3 + z * series)))
    half = 0.5 * f * f
    return whole * LN2_HIGH - ((half - (s * (half + series) + whole * LN2_LOW)) - f)


def sincos(x: Floats) -> tuple[Floats, Floats]:
    """Return sine and cosine of angles: one reduction serves both."""
    x = _floats(x)
    near = np.abs(x) < ANGLE_FAR
    if near.all():
        return _of_reduced(*_reduced(x))
    quarters, high, low = _reduced(np.where(near, x, 0.0).ravel())
    # They are rare, and whole numbers of that length are Python's.
    for place in np.flatnonzero(~near):
        angle = float(x.flat[place])
        is_finite = -np.inf < angle < np.inf
        reduced = single.reduced_in_integers(angle) if is_finite else (0, np.nan, np.nan)
        quarters[place], high[place], low[place] = reduced
    sine, cosine = _of_reduced(quarters, high, low)
    return sine.reshape(x.shape), cosine.reshape(x.shape)


def _of_reduced(quarters: NDArray[np.int64], high: Floats, low: Floats) -> tuple[Floats, Floats]:
    """Return sine and cosine of quarter turns and a rest in two parts."""
    sine, cosine = _sin_near_zero(high, low), _cos_near_zero(high, low)
    is_odd, is_beyond_half = (quarters & 1) == 1, (quarters & 2) == 2
    sine, cosine = np.where(is_odd, cosine, sine), np.where(is_odd, -sine, cosine)
    return np.where(is_beyond_half, -sine, sine), np.where(is_beyond_half, -cosine, cosine)


def _reduced(x: Floats) -> tuple[NDArray[np.int64], Floats, Floats]:
    """Return quarter turns and the rest of angles below ANGLE_FAR, in two parts: an eighth of a turn at most."""
    quarters = x * single.PER_QUARTER + NEAREST - NEAREST
    first = x - quarters * single.QUARTER1
    second = quarters * single.QUARTER2
    rest = first - second
    back = rest - first
    lost = (first - (rest - back)) - (second + back)
    third = quarters * single.QUARTER3
    further = rest - third
    back = further - rest
    lost = lost + ((rest - (further - back)) - (third + back))
    fourth = quarters * single.QUARTER4 - lost
    high = further - fourth
    return quarters.astype(np.int64), high, (further - high) - fourth


def _sin_near_zero(x: Floats, low: Floats) -> Floats:
    z = x * x
    cube = z * x
    series = single.SIN2 + z * (single.SIN3 + z * (single.SIN4 + z * (single.SIN5 + z * single.SIN6)))
    return x - ((z * (0.5 * low - cube * series) - low) - cube * single.SIN1)


def _cos_near_zero(x: Floats, low: Floats) -> Floats:
    z = x * x
    series = single.COS3 + z * (single.COS4 + z * (single.COS5 + z * single.COS6))
    series = z * (single.COS1 + z * (single.COS2 + z * series))
    half = 0.5 * z
    value = 1.0 - half
    return value + (((1.0 - value) - half) + (z * series - x * low))

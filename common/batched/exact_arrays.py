"""The functions of `foosim.common.exact_math` for arrays, element by element: the same bits, whatever the array.

Each is the same operations in the same order as its single form, where that branches by selecting. Of numpy only what
IEEE 754 defines to the last bit is used: + - * / and square roots, comparisons, selections, whole numbers and taking
floats apart. Its own `exp`, `sin` and the like differ between processors and lengths; sums and products of matrices
depend on the order.

Arguments are arrays of floats of any shape, results new arrays of that shape (of two arguments: of their common shape).
Errors and limits are those of the single forms; no argument raises, or warns where numpy is set as usual.
"""

from __future__ import annotations

from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foosim.common import exact_math as single
from foosim.common.exact_math import (
    ANGLE_FAR,
    ATAN_FAR,
    EXP_LEAST,
    EXP_MOST,
    HALF_PI,
    HALF_PI_LOW,
    LN2_HIGH,
    LN2_LOW,
    NEAREST,
    PI,
    PI_LOW,
    TANH_FAR,
    TANH_NEAR,
)

Floats: TypeAlias = NDArray[np.float64]

_ATAN_HIGH: Final = np.array((0.0, single.ATAN_OF_HALF, single.ATAN_OF_1, single.ATAN_OF_3_HALVES, HALF_PI))
_ATAN_LOW: Final = np.array(
    (0.0, single.ATAN_OF_HALF_LOW, single.ATAN_OF_1_LOW, single.ATAN_OF_3_HALVES_LOW, HALF_PI_LOW)
)
_ATAN_UP: Final = np.array((1.0, 2.0, 1.0, 1.0, 0.0))
_ATAN_ABOVE: Final = np.array((0.0, -1.0, -1.0, -1.5, -1.0))
_ATAN_DOWN: Final = np.array((0.0, 1.0, 1.0, 1.5, 1.0))
_ATAN_BELOW: Final = np.array((1.0, 2.0, 1.0, 1.0, 0.0))
"""By cell: the polynomial's argument is (up x + above) / (down x + below)."""


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


def sin(x: Floats) -> Floats:
    """Return the sine of any angle, however large; nan of an infinite one."""
    return sincos(x)[0]


def cos(x: Floats) -> Floats:
    """Return the cosine of any angle, however large; nan of an infinite one."""
    return sincos(x)[1]


def tan(x: Floats) -> Floats:
    """Return the tangent of any angle, however large; nan of an infinite one."""
    sine, cosine = sincos(x)
    return sine / cosine


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


def atan(x: Floats) -> Floats:
    """Return the arctangent of x, between -pi/2 and pi/2."""
    x = _floats(x)
    is_number = ~np.isnan(x)
    if is_number.all():
        return np.copysign(_atan_of_positive(np.abs(x)), x)
    return np.where(is_number, np.copysign(_atan_of_positive(np.where(is_number, np.abs(x), 0.0)), x), np.nan)


def _atan_of_positive(x: Floats) -> Floats:
    """Return the arctangent of x from 0 to infinity."""
    x = np.minimum(x, ATAN_FAR)
    cell = (x >= single.ATAN_BORDER1).astype(np.int64) + (x >= single.ATAN_BORDER2)
    cell += (x >= single.ATAN_BORDER3).astype(np.int64) + (x >= single.ATAN_BORDER4)
    upper: Floats = _ATAN_UP.take(cell) * x + _ATAN_ABOVE.take(cell)
    lower: Floats = _ATAN_DOWN.take(cell) * x + _ATAN_BELOW.take(cell)
    t = upper / lower
    z = t * t
    series = single.ATAN7 + z * (single.ATAN8 + z * (single.ATAN9 + z * (single.ATAN10 + z * single.ATAN11)))
    series = single.ATAN3 + z * (single.ATAN4 + z * (single.ATAN5 + z * (single.ATAN6 + z * series)))
    series = z * (single.ATAN1 + z * (single.ATAN2 + z * series))
    angle: Floats = _ATAN_HIGH.take(cell) - ((t * series - _ATAN_LOW.take(cell)) - t)
    return angle


def atan2(y: Floats, x: Floats) -> Floats:
    """Return the angles of the points (x, y), between -pi and pi."""
    y, x = np.broadcast_arrays(_floats(y), _floats(x))
    is_number = ~(np.isnan(x) | np.isnan(y))
    across, along = np.where(is_number, np.abs(y), 0.0), np.where(is_number, np.abs(x), 0.0)
    small, large = np.minimum(across, along), np.maximum(across, along)
    is_corner = (small == np.inf) | (large == 0.0)
    ratio = np.where(small == np.inf, 1.0, small) / np.where(is_corner, 1.0, large)
    angle = _atan_of_positive(ratio)
    is_left = np.copysign(1.0, x) < 0.0
    steep = HALF_PI + (HALF_PI_LOW - np.copysign(angle, x))
    flat = np.where(is_left, PI + (PI_LOW - angle), angle)
    return np.where(is_number, np.copysign(np.where(across > along, steep, flat), y), np.nan)


def asin(x: Floats) -> Floats:
    """Return the arcsines of x, between -pi/2 and pi/2; nan where x is beyond -1 and 1."""
    x = _floats(x)
    inside = np.where((x >= -1.0) & (x <= 1.0), x, np.nan)
    return atan2(inside, np.sqrt((1.0 - inside) * (1.0 + inside)))


def acos(x: Floats) -> Floats:
    """Return the arccosines of x, between 0 and pi; nan where x is beyond -1 and 1."""
    x = _floats(x)
    inside = np.where((x >= -1.0) & (x <= 1.0), x, np.nan)
    return atan2(np.sqrt((1.0 - inside) * (1.0 + inside)), inside)


def tanh(x: Floats) -> Floats:
    """Return the hyperbolic tangents of x."""
    x = _floats(x)
    is_number = ~np.isnan(x)
    size = np.where(is_number, np.minimum(np.abs(x), TANH_FAR), 0.0)
    near = np.minimum(size, TANH_NEAR)
    z = near * near
    upper = single.TANH1 + z * (single.TANH2 + z * single.TANH3)
    lower = single.TANH4 + z * (single.TANH5 + z * (single.TANH6 + z))
    below = near + near * (z * (upper / lower))
    above = 1.0 - 2.0 / (_exp_inside(2.0 * size) + 1.0)
    return np.where(is_number, np.copysign(np.where(size < TANH_NEAR, below, above), x), np.nan)


def hypot(x: Floats, y: Floats) -> Floats:
    """Return the lengths of (x, y); infinite where one of them is."""
    x, y = np.broadcast_arrays(_floats(x), _floats(y))
    is_infinite = np.isinf(x) | np.isinf(y)
    is_finite = np.isfinite(x) & np.isfinite(y)
    across, along = np.where(is_finite, np.abs(x), 0.0), np.where(is_finite, np.abs(y), 0.0)
    large = np.maximum(across, along)
    is_large, is_small = large >= single.LARGE, large <= single.SMALL
    factor = np.where(is_large, single.DOWN, np.where(is_small, single.UP, 1.0))
    back = np.where(is_large, single.UP, np.where(is_small, single.DOWN, 1.0))
    across, along = across * factor, along * factor
    with np.errstate(over="ignore"):
        length = np.sqrt(across * across + along * along) * back
    return np.where(is_finite, length, np.where(is_infinite, np.inf, np.nan))

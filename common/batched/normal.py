"""Standard normal numbers from 64-bit words: the inverse distribution function, from a table of cubic polynomials.

A word stands for the probability p = (floor(word / 2^12) + 1/2) / 2^52, as in `keyed_random.gaussian`. The function is
tabled over the lower half, since x(1 - p) = -x(p): a word and its complement give x and -x. Cells follow p as floats
are spaced, 128 to each halving from 1/2 down to the least p, 2^-53: the tail has no last cell that all that is rarer
falls into, and -8.2 comes from the table like -0.5. In a cell the polynomial has the function's values and slopes at
both ends, so the whole is smooth and grows with the word. It differs from the exact inverse by at most `ERROR_MAX`.

The table is made at import by exact arithmetic: its bits are the same on every machine. Sources: Wichura,
"Algorithm AS241", Applied Statistics 37 (1988), PPND16, for its values; cubic Hermite interpolation between them.
"""

from __future__ import annotations

from math import copysign, frexp
from typing import Final

import numpy as np
from numpy.typing import NDArray

from foosim.common.batched import exact_arrays
from foosim.common.batched.exact_arrays import Floats
from foosim.common.batched.philox import Words

ERROR_MAX: Final = 3e-11
"""Absolute: noise of 1 m is wrong by 0.03 nm."""

HALF: Final = 2.0**51
"""p = 1/2, in units of 2^-52."""
CELL_BITS: Final = 7
HALVINGS: Final = 52
FIRST_CELL: Final = 1022 << CELL_BITS
"""The upper bits of 0.5 as a float: the least p, in units of 2^-52."""
ROOT_2PI: Final = 2.5066282746310007

Coefficients = tuple[float, ...]
# AS241: numerators and denominators of x over q, and of x over sqrt(-ln p) less 1.6 and less 5; constant terms first.
CENTRE: Final = (
    (
        *(3.3871328727963666080e0, 1.3314166789178437745e2, 1.9715909503065514427e3, 1.3731693765509461125e4),
        *(4.5921953931549871457e4, 6.7265770927008700853e4, 3.3430575583588128105e4, 2.5090809287301226727e3),
    ),
    (
        *(1.0, 4.2313330701600911252e1, 6.8718700749205790830e2, 5.3941960214247511077e3),
        *(2.1213794301586595867e4, 3.9307895800092710610e4, 2.8729085735721942674e4, 5.2264952788528545610e3),
    ),
)
TAIL: Final = (
    (
        *(1.42343711074968357734e0, 4.63033784615654529590e0, 5.76949722146069140550e0, 3.64784832476320460504e0),
        *(1.27045825245236838258e0, 2.41780725177450611770e-1, 2.27238449892691845833e-2, 7.74545014278341407640e-4),
    ),
    (
        *(1.0, 2.05319162663775882187e0, 1.67638483018380384940e0, 6.89767334985100004550e-1),
        *(1.48103976427480074590e-1, 1.51986665636164571966e-2, 5.47593808499534494600e-4, 1.05075007164441684324e-9),
    ),
)
FAR_TAIL: Final = (
    (
        *(6.65790464350110377720e0, 5.46378491116411436990e0, 1.78482653991729133580e0, 2.96560571828504891230e-1),
        *(2.65321895265761230930e-2, 1.24266094738807843860e-3, 2.71155556874348757815e-5, 2.01033439929228813265e-7),
    ),
    (
        *(1.0, 5.99832206555887937690e-1, 1.36929880922735805310e-1, 1.48753612908506148525e-2),
        *(7.86869131145613259100e-4, 1.84631831751005468180e-5, 1.42151175831644588870e-7, 2.04426310338993978564e-15),
    ),
)


def _ratio(x: Floats, polynomials: tuple[Coefficients, Coefficients]) -> Floats:
    """Return the quotient of two polynomials of degree 7."""
    values = []
    for coefficients in polynomials:
        value = np.full_like(x, coefficients[-1])
        for coefficient in coefficients[-2::-1]:
            value = value * x + coefficient
        values.append(value)
    return values[0] / values[1]


def inverse_of_lower_half(p: Floats) -> Floats:
    """Return x of the probabilities 0 < p <= 1/2, by AS241 (relative error 1e-15): x <= 0."""
    q = p - 0.5
    tail = np.sqrt(-exact_arrays.log(p))
    outer = np.where(tail <= 5.0, _ratio(tail - 1.6, TAIL), _ratio(tail - 5.0, FAR_TAIL))
    return np.where(q >= -0.425, q * _ratio(0.180625 - q * q, CENTRE), -outer)


def _table() -> Floats:
    """Return by cell the coefficients of |x| as a polynomial of p less the cell's start, constant term first.

    p is in units of 2^-52. The shape is (HALVINGS << CELL_BITS, 4).
    """
    edges = ((np.arange((HALVINGS << CELL_BITS) + 1) + FIRST_CELL) << (52 - CELL_BITS)).view(np.float64)
    x = -inverse_of_lower_half(edges * 2.0**-52)
    slope = exact_arrays.exp(0.5 * x * x) * (-ROOT_2PI * 2.0**-52)
    width = edges[1:] - edges[:-1]
    rise = (x[1:] - x[:-1]) / width
    left, right = slope[:-1], slope[1:]
    square = (3.0 * rise - 2.0 * left - right) / width
    cube = (left + right - 2.0 * rise) / (width * width)
    return np.stack([x[:-1], left, square, cube], axis=1)


_TABLE: Final = _table()
_CELLS: Final = _TABLE.ravel().data
_UNITS: Final = np.array(12, np.uint64)
_WITHIN: Final = np.array(52 - CELL_BITS, np.uint64)
_FIRST: Final = np.array(FIRST_CELL, np.uint64)


def normal_of_words(words: Words) -> Floats:
    """Return the standard normal numbers of words, of the same shape."""
    beyond = (words >> _UNITS).astype(np.float64)
    beyond += 0.5
    beyond -= HALF
    p = HALF - np.abs(beyond)
    cell = p.view(np.uint64) >> _WITHIN
    offset = p - (cell << _WITHIN).view(np.float64)
    cell -= _FIRST
    coefficients: NDArray[np.float64] = _TABLE.take(cell.view(np.int64), axis=0)
    x = coefficients[..., 3] * offset
    x += coefficients[..., 2]
    x *= offset
    x += coefficients[..., 1]
    x *= offset
    x += coefficients[..., 0]
    return np.copysign(x, beyond, out=x)


def normal_of_word(word: int) -> float:
    """Return the standard normal number of one word: the same bits as in `normal_of_words`."""
    beyond = ((word >> 12) + 0.5) - HALF
    p = HALF - abs(beyond)
    mantissa, exponent = frexp(p)
    sub_cell = int(mantissa * (2 << CELL_BITS))
    offset = p - sub_cell * 2.0 ** (exponent - CELL_BITS - 1)
    at = 4 * ((exponent << CELL_BITS) + sub_cell - (1 << CELL_BITS))
    x = ((_CELLS[at + 3] * offset + _CELLS[at + 2]) * offset + _CELLS[at + 1]) * offset + _CELLS[at]
    return copysign(x, beyond)

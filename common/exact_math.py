"""Elementary functions of + - * / and square roots alone: the same bits on every machine, for one number as for many.

The last bits of `math` and numpy depend on the machine, on the version and on the length of an array. What enters a
frame takes these functions instead; their bits never change. `foosim.common.batched.exact_arrays` has `exp`, `log` and
`sincos` for arrays: the same operations in the same order, with the constants of this module, hence the same bits.

Angles are in rad. No argument raises: an overflow is `inf`, and an undefined value is `nan`, always the same one,
since processors make NaNs of different signs. Zeros keep their signs as in Annex F of C99. Square roots come from
`math.sqrt` and `numpy.sqrt`, which IEEE 754 defines to the last bit.

Largest errors, in units of the last place (tests/common/test_exact_math.py):

| function | error |
|---|---|
| `exp`, `log`, `sin`, `cos`, `sincos`, `atan` | 1 |
| `hypot`, `atan2` | 1.5 |
| `tan`, `asin`, `acos` | 2.5 |

Sources. Polynomials and their arrangement for `exp`, `log`, `sin`, `cos`, `atan`: fdlibm 5.3 (Sun Microsystems, 1993).
Reduction of angles: Cody and Waite, Software Manual for the Elementary Functions (1980), and for large ones Payne and
Hanek, ACM SIGNUM 18 (1983). Exact differences: Knuth, The Art of Computer Programming 2, 4.2.2.
"""

from __future__ import annotations

from math import copysign, frexp, inf, isinf, isnan, ldexp, nan, sqrt
from typing import Final

NEAREST: Final = 6755399441055744.0
"""1.5 * 2^52: adding and subtracting it rounds to a whole number."""

EXP_LEAST: Final = -745.1332191019411
EXP_MOST: Final = 709.782712893384
"""What lies outside has the exponential 0 or infinity."""
PER_LN2: Final = 1.4426950408889634
LN2_HIGH: Final = 0.6931471803691238
LN2_LOW: Final = 1.9082149292705877e-10
"""LN2_HIGH has 21 bits of 0 at its end: its product with an exponent is exact."""
EXP1: Final = 0.16666666666666602
EXP2: Final = -0.0027777777777015593
EXP3: Final = 6.613756321437934e-05
EXP4: Final = -1.6533902205465252e-06
EXP5: Final = 4.1381367970572385e-08

SQRT_HALF: Final = 0.7071067811865476
LOG1: Final = 0.6666666666666735
LOG2: Final = 0.3999999999940942
LOG3: Final = 0.2857142874366239
LOG4: Final = 0.22222198432149784
LOG5: Final = 0.1818357216161805
LOG6: Final = 0.15313837699209373
LOG7: Final = 0.14798198605116586

ANGLE_FAR: Final = 1048576.0
"""From 2^20 rad on an angle is reduced in integers."""
PER_QUARTER: Final = 0.6366197723675814
QUARTER1: Final = 1.5707963267341256
QUARTER2: Final = 6.077100506303966e-11
QUARTER3: Final = 2.0222662487111665e-21
QUARTER4: Final = 8.4784276603689e-32
"""A quarter turn in four parts. The first three have 33 bits: their products with up to 2^20 quarters are exact."""

SIN1: Final = -0.16666666666666632
SIN2: Final = 0.00833333333332249
SIN3: Final = -0.0001984126982985795
SIN4: Final = 2.7557313707070068e-06
SIN5: Final = -2.5050760253406863e-08
SIN6: Final = 1.58969099521155e-10
COS1: Final = 0.0416666666666666
COS2: Final = -0.001388888888887411
COS3: Final = 2.480158728947673e-05
COS4: Final = -2.7557314351390663e-07
COS5: Final = 2.087572321298175e-09
COS6: Final = -1.1359647557788195e-11

PI: Final = 3.141592653589793
PI_LOW: Final = 1.2246467991473532e-16
HALF_PI: Final = 1.5707963267948966
HALF_PI_LOW: Final = 6.123233995736766e-17
"""What pi and its half are more than the floats."""

ATAN_FAR: Final = 73786976294838206464.0
"""From 2^66 on an arctangent is that of infinity."""
ATAN_BORDER1: Final = 0.4375
ATAN_BORDER2: Final = 0.6875
ATAN_BORDER3: Final = 1.1875
ATAN_BORDER4: Final = 2.4375
"""Arguments at which the arctangent changes its reference point: from 0 to 1/2, 1, 3/2 and infinity."""
ATAN_OF_HALF: Final = 0.4636476090008061
ATAN_OF_HALF_LOW: Final = 2.2698777452961687e-17
ATAN_OF_1: Final = 0.7853981633974483
ATAN_OF_1_LOW: Final = 3.061616997868383e-17
ATAN_OF_3_HALVES: Final = 0.982793723247329
ATAN_OF_3_HALVES_LOW: Final = 1.3903311031230998e-17
"""The arctangents of these points, in two parts."""
ATAN1: Final = 0.3333333333333293
ATAN2: Final = -0.19999999999876483
ATAN3: Final = 0.14285714272503466
ATAN4: Final = -0.11111110405462356
ATAN5: Final = 0.09090887133436507
ATAN6: Final = -0.0769187620504483
ATAN7: Final = 0.06661073137387531
ATAN8: Final = -0.058335701337905735
ATAN9: Final = 0.049768779946159324
ATAN10: Final = -0.036531572744216916
ATAN11: Final = 0.016285820115365782

LARGE: Final = 3.3519519824856493e153
SMALL: Final = 3.2033329522929615e-145
"""2^510 and 2^-480: numbers beyond may not be squared."""
UP: Final = 4.149515568880993e180
DOWN: Final = 2.409919865102884e-181
"""2^600 and 2^-600."""


def exp(x: float) -> float:
    """Return e to the power x."""
    if not EXP_LEAST <= x <= EXP_MOST:
        return inf if x > EXP_MOST else 0.0 if x < EXP_LEAST else nan
    exponent = x * PER_LN2 + NEAREST - NEAREST
    high = x - exponent * LN2_HIGH
    low = exponent * LN2_LOW
    r = high - low
    z = r * r
    c = r - z * (EXP1 + z * (EXP2 + z * (EXP3 + z * (EXP4 + z * EXP5))))
    value = 1.0 - ((low - r * c / (2.0 - c)) - high)
    # In two steps, since 2^1024 is no float, and a subnormal result may be rounded once only.
    whole = int(exponent)
    half = whole >> 1
    return value * ldexp(1.0, half) * ldexp(1.0, whole - half)


def log(x: float) -> float:
    """Return the natural logarithm of x: -inf of zero, nan of a negative x."""
    if not 0.0 < x < inf:
        return -inf if x == 0.0 else inf if x > 0.0 else nan
    mantissa, exponent = frexp(x)
    if mantissa < SQRT_HALF:
        mantissa += mantissa
        exponent -= 1
    whole = float(exponent)
    f = mantissa - 1.0
    s = f / (2.0 + f)
    z = s * s
    series = z * (LOG1 + z * (LOG2 + z * (LOG3 + z * (LOG4 + z * (LOG5 + z * (LOG6 + z * LOG7))))))
    half = 0.5 * f * f
    return whole * LN2_HIGH - ((half - (s * (half + series) + whole * LN2_LOW)) - f)


def sin(x: float) -> float:
    """Return the sine of any angle, however large; nan of an infinite one."""
    return sincos(x)[0]


def cos(x: float) -> float:
    """Return the cosine of any angle, however large; nan of an infinite one."""
    return sincos(x)[1]


def tan(x: float) -> float:
    """Return the tangent of any angle, however large; nan of an infinite one."""
    sine, cosine = sincos(x)
    return sine / cosine


def sincos(x: float) -> tuple[float, float]:
    """Return sine and cosine of an angle: one reduction serves both."""
    if not -inf < x < inf:
        return nan, nan
    quarters, high, low = _reduced(x) if abs(x) < ANGLE_FAR else reduced_in_integers(x)
    sine, cosine = _sin_near_zero(high, low), _cos_near_zero(high, low)
    if quarters & 1:
        sine, cosine = cosine, -sine
    return (-sine, -cosine) if quarters & 2 else (sine, cosine)


def _reduced(x: float) -> tuple[int, float, float]:
    """Return quarter turns and the rest of an angle below ANGLE_FAR, in two parts: an eighth of a turn at most."""
    quarters = x * PER_QUARTER + NEAREST - NEAREST
    first = x - quarters * QUARTER1
    second = quarters * QUARTER2
    rest = first - second
    back = rest - first
    lost = (first - (rest - back)) - (second + back)
    third = quarters * QUARTER3
    further = rest - third
    back = further - rest
    lost += (rest - (further - back)) - (third + back)
    fourth = quarters * QUARTER4 - lost
    high = further - fourth
    return int(quarters), high, (further - high) - fourth


def _atan_of_inverse(n: int, one: int) -> int:
    """Return `one` times the arctangent of 1/n, in whole numbers."""
    power, total, odd = one // n, 0, 1
    while power:
        total += power // odd if odd & 3 == 1 else -(power // odd)
        power //= n * n
        odd += 2
    return total


def _pi_times_2_to(bits: int) -> int:
    """Return pi * 2^bits in whole numbers, by Machin's formula."""
    one = 1 << (bits + 64)
    return (16 * _atan_of_inverse(5, one) - 4 * _atan_of_inverse(239, one)) >> 64


FRACTION_BITS: Final = 192
PER_QUARTER_BITS: Final = 1280
"""Enough for the largest float, 2^1024, and for the one nearest to a whole number of quarters, 2^-62."""
HALF_PI_INTEGER: Final = _pi_times_2_to(FRACTION_BITS - 1)
PER_QUARTER_INTEGER: Final = (1 << (2 * PER_QUARTER_BITS + 1)) // _pi_times_2_to(PER_QUARTER_BITS)


def reduced_in_integers(x: float) -> tuple[int, float, float]:
    """Return quarter turns (modulo 4) and the rest, in two parts, of a finite angle of at least ANGLE_FAR."""
    mantissa, exponent = frexp(x)
    shift = PER_QUARTER_BITS + 53 - exponent
    turned = int(mantissa * 9007199254740992.0) * PER_QUARTER_INTEGER
    quarters = (turned + (1 << (shift - 1))) >> shift
    fraction = (turned - (quarters << shift)) >> (shift - FRACTION_BITS)
    rest = fraction * HALF_PI_INTEGER
    high = float(rest)
    low = float(rest - int(high))
    return quarters & 3, ldexp(high, -2 * FRACTION_BITS), ldexp(low, -2 * FRACTION_BITS)


def _sin_near_zero(x: float, low: float) -> float:
    """Return the sine of x + low, up to an eighth of a turn."""
    z = x * x
    cube = z * x
    series = SIN2 + z * (SIN3 + z * (SIN4 + z * (SIN5 + z * SIN6)))
    return x - ((z * (0.5 * low - cube * series) - low) - cube * SIN1)


def _cos_near_zero(x: float, low: float) -> float:
    """Return the cosine of x + low, up to an eighth of a turn."""
    z = x * x
    series = z * (COS1 + z * (COS2 + z * (COS3 + z * (COS4 + z * (COS5 + z * COS6)))))
    half = 0.5 * z
    value = 1.0 - half
    return value + (((1.0 - value) - half) + (z * series - x * low))


def atan(x: float) -> float:
    """Return the arctangent of x, between -pi/2 and pi/2."""
    return nan if isnan(x) else copysign(_atan_of_positive(abs(x)), x)


def _atan_of_positive(x: float) -> float:
    """Return the arctangent of x from 0 to infinity."""
    if x < ATAN_BORDER1:
        high, low, t = 0.0, 0.0, x
    elif x < ATAN_BORDER2:
        high, low, t = ATAN_OF_HALF, ATAN_OF_HALF_LOW, (2.0 * x - 1.0) / (x + 2.0)
    elif x < ATAN_BORDER3:
        high, low, t = ATAN_OF_1, ATAN_OF_1_LOW, (x - 1.0) / (x + 1.0)
    elif x < ATAN_BORDER4:
        high, low, t = ATAN_OF_3_HALVES, ATAN_OF_3_HALVES_LOW, (x - 1.5) / (1.5 * x + 1.0)
    else:
        high, low, t = HALF_PI, HALF_PI_LOW, -1.0 / min(x, ATAN_FAR)
    z = t * t
    series = ATAN7 + z * (ATAN8 + z * (ATAN9 + z * (ATAN10 + z * ATAN11)))
    series = z * (ATAN1 + z * (ATAN2 + z * (ATAN3 + z * (ATAN4 + z * (ATAN5 + z * (ATAN6 + z * series))))))
    return high - ((t * series - low) - t)


def atan2(y: float, x: float) -> float:
    """Return the angle of the point (x, y), between -pi and pi."""
    if isnan(x) or isnan(y):
        return nan
    across, along = abs(y), abs(x)
    small, large = min(across, along), max(across, along)
    if small == inf:
        small = large = 1.0
    angle = _atan_of_positive(small / large if large > 0.0 else 0.0)
    if across > along:
        angle = HALF_PI + (HALF_PI_LOW - copysign(angle, x))
    elif copysign(1.0, x) < 0.0:
        angle = PI + (PI_LOW - angle)
    return copysign(angle, y)


def asin(x: float) -> float:
    """Return the arcsine of x, between -pi/2 and pi/2; nan where x is beyond -1 and 1."""
    return atan2(x, sqrt((1.0 - x) * (1.0 + x))) if -1.0 <= x <= 1.0 else nan


def acos(x: float) -> float:
    """Return the arccosine of x, between 0 and pi; nan where x is beyond -1 and 1."""
    return atan2(sqrt((1.0 - x) * (1.0 + x)), x) if -1.0 <= x <= 1.0 else nan


def hypot(x: float, y: float) -> float:
    """Return the length of (x, y); infinite where one of them is."""
    if isinf(x) or isinf(y):
        return inf
    if isnan(x) or isnan(y):
        return nan
    large = max(abs(x), abs(y))
    if SMALL < large < LARGE:
        return sqrt(x * x + y * y)
    factor, back = (DOWN, UP) if large >= LARGE else (UP, DOWN)
    x *= factor
    y *= factor
    return sqrt(x * x + y * y) * back

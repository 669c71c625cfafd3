"""Elementary functions: the same bits for one number and for many, within the stated units of the last place."""

from __future__ import annotations

import ast
import inspect
import math
import struct
from collections.abc import Callable
from decimal import Decimal, localcontext
from functools import lru_cache
from typing import Any, Final

import numpy as np
import pytest
from numpy.typing import NDArray

from foosim.common import exact_math
from foosim.common.batched import exact_arrays

Floats = NDArray[np.float64]

LIMITS_ULP: Final = {
    **dict.fromkeys(("exp", "log", "sin", "cos", "atan"), 1.0),
    **dict.fromkeys(("hypot", "atan2"), 1.5),
    **dict.fromkeys(("tan", "asin", "acos"), 2.5),
}
"""As the docstring of exact_math has them."""
OF_TWO: Final = ("atan2", "hypot")
OF_ONE: Final = tuple(name for name in LIMITS_ULP if name not in OF_TWO)
NAMES: Final = (*OF_ONE, *OF_TWO)
MANY: Final[dict[str, Callable[[Any], Floats]]] = {
    "exp": exact_arrays.exp,
    "log": exact_arrays.log,
    "sin": lambda x: exact_arrays.sincos(x)[0],
    "cos": lambda x: exact_arrays.sincos(x)[1],
}
"""The functions of arrays."""

LEAST: Final = 5e-324
MOST: Final = 1.7976931348623157e308
NEAREST_TO_A_QUARTER: Final = math.ldexp(6381956970095103, 797)
"""Of all floats this comes nearest to a multiple of a quarter turn (Muller, Elementary Functions, 2016)."""
BORDERS: Final = (
    *(0.0, LEAST, 2.2250738585072014e-308, 1e-300, 1e-30, 2.0**-27, 0.25, 0.5, 0.625, 0.75, 1.0, 1.5, 2.0, 22.0, 1e10),
    *(exact_math.SQRT_HALF, math.sqrt(2), math.pi / 4, math.pi / 2, math.pi, 3 * math.pi / 4, 100 * math.pi),
    *(exact_math.EXP_LEAST, exact_math.EXP_MOST, 708.4, 745.0, 1e3, exact_math.ANGLE_FAR, exact_math.ATAN_FAR),
    *(
        exact_math.ATAN_BORDER1,
        exact_math.ATAN_BORDER2,
        exact_math.ATAN_BORDER3,
        exact_math.ATAN_BORDER4,
        exact_math.LARGE,
        exact_math.SMALL,
        1e22,
        NEAREST_TO_A_QUARTER,
        MOST,
        math.inf,
    ),
)
PI_60: Final = Decimal(
    "3.14159265358979323846264338327950288419716939937510582097494459230781640628620899862803482534211"
)


def special() -> list[float]:
    """Return borders of cases with their neighbours, of both signs, and NaNs of both signs."""
    near = {value for at in BORDERS for value in (at, math.nextafter(at, -math.inf), math.nextafter(at, math.inf))}
    return [*sorted(near), *(-value for value in sorted(near)), 0.0, -0.0, math.nan, -math.nan]


def drawn(count: int, seed: int) -> Floats:
    """Return numbers of three kinds: any bits, any size, and those that a world has."""
    rng = np.random.default_rng(seed)
    bits = rng.integers(0, 2**64, count // 3, dtype=np.uint64).view(np.float64)
    sizes = rng.choice([-1.0, 1.0], count // 3) * 2.0 ** rng.uniform(-60, 25, count // 3)
    return np.concatenate([bits, sizes, rng.uniform(-12, 12, count - 2 * (count // 3))])


def both(name: str) -> tuple[Callable[..., float], Callable[[Any], Floats]]:
    return getattr(exact_math, name), MANY[name]


def bits(values: Any) -> NDArray[np.uint64]:
    return np.asarray(values, np.float64).view(np.uint64)


def assert_same_bits(one: Any, other: Any, *arguments: Floats) -> None:
    wrong = np.flatnonzero(bits(one).ravel() != bits(other).ravel())
    at = [tuple(argument.ravel()[place] for argument in arguments) for place in wrong[:3]]
    assert not wrong.size, (wrong.size, at)


def check_single_against_batch(name: str, count: int, seed: int) -> None:
    one, many = both(name)
    values = np.concatenate([special(), drawn(count, seed)])
    assert_same_bits(many(values), [one(number) for number in values.tolist()], values)


@pytest.mark.parametrize("name", MANY)
def test_one_number_and_many_have_the_same_bits(name: str) -> None:
    check_single_against_batch(name, 6_000, seed=1)


@pytest.mark.campaign
@pytest.mark.parametrize("seed", range(100, 108))
@pytest.mark.parametrize("name", MANY)
def test_millions_of_numbers_have_the_same_bits(name: str, seed: int) -> None:
    check_single_against_batch(name, 300_000, seed)


def test_sincos_is_sine_and_cosine() -> None:
    values = np.concatenate([special(), drawn(3_000, 2)])
    sine, cosine = exact_arrays.sincos(values)
    assert_same_bits([exact_math.sin(x) for x in values.tolist()], sine, values)
    assert_same_bits([exact_math.cos(x) for x in values.tolist()], cosine, values)
    assert_same_bits([exact_math.sincos(x) for x in values.tolist()], np.stack([sine, cosine], axis=1))


@pytest.mark.parametrize("name", MANY)
def test_neither_length_nor_order_nor_layout_of_an_array_matters(name: str) -> None:
    many = MANY[name]
    values = np.concatenate([special(), drawn(900, 3)])[:960]
    usual = many(values)
    assert usual.shape == values.shape
    for length in (1, 2, 3, 4, 5, 7, 8, 9, 16, 17, 31, 64, 100):
        parts = [many(values[start : start + length]) for start in range(0, usual.size, length)]
        assert_same_bits(np.concatenate(parts), usual, values)
    order = np.random.default_rng(4).permutation(usual.size)
    assert_same_bits(many(values[order]), usual[order])
    assert_same_bits(many(values[::-3]), usual[::-3])
    square = values.reshape(-1, 24)
    for table in (square, np.asfortranarray(square), square[:, 3:17:2]):
        expected = many(np.ascontiguousarray(table).ravel()).reshape(table.shape)
        assert_same_bits(np.ascontiguousarray(many(table)), expected)
    assert many(values[5]) == usual[5], "a single number counts as an array"
    assert many(values[:0]).shape == (0,)


def test_numbers_of_other_types_are_floats_of_64_bits() -> None:
    whole = np.arange(-3, 4)
    for name in MANY:
        one, many = both(name)
        assert_same_bits(many(whole), [one(float(x)) for x in whole])
        assert_same_bits(many(whole.astype(np.float32)), many(whole.astype(np.float64)))


def test_there_is_one_nan() -> None:
    """Processors make NaNs of either sign, which no digest of a frame may depend on."""
    of_nothing: dict[str, list[tuple[float, ...]]] = {
        **{name: [(math.nan,), (-math.nan,)] for name in OF_ONE},
        **{name: [(math.nan, 1.0), (1.0, -math.nan), (math.nan, math.nan)] for name in OF_TWO},
    }
    of_nothing["log"] += [(-1.0,), (-LEAST,), (-math.inf,)]
    for name in ("sin", "cos", "tan"):
        of_nothing[name] += [(math.inf,), (-math.inf,)]
    for name in ("asin", "acos"):
        of_nothing[name] += [(math.nextafter(1.0, 2.0),), (-math.inf,)]
    for name, cases in of_nothing.items():
        for case in cases:
            assert struct.pack("<d", getattr(exact_math, name)(*case)) == struct.pack("<d", math.nan), (name, case)
            if name in MANY:
                assert bits(MANY[name](np.array(case))) == bits(math.nan), (name, case)


@pytest.mark.parametrize("name", NAMES)
def test_zeros_and_infinities_are_those_of_the_standard(name: str) -> None:
    """`math` follows Annex F of C99, where it does not raise."""
    one = getattr(exact_math, name)
    exact = [0.0, -0.0, math.inf, -math.inf]
    values = [*exact, 1.0, -1.0]
    for case in [(y, x) for y in exact for x in values] if name in OF_TWO else [(x,) for x in values]:
        try:
            expected = getattr(math, name)(*case)
        except ValueError:
            expected = -math.inf if name == "log" and case == (0.0,) else math.nan
        found = one(*case)
        assert found == pytest.approx(expected, rel=1e-15, abs=0.0, nan_ok=True), case
        assert math.copysign(1.0, found) == math.copysign(1.0, expected), case
        if expected in (0.0, 1.0, -1.0):
            assert found == expected, case


def test_exponentials_end_where_floats_end() -> None:
    assert exact_math.exp(exact_math.EXP_MOST) == pytest.approx(MOST, rel=1e-12)
    assert exact_math.exp(math.nextafter(exact_math.EXP_MOST, 1e3)) == math.inf
    assert exact_math.exp(-745.0) == LEAST and exact_math.exp(-746.0) == 0.0
    assert exact_math.exp(exact_math.EXP_LEAST) == LEAST
    assert exact_math.exp(math.nextafter(exact_math.EXP_LEAST, -1e3)) == 0.0
    assert exact_math.hypot(MOST, MOST) == math.inf and exact_math.hypot(0.6 * MOST, 0.6 * MOST) < math.inf
    assert exact_math.hypot(3 * LEAST, 4 * LEAST) == 5 * LEAST
    assert exact_math.hypot(3e300, 4e300) == 5e300


def test_odd_functions_are_odd_and_even_ones_even() -> None:
    values = np.abs(np.concatenate([special(), drawn(3_000, 7)]))
    values = values[~np.isnan(values)]
    for name in ("tan", "sin", "atan", "asin", "cos"):
        function, sign = getattr(exact_math, name), 1.0 if name == "cos" else -1.0
        for value in values.tolist():
            positive, negative = function(value), function(-value)
            assert math.isnan(positive) or struct.pack("<d", sign * negative) == struct.pack("<d", positive), value


# What the functions are held against: series in decimal numbers of 60 digits and more.


@lru_cache(maxsize=1)
def pi_of_400_digits() -> Decimal:
    """Return pi by Gauss's formula: 48 atan(1/18) + 32 atan(1/57) - 20 atan(1/239)."""
    with localcontext(prec=420):
        return sum((f * atan_series(1 / Decimal(n)) for f, n in ((48, 18), (32, 57), (-20, 239))), Decimal(0))


def atan_series(x: Decimal) -> Decimal:
    total = power = x
    n = 1
    while total + power != total:
        power *= -x * x
        n += 2
        total += power / n
    return total


def exact_atan(x: Decimal) -> Decimal:
    halvings = 0
    while abs(x) > Decimal("0.05"):
        x /= 1 + (1 + x * x).sqrt()
        halvings += 1
    return atan_series(x) * (1 << halvings)


def exact_sincos(x: Decimal) -> tuple[Decimal, Decimal]:
    with localcontext(prec=60 + max(0, x.adjusted()) + 20):
        half_pi = pi_of_400_digits() / 2
        quarters = (x / half_pi).to_integral_value()
        rest = x - quarters * half_pi
        turns = int(quarters % 4)
    sine, cosine = Decimal(0), Decimal(0)
    term, n = Decimal(1), 0
    while abs(term) > Decimal("1e-90"):
        if n & 1:
            sine += term if n & 3 == 1 else -term
        else:
            cosine += term if n & 3 == 0 else -term
        n += 1
        term *= rest / n
    turned = [(sine, cosine), (cosine, -sine), (-sine, -cosine), (-cosine, sine)]
    return turned[turns]


def exact_atan2(y: Decimal, x: Decimal) -> Decimal:
    if abs(y) > abs(x):
        return (PI_60 / 2).copy_sign(y) - exact_atan(x / y)
    return exact_atan(y / x) + (PI_60.copy_sign(y) if x < 0 else 0)


EXACT: Final[dict[str, Callable[..., Decimal]]] = {
    "exp": Decimal.exp,
    "log": Decimal.ln,
    "sin": lambda x: exact_sincos(x)[0],
    "cos": lambda x: exact_sincos(x)[1],
    "tan": lambda x: exact_sincos(x)[0] / exact_sincos(x)[1],
    "atan": exact_atan,
    "asin": lambda x: exact_atan2(x, (1 - x * x).sqrt()),
    "acos": lambda x: exact_atan2((1 - x * x).sqrt(), x),
    "atan2": exact_atan2,
    "hypot": lambda x, y: (x * x + y * y).sqrt(),
}


def arguments_of(name: str, count: int, seed: int) -> list[tuple[float, ...]]:
    """Return numbers over the whole range of a function, more of them where it bends."""
    rng = np.random.default_rng(seed)
    sizes = rng.choice([-1.0, 1.0], count) * 2.0 ** rng.uniform(-40, 40, count)
    mild = rng.uniform(-3.0, 3.0, count)
    borders = np.array([x for x in special() if 1e-12 < abs(x) < 1e12])
    chosen = np.concatenate([sizes, mild, borders])
    if name == "exp":
        chosen = np.concatenate([rng.uniform(-708.0, 709.7, count), mild, mild / 1e3])
    elif name == "log":
        chosen = np.concatenate([2.0 ** rng.uniform(-1070, 1023, count), np.abs(chosen), 1.0 + mild / 1e4])
    elif name in ("sin", "cos", "tan"):
        quarters = rng.integers(1, 600_000, count // 2) * (math.pi / 2)
        far = [*(2.0 ** rng.uniform(20, 1023, 40)), NEAREST_TO_A_QUARTER, MOST]
        chosen = np.concatenate([chosen, rng.uniform(-1e6, 1e6, count), quarters, far])
    elif name in ("asin", "acos"):
        chosen = np.concatenate([rng.uniform(-1, 1, count), mild / 1e6, 1.0 - 2.0 ** rng.uniform(-50, -1, count)])
    elif name in OF_TWO:
        other = np.concatenate([rng.permutation(sizes), mild[::-1]])
        return [*zip(np.concatenate([sizes, mild]).tolist(), other.tolist(), strict=True)]
    return [(x,) for x in chosen.tolist()]


def worst_ulp(name: str, count: int, seed: int) -> tuple[float, tuple[float, ...]]:
    one = getattr(exact_math, name)
    worst, at = 0.0, tuple[float, ...]()
    with localcontext(prec=60):
        for case in arguments_of(name, count, seed):
            exact = EXACT[name](*map(Decimal, case))
            found = one(*case)
            error = float(abs(Decimal(found) - exact) / Decimal(math.ulp(float(exact))))
            if error > worst:
                worst, at = error, case
    return worst, at


@pytest.mark.parametrize("name", NAMES)
def test_errors_stay_below_the_stated_units_of_the_last_place(name: str) -> None:
    worst, at = worst_ulp(name, 300, seed=1)
    assert worst < LIMITS_ULP[name], at


@pytest.mark.campaign
@pytest.mark.parametrize("name", NAMES)
def test_errors_stay_below_the_stated_ones_for_many(name: str) -> None:
    worst, at = worst_ulp(name, 30_000, seed=2)
    print(f"{name}: {worst:.3f} units of the last place at {at}")
    assert worst < LIMITS_ULP[name], at


def test_parts_of_constants_add_up() -> None:
    """What an angle is reduced by has the digits of pi that it claims."""
    pi = pi_of_400_digits()
    with localcontext(prec=400):
        quarter = [exact_math.QUARTER1, exact_math.QUARTER2, exact_math.QUARTER3, exact_math.QUARTER4]
        assert abs(sum(map(Decimal, quarter)) - pi / 2) < Decimal(2) ** -155
        assert abs(Decimal(exact_math.PI) + Decimal(exact_math.PI_LOW) - pi) < Decimal(2) ** -106
        assert abs(Decimal(exact_math.LN2_HIGH) + Decimal(exact_math.LN2_LOW) - Decimal(2).ln()) < Decimal(2) ** -85
        scale = Decimal(2) ** (exact_math.FRACTION_BITS - 1)
        assert abs(exact_math.HALF_PI_INTEGER - pi * scale) < 2
        assert (
            abs(exact_math.PER_QUARTER_INTEGER / Decimal(2) ** exact_math.PER_QUARTER_BITS - 2 / pi)
            < Decimal(2) ** -1270
        )
    for part in quarter[:3]:
        assert (part * 2**20 * 2.0 ** (33 - math.frexp(part)[1])).is_integer(), "33 bits"


def test_only_exact_operations_are_used() -> None:
    """Of `math` taking floats apart, of numpy also what works on bits; nothing that a library rounds in its own way."""
    exact = {"frexp", "ldexp", "copysign", "sqrt", "inf", "nan", "isinf", "isnan"}
    imported = {
        alias.name
        for node in ast.walk(ast.parse(inspect.getsource(exact_math)))
        if isinstance(node, ast.ImportFrom) and node.module == "math"
        for alias in node.names
    }
    assert imported == exact
    of_numpy = {
        node.attr
        for node in ast.walk(ast.parse(inspect.getsource(exact_arrays)))
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "np"
    }
    assert of_numpy <= exact | {"abs", "asarray", "flatnonzero", "float64", "int64", "where"}
    assert "**" not in inspect.getsource(exact_math).split('"""', 2)[2]

"""Quantities: what is read, to which exact value, what is refused in which words, and that texts read back."""

import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.units import Dimension, Pace, format_ns, format_rate, parse, parse_ns, parse_pace

DIMENSIONS = [value for value in vars(units).values() if isinstance(value, Dimension)]


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("84 mm", units.LENGTH, 0.084),
        ("10.5 mm", units.LENGTH, 0.0105),
        ("-522 mm", units.LENGTH, -0.522),
        ("1.2m", units.LENGTH, 1.2),
        ("150 um", units.LENGTH, 0.00015),
        ("21 g", units.MASS, 0.021),
        ("0.5 deg", units.ANGLE, math.radians(0.5)),
        ("180 deg", units.ANGLE, math.pi),
        ("3.5 m/s", units.SPEED, 3.5),
        ("36 km/h", units.SPEED, 10.0),
        ("60 rpm", units.SPIN, 2 * math.pi),
        ("9.81 m/s2", units.ACCELERATION, 9.81),
        ("90 N", units.FORCE, 90.0),
        ("2 N m", units.TORQUE, 2.0),
        ("20 mN s", units.IMPULSE, 0.02),
        ("0.5 %", units.PROBABILITY, 0.005),
        ("0.005 p", units.PROBABILITY, 0.005),
        ("2e-3 m", units.LENGTH, 0.002),
    ],
)
def test_a_quantity_is_the_nearest_float_in_si_units(text: str, dimension: Dimension, value: float) -> None:
    assert float(parse(text, dimension)) == value


@pytest.mark.parametrize(
    ("texts", "numbers"),
    [
        (["10ms", "0 s", "1.5s", "1 min"], ([10.0, 0.0, 1500.0, 60_000.0], "ms")),
        (["1", "-2.5e-1", "0"], ([1.0, -0.25, 0.0], "")),
        (["5 %", "0.1 p"], ([5.0, 10.0], "%")),
        (["1 GHz", "100 MHz"], ([1.0, 0.1], "GHz")),
        (["10ms", "10mm"], None),
        (["10ms", "10"], None),
        (["10ms", "slow"], None),
        (["1 parsec"], None),
        ([], None),
    ],
)
def test_quantities_of_one_dimension_are_numbers_of_the_first_unit(
    texts: list[str], numbers: tuple[list[float], str] | None
) -> None:
    assert units.in_one_unit(texts) == numbers


@pytest.mark.parametrize(
    ("text", "time_ns"),
    [
        ("2 ms", 2_000_000),
        ("20s", 20_000_000_000),
        ("0.3 ms", 300_000),
        ("1 ns", 1),
        ("1.5 us", 1500),
        ("1 h", 3600 * 10**9),
    ],
)
def test_a_time_is_a_whole_number_of_nanoseconds(text: str, time_ns: int) -> None:
    assert parse_ns(text) == time_ns


def test_the_bounds_of_a_quantity_are_of_its_dimension_and_in_order() -> None:
    with pytest.raises(BadValue, match="V measures a voltage"):
        units.Quantity(units.PROBABILITY, "1 V", "100 %")
    with pytest.raises(BadValue, match="a lower bound above the upper bound 1 %, '100 %'"):
        units.Quantity(units.PROBABILITY, "100 %", "1 %")


@pytest.mark.parametrize(
    ("text", "dimension", "message"),
    [
        (17.5, units.LENGTH, "not a length (a number and one of m, cm, mm, um, km), 17.5"),
        ("17.5", units.LENGTH, "not a length (a number and one of m, cm, mm, um, km), '17.5', nearest is '17.5 m'"),
        ("5", units.TIME, "not a time (a number and one of ns, us, ms, s, min, h), '5', nearest is '5 s'"),
        ("5", units.PROBABILITY, "not a probability (a number and one of p, %), '5', nearest is '5 %'"),
        (
            "17.5 ms",
            units.LENGTH,
            "not a length (a number and one of m, cm, mm, um, km); ms measures a time, '17.5 ms'",
        ),
        ("1 furlong", units.LENGTH, "not a length (a number and one of m, cm, mm, um, km), '1 furlong'"),
        ("20 kg", units.LENGTH, "not a length (a number and one of m, cm, mm, um, km); kg measures a mass, '20 kg'"),
        ("1 MHz", units.RATE, "not a rate (a number and one of Hz, kHz, mHz), '1 MHz', nearest is '1 mHz'"),
        ("1 grün", units.MASS, "not a mass (a number and one of kg, g, mg), '1 grün'"),
        ("1 \x1bm\u202e", units.MASS, "not a mass (a number and one of kg, g, mg), '1 \\x1bm\\u202e'"),
        ("21 gr", units.MASS, "not a mass (a number and one of kg, g, mg), '21 gr', nearest is '21 g'"),
        ("1 hz", units.RATE, "not a rate (a number and one of Hz, kHz, mHz), '1 hz', nearest is '1 Hz'"),
        ("2 m/s^2", units.ACCELERATION,
         "not an acceleration (a number and one of m/s2, mm/s2), '2 m/s^2', nearest is '2 m/s2'"),
        ("90°", units.ANGLE, "not an angle (a number and one of rad, mrad, deg), '90°', nearest is '90 deg'"),
        ("mm", units.LENGTH, "not a length (a number and one of m, cm, mm, um, km), 'mm'"),
        ("1/3 m", units.LENGTH, "not a length (a number and one of m, cm, mm, um, km), '1/3 m'"),
        ("1_0 mm", units.LENGTH, "not a length (a number and one of m, cm, mm, um, km), '1_0 mm'"),
        ("nan m", units.LENGTH, "not a length (a number and one of m, cm, mm, um, km), 'nan m'"),
        ("12:30:45", units.TIME, "not a time (a number and one of ns, us, ms, s, min, h), '12:30:45'"),
        (True, units.TIME, "not a time (a number and one of ns, us, ms, s, min, h), true"),
        (None, units.TICKS, "not a number of ticks (a number and one of ticks, tick), null"),
        ("1e999 m", units.LENGTH, "not a length (a number and one of m, cm, mm, um, km), '1e999 m'"),
        ("1 m\n", units.LENGTH, "not a length (a number and one of m, cm, mm, um, km), '1 m\\n'"),
    ],
)  # fmt: skip
def test_what_is_no_quantity_is_refused_with_the_units_named(text: object, dimension: Dimension, message: str) -> None:
    with pytest.raises(BadValue) as refused:
        parse(text, dimension)
    assert str(refused.value) == message


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0.5 ns", "not a whole number of ns, '0.5 ns'"),
        ("-1 ms", "negative; a time is at least 0, '-1 ms'"),
        ("1e-9 us", "not a whole number of ns, '1e-9 us'"),
    ],
)
def test_a_part_of_a_nanosecond_and_a_negative_time_are_refused(text: str, message: str) -> None:
    with pytest.raises(BadValue) as refused:
        parse_ns(text)
    assert str(refused.value) == message


@pytest.mark.parametrize("dimension", DIMENSIONS, ids=lambda dimension: dimension.name)
def test_each_unit_suggests_itself_in_capitals(dimension: Dimension) -> None:
    for unit in dimension.units:
        if unit.upper() not in dimension.units:
            with pytest.raises(BadValue) as refused:
                parse(f"3 {unit.upper()}", dimension)
            assert refused.value.nearest is not None
            suggested = refused.value.nearest.strip("'").removeprefix("3 ")
            assert suggested.lower() == unit.lower()


@given(st.integers(min_value=0, max_value=2**63 - 1))
def test_a_time_reads_back(time_ns: int) -> None:
    assert parse_ns(format_ns(time_ns)) == time_ns


@given(st.fractions(min_value=Fraction(1, 1000), max_value=10_000, max_denominator=10**6))
def test_a_rate_reads_back(rate_hz: Fraction) -> None:
    assert parse(format_rate(rate_hz), units.RATE) == rate_hz


@pytest.mark.parametrize(
    ("rate_hz", "text"),
    [
        (Fraction(100), "100 Hz"),
        (Fraction(25, 2), "12.5 Hz"),
        (Fraction(500, 3), "500/3 Hz"),
        (Fraction(1, 1000), "0.001 Hz"),
        (Fraction(1000), "1000 Hz"),
    ],
)
def test_a_rate_is_written_as_people_write_it(rate_hz: Fraction, text: str) -> None:
    assert format_rate(rate_hz) == text


@given(
    st.floats(allow_nan=False, allow_infinity=False, min_value=-1e15, max_value=1e15).filter(
        lambda x: x == 0 or abs(x) > 1e-15
    )
)
def test_a_float_in_the_base_unit_reads_back_to_the_last_bit(value: float) -> None:
    assert float(parse(units.Quantity(units.LENGTH, "0 m", "1 m").write(value), units.LENGTH)) == value


def test_a_period_is_whole_ticks() -> None:
    assert units.period_ticks(Fraction(100), 2_000_000) == 5
    assert units.period_ticks(Fraction(500, 3), 2_000_000) == 3


@pytest.mark.parametrize(
    ("rate_hz", "message"),
    [
        (150, "not a whole number of ticks of 2 ms, '150 Hz', nearest is '125 Hz' and '500/3 Hz'"),
        (1000, "not a whole number of ticks of 2 ms, '1000 Hz', nearest is '500 Hz'"),
    ],
)
def test_another_period_is_refused_with_the_nearest_valid_rates(rate_hz: int, message: str) -> None:
    with pytest.raises(BadValue) as refused:
        units.period_ticks(Fraction(rate_hz), 2_000_000)
    assert str(refused.value) == message


@given(st.fractions(min_value=Fraction(1, 100), max_value=5000, max_denominator=1000), st.integers(1, 10**8))
def test_the_nearest_rates_that_are_named_are_valid(rate_hz: Fraction, tick_ns: int) -> None:
    try:
        units.period_ticks(rate_hz, tick_ns)
    except BadValue as refused:
        assert refused.nearest is not None
        for text in refused.nearest.split(" and "):
            units.period_ticks(parse(text.strip("'"), units.RATE), tick_ns)


@pytest.mark.parametrize(
    ("text", "pace", "shown"),
    [
        ("fast", Pace("fast"), "fast"),
        ("realtime", Pace("realtime"), "realtime"),
        ("1x", Pace("realtime"), "realtime"),
        ("2x", Pace("realtime", Fraction(2)), "2x"),
        ("0.5x", Pace("realtime", Fraction(1, 2)), "0.5x"),
        ("1/3x", Pace("realtime", Fraction(1, 3)), "1/3x"),
    ],
)
def test_a_pace_is_fast_or_a_multiple_of_the_wall_clock(text: str, pace: Pace, shown: str) -> None:
    assert parse_pace(text) == pace
    assert str(pace) == shown
    assert parse_pace(shown) == pace


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("realtme", "not a pace (realtime, fast or a factor such as 2x), 'realtme', nearest is 'realtime'"),
        ("2", "not a pace (realtime, fast or a factor such as 2x), '2'"),
        (2, "not a pace (realtime, fast or a factor such as 2x), 2"),
        ("0x", "out of range 0.001x to 1000x, '0x'"),
        ("-1x", "out of range 0.001x to 1000x, '-1x'"),
        ("1e9x", "out of range 0.001x to 1000x, '1e9x'"),
    ],
)
def test_another_pace_is_refused(text: object, message: str) -> None:
    with pytest.raises(BadValue) as refused:
        parse_pace(text)
    assert str(refused.value) == message

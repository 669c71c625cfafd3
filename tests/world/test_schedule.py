"""When sensors measure: at any rate, the ticks of the rational inequality, and nothing lost over long spans."""

from __future__ import annotations

from fractions import Fraction
from math import ceil, floor
from typing import NamedTuple

from hypothesis import assume, given
from hypothesis import strategies as st

from foosim.world.spec import Schedule, schedule_of

NS_PER_S = 1_000_000_000


class Timed(NamedTuple):
    """A rate and an offset, as sensors have them."""

    rate_hz: Fraction
    offset_ns: int


TICKS_NS = st.integers(100_000, 100_000_000)
RATES = st.fractions(Fraction(1, 1000), 10_000, max_denominator=10_000)


def drawn(tick_ns: int, rate: Fraction, share: float) -> tuple[Timed, Schedule]:
    """Return a sensor with an offset that is this share of its period, and its schedule."""
    assume(rate * tick_ns <= NS_PER_S)
    timed = Timed(rate, int(share * (ceil(NS_PER_S / rate) - 1)))
    return timed, schedule_of(timed, tick_ns)


@given(TICKS_NS, RATES, st.floats(0, 1), st.integers(0, 1 << 50))
def test_a_tick_is_due_by_the_rational_inequality(tick_ns: int, rate: Fraction, share: float, first: int) -> None:
    timed, schedule = drawn(tick_ns, rate, share)
    per_ns = rate / NS_PER_S
    for tick in range(first, first + 50):
        reached, before = (floor((k * tick_ns - timed.offset_ns) * per_ns) for k in (tick, tick - 1))
        assert schedule.is_due(tick) == (reached > before)


@given(TICKS_NS, RATES, st.floats(0, 1), st.integers(0, 1000))
def test_a_reading_is_taken_at_the_first_tick_not_before_its_time(
    tick_ns: int, rate: Fraction, share: float, number: int
) -> None:
    timed, schedule = drawn(tick_ns, rate, share)
    due_ns = timed.offset_ns + number * NS_PER_S / rate
    tick = ceil(due_ns / tick_ns)
    assert schedule.is_due(tick) and 0 <= tick * tick_ns - due_ns < tick_ns


@given(st.integers(1, 1000), st.integers(0, 999), TICKS_NS, st.integers(0, 1 << 40))
def test_whole_ticks_are_those_of_period_and_offset(period: int, offset: int, tick_ns: int, first: int) -> None:
    offset %= period
    schedule = schedule_of(Timed(Fraction(NS_PER_S, period * tick_ns), offset * tick_ns), tick_ns)
    assert schedule == (1, -offset % period, period)
    for tick in range(first, first + 10):
        assert schedule.is_due(tick) == (tick % period == offset)

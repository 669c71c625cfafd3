"""When orders are released: never ahead of the clock, never further than W past the last commit, never while paused."""

from __future__ import annotations

from fractions import Fraction
from math import ceil
from typing import Final

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foosim.common import limits
from foosim.common.histogram import Lags
from foosim.common.units import Pace, parse_pace
from foosim.supervisor.pacing import Pacer

T: Final = 2_000_000
START: Final = 1_000_000_007
W: Final = limits.RELEASE_AHEAD
FAST: Final = Pace("fast")
REALTIME: Final = Pace("realtime")


def pacer(pace: Pace = REALTIME, tick: int = 0) -> Pacer:
    made = Pacer(T, pace)
    made.start(START, tick)
    return made


def first_release(made: Pacer, tick: int, committed: int = 10**9) -> int:
    """The first nanosecond at which an order may be released, by looking for it."""
    low, high = 0, START + 10**15
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if made.may_release(tick, committed, middle) else (middle + 1, high)
    return low


@pytest.mark.parametrize("pace", [FAST, REALTIME, Pace("realtime", Fraction(2))], ids=str)
def test_no_order_is_released_further_than_w_past_the_last_commit(pace: Pace) -> None:
    made, late = pacer(pace), START + 10**12
    for committed in (0, 1, 17):
        assert [made.may_release(committed + ahead, committed, late) for ahead in range(W + 3)] == [True] * (W + 1) + [
            False,
            False,
        ]


def test_fast_knows_no_clock() -> None:
    made = pacer(FAST)
    assert made.may_release(3, 0, 0) and made.release_ns(3) is None and made.is_fast
    assert made.committed(3, START + 10**12) == 0
    assert (made.last_lag_ns, made.lags.count) == (0, 0)


@settings(max_examples=60)
@given(tick=st.integers(0, 10**7), pace=st.sampled_from(["realtime", "2x", "0.5x", "3x", "1/7x", "1000x"]))
def test_an_order_is_released_at_its_time_and_not_a_nanosecond_before(tick: int, pace: str) -> None:
    made = pacer(parse_pace(pace))
    expected = START + int(tick * T / parse_pace(pace).factor)
    assert made.release_ns(tick) == expected == first_release(made, tick)


def test_a_late_tick_is_counted_and_less_than_a_tenth_of_a_second_is_caught_up() -> None:
    made = pacer()
    assert made.committed(1, START + T) == 0 and made.last_lag_ns == 0
    assert made.committed(2, START + 2 * T + 99_999_999) == 0
    assert made.last_lag_ns == 99_999_999 and made.anchor_ns == START
    assert made.committed(3, START + 3 * T - 5) == 0 and made.last_lag_ns == 0
    assert (made.lags.count, made.lags.max_ns) == (3, 99_999_999)
    assert made.release_ns(4) == START + 4 * T


def test_a_greater_lag_moves_the_anchor() -> None:
    made = pacer()
    lag = limits.LAG_ANCHOR_NS + 1
    assert made.committed(5, START + 5 * T + lag) == lag
    assert made.release_ns(6) == START + 6 * T + lag, "the next ticks come at the pace, not in a burst"
    assert made.committed(6, START + 6 * T + lag + 7) == 0 and made.last_lag_ns == 7


def test_a_pause_releases_nothing_and_moves_the_anchor() -> None:
    made = pacer()
    made.pause(50)
    assert not made.may_release(50, 49, START + 10**12) and made.release_ns(50) is None
    assert made.committed(50, START + 10**12) == 0 and made.lags.count == 0, "what was released before is not late"
    back = START + 10**12
    made.resume(50, back)
    assert made.release_ns(50) == back and made.release_ns(51) == back + T
    assert first_release(made, 51) == back + T


@pytest.mark.parametrize("pace", [FAST, REALTIME], ids=str)
def test_a_step_grants_so_many_ticks_and_pauses_behind_them(pace: Pace) -> None:
    made = pacer(pace)
    made.pause(50)
    made.step(50, 3)
    assert [made.may_release(tick, 49, 0) for tick in range(50, 55)] == [True, True, True, False, False]
    made.step(51, 2)
    assert [made.may_release(tick, 52, 0) for tick in range(51, 57)] == [True] * 4 + [False] * 2, "grants add up"
    made.resume(55, START + 10**12)
    assert made.may_release(56, 55, START + 10**12 + T)


def test_a_step_without_a_pause_pauses_behind_it() -> None:
    made = pacer()
    made.step(50, 2)
    assert made.paused
    assert [made.may_release(tick, 49, START + 10**12) for tick in range(50, 53)] == [True, True, False]


def test_a_pause_takes_back_what_a_step_granted() -> None:
    made = pacer()
    made.step(50, 10)
    made.pause(52)
    assert not made.may_release(52, 51, START + 10**12)


def test_another_pace_goes_on_from_the_next_tick() -> None:
    made = pacer()
    now = START + 100 * T + 123
    made.set_pace(parse_pace("2x"), 101, now)
    assert made.release_ns(101) == now and made.release_ns(103) == now + T
    made.set_pace(FAST, 110, now + 10**9)
    assert made.may_release(110, 109, 0)
    made.set_pace(REALTIME, 5000, now + 2 * 10**9)
    assert made.release_ns(5001) == now + 2 * 10**9 + T


def test_another_pace_does_not_end_a_pause() -> None:
    made = pacer()
    made.pause(10)
    made.set_pace(FAST, 10, START + 10**9)
    assert not made.may_release(10, 9, START + 10**12)


# --- quantiles of lag ------------------------------------------------------------------------------------------------


@settings(max_examples=100)
@given(lags=st.lists(st.integers(0, 20_000_000_000), min_size=1, max_size=200), share=st.floats(0.01, 1.0))
def test_quantiles_are_right_to_ten_microseconds_or_to_their_512th(lags: list[int], share: float) -> None:
    made = Lags()
    for lag in lags:
        made.add(lag)
    ordered = sorted(lags)
    exact_ms = ordered[ceil(share * len(lags)) - 1] / 1e6
    found_ms = made.quantile_ms(share)
    assert found_ms <= made.max_ns / 1e6
    if exact_ms < 10_000.0:
        assert exact_ms - 1e-9 <= found_ms <= exact_ms + max(0.01, (exact_ms + 0.01) / 512) + 1e-9
    assert made.max_ns == ordered[-1] and made.count == len(lags)


def test_lags_take_bounded_memory() -> None:
    made = Lags()
    for lag in range(0, 11 * 10**9, 10**4):
        made.add(lag)
    assert len(made.cells) <= 6_200 and made.quantile_ms(1.0) == 10_004.48
    assert Lags().quantile_ms(0.5) == 0.0

"""Keyed draws: BLAKE2b of their key and counter alone, and what is made of their words."""

from __future__ import annotations

import struct
from hashlib import blake2b
from math import sqrt
from statistics import NormalDist, fmean
from typing import Final

import pytest

from foosim.common.keyed_random import Slot, chance_threshold, draw_key, draw_words, gaussian, unit_interval

COUNT: Final = 20_000
KEY: Final = draw_key(1, "link", "player-red", "red.goal")
CELLS: Final = 64
CHI2_63_999: Final = 103.44
"""The 99.9 % quantile of chi-squared with 63 degrees of freedom; the seeds are fixed, so a failure is no bad luck."""


def words(slot: int, key: bytes = KEY, count: int = COUNT) -> list[int]:
    return [draw_words(key, number)[slot] for number in range(count)]


def chi2(cells: list[int], kinds: int) -> float:
    expected = len(cells) / kinds
    counts = [0] * kinds
    for cell in cells:
        counts[cell] += 1
    return sum((count - expected) ** 2 / expected for count in counts)


def test_parts_of_a_purpose_do_not_run_into_each_other() -> None:
    purposes = [("ab", "c"), ("a", "bc"), ("abc",), ("abc", ""), ("", "abc"), ("a", "b", "c"), ()]
    assert len({draw_key(1, *purpose) for purpose in purposes}) == len(purposes)
    assert len(draw_key(2**63 - 1, "x")) == 32


def test_draws_are_the_named_function() -> None:
    """BLAKE2b of (counter, copy), keyed: another language can compute them."""
    expected = blake2b(struct.pack("<QQ", 5, 1), key=KEY).digest()
    assert draw_words(KEY, 5, 1) == struct.unpack("<8Q", expected)
    key = blake2b(struct.pack("<Q", 1), digest_size=32, person=b"foosim draw")
    for part in ("link", "player-red", "red.goal"):
        key.update(struct.pack("<I", len(part)) + part.encode())
    assert key.digest() == KEY


def test_slots_keep_their_numbers() -> None:
    """A capture's draws mean the same in every version."""
    assert {slot.name: int(slot) for slot in Slot} == {
        "LOSS": 0,
        "ERROR": 1,
        "JITTER": 2,
        "JITTER_STATE": 3,
        "DUPLICATE": 4,
        "CORRUPT": 5,
        "REORDER": 6,
        "BACKOFF": 7,
    }


def test_unit_interval_ends_below_one() -> None:
    assert unit_interval(0) == 0.0
    assert unit_interval(2**64 - 1) == 1.0 - 2**-53
    assert unit_interval(2**63) == 0.5


def test_gaussian_is_finite_symmetric_and_normal() -> None:
    assert gaussian(0) == -gaussian(2**64 - 1) and 8.0 < gaussian(2**64 - 1) < 9.0
    assert gaussian(2**63) == -gaussian(2**63 - 1) > 0.0
    drawn = sorted(gaussian(word) for word in words(Slot.BACKOFF))
    assert abs(fmean(drawn)) < 3.29 / sqrt(COUNT)
    assert abs(fmean(x * x for x in drawn) - 1.0) < 3.29 * sqrt(2 / COUNT)
    assert abs(fmean(x**4 for x in drawn) - 3.0) < 3.29 * sqrt(96 / COUNT)
    cells = [int(NormalDist().cdf(x) * CELLS) for x in drawn]
    assert chi2(cells, CELLS) < CHI2_63_999


@pytest.mark.parametrize("probability", [0.0, 1e-9, 0.005, 0.5, 0.999, 1.0])
def test_a_chance_is_an_integer_comparison(probability: float) -> None:
    threshold = chance_threshold(probability)
    assert abs(threshold / 2**64 - probability) <= 2**-53
    assert (probability == 0.0) == (threshold == 0)
    assert probability < 1.0 or threshold > 2**64 - 1, "what is certain happens to every word"
    happened = sum(word < threshold for word in words(Slot.ERROR))
    assert abs(happened - COUNT * probability) <= 3.29 * sqrt(COUNT * probability * (1 - probability))


@pytest.mark.parametrize("probability", [-1e-9, 1.0 + 1e-9, float("nan")])
def test_what_is_no_probability_is_a_programmers_error(probability: float) -> None:
    with pytest.raises(AssertionError):
        chance_threshold(probability)

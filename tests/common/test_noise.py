"""Keyed noise in batches: known answers of Philox, the same bits in any batch, and the statistics of normal numbers."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
from collections.abc import Iterable
from math import sqrt
from pathlib import Path
from statistics import NormalDist
from typing import Any, Final

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from foosim.common.batched.noise import NoiseKey, NoiseKeys
from foosim.common.batched.normal import ERROR_MAX, inverse_of_lower_half, normal_of_word, normal_of_words
from foosim.common.batched.philox import Lanes, block, round_keys
from foosim.common.keyed_random import draw_key, gaussian, unit_interval
from tests.common.digest_of_numbers import digest_of_numbers

Words = NDArray[np.uint64]
Floats = NDArray[np.float64]

ROOT: Final = Path(__file__).parents[2]
NAMES: Final = [f"rover-{n}" for n in range(5_000)]
KEYS: Final = [draw_key(1, "noise", name, "imu") for name in NAMES]
TICK: Final = 123_456_789_012

# Counter, key and result in words of 32 bits: Random123 1.14, tests/kat_vectors, philox4x32 with 10 rounds.
KNOWN: Final = """
00000000 00000000 00000000 00000000 00000000 00000000  6627e8d5 e169c58d bc57ac4c 9b00dbd8
ffffffff ffffffff ffffffff ffffffff ffffffff ffffffff  408f276d 41c83b0e a20bc7c6 6d5451fd
243f6a88 85a308d3 13198a2e 03707344 a4093822 299f31d0  d16cfe09 94fdcceb 5001e420 24126ea1
"""

FROZEN_WORDS: Final = [12803627770127481393, 8325624015672154114, 9683107586318089448]
FROZEN_NORMAL: Final = ["0x1.03d294f76c4d0p-1", "-0x1.f4ead7eeaa4ccp-4", "0x1.000c3b9d1555fp-4"]
FROZEN_TAIL: Final = [
    "-0x1.06b48528cea51p+3",
    "-0x1.02734508d1f1cp+3",
    "-0x1.52dc6e853f1cap+2",
    "-0x1.13b22a7d56856p+1",
    "-0x1.4000000000000p-52",
]


def known() -> list[tuple[int, int, int, tuple[int, int]]]:
    """Return key, counter's halves and result, in words of 64 bits."""
    rows = [[int(word, 16) for word in line.split()] for line in KNOWN.split("\n") if line]
    pairs = [[low | high << 32 for low, high in zip(row[::2], row[1::2], strict=True)] for row in rows]
    return [(key, counter, further, (one, two)) for counter, further, key, one, two in pairs]


def philox(counter: Iterable[int], key: Iterable[int]) -> list[int]:
    """Return four words of 32 bits: the paper's figure 2 and section 3.4, word by word."""
    r0, l0, r1, l1 = counter
    k0, k1 = key
    for _ in range(10):
        first, second = 0xD2511F53 * r0, 0xCD9E8D57 * r1
        r0, l0, r1, l1 = (second >> 32) ^ l0 ^ k0, second % 2**32, (first >> 32) ^ l1 ^ k1, first % 2**32
        k0, k1 = (k0 + 0x9E3779B9) % 2**32, (k1 + 0xBB67AE85) % 2**32
    return [r0, l0, r1, l1]


def bits(values: Any) -> Words:
    return np.ascontiguousarray(values, np.float64).view(np.uint64)


# Known answers and the format.


@pytest.mark.parametrize(("key", "counter", "further", "result"), known())
def test_blocks_are_those_of_random123(key: int, counter: int, further: int, result: tuple[int, int]) -> None:
    assert block(round_keys(key), counter, further) == result
    first, second = Lanes(np.array([key], np.uint64)).blocks(counter, further)
    assert ([*first], [*second]) == ([result[0]], [result[1]])


def test_lanes_do_not_mix_keys_or_counters() -> None:
    keys, counters, further = (np.array(column, np.uint64) for column in list(zip(*known(), strict=True))[:3])
    first, second = Lanes(keys).blocks(counters, further)
    assert [*zip(first.tolist(), second.tolist(), strict=True)] == [result for *_, result in known()]


def test_the_format_of_a_draw_is_the_documented_one() -> None:
    key = draw_key(7, "noise", "rover-7", "imu")
    halves = struct.unpack("<2I", key[:8])
    for counter, slot in ((0, 0), (1, 2), (2**32, 0), (2**63 - 1, 2**32 - 1), (TICK, 3)):
        expected = []
        for number in range(4):
            words = philox((counter % 2**32, counter >> 32, number, slot), halves)
            expected += [words[0] | words[1] << 32, words[2] | words[3] << 32]
        for width in range(1, 9):
            assert NoiseKey(key).words(counter, width, slot) == expected[:width]
            assert NoiseKeys([key]).words(counter, width, slot).tolist() == [expected[:width]]


def test_values_never_change() -> None:
    """Captures depend on them."""
    key = NoiseKey(draw_key(1, "noise", "red.goal", "encoder"))
    assert key.words(5, 3, 2) == FROZEN_WORDS
    assert [x.hex() for x in key.normal(5, 3, 2)] == FROZEN_NORMAL
    assert [normal_of_word(word).hex() for word in (0, 1 << 12, 1 << 40, 1 << 58, 2**63 - 1)] == FROZEN_TAIL


# The same bits in any batch.


@settings(max_examples=40)
@given(
    rows=st.lists(st.integers(0, 4_999), max_size=40),
    counter=st.integers(0, 2**64 - 1),
    width=st.integers(1, 9),
    slot=st.integers(0, 2**32 - 1),
)
def test_a_stream_by_itself_has_the_bits_of_its_row(rows: list[int], counter: int, width: int, slot: int) -> None:
    batch = NoiseKeys(KEYS[row] for row in rows)
    assert len(batch) == len(rows)
    alone = [NoiseKey(KEYS[row]) for row in rows]
    words, normal = batch.words(counter, width, slot), batch.normal(counter, width, slot)
    assert words.shape == normal.shape == (len(rows), width)
    assert words.dtype == np.uint64 and normal.dtype == np.float64
    for row, key in enumerate(alone):
        assert words[row].tolist() == key.words(counter, width, slot)
        assert key.uniform(counter, width, slot) == [unit_interval(word) for word in words[row].tolist()]
        assert normal[row].tolist() == key.normal(counter, width, slot)


@pytest.mark.parametrize("width", [1, 2, 5])
def test_neither_size_nor_order_of_a_batch_matters(width: int) -> None:
    usual = NoiseKeys(KEYS).normal(TICK, width, 1)
    order = np.random.default_rng(1).permutation(len(KEYS))
    assert np.array_equal(bits(NoiseKeys(KEYS[row] for row in order).normal(TICK, width, 1)), bits(usual[order]))
    for size in (1, 2, 3, 7, 8, 9, 64, 500):
        for start in range(0, 1_000, 250):
            part = NoiseKeys(KEYS[start : start + size]).normal(TICK, width, 1)
            assert np.array_equal(bits(part), bits(usual[start : start + size])), (start, size)
    rows = np.array([4, 4_999, 4, 0])
    assert np.array_equal(bits(NoiseKeys(KEYS).taken(rows).normal(TICK, width, 1)), bits(usual[rows]))


def test_earlier_draws_shift_nothing() -> None:
    keys = NoiseKeys(KEYS[:50])
    usual = keys.normal(3, 4)
    for counter, width, slot in ((4, 4, 0), (3, 9, 0), (3, 1, 7), (3, 2, 0)):
        keys.normal(counter, width, slot)
    assert np.array_equal(keys.normal(3, 4), usual)
    assert np.array_equal(keys.normal(3, 9)[:, :4], usual), "a longer draw begins with a shorter one"


def test_what_is_drawn_belongs_to_the_caller() -> None:
    keys = NoiseKeys(KEYS[:9])
    for width in (1, 2, 3):
        drawn = keys.words(1, width)
        expected = drawn.copy()
        assert keys.words(2, width) is not drawn and np.array_equal(drawn, expected)
        drawn[:] = 0
        assert np.array_equal(keys.words(1, width), expected)


@pytest.mark.parametrize("width", [1, 2, 5])
def test_each_stream_may_have_a_counter_of_its_own(width: int) -> None:
    counters = np.array([0, 5, 2**32, 2**64 - 1, TICK, 1], np.uint64)
    keys = NoiseKeys(KEYS[:6])
    expected = [keys.normal(int(counter), width, 2)[row] for row, counter in enumerate(counters)]
    assert np.array_equal(keys.normal(counters, width, 2), np.array(expected))
    assert np.array_equal(keys.normal(np.full(6, 5, np.uint64), width, 2), keys.normal(5, width, 2))


@pytest.mark.parametrize("draw", [(-1, 1, 0), (2**64, 1, 0), (0, 0, 0), (0, 1, -1), (0, 1, 2**32)])
def test_what_is_no_draw_is_a_programmers_error(draw: tuple[int, int, int]) -> None:
    for key in (NoiseKey(KEYS[0]), NoiseKeys(KEYS[:2])):
        with pytest.raises(AssertionError):
            key.words(*draw)


def test_bits_are_the_same_in_every_version_and_on_every_machine() -> None:
    assert digest_of_numbers() == "9f3d3ff5b076f8e2a331576a07f585f4"


def test_another_process_without_the_processors_extensions_has_the_same_bits() -> None:
    """numpy has code for each generation of processors; element-wise it must not matter which one runs."""
    found = np.show_config(mode="dicts")["SIMD Extensions"].get("found", [])
    environment = {**os.environ, "NPY_DISABLE_CPU_FEATURES": " ".join(found), "PYTHONHASHSEED": "7"}
    command = [sys.executable, "-m", "tests.common.digest_of_numbers"]
    run = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=True)
    assert run.stdout.strip() == digest_of_numbers(), run.stderr


# The inverse distribution function.


def tail_words(count: int, seed: int) -> Words:
    """Return words of all halvings of the probability alike, in both tails."""
    rng = np.random.default_rng(seed)
    words = rng.integers(0, 2**64, count, dtype=np.uint64) >> rng.integers(0, 53, count).astype(np.uint64)
    return np.concatenate([words, ~words])


def test_a_normal_number_is_near_the_exact_inverse_everywhere() -> None:
    words = np.concatenate(
        [tail_words(40_000, 1), np.random.default_rng(2).integers(0, 2**64, 40_000, dtype=np.uint64)]
    )
    exact = np.array([gaussian(word) for word in words.tolist()])
    errors = np.abs(normal_of_words(words) - exact)
    assert errors.max() < ERROR_MAX
    assert errors.max() > ERROR_MAX / 2, "as stated, not more"
    assert exact.max() > 8.0, "the whole tail was looked at"


def test_one_word_has_the_bits_of_many() -> None:
    edges = [word + step for word in (1 << n for n in range(13, 64)) for step in (-4096, -1, 0, 1, 4096)]
    words = np.concatenate([tail_words(10_000, 3), np.array([0, 1, 2**63, 2**64 - 1, *edges], np.uint64)])
    assert np.array_equal(bits([normal_of_word(word) for word in words.tolist()]), bits(normal_of_words(words)))
    table = words[:20_000].reshape(50, 400)
    assert np.array_equal(normal_of_words(table), normal_of_words(table.ravel()).reshape(50, 400))
    assert np.array_equal(normal_of_words(table[::2, ::-3]), normal_of_words(table)[::2, ::-3])


def test_a_word_and_its_complement_are_opposite() -> None:
    words = tail_words(20_000, 4)
    assert np.array_equal(normal_of_words(words), -normal_of_words(~words))
    ends = normal_of_words(np.array([0, 2**63 - 1, 2**63, 2**64 - 1], np.uint64))
    assert ends[0] == -ends[3] and 8.2 < ends[3] < 8.3, "no tail is cut off"
    assert ends[1] == -ends[2] and 0.0 < ends[2] < 1e-15


def test_normal_numbers_grow_with_the_word() -> None:
    """Also from cell to cell."""
    edges = np.unique([(1 << n) + (step << (n - 8)) for n in range(20, 63) for step in range(256)]).astype(np.uint64)
    around = np.sort(np.concatenate([edges - np.uint64(1 << 12), edges, edges + np.uint64(1 << 12)]))
    assert (np.diff(normal_of_words(np.unique(around >> np.uint64(12)) << np.uint64(12))) > 0.0).all()
    assert (np.diff(normal_of_words(np.sort(tail_words(50_000, 5)))) >= 0.0).all()


def test_the_tables_values_are_wichuras() -> None:
    p = np.concatenate([2.0 ** -np.random.default_rng(6).uniform(1, 53, 5_000), [0.5, 0.075, 2.0**-53]])
    assert inverse_of_lower_half(p) == pytest.approx([NormalDist().inv_cdf(x) for x in p.tolist()], rel=2e-15)


# Statistics of normal numbers; those of the words are Philox's, whose known answers are above.


def check_moments(x: Floats) -> None:
    """Each within 3.29 standard errors, two-sided one in a thousand."""
    n = x.size
    moments = [float((x**power).mean()) for power in (1, 2, 3, 4, 6)]
    exact, variances = (0.0, 1.0, 0.0, 3.0, 15.0), (1.0, 2.0, 15.0, 96.0, 10170.0)
    for moment, expected, variance in zip(moments, exact, variances, strict=True):
        assert abs(moment - expected) < 3.29 * sqrt(variance / n), (moments, n)


def check_distribution(x: Floats) -> None:
    """Kolmogorov and Smirnov: the greatest distance to the distribution function; 1.95 is its 99.9 % quantile."""
    cdf = np.array([NormalDist().cdf(value) for value in np.sort(x.ravel()).tolist()])
    steps = np.arange(x.size + 1) / x.size
    distance = max((steps[1:] - cdf).max(), (cdf - steps[:-1]).max())
    assert distance * sqrt(x.size) < 1.95


def check_tails(x: Floats, count: int, sigmas: tuple[int, ...]) -> None:
    """Of `count` numbers, `x` are those that may be beyond the sigmas."""
    for sigma in sigmas:
        expected = count * NormalDist().cdf(-sigma)
        for side in (-1.0, 1.0):
            found = int((side * x > sigma).sum())
            assert abs(found - expected) < 3.29 * sqrt(expected), (sigma, side, found, expected)


def test_normal_numbers_are_normal() -> None:
    keys = NoiseKeys(KEYS[:1_000])
    x = normal_of_words(np.stack([keys.words(tick, 4) for tick in range(250)]))
    assert x.size == 1_000_000
    check_moments(x)
    check_distribution(x[:, :20])
    check_tails(x, x.size, (1, 2, 3, 4))


@pytest.mark.campaign
def test_millions_of_normal_numbers_are_normal() -> None:
    keys, ticks, blocks = NoiseKeys(KEYS), 100, 16
    tails = []
    for first in range(0, blocks * ticks, ticks):
        words = np.concatenate([keys.words(first + tick, 8) for tick in range(ticks)])
        x = normal_of_words(words)
        check_moments(x)
        check_distribution(x[:25_000])
        tails.append(x[np.abs(x) > 3.0])
    count = blocks * ticks * 8 * len(KEYS)
    assert count == 64_000_000
    check_tails(np.concatenate(tails), count, (3, 4, 5))

"""What a normal number of noise costs, by the size of the batch; beside it single draws, and draws of BLAKE2b.

A batch has a stream for each robot and draws its values of one tick. The limit is written as a multiple of b, like all
figures.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median
from typing import Final

from bench.bare_tick import bare_tick_us
from foosim.common.batched.noise import NoiseKey, NoiseKeys
from foosim.common.keyed_random import draw_key, draw_words, gaussian

SHAPES: Final = ((1, 1), (10, 1), (100, 1), (500, 1), (5000, 1), (100, 5), (20, 25), (3, 181))
"""Streams, and values that each draws in a tick."""
LIMITED: Final = (500, 1)
LIMIT_US: Final = 0.3
LIMIT_B_US: Final = 155.0
"""A value of that batch may take so long where b is that."""
TICKS_PER_S: Final = 100
BLOCKS: Final = 20


@dataclass(frozen=True, slots=True)
class Batch:
    """The cost of one shape."""

    streams: int
    width: int
    batch_us: float
    value_us: float
    batch_b: float
    """The batch, in bare ticks."""


@dataclass(frozen=True, slots=True)
class Noise:
    """Medians over blocks of ticks, on the wall."""

    b_us: float
    batches: list[Batch]
    single_us: float
    """One value of one stream, by `NoiseKey`."""
    blake2b_us: float
    """One value by `draw_words` and `gaussian`."""
    blake2b_of_8_us: float
    """A value where all eight words of a draw are used."""
    limit_us: float


def noise(seconds: float = 3.0) -> Noise:
    """Draw in a hundred ticks for each of the seconds, each shape by itself."""
    ticks = max(1, round(seconds * TICKS_PER_S / BLOCKS))
    b_us = bare_tick_us()
    raw = [draw_key(1, "noise", f"robot{n}", "sensor") for n in range(max(streams for streams, _ in SHAPES))]
    batches = []
    for streams, width in SHAPES:
        keys = NoiseKeys(raw[:streams])
        took_us = _median_us(_draw(keys, width), ticks)
        values = streams * width
        batches.append(Batch(streams, width, round(took_us, 1), round(took_us / values, 3), round(took_us / b_us, 2)))
    alone, key = NoiseKey(raw[0]), raw[0]
    return Noise(
        round(b_us, 1),
        batches,
        round(_median_us(lambda tick: alone.normal(tick, 1), 50 * ticks), 2),
        round(_median_us(lambda tick: gaussian(draw_words(key, tick)[0]), 50 * ticks), 2),
        round(_median_us(lambda tick: [*map(gaussian, draw_words(key, tick))], 50 * ticks) / 8, 2),
        round(LIMIT_US * b_us / LIMIT_B_US, 3),
    )


def _draw(keys: NoiseKeys, width: int) -> Callable[[int], object]:
    return lambda tick: keys.normal(tick, width)


def _median_us(draw: Callable[[int], object], ticks: int) -> float:
    """Return the time of a tick in us: the median over blocks."""
    draw(0)
    blocks = []
    for block in range(BLOCKS):
        begun_ns = time.perf_counter_ns()
        for tick in range(block * ticks, (block + 1) * ticks):
            draw(tick)
        blocks.append((time.perf_counter_ns() - begun_ns) / 1e3 / ticks)
    return median(blocks)


def lines(found: Noise) -> list[str]:
    """Return the figures for people."""
    rows = [
        f"{batch.streams:5} streams x {batch.width:3} values {batch.batch_us:8.1f} us, {batch.batch_b:5.2f} b"
        f"{batch.value_us:9.3f} us a value"
        + (f" (to stay below {found.limit_us:.3f})" if (batch.streams, batch.width) == LIMITED else "")
        for batch in found.batches
    ]
    return [
        f"b {found.b_us:.0f} us",
        *rows,
        f"one value of one stream by itself {found.single_us:.2f} us",
        f"by draw_words and gaussian {found.blake2b_us:.2f} us, {found.blake2b_of_8_us:.2f} us of eight",
    ]

"""Keyed noise in batches: words, uniform and normal numbers of many streams at one tick, or of one stream by itself.

A stream is a purpose: `draw_key(seed, "noise", robot, component)`. A value is a function of (key, counter, slot, place)
and of nothing else: not of the other streams in a batch, of their order or number, nor of how many values are drawn.

* `counter`: the tick, or the number of the sample; 0 to 2^64 - 1.
* `slot`: which draw of the component this is (its noise, its drop-out, its bias); 0 to 2^32 - 1. What a slot is for
  never changes, so that a further draw of a component shifts no other.
* place: which value of that draw, 0 to width - 1: an axis, a ray. A wider draw begins with those of a narrower one.

The words are those of Philox4x32-10 (`philox`). Its key is the first eight bytes of the draw key, little-endian. Its
counter is, in words of 32 bits: counter mod 2^32, counter / 2^32, place / 2, slot. Of the block's two words an even
place has the first, an odd place the second. Captures and digests depend on this layout: it never changes.

    keys = NoiseKeys([draw_key(seed, "noise", name, "imu") for name in robots])
    turned = rates + 0.01 * keys.normal(tick, width=3, slot=0)           # (robots, 3)
    alone = NoiseKey(draw_key(seed, "noise", "robot-7", "imu")).normal(tick, width=3, slot=0)    # its row, in a list

Neighbours: `foosim.common.keyed_random` has draws of eight words for one packet or event, from BLAKE2b.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from foosim.common.batched.exact_arrays import Floats
from foosim.common.batched.normal import normal_of_word, normal_of_words
from foosim.common.batched.philox import Lanes, Words, block, round_keys
from foosim.common.keyed_random import unit_interval

AHEAD: Final = 64
"""Draws of one stream that are made at once."""
_KEY: Final = struct.Struct("<Q")


def _philox_key(key: bytes) -> int:
    """Return the key of 64 bits that a draw key begins with."""
    word: int = _KEY.unpack_from(key)[0]
    return word


def _blocks_of(counter: int, width: int, slot: int) -> int:
    """Return how many blocks a draw takes of each stream."""
    assert 0 <= counter < 1 << 64, counter
    assert width > 0, width
    assert 0 <= slot < 1 << 32, slot
    return (width + 1) // 2


class NoiseKeys:
    """The streams of a batch, one for each row of draws."""

    def __init__(self, keys: Iterable[bytes]) -> None:
        """Take the draw keys of the streams, in the order of the rows."""
        self._keys: Words = np.array([_philox_key(key) for key in keys], np.uint64)
        self._prepared: dict[int, tuple[Lanes, Words | int]] = {}

    def __len__(self) -> int:
        """Return the number of streams."""
        return self._keys.size

    def taken(self, rows: NDArray[np.intp]) -> NoiseKeys:
        """Return the streams of some rows, to be kept where it is drawn from again: the first draw prepares keys."""
        some = NoiseKeys(())
        some._keys = self._keys[rows]
        return some

    def words(self, counter: int | Words, width: int, slot: int = 0) -> Words:
        """Return words of 64 bits, of shape (streams, width). The counter is one for all, or of shape (streams,)."""
        blocks = _blocks_of(0 if isinstance(counter, np.ndarray) else counter, width, slot)
        lanes, numbers = self._lanes(blocks)
        counters = np.tile(counter, blocks) if isinstance(counter, np.ndarray) else counter
        first, second = lanes.blocks(counters, numbers + (slot << 32))
        if width == 1:
            return first[:, np.newaxis]
        made = np.empty((len(self), width), np.uint64)
        made[:, ::2] = first.reshape(blocks, -1).T
        made[:, 1::2] = second.reshape(blocks, -1).T[:, : width // 2]
        return made

    def normal(self, counter: int | Words, width: int, slot: int = 0) -> Floats:
        """Return standard normal numbers, of shape (streams, width)."""
        return normal_of_words(self.words(counter, width, slot))

    def _lanes(self, blocks: int) -> tuple[Lanes, Words | int]:
        """Return a lane for each block of each stream, and the numbers of the blocks."""
        prepared = self._prepared.get(blocks)
        if prepared is None:
            numbers = np.repeat(np.arange(blocks, dtype=np.uint64), len(self)) if blocks > 1 else 0
            prepared = self._prepared[blocks] = Lanes(np.tile(self._keys, blocks)), numbers
        return prepared


class NoiseKey:
    """One stream: its draws are a row of those of `NoiseKeys`, bit for bit."""

    def __init__(self, key: bytes) -> None:
        """Take the draw key."""
        self._round_keys = round_keys(_philox_key(key))

    def words(self, counter: int, width: int, slot: int = 0) -> list[int]:
        """Return `width` words of 64 bits."""
        made: list[int] = []
        for number in range(_blocks_of(counter, width, slot)):
            made += block(self._round_keys, counter, slot << 32 | number)
        return made[:width]

    def uniform(self, counter: int, width: int, slot: int = 0) -> list[float]:
        """Return `width` numbers in [0, 1) of 53 bits."""
        return [unit_interval(word) for word in self.words(counter, width, slot)]

    def normal(self, counter: int, width: int, slot: int = 0) -> list[float]:
        """Return `width` standard normal numbers."""
        return [normal_of_word(word) for word in self.words(counter, width, slot)]


class NoiseAhead:
    """One stream at regular counters: with a draw those at the next ones are made, in a batch.

    Draws are those of `NoiseKey`, bit for bit, and functions of the counter alone: the cache only saves time. Of a
    pair of numbers it saves five sixths.
    """

    def __init__(self, key: bytes, width: int, step: int, slot: int = 0) -> None:
        """Take the draw key; how many numbers a draw has; the step from counter to counter; the slot."""
        assert step > 0, step
        self._key, self._width, self._step, self._slot = key, width, step, slot
        self._alone = NoiseKey(key)
        self._lanes: NoiseKeys | None = None
        self._first = 0
        self._rows: list[list[float]] = []

    def normal(self, counter: int) -> list[float]:
        """Return standard normal numbers."""
        place, rest = divmod(counter - self._first, self._step)
        if not rest and 0 <= place < len(self._rows):
            return self._rows[place]
        if self._rows and (rest or counter < self._first):
            return self._alone.normal(counter, self._width, self._slot)
        if self._lanes is None:
            self._lanes = NoiseKeys([self._key] * AHEAD)
        counters = np.uint64(counter) + np.arange(AHEAD, dtype=np.uint64) * np.uint64(self._step)
        self._first, self._rows = counter, self._lanes.normal(counters, self._width, self._slot).tolist()
        return self._rows[0]

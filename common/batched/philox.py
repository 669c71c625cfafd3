"""Philox4x32-10: a block of two 64-bit words as a function of a key of 64 bits and a counter of 128 bits.

Source: Salmon, Moraes, Dror, Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC11 (2011); the tests have the
known answers of its library, Random123. It passes BigCrush, takes any key, and needs products of 32 bits alone, which
numpy has. `block` makes one block from whole numbers of Python, `Lanes` many at once from arrays; both have the same
bits. The paper's words have 32 bits; here two of them are one of 64, the first its lower half.
"""

from __future__ import annotations

from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

Words: TypeAlias = NDArray[np.uint64]
RoundKeys: TypeAlias = tuple[tuple[int, int], ...]

ROUNDS: Final = 10
MULTIPLIERS: Final = (0xD2511F53, 0xCD9E8D57)
STEPS: Final = (0x9E3779B9, 0xBB67AE85)
"""The increments of a key from round to round: the fractions of the golden ratio and of the square root of 3."""
HALF: Final = 0xFFFFFFFF

# `Lanes` views a word of 64 bits as two of 32, the lower one first: so the order of its bytes is fixed.
_WORD: Final = np.dtype("<u8")
_HALF_WORD: Final = np.dtype("<u4")
_HALF_MASK: Final = np.array(HALF, _WORD)
_HALF_BITS: Final = np.array(32, _WORD)


def round_keys(key: int) -> RoundKeys:
    """Return the two words of 32 bits that each round takes from a key of 64 bits."""
    low, high = key & HALF, key >> 32
    return tuple(((low + n * STEPS[0]) & HALF, (high + n * STEPS[1]) & HALF) for n in range(ROUNDS))


def block(keys: RoundKeys, counter: int, further: int) -> tuple[int, int]:
    """Return the two words of a counter of 128 bits, of which `counter` is the lower half and `further` the upper."""
    left, low = counter & HALF, counter >> 32
    right, other_low = further & HALF, further >> 32
    first, second = MULTIPLIERS
    for key, other_key in keys:
        product, other_product = left * first, right * second
        left, low = (other_product >> 32) ^ low ^ key, other_product & HALF
        right, other_low = (product >> 32) ^ other_low ^ other_key, product & HALF
    return left | low << 32, right | other_low << 32


class Lanes:
    """Blocks of many keys at once, a lane each.

    A round of the paper multiplies two of a block's four words and exchanges the products. The first words of all lanes
    stand in an array, and behind them the second words in *reverse* order: so a reversed view exchanges the two, and
    each step of a round is one operation on arrays of one dimension. Up to some hundred lanes most of the time is that
    of starting operations, which takes three times as long where an array has rows.
    """

    def __init__(self, keys: Words) -> None:
        """Take the keys of the lanes, of shape (lanes,)."""
        self._lanes = keys.size
        multipliers, steps = np.repeat(np.array([MULTIPLIERS, STEPS], np.uint64), keys.size, axis=1)
        start = np.concatenate([keys & np.uint64(HALF), keys[::-1] >> np.uint64(32)])
        self._multipliers = multipliers.astype(_WORD)
        rounds = ((start + steps * np.uint64(n)) & np.uint64(HALF) for n in range(ROUNDS))
        self._round_keys = [round_key.astype(_WORD) for round_key in rounds]

    def blocks(self, counter: Words | int, further: Words | int) -> tuple[Words, Words]:
        """Return the first and the second words of the lanes' blocks, of shape (lanes,) each.

        `counter` and `further` are the lower and the upper halves of the counters: of shape (lanes,), or one for all.
        """
        lanes = self._lanes
        counters = np.empty(2 * lanes, _WORD)
        counters[:lanes], counters[lanes:][::-1] = further, counter
        words = counters[::-1] & _HALF_MASK
        lower = words.view(_HALF_WORD)[::2]
        old, new = counters >> _HALF_BITS, np.empty_like(counters)
        (old_high, old_low), (new_high, new_low) = _exchanged(old), _exchanged(new)
        for key in self._round_keys:
            np.multiply(words, self._multipliers, out=new)
            np.bitwise_xor(new_high, old_low, out=lower)
            np.bitwise_xor(words, key, out=words)
            old, old_high, old_low, new, new_high, new_low = new, new_high, new_low, old, old_high, old_low
        words |= old[::-1] << _HALF_BITS
        return words[:lanes], words[lanes:][::-1]


def _exchanged(products: Words) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
    """Return views of the upper and of the lower halves of products, first and second words exchanged."""
    halves = products.view(_HALF_WORD)[::-1]
    return halves[::2], halves[1::2]

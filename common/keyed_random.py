"""Keyed random draws: a number is a function of its purpose, never the next one of a running stream.

A key is made once for a purpose (`draw_key(seed, "link", source, destination)`); a draw takes the key and one or two
counters (a sequence number, a tick) and gives eight 64-bit words. So no draw depends on other draws,
on the order of arrival or on the caller. BLAKE2b (RFC 7693) gives the same words on every machine. The slots of a link
are named and permanent (`Slot`): switching one impairment on shifts no other.
"""

import struct
from enum import IntEnum
from hashlib import blake2b
from statistics import NormalDist
from typing import Final

_AS_WORDS: Final = struct.Struct("<8Q").unpack
_OF_COUNTERS: Final = struct.Struct("<QQ").pack
_KEYED: Final[dict[bytes, blake2b]] = {}
"""A hash state with the key: copying it costs half as much as creating it."""
_KEYED_MAX: Final = 65_536
_NORMAL = NormalDist()

HALF_WORD: Final = 2**-53
UNIT: Final = 2**64


class Slot(IntEnum):
    """The words of a link's draw and the purpose of each. Numbers are never reused."""

    LOSS = 0
    ERROR = 1
    JITTER = 2
    JITTER_STATE = 3
    DUPLICATE = 4
    CORRUPT = 5
    REORDER = 6
    BACKOFF = 7


def draw_key(seed: int, *purpose: str) -> bytes:
    """Return the 32-byte key of one purpose, e.g. `draw_key(1, "noise", "red.attack", "encoder")`."""
    hasher = blake2b(struct.pack("<Q", seed), digest_size=32, person=b"foosim draw")
    for part in purpose:
        raw = part.encode()
        hasher.update(struct.pack("<I", len(raw)) + raw)
    return hasher.digest()


def draw_words(key: bytes, counter: int, copy: int = 0) -> tuple[int, ...]:
    """Return the eight 64-bit words of `counter` (and `copy`) under `key`."""
    keyed = _KEYED.get(key)
    if keyed is None:
        if len(_KEYED) >= _KEYED_MAX:
            _KEYED.clear()
        keyed = _KEYED[key] = blake2b(key=key)
    hasher = keyed.copy()
    hasher.update(_OF_COUNTERS(counter, copy))
    return _AS_WORDS(hasher.digest())


def unit_interval(word: int) -> float:
    """Return a float in [0, 1) from the 53 upper bits of a word."""
    return (word >> 11) * HALF_WORD


def gaussian(word: int) -> float:
    """Return a standard normal number: the inverse distribution function at the middle of the word's 2^-53 cell.

    Source: Wichura, "Algorithm AS241", Applied Statistics 37 (1988), as `statistics.NormalDist.inv_cdf` has it.
    """
    return _NORMAL.inv_cdf(((word >> 12) + 0.5) * 2**-52)


def chance_threshold(probability: float) -> int:
    """Return the integer t for which `word < t` has the given probability, so that verdicts compare integers."""
    assert 0.0 <= probability <= 1.0, probability
    return int(probability * UNIT)

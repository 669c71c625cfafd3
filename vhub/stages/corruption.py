"""Corruption: bit errors that no code corrects, and duplicated packets.

The number of flipped bits is binomial, at least 1 in a packet with errors; their places come from further blocks of
the packet's own draws, so that a replay flips the same bits.
"""

from __future__ import annotations

from functools import lru_cache
from math import sqrt
from typing import Final

from foosim.common.keyed_random import UNIT, Slot, chance_threshold
from foosim.vhub.network.link_context import LinkSetup
from foosim.vhub.network.packet import Flight
from foosim.vhub.network.series_math import exp, ln, ln_gamma
from foosim.vhub.stages.explanation import Explanation, Seen, beside
from foosim.vhub.stages.stage import Stage

CRC_FAIL: Final = "crc_fail"
FLIP_BLOCK: Final = 1024
"""The blocks of a packet's draws from here on select the flipped bits."""
MEAN_SMALL: Final = 400.0
DEVIATIONS: Final = 12.0
"""Fewer flipped bits than the mean less this many deviations: less likely than 2^-64."""


@lru_cache(maxsize=1_024)
def error_threshold(bit_error_rate: float, bits: int) -> int:
    """Return the probability of any error in a number of bits, in units of 2^-64."""
    return chance_threshold(1.0 - exp(bits * ln(1.0 - bit_error_rate)))


class Corruption(Stage):
    """Flips bits of a packet, or drops it for them; decides whether it is duplicated."""

    def __init__(self, setup: LinkSetup) -> None:
        self._setup = setup
        corrupt = setup.settings.corrupt
        self._error_rate = 0.0 if corrupt is None else corrupt.bit_error_rate
        self._delivers = corrupt is not None and corrupt.deliver
        self._doubled = chance_threshold(setup.settings.duplicate)

    @classmethod
    def for_link(cls, setup: LinkSetup) -> Corruption | None:
        settings = setup.settings
        errors = settings.corrupt is not None and settings.corrupt.bit_error_rate > 0.0
        return cls(setup) if errors or settings.duplicate > 0.0 else None

    def at_sending(self, flight: Flight) -> str:
        words, bits = flight.words, 8 * flight.size
        if self._error_rate and bits and words[Slot.CORRUPT] < error_threshold(self._error_rate, bits):
            if not self._delivers:
                return CRC_FAIL
            self._flip(flight, bits)
        if flight.copy == 0 and words[Slot.DUPLICATE] < self._doubled:
            flight.is_doubled = True
            self._setup.memory.copies += 1
        return ""

    def explain(self, seen: Seen, note: Explanation) -> None:
        row, words = seen.row, seen.flight.words
        note.facts["bits_flipped"] = row.bits_flipped
        parts = []
        if seen.settings.corrupt is not None:
            rate, bits, draw = self._error_rate, 8 * row.size, words[Slot.CORRUPT]
            threshold = error_threshold(self._error_rate, bits) if rate else 0
            flipped = "some" if row.cause == CRC_FAIL else str(row.bits_flipped)
            note.facts |= {"error_rate": threshold / UNIT, "error_draw": draw / UNIT}
            parts.append(f"{flipped} bits flipped: {beside(draw, threshold)}, {rate:g} a bit in {bits}")
        if self._doubled and row.copy == 0 and row.cause != CRC_FAIL:
            draw = words[Slot.DUPLICATE]
            copied = "a copy" if draw < self._doubled else "no copy"
            parts.append(f"{copied}: draw {draw / UNIT:g}, {seen.settings.duplicate:g}")
        note.text = ", ".join(parts) or "a copy is not copied again"

    def _flip(self, flight: Flight, bits: int) -> None:
        """Flip as many bits of the payload as of the `bits` that the network carries, or all it has."""
        count, bits = self._count(flight.words[Slot.CORRUPT], bits), 8 * len(flight.payload)
        count = min(bits, count)
        places: set[int] = set()
        block = FLIP_BLOCK
        while len(places) < count:
            for word in self._setup.words(flight, block):
                if len(places) < count:
                    places.add(word * bits // UNIT)
            block += 1
        payload = bytearray(flight.payload)
        for place in places:
            payload[place >> 3] ^= 1 << (place & 7)
        flight.mangled, flight.bits_flipped = bytes(payload), count

    def _count(self, word: int, bits: int) -> int:
        """Return the number of flipped bits, given that it is not 0: the binomial law."""
        rate = self._error_rate
        odds = rate / (1.0 - rate)
        count = self._least(bits)
        ln_ways = ln_gamma(bits + 1.0) - ln_gamma(count + 1.0) - ln_gamma(bits - count + 1.0)
        chance = below = exp(ln_ways + count * ln(rate) + (bits - count) * ln(1.0 - rate))
        while word >= chance_threshold(min(1.0, below)) and count < bits:
            chance *= (bits - count) / (count + 1) * odds
            count += 1
            if below + chance == below:
                break
            below += chance
        return count

    def _least(self, bits: int) -> int:
        """Return from which count on the law is looked at: 1, unless no float is as small as what it has there."""
        mean = bits * self._error_rate
        return 1 if mean < MEAN_SMALL else max(1, int(mean - DEVIATIONS * sqrt(mean)))

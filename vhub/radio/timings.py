"""Constants of media: slots, spaces between frames, contention windows, preambles; each set names its source.

Times are in nanoseconds, `cw_*` in slots (the draw is uniform in 0 to cw), retries are attempts after the first.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final

US: Final = 1_000


@dataclass(frozen=True)
class WifiTiming:
    """An 802.11 channel as one access category sees it."""

    source: str
    slot_ns: int
    sifs_ns: int
    preamble_ns: int
    """Training and SIGNAL field of a legacy OFDM frame."""
    symbol_ns: int
    signal_extension_ns: int = 0
    """Silence at the end of every OFDM frame at 2.4 GHz."""
    aifsn: int = 2
    """Slots of silence before backoff, after SIFS; 2 is DIFS, the distributed coordination function's."""
    cw_min: int = 15
    cw_max: int = 1023
    retries: int = 7

    def __hash__(self) -> int:
        """Of two fields: tables are keyed by it for every frame."""
        return self.slot_ns + self.aifsn

    @property
    def difs_ns(self) -> int:
        """The silence before backoff: SIFS and `aifsn` slots."""
        return self.sifs_ns + self.aifsn * self.slot_ns


WIFI_2_4: Final = WifiTiming(
    "IEEE 802.11 ERP-OFDM with short slots; retries as in ns-3",
    slot_ns=9 * US,
    sifs_ns=10 * US,
    preamble_ns=20 * US,
    symbol_ns=4 * US,
    signal_extension_ns=6 * US,
)
WIFI_5: Final = WifiTiming(
    "IEEE 802.11 OFDM, 20 MHz; retries as in ns-3",
    slot_ns=9 * US,
    sifs_ns=16 * US,
    preamble_ns=20 * US,
    symbol_ns=4 * US,
)
DOT11P: Final = WifiTiming(
    "IEEE 802.11 OFDM, 10 MHz (outside the context of a basic service set)",
    slot_ns=13 * US,
    sifs_ns=32 * US,
    preamble_ns=40 * US,
    symbol_ns=8 * US,
)

CATEGORIES: Final[Mapping[str, tuple[int, int, int]]] = MappingProxyType(
    {
        "best_effort": (3, 15, 1023),
        "video": (2, 7, 15),
        "voice": (2, 3, 7),
    }
)
"""AIFSN, cw_min and cw_max of the access categories of 802.11 that a radio may have, with cw_min 15.

Source: ns-3's wifi-mac (best effort and voice were read there; video is recalled, unverified).
"""
DOT11P_CATEGORIES: Final[Mapping[str, tuple[int, int, int]]] = MappingProxyType(
    {
        "best_effort": (6, 15, 1023),
        "video": (3, 7, 15),
        "voice": (2, 3, 7),
    }
)
"""The same outside the context of a basic service set, recalled from IEEE 802.11, unverified."""


def with_category(timing: WifiTiming, category: tuple[int, int, int]) -> WifiTiming:
    """Return the timing of the same channel for an access category, a value of CATEGORIES or DOT11P_CATEGORIES."""
    aifsn, cw_min, cw_max = category
    return replace(timing, aifsn=aifsn, cw_min=cw_min, cw_max=cw_max)


@dataclass(frozen=True)
class LrwpanTiming:
    """IEEE 802.15.4, unslotted, at 2.4 GHz: symbols of 16 us, two symbols a byte."""

    source: str = "IEEE 802.15.4-2006 O-QPSK at 2.4 GHz; constants as in ns-3's lr-wpan"
    byte_ns: int = 32 * US
    unit_backoff_ns: int = 320 * US
    cca_ns: int = 128 * US
    turnaround_ns: int = 192 * US
    phy_bytes: int = 6
    """Preamble, delimiter and length."""
    ack_bytes: int = 11
    """With `phy_bytes`."""
    be_min: int = 3
    be_max: int = 5
    backoffs: int = 4
    """Busy channels after the first that are put up with before access fails."""
    retries: int = 3

    def __hash__(self) -> int:
        """Of one field: tables are keyed by it for every frame."""
        return self.byte_ns


LRWPAN: Final = LrwpanTiming()

LORA_PREAMBLE_SYMBOLS: Final = 8
LORA_BANDWIDTH_HZ: Final = 125_000
LORA_DUTY_CYCLES: Final[tuple[tuple[int, int, float], ...]] = (
    (868_000_000, 868_600_000, 0.01),
    (868_700_000, 869_200_000, 0.001),
    (869_400_000, 869_650_000, 0.1),
)
"""From and to (Hz), and the share of time for which one may send, in the EU. Source: ns-3 module lorawan."""

"""How long a frame is on the air or on a wire, in whole nanoseconds, rounded up. Sizes are in bytes."""

from __future__ import annotations

from functools import lru_cache
from typing import Final

from foosim.vhub.radio.errors import MODES
from foosim.vhub.radio.timings import (
    LORA_BANDWIDTH_HZ,
    LORA_PREAMBLE_SYMBOLS,
    LRWPAN,
    LrwpanTiming,
    WifiTiming,
)

WIFI_OVERHEAD_BYTES: Final = 36
"""Header of a data frame 24, logical link control 8, check sequence 4."""
WIFI_ACK_BYTES: Final = 14
LRWPAN_OVERHEAD_BYTES: Final = 25
"""What 802.15.4 takes of the 127 bytes of a frame, with 64-bit addresses: 102 are left."""
_SERVICE_BITS: Final = 16
_TAIL_BITS: Final = 6
_HT_PREAMBLE_SYMBOLS: Final = 4
"""HT-SIG, HT-STF and one HT-LTF after the legacy preamble (mixed format, one stream)."""


def _ceil(numerator: int, denominator: int) -> int:
    return -(-numerator // denominator)


def _ofdm_ns(timing: WifiTiming, mac_bytes: int, bits: int, extra_symbols: int = 0) -> int:
    symbols = _ceil(_SERVICE_BITS + 8 * mac_bytes + _TAIL_BITS, bits) + extra_symbols
    return timing.preamble_ns + symbols * timing.symbol_ns + timing.signal_extension_ns


@lru_cache(maxsize=65_536)
def wifi_airtime_ns(mode: str, size_bytes: int, timing: WifiTiming) -> int:
    """Return the duration of a data frame with `size_bytes` of payload: preamble, then whole OFDM symbols.

    `mode` is one of 802.11 in `errors.MODES`: with `timings.WIFI_2_4`, `WIFI_5` or `DOT11P`.
    """
    known = MODES[mode]
    extra = _HT_PREAMBLE_SYMBOLS if known.family == "ht" else 0
    return _ofdm_ns(timing, size_bytes + WIFI_OVERHEAD_BYTES, known.bits, extra)


@lru_cache(maxsize=1_024)
def wifi_ack_ns(mode: str, timing: WifiTiming) -> int:
    """Return the duration of the acknowledgement of a frame in `mode`, at the highest mandatory rate not above it."""
    return _ofdm_ns(timing, WIFI_ACK_BYTES, MODES[mode].control_bits)


def lrwpan_airtime_ns(size_bytes: int, timing: LrwpanTiming = LRWPAN) -> int:
    """Return the duration of an 802.15.4 frame with `size_bytes` of payload, with MAC and physical headers."""
    return (size_bytes + LRWPAN_OVERHEAD_BYTES + timing.phy_bytes) * timing.byte_ns


@lru_cache(maxsize=65_536)
def lora_airtime_ns(
    factor: int,
    size_bytes: int,
    bandwidth_hz: int = LORA_BANDWIDTH_HZ,
    coding_rate: int = 1,
    preamble_symbols: int = LORA_PREAMBLE_SYMBOLS,
) -> int:
    """Return LoRa's time on air with explicit header and checksum; `coding_rate` 1 to 4 stands for 4/5 to 4/8.

    Low data rate optimisation is on where a symbol is longer than 16 ms. Source: Semtech, SX1272 modem designer's
    guide.
    """
    chips = 1 << factor
    optimised = 2 if chips * 1_000 > 16 * bandwidth_hz else 0
    groups = max(_ceil(8 * size_bytes - 4 * factor + 28 + 16, 4 * (factor - optimised)), 0)
    quarters = 4 * preamble_symbols + 17 + 4 * (8 + groups * (coding_rate + 4))
    return _ceil(quarters * chips * 1_000_000_000, 4 * bandwidth_hz)


def serialisation_ns(size_bytes: int, rate_bps: int) -> int:
    """Return how long a wire of `rate_bps` takes for `size_bytes`, headers included by the caller."""
    return _ceil(8_000_000_000 * size_bytes, rate_bps)

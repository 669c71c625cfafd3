"""Whether a frame of some size gets through: error probabilities by signal to noise ratio, as thresholds for a draw.

A ratio is given in whole hundredths of a dB and an answer is an integer t: the frame is in error when its 64-bit word
is below t. So the last bit of a mathematical library decides nothing, but for one draw in 2^50. Sizes are of the whole
transmission: the payload plus the headers that the medium adds (`airtime.WIFI_OVERHEAD_BYTES` and its like).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import erfc, exp, expm1, log1p, log2, sqrt
from types import MappingProxyType
from typing import Final, Literal

from foosim.common.keyed_random import UNIT

Family = Literal["ofdm", "ht", "ofdm10", "oqpsk"]

SNR_MIN: Final = -3_000
SNR_MAX: Final = 6_000
"""In hundredths of a dB: beyond these nothing changes any more."""
GOOD_PER: Final = 0.1
"""What rate control puts up with."""


@dataclass(frozen=True)
class Mode:
    """A modulation with its code. `bits` are those of data in one OFDM symbol; `points` of the constellation."""

    name: str
    family: Family
    rate_bps: int
    points: int
    code: str
    bits: int

    @property
    def control_bits(self) -> int:
        """Of the frame that answers it: the highest mandatory rate (6, 12, 24 Mb/s) up to its own."""
        if self.points == 2:
            return 24
        return 48 if self.points == 4 else 96


SPECTRA: Final[Mapping[str, tuple[int, int, int, tuple[int, ...]]]] = MappingProxyType(
    {
        "1/2": (1, 10, 2, (36, 211, 1404, 11633, 77433, 502690, 3322763, 21292910, 134365911)),
        "2/3": (2, 6, 1, (3, 70, 285, 1276, 6160, 27128, 117019, 498860, 2103891, 8784123)),
        "3/4": (3, 5, 1, (42, 201, 1492, 10469, 62935, 379644, 2253373, 13073811, 75152755, 428005675)),
        "5/6": (5, 4, 1, (92, 528, 8694, 79453, 792114, 7375573, 67884974, 610875423, 5427275376, 47664215639)),
    }
)
"""Of the punctured convolutional codes: bits a branch, least weight, step of the weights, bit errors at each weight.

Source: Frenger et al., "Multi-rate convolutional codes" (1998), and Haccoun and Begin (1984) for 5/6, as the NIST model
in ns-3 takes them.
"""
_OFDM: Final = (
    ("6", 6_000_000, 2, "1/2", 24),
    ("9", 9_000_000, 2, "3/4", 36),
    ("12", 12_000_000, 4, "1/2", 48),
    ("18", 18_000_000, 4, "3/4", 72),
    ("24", 24_000_000, 16, "1/2", 96),
    ("36", 36_000_000, 16, "3/4", 144),
    ("48", 48_000_000, 64, "2/3", 192),
    ("54", 54_000_000, 64, "3/4", 216),
)
_HT: Final = ((2, "1/2"), (4, "1/2"), (4, "3/4"), (16, "1/2"), (16, "3/4"), (64, "2/3"), (64, "3/4"), (64, "5/6"))
_HT_BITS: Final = (26, 52, 78, 104, 156, 208, 234, 260)
_BINOMIALS: Final[tuple[int, ...]] = (
    *(120, -560, 1820, -4368, 8008, -11440, 12870, -11440),
    *(8008, -4368, 1820, -560, 120, -16, 1),
)
"""(-1)^k C(16, k) for k = 2 to 16."""


def _modes() -> list[Mode]:
    ofdm = [Mode(f"ofdm_{name}", "ofdm", rate, points, code, bits) for name, rate, points, code, bits in _OFDM]
    half = [
        Mode(f"ofdm10_{rate / 2e6:g}", "ofdm10", rate // 2, points, code, bits) for _, rate, points, code, bits in _OFDM
    ]
    ht = [
        Mode(f"ht_mcs{index}", "ht", bits * 250_000, points, code, bits)
        for index, ((points, code), bits) in enumerate(zip(_HT, _HT_BITS, strict=True))
    ]
    return [*ofdm, *ht, *half, Mode("oqpsk_250", "oqpsk", 250_000, 16, "", 0)]


MODES: Final[Mapping[str, Mode]] = MappingProxyType({mode.name: mode for mode in _modes()})
WIFI_MODES: Final = tuple(mode.name for mode in MODES.values() if mode.family == "ofdm")
HT_MODES: Final = tuple(mode.name for mode in MODES.values() if mode.family == "ht")
DOT11P_MODES: Final = tuple(mode.name for mode in MODES.values() if mode.family == "ofdm10")
DOT11N_MODES: Final = ("ofdm_6", *HT_MODES)
"""Each in order of rising rate, as `frames.WifiFrames` wants it. The first is that of broadcasts; 802.11n's is one of
old."""


def _bit_error(points: int, snr: float) -> float:
    """Of an uncoded bit in a Gray-coded constellation. Source: NIST, as in ns-3's error rate model."""
    if points == 2:
        return 0.5 * erfc(sqrt(snr))
    if points == 4:
        return 0.5 * erfc(sqrt(snr / 2.0))
    side = sqrt(points)
    return (side - 1.0) / (side * log2(side)) * erfc(sqrt(1.5 * snr / (points - 1.0)))


def _decoded_error(code: str, p: float) -> float:
    """The union bound of the Viterbi decoder's error rate with hard decisions, at most 1."""
    branch, weight, step, errors = SPECTRA[code]
    root = sqrt(4.0 * p * (1.0 - p))
    factor = root * root if step == 2 else root
    power = 1.0
    for _ in range(weight):
        power *= root
    total = 0.0
    for count in errors:
        total += count * power
        power *= factor
    return min(total / (2.0 * branch), 1.0)


def _oqpsk_error(snr: float) -> float:
    """Of a bit of 802.15.4 at 2.4 GHz: 16 orthogonal symbols. Source: IEEE 802.15.4 annex E, as in ns-3's lr-wpan."""
    total = 0.0
    for k, binomial in enumerate(_BINOMIALS, 2):
        total += binomial * exp(20.0 * snr * (1.0 / k - 1.0))
    return min(max(8.0 / 15.0 / 16.0 * total, 0.0), 1.0)


@lru_cache(maxsize=65_536)
def _bit_failure(mode: str, snr_centi_db: int) -> float:
    """The probability that a bit after decoding starts an error."""
    known = MODES[mode]
    snr = 10.0 ** (snr_centi_db / 1000.0)
    if known.family == "oqpsk":
        return _oqpsk_error(snr)
    return _decoded_error(known.code, _bit_error(known.points, snr))


@lru_cache(maxsize=262_144)
def per_threshold(mode: str, snr_centi_db: int, size_bytes: int) -> int:
    """Return the t in 0 to 2^64 for which `word < t` means that a frame of `size_bytes` is in error.

    `mode` is a name of MODES; the ratio is in hundredths of a dB, over the noise in the mode's bandwidth. The error
    probability is 1 - (1 - p)^(8 size).
    """
    bit = _bit_failure(mode, min(max(snr_centi_db, SNR_MIN), SNR_MAX))
    if bit >= 1.0:
        return UNIT
    return int(-expm1(8 * size_bytes * log1p(-bit)) * UNIT)


def snr_needed(mode: str, size_bytes: int, per: float = GOOD_PER) -> int:
    """Return the least ratio, in hundredths of a dB, with at most `per` errors: from there on there are fewer."""
    low, high, most = SNR_MIN, SNR_MAX, int(per * UNIT)
    while low < high:
        middle = (low + high) // 2
        if per_threshold(mode, middle, size_bytes) <= most:
            high = middle
        else:
            low = middle + 1
    return low


# --- LoRa: a receiver's floor, and what other spreading factors leave of it -----------------------------------------

LORA_FACTORS: Final = (7, 8, 9, 10, 11, 12)
LORA_SENSITIVITY_DBM: Final[tuple[float, ...]] = (-124.0, -127.0, -130.0, -133.0, -135.0, -137.0)
"""Of a device, by spreading factor 7 to 12 at 125 kHz. Source: SX1272 datasheet, as in the ns-3 module lorawan."""
LORA_GATEWAY_SENSITIVITY_DBM: Final[tuple[float, ...]] = (-130.0, -132.5, -135.0, -137.5, -140.0, -142.5)
"""Of a gateway. Source: SX1301 datasheet, as in the ns-3 module lorawan."""
LORA_ISOLATION_DB: Final = (
    (6, -16, -18, -19, -19, -20),
    (-24, 6, -20, -22, -22, -22),
    (-27, -27, 6, -23, -25, -25),
    (-30, -30, -30, 6, -26, -28),
    (-33, -33, -33, -33, 6, -29),
    (-36, -36, -36, -36, -36, 6),
)
"""Least ratio of the signal (row) to interference (column), dB. Source: Goursaud and Gorce (2015), as in lorawan."""


def lora_received(factor: int, power_dbm: float, at_gateway: bool = False) -> bool:
    """Return whether a frame of a spreading factor is strong enough for the receiver, without interference."""
    floors = LORA_GATEWAY_SENSITIVITY_DBM if at_gateway else LORA_SENSITIVITY_DBM
    return power_dbm >= floors[factor - 7]


def lora_interferer(factor: int, power_dbm: float, interference_dbm: Sequence[float | None]) -> int:
    """Return the spreading factor of the interference that destroys a frame, the lowest; 0 when it survives all.

    `interference_dbm` has, for each spreading factor from 7 on, the sum of the received powers of all that overlap with
    the frame, however briefly; None where nothing does.
    """
    for other, (interference, isolation_db) in enumerate(
        zip(interference_dbm, LORA_ISOLATION_DB[factor - 7], strict=True), LORA_FACTORS[0]
    ):
        if interference is not None and power_dbm - interference < isolation_db:
            return other
    return 0


# --- LTE: a truncated Shannon curve, and retransmissions that turn loss into delay ----------------------------------

LTE_FLOOR_CENTI_DB: Final = -1_000
LTE_ALPHA: Final = {"down": 0.6, "up": 0.4}
LTE_MAX_BPS_HZ: Final = {"down": 4.4, "up": 2.0}
"""Share of Shannon's capacity, and its upper end. Source: 3GPP TR 36.942 A.2, recalled, unverified."""
HARQ_ROUND_NS: Final = 8_000_000
HARQ_ATTEMPTS: Final = 4
_HARQ: Final[tuple[int, ...]] = (UNIT // 10, UNIT // 100, UNIT // 1_000, UNIT // 10_000)
"""The first transmission fails with 10 %, and so does each repetition. Recalled, unverified."""


@lru_cache(maxsize=65_536)
def lte_rate_bps(snr_centi_db: int, bandwidth_hz: int, direction: Literal["down", "up"]) -> int:
    """Return the bit rate alpha B lg2(1 + SNR), at most its upper end; 0 below -10 dB, where the cell is lost."""
    if snr_centi_db < LTE_FLOOR_CENTI_DB:
        return 0
    efficiency = LTE_ALPHA[direction] * log2(1.0 + 10.0 ** (snr_centi_db / 1000.0))
    return int(bandwidth_hz * min(efficiency, LTE_MAX_BPS_HZ[direction]))


def lte_harq(word: int) -> tuple[int, bool]:
    """Return how often a block was sent again, and whether it was lost for all that; each time costs HARQ_ROUND_NS."""
    failures = 0
    while failures < HARQ_ATTEMPTS and word < _HARQ[failures]:
        failures += 1
    return min(failures, HARQ_ATTEMPTS - 1), failures == HARQ_ATTEMPTS

"""Airtime (T16, T17): Wi-Fi by symbols, 802.15.4 by bytes, LoRa by its modem guide, wires by their rate; all exact."""

from __future__ import annotations

from math import ceil
from typing import get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from foosim.deployment.network.radios import Radio
from foosim.vhub.radio.airtime import (
    lora_airtime_ns,
    lrwpan_airtime_ns,
    wifi_ack_ns,
    wifi_airtime_ns,
)
from foosim.vhub.radio.errors import DOT11P_MODES, HT_MODES, WIFI_MODES
from foosim.vhub.radio.timings import (
    CATEGORIES,
    DOT11P,
    DOT11P_CATEGORIES,
    LRWPAN,
    WIFI_2_4,
    WIFI_5,
    with_category,
)
from tests.links.proof import Proof


@given(size=st.integers(0, 2304), index=st.integers(0, 7))
def test_frames_by_the_formula(size: int, index: int) -> None:
    mbps = (6, 9, 12, 18, 24, 36, 48, 54)[index]
    symbols = ceil((16 + 8 * (size + 36) + 6) / (mbps * 4))
    assert wifi_airtime_ns(WIFI_MODES[index], size, WIFI_5) == 20_000 + 4_000 * symbols
    assert wifi_airtime_ns(WIFI_MODES[index], size, WIFI_2_4) == 26_000 + 4_000 * symbols, "signal extension"
    assert wifi_airtime_ns(DOT11P_MODES[index], size, DOT11P) == 40_000 + 8_000 * symbols, "twice as long at 10 MHz"
    ht = (6.5, 13, 19.5, 26, 39, 52, 58.5, 65)[index]
    symbols = ceil((16 + 8 * (size + 36) + 6) / (ht * 4))
    assert wifi_airtime_ns(HT_MODES[index], size, WIFI_5) == 36_000 + 4_000 * symbols


def test_acknowledgements() -> None:
    """134 bits at 6, 12 or 24 Mb/s: 23, 3 x 48, 2 x 96 bits a symbol."""
    assert [wifi_ack_ns(mode, WIFI_5) // 1000 for mode in WIFI_MODES] == [44, 44, 32, 32, 28, 28, 28, 28]
    assert [wifi_ack_ns(mode, WIFI_5) // 1000 for mode in HT_MODES] == [44, 32, 32, 28, 28, 28, 28, 28]
    assert wifi_ack_ns("ofdm_24", WIFI_2_4) == 34_000
    assert [wifi_ack_ns(mode, DOT11P) // 1000 for mode in DOT11P_MODES[:3]] == [88, 88, 64]


def test_spaces_between_frames() -> None:
    assert [timing.difs_ns for timing in (WIFI_2_4, WIFI_5, DOT11P)] == [28_000, 34_000, 58_000]
    best_effort, voice = (with_category(WIFI_5, CATEGORIES[name]) for name in ("best_effort", "voice"))
    assert (best_effort.difs_ns, best_effort.cw_min, best_effort.cw_max) == (43_000, 15, 1023)
    assert (voice.difs_ns, voice.cw_min, voice.cw_max) == (34_000, 3, 7)
    assert with_category(DOT11P, DOT11P_CATEGORIES["best_effort"]).difs_ns == 110_000
    assert CATEGORIES.keys() == DOT11P_CATEGORIES.keys() == {*get_args(Radio.model_fields["access"].annotation)}


def test_802154() -> None:
    """32 us a byte; sensing 128, turnaround 192 before the frame and before the acknowledgement of 11 bytes."""
    assert lrwpan_airtime_ns(102) == (127 + 6) * 32_000, "the longest frame"
    assert lrwpan_airtime_ns(50) == 81 * 32_000
    # With the mean of 3.5 backoff periods, and the turnaround back to listening, 84 kb/s.
    sent = LRWPAN.cca_ns + LRWPAN.turnaround_ns + lrwpan_airtime_ns(50)
    acknowledged = LRWPAN.turnaround_ns + LRWPAN.ack_bytes * LRWPAN.byte_ns
    cycle = sent + acknowledged + 3.5 * LRWPAN.unit_backoff_ns + LRWPAN.turnaround_ns
    assert cycle == 4_768_000 and 50 * 8e9 / cycle == pytest.approx(84e3, rel=0.005)


def test_lora(proof: Proof) -> None:
    """20 bytes at 125 kHz, 4/5, 8 symbols of preamble, worked out by the modem designer's guide."""
    expected = [56.576, 102.912, 185.344, 370.688, 741.376, 1318.912]
    airtime_ms = [lora_airtime_ns(factor, 20) / 1e6 for factor in range(7, 13)]
    proof.exact("T17", "time on air of 20 B, spreading factors 7 to 12, ms", airtime_ms, expected, 6)


@given(
    factor=st.integers(7, 12),
    size=st.integers(0, 255),
    bandwidth=st.sampled_from([125_000, 250_000, 500_000]),
    rate=st.integers(1, 4),
    preamble=st.integers(6, 20),
)
def test_lora_by_the_formula(factor: int, size: int, bandwidth: int, rate: int, preamble: int) -> None:
    symbol = 2**factor / bandwidth
    de = 1 if symbol > 0.016 else 0
    payload = 8 + max(ceil((8 * size - 4 * factor + 28 + 16) / (4 * (factor - 2 * de))) * (rate + 4), 0)
    seconds = (preamble + 4.25 + payload) * symbol
    assert lora_airtime_ns(factor, size, bandwidth, rate, preamble) == pytest.approx(seconds * 1e9, abs=1.0)

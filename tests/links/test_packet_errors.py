"""Noise and packet errors (T19): against ns-3's vectors (T28), the formulas worked out here; they never turn back."""

from __future__ import annotations

from itertools import pairwise, permutations
from math import comb, erfc, exp, log2, log10, sqrt
from typing import Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from foosim.common.keyed_random import UNIT
from foosim.vhub.radio.airtime import wifi_ack_ns, wifi_airtime_ns
from foosim.vhub.radio.errors import (
    DOT11P_MODES,
    HT_MODES,
    LORA_GATEWAY_SENSITIVITY_DBM,
    LORA_SENSITIVITY_DBM,
    MODES,
    WIFI_MODES,
    lora_interferer,
    lora_received,
    lte_harq,
    lte_rate_bps,
    per_threshold,
    snr_needed,
)
from foosim.vhub.radio.frames import WifiFrames
from foosim.vhub.radio.noise import level_of, noise_dbm, ratio_cdb, units_of
from foosim.vhub.radio.timings import WIFI_5
from tests.links.proof import Proof
from tests.links.statistics import Z_ALPHA, binomial_z

# Share of frames of 2000 bytes that get through, by Mb/s and dB: numbers of ns-3's wifi-error-rate-models test (NIST).
NS3: Final = {
    ("ofdm_6", 2.5): (2.04e-10, 1e-10),
    ("ofdm_6", 3.0): (0.020, 0.001),
    ("ofdm_6", 4.0): (0.885, 0.001),
    ("ofdm_6", 5.0): (0.997, 0.001),
    ("ofdm_9", 6.0): (0.097, 0.001),
    ("ofdm_9", 7.0): (0.918, 0.001),
    ("ofdm_12", 6.0): (0.0174, 0.001),
    ("ofdm_12", 7.0): (0.881, 0.001),
    ("ofdm_18", 8.5): (2.85e-6, 1e-6),
    ("ofdm_18", 9.5): (0.623, 0.001),
    ("ofdm_24", 13.0): (0.495, 0.001),
    ("ofdm_24", 14.0): (0.974, 0.001),
    ("ofdm_36", 15.5): (0.012, 0.001),
    ("ofdm_36", 16.5): (0.818, 0.001),
    ("ofdm_48", 20.0): (1.3e-4, 1e-4),
    ("ofdm_48", 21.0): (0.649, 0.001),
    ("ofdm_54", 21.0): (5.44e-8, 1e-8),
    ("ofdm_54", 22.0): (0.410, 0.001),
    ("ofdm_54", 23.0): (0.958, 0.001),
}


def per(mode: str, snr_db: float, size_bytes: int) -> float:
    return per_threshold(mode, round(snr_db * 100), size_bytes) / UNIT


@pytest.mark.parametrize(("mode", "snr_db"), NS3)
def test_vectors_of_ns3(proof: Proof, mode: str, snr_db: float) -> None:
    expected, tolerance = NS3[mode, snr_db]
    what = f"{mode} at {snr_db:g} dB, 2000 B: share that gets through, ns-3's"
    proof.within("T28", what, 1.0 - per(mode, snr_db, 2000), expected, tolerance, 1)


WEIGHTS: Final = {
    "1/2": (1, {10: 36, 12: 211, 14: 1404, 16: 11633, 18: 77433, 20: 502690, 22: 3322763, 24: 21292910, 26: 134365911}),
    "2/3": (2, dict(enumerate((3, 70, 285, 1276, 6160, 27128, 117019, 498860, 2103891, 8784123), 6))),
    "3/4": (3, dict(enumerate((42, 201, 1492, 10469, 62935, 379644, 2253373, 13073811, 75152755, 428005675), 5))),
}
CODES: Final = {  # points of the constellation and code
    **dict(zip(WIFI_MODES, [(2, "1/2"), (2, "3/4"), (4, "1/2"), (4, "3/4")], strict=False)),
    **dict(zip(WIFI_MODES[4:], [(16, "1/2"), (16, "3/4"), (64, "2/3"), (64, "3/4")], strict=True)),
    **dict(zip(DOT11P_MODES, [(2, "1/2"), (2, "3/4"), (4, "1/2"), (4, "3/4"), (16, "1/2"), (16, "3/4")], strict=False)),
    **dict(zip(HT_MODES, [(2, "1/2"), (4, "1/2"), (4, "3/4"), (16, "1/2"), (16, "3/4"), (64, "2/3")], strict=False)),
}


@pytest.mark.parametrize("mode", CODES)
@pytest.mark.parametrize("size", [100, 1500])
def test_the_formula_of_ofdm(proof: Proof, mode: str, size: int) -> None:
    points, code = CODES[mode]
    branch, weights = WEIGHTS[code]
    off = []
    for step in range(-6, 7):
        snr_db = snr_needed(mode, size) / 100 + step * 0.25
        s = 10 ** (round(snr_db * 100) / 1000)
        if points == 2:
            p = erfc(sqrt(s)) / 2
        elif points == 4:
            p = erfc(sqrt(s / 2)) / 2
        else:
            p = (1 - 1 / sqrt(points)) / log2(sqrt(points)) * erfc(sqrt(1.5 * s / (points - 1)))
        d = 2 * sqrt(p * (1 - p))
        event = min(sum(count * d**weight for weight, count in weights.items()) / (2 * branch), 1)
        off.append(abs(per(mode, snr_db, size) - (1 - (1 - event) ** (8 * size))))
    proof.below("T19", f"{mode}, {size} B: error rate less that of the formula", max(off), 0.005, len(off))


@pytest.mark.parametrize("size", [20, 127])
def test_the_formula_of_802154(proof: Proof, size: int) -> None:
    off = []
    for snr_db in (-3.0, -1.5, -0.7, 0.2, 1.0, 3.0):
        s = 10 ** (snr_db / 10)
        ber = 8 / 15 / 16 * sum((-1) ** k * comb(16, k) * exp(20 * s * (1 / k - 1)) for k in range(2, 17))
        off.append(abs(per("oqpsk_250", snr_db, size) - (1 - (1 - ber) ** (8 * size))))
    proof.below("T19", f"oqpsk_250, {size} B: error rate less that of the formula", max(off), 0.005, len(off))


@given(mode=st.sampled_from(sorted(MODES)), snr=st.integers(-4000, 7000), size=st.integers(1, 2304))
def test_more_signal_or_a_shorter_frame_never_fails_more(mode: str, snr: int, size: int) -> None:
    threshold = per_threshold(mode, snr, size)
    assert 0 <= threshold <= UNIT
    assert per_threshold(mode, snr + 25, size) <= threshold <= per_threshold(mode, snr, size + 1)


def test_rates_and_ends_of_the_scale() -> None:
    assert [MODES[mode].rate_bps for mode in DOT11P_MODES] == [MODES[mode].rate_bps // 2 for mode in WIFI_MODES]
    assert [MODES[mode].rate_bps / 1e6 for mode in HT_MODES] == [6.5, 13, 19.5, 26, 39, 52, 58.5, 65]
    assert snr_needed("ht_mcs7", 1500) / 100 == pytest.approx(23.8, abs=0.06)
    for mode in MODES:
        assert per_threshold(mode, -10_000, 100) == per_threshold(mode, -3_000, 100) > 0.999 * UNIT
        assert per_threshold(mode, 10_000, 1500) == 0
    assert per_threshold("ofdm_6", -3_000, 1) == UNIT, "every word is below it"


@pytest.mark.parametrize("modes", [WIFI_MODES, HT_MODES, DOT11P_MODES])
def test_rate_control_takes_the_fastest_with_few_errors(modes: tuple[str, ...]) -> None:
    frames = WifiFrames(modes, WIFI_5)
    for size in (1, 300, 1464):
        for snr in range(-600, 3200, 7):
            good = [mode for mode in modes if per_threshold(mode, snr, size + 36) <= 0.1 * UNIT]
            frame = frames.unicast(size, snr)
            assert frame.mode == (good or modes)[-1 if good else 0], (size, snr)
            assert frame.airtime_ns == wifi_airtime_ns(frame.mode, size, WIFI_5)
            assert frame.ack_ns == wifi_ack_ns(frame.mode, WIFI_5)
    assert frames.unicast(300, -10_000).mode == frames.broadcast(300).mode == modes[0], "none is good: the slowest"
    assert frames.unicast(300, 10_000).mode == modes[-1]
    fixed = WifiFrames(modes, WIFI_5, modes[3])
    assert {fixed.unicast(300, snr).mode for snr in range(-3000, 3000, 100)} == {modes[3]}
    assert fixed.broadcast(300).mode == modes[3]


# --- LoRa and LTE ----------------------------------------------------------------------------------------------------


def test_lora_needs_its_sensitivity() -> None:
    for factor, device, gateway in zip(range(7, 13), LORA_SENSITIVITY_DBM, LORA_GATEWAY_SENSITIVITY_DBM, strict=True):
        assert lora_received(factor, device) and not lora_received(factor, device - 0.01)
        assert lora_received(factor, gateway, True) and not lora_received(factor, gateway - 0.01, True)
    assert all(near > far for near, far in pairwise(LORA_SENSITIVITY_DBM))


def test_lora_captures() -> None:
    def alone(factor: int, power_dbm: float) -> list[float | None]:
        return [power_dbm if sf == factor else None for sf in range(7, 13)]

    assert lora_interferer(9, -100.0, [None] * 6) == 0
    assert lora_interferer(9, -100.0, alone(9, -105.9)) == 9 and lora_interferer(9, -100.0, alone(9, -106.1)) == 0
    assert lora_interferer(7, -100.0, alone(12, -80.1)) == 0 and lora_interferer(7, -100.0, alone(12, -79.9)) == 12
    assert lora_interferer(12, -100.0, alone(7, -64.1)) == 0 and lora_interferer(12, -100.0, alone(7, -63.9)) == 7


def test_lte_rate() -> None:
    assert lte_rate_bps(-1001, 10_000_000, "up") == 0 < lte_rate_bps(-1000, 10_000_000, "up")
    assert lte_rate_bps(1000, 10_000_000, "down") == pytest.approx(0.6e7 * log2(11), abs=1)
    assert lte_rate_bps(4000, 10_000_000, "down") == 44_000_000
    assert lte_rate_bps(4000, 10_000_000, "up") == 20_000_000


def test_lte_repeats() -> None:
    words = [UNIT // 20_000 * n + UNIT // 40_000 for n in range(20_000)]
    outcomes = [lte_harq(word) for word in words]
    assert sum(lost for _, lost in outcomes) == 2, "one in 10,000"
    for repeats, share in ((0, 0.9), (1, 0.09), (2, 0.009)):
        count = sum(again == repeats for again, _ in outcomes)
        assert abs(binomial_z(count, len(words), share)) < Z_ALPHA
    for failures, one_in in ((1, 10), (2, 100), (3, 1_000)):
        assert lte_harq(UNIT // one_in) == (failures - 1, False)
        assert lte_harq(UNIT // one_in - 1) == (failures, False)
    assert lte_harq(0) == (3, True) and lte_harq(UNIT - 1) == (0, False)


@pytest.mark.parametrize(
    ("bandwidth_hz", "figure_db", "expected"),
    [(20e6, 7.0, -94.0), (10e6, 9.0, -95.0), (125e3, 6.0, -117.0), (9e6, 9.0, -95.5)],
)
def test_noise_floors(bandwidth_hz: float, figure_db: float, expected: float) -> None:
    assert noise_dbm(bandwidth_hz, figure_db) == pytest.approx(expected, abs=0.05)


def test_interference_adds_in_power() -> None:
    assert ratio_cdb(-7000, -9400, units_of(-9400)) == 2400 - round(1000 * log10(2))
    assert ratio_cdb(-7000, -9400, units_of(-8000)) == round(-100 * (70 + 10 * log10(1e-8 + 10**-9.4)))


def test_powers_come_back_to_the_hundredth() -> None:
    for level_cdbm in range(-14000, 3000, 37):
        assert level_of(units_of(level_cdbm)) == pytest.approx(level_cdbm / 100, abs=0.005)


def test_the_order_of_interferers_is_nothing() -> None:
    powers = [units_of(level) for level in (-9130, -6001, -7770, -8880, -9321)]
    assert len({ratio_cdb(-6600, -9400, sum(order)) for order in permutations(powers)}) == 1

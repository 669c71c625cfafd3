"""Noise and interference: the presets' noise floors, sums of powers in any order, hundredths of a dB."""

from __future__ import annotations

from itertools import permutations
from math import log10

import pytest

from foosim.vhub.radio.noise import milliwatts, noise_dbm, sinr_centi_db


@pytest.mark.parametrize(
    ("bandwidth_hz", "figure_db", "expected"),
    [(20e6, 7.0, -94.0), (10e6, 9.0, -95.0), (125e3, 6.0, -117.0), (9e6, 9.0, -95.5)],
)
def test_noise_floors(bandwidth_hz: float, figure_db: float, expected: float) -> None:
    assert noise_dbm(bandwidth_hz, figure_db) == pytest.approx(expected, abs=0.05)


def test_without_interference_it_is_the_difference() -> None:
    assert sinr_centi_db(-70.0, -94.0) == 2400
    assert sinr_centi_db(-70.004, -94.0) == 2400 and sinr_centi_db(-70.006, -94.0) == 2399


def test_interference_adds_in_power() -> None:
    assert sinr_centi_db(-70.0, -94.0, [-94.0]) == 2400 - round(1000 * log10(2))
    assert sinr_centi_db(-70.0, -94.0, [-80.0]) == round(-100 * (70 + 10 * log10(1e-8 + milliwatts(-94.0))))


def test_what_is_far_below_the_noise_is_left_out() -> None:
    assert sinr_centi_db(-70.0, -94.0, [-104.1] * 50) == 2400
    assert sinr_centi_db(-70.0, -94.0, [-103.9]) < 2400


def test_the_order_of_interferers_is_nothing() -> None:
    powers = (-91.3, -60.01, -77.7, -88.8, -93.21)
    assert len({sinr_centi_db(-66.0, -94.0, order) for order in permutations(powers)}) == 1

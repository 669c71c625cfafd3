"""Noise and interference: the presets' noise floors, sums of powers in any order, hundredths of a dB."""

from __future__ import annotations

from itertools import permutations
from math import log10

import pytest

from foosim.vhub.radio.noise import level_of, noise_dbm, ratio_cdb, units_of


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

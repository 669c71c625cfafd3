"""Signal over noise and interference: what a receiver has, in the whole hundredths of a dB that `errors` wants.

Powers of others are summed in whole units of 1e-21 W, so that no order matters.
"""

from __future__ import annotations

from math import log10
from typing import Final

THERMAL_DBM_HZ: Final = -174.0
"""Of a resistor at room temperature, in each hertz."""
NEGLIGIBLE_CDB: Final = 1000
"""Interference that is weaker than the noise by more than this is left out."""
UNIT_DBM: Final = -180.0
"""1e-21 W."""


def noise_dbm(bandwidth_hz: float, noise_figure_db: float) -> float:
    """Return a receiver's noise power, -174 dBm + 10 lg(bandwidth / Hz) + noise figure."""
    return THERMAL_DBM_HZ + 10.0 * log10(bandwidth_hz) + noise_figure_db


def centi(level: float) -> int:
    """Return a level in whole hundredths."""
    return round(level * 100.0)


def units_of(level_cdbm: int) -> int:
    """Return a power given in 0.01 dBm in whole units of 1e-21 W."""
    return int(10.0 ** ((level_cdbm / 100.0 - UNIT_DBM) / 10.0))


def level_of(power: int) -> float:
    """Return a power in units of 1e-21 W, more than 0, as a level in dBm."""
    return 10.0 * log10(power) + UNIT_DBM


def ratio_cdb(received_cdbm: int, noise_cdbm: int, interference: int) -> int:
    """Return the ratio of a signal to noise and interference (units of 1e-21 W), in hundredths of a dB."""
    return received_cdbm - centi(level_of(units_of(noise_cdbm) + interference))

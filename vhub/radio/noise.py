"""Signal over noise and interference: what a receiver has, in the whole hundredths of a dB that `errors` wants."""

from __future__ import annotations

from collections.abc import Iterable
from math import fsum, log10
from typing import Final

THERMAL_DBM_HZ: Final = -174.0
"""Of a resistor at room temperature, in each hertz."""
NEGLIGIBLE_DB: Final = 10.0
"""Interference that is weaker than the noise by more than this is left out."""


def noise_dbm(bandwidth_hz: float, noise_figure_db: float) -> float:
    """Return a receiver's noise power, -174 dBm + 10 lg(bandwidth / Hz) + noise figure."""
    return THERMAL_DBM_HZ + 10.0 * log10(bandwidth_hz) + noise_figure_db


def milliwatts(power_dbm: float) -> float:
    """Return a power in mW."""
    return float(10.0 ** (power_dbm / 10.0))


def sinr_centi_db(received_dbm: float, noise_power_dbm: float, interference_dbm: Iterable[float] = ()) -> int:
    """Return the ratio of a signal to noise and interference, rounded to 0.01 dB, in hundredths of a dB.

    `interference_dbm` has the received power of each transmission that overlaps in time on the channel, in any order:
    their sum is rounded once.
    """
    heard = [milliwatts(power) for power in interference_dbm if power > noise_power_dbm - NEGLIGIBLE_DB]
    if heard:
        noise_power_dbm = 10.0 * log10(fsum([milliwatts(noise_power_dbm), *heard]))
    return round((received_dbm - noise_power_dbm) * 100.0)

"""What a wall takes away: transmission through a single slab at normal incidence, by ITU-R P.2040.

The slab's permittivity and conductivity are eps = a f^b and sigma = c f^d with f in GHz. A thin pane can be a
resonator: its loss swings with thickness, so that a thicker pane of glass may lose less than a thinner one.
"""

from __future__ import annotations

from cmath import sqrt
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from math import cos, exp, inf, log10, pi, sin
from types import MappingProxyType
from typing import Final

from foosim.vhub.radio.path_loss import LIGHT_M_S

LG_E: Final = log10(2.718281828459045)
METAL_MAX_DB: Final = 60.0
"""Judgement: behind a closed sheet of metal, what comes round its edges and through its gaps is what is left."""


@dataclass(frozen=True)
class Material:
    """Coefficients of eps = a f^b and sigma = c f^d (S/m), f in GHz, and the frequencies in GHz they were fitted for.

    Below that range the same law is used: at 868 MHz it is the common practice.
    """

    a: float
    b: float
    c: float
    d: float
    fitted_ghz: tuple[float, float] = (1.0, 100.0)
    max_db: float | None = None


MATERIALS: Final[Mapping[str, Material]] = MappingProxyType(
    {
        "concrete": Material(5.24, 0.0, 0.0462, 0.7822),
        "brick": Material(3.91, 0.0, 0.0238, 0.16, (1.0, 40.0)),
        "plasterboard": Material(2.73, 0.0, 0.0085, 0.9395),
        "wood": Material(1.99, 0.0, 0.0047, 1.0718, (0.001, 100.0)),
        "glass": Material(6.31, 0.0, 0.0036, 1.3394, (0.1, 100.0)),
        "ceiling_board": Material(1.48, 0.0, 0.0011, 1.0750),
        "chipboard": Material(2.58, 0.0, 0.0217, 0.7800),
        "plywood": Material(2.71, 0.0, 0.33, 0.0, (1.0, 40.0)),
        "marble": Material(7.074, 0.0, 0.0055, 0.9262, (1.0, 60.0)),
        "floorboard": Material(3.66, 0.0, 0.0044, 1.3515, (50.0, 100.0)),
        "metal": Material(1.0, 0.0, 1e7, 0.0, max_db=METAL_MAX_DB),
        "very_dry_ground": Material(3.0, 0.0, 0.00015, 2.52, (1.0, 10.0)),
        "medium_dry_ground": Material(15.0, -0.1, 0.035, 1.63, (1.0, 10.0)),
        "wet_ground": Material(30.0, -0.4, 0.15, 1.30, (1.0, 10.0)),
    }
)
"""Source: ITU-R P.2040, table 3, lowest range of frequencies of each material."""


@lru_cache(maxsize=1_024)
def _slab(material: str, frequency_hz: float) -> tuple[complex, complex, float, float]:
    """Return what slabs of a material share at a frequency: sqrt(eta), r^2, the gain at both surfaces and the cap."""
    known = MATERIALS[material]
    f_ghz = frequency_hz * 1e-9
    eta = complex(known.a * f_ghz**known.b, -17.98 * known.c * f_ghz**known.d / f_ghz)
    root = sqrt(eta)
    r2 = ((1.0 - root) / (1.0 + root)) * ((1.0 - root) / (1.0 + root))
    return root, r2, 20.0 * log10(abs(1.0 - r2)), inf if known.max_db is None else known.max_db


def slab_loss_db(material: str, thickness_m: float, frequency_hz: float) -> float:
    """Return the loss in dB of a wave that crosses a slab of a material in MATERIALS at a right angle.

    With eta the complex permittivity, q = 2 pi (t / lambda) sqrt(eta) and r = (1 - sqrt(eta)) / (1 + sqrt(eta)), a slab
    of thickness t loses -20 lg|(1 - r^2) e^-jq / (1 - r^2 e^-2jq)|, taken apart so that a thick one cannot underflow.
    Source: ITU-R P.2040, 2.2.2.
    """
    assert thickness_m >= 0.0, thickness_m
    root, r2, surface_db, max_db = _slab(material, frequency_hz)
    turns = 2.0 * pi * thickness_m * frequency_hz / LIGHT_M_S
    q_real, q_imag = turns * root.real, turns * root.imag
    absorbed_db = -q_imag * 20.0 * LG_E
    echo_real = echo_imag = 0.0
    if q_imag > -300.0:
        size = exp(2.0 * q_imag)
        real, imag = size * cos(-2.0 * q_real), size * sin(-2.0 * q_real)
        echo_real = r2.real * real - r2.imag * imag
        echo_imag = r2.real * imag + r2.imag * real
    loss_db = absorbed_db - surface_db + 20.0 * log10(abs(complex(1.0 - echo_real, -echo_imag)))
    return min(max(loss_db, 0.0), max_db)

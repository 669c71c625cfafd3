"""Shadowing as a function of position: what the surroundings take or give at a place, the same on every visit.

A unit Gaussian field F over the horizontal plane is the sum of three lattices, whose pitches and weights are tuned so
that its autocorrelation follows exp(-distance / d_corr) within 0.05. A node's value is a keyed draw of its lattice
and cell, so the field has no order of asking and no memory. The height is left out: d_corr was measured along streets
and corridors, and what casts a shadow there stands upright.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import exp, floor, sqrt
from typing import Final

from foosim.protocol.draws import draw_words, gaussian

LATTICES: Final = ((0, 1.0 / 0.25), (1, 1.0 / 1.0), (2, 1.0 / 2.8))
"""Number, and nodes per correlation distance: the pitches are 0.25, 1 and 2.8 correlation distances."""
ROOT_WEIGHTS: Final[tuple[float, ...]] = (sqrt(0.3), sqrt(0.4), sqrt(0.3))
"""Square roots of each lattice's share of the variance."""
_LOW_32: Final = 0xFFFF_FFFF

Bilinear = tuple[float, float, float, float]


@lru_cache(maxsize=65_536)
def _node(key: bytes, lattice: int, i: int, j: int) -> float:
    """The value at a node: eight of one row share a draw."""
    row = draw_words(key, (i >> 3 & _LOW_32) << 32 | j & _LOW_32, lattice)
    return ROOT_WEIGHTS[lattice] * gaussian(row[i & 7])


@lru_cache(maxsize=65_536)
def _cell(key: bytes, lattice: int, i: int, j: int) -> Bilinear:
    """Coefficients of 1, u, v and u v within a cell: a robot that moves about in it asks again and again."""
    here, east = _node(key, lattice, i, j), _node(key, lattice, i + 1, j)
    north, far = _node(key, lattice, i, j + 1), _node(key, lattice, i + 1, j + 1)
    return here, east - here, north - here, here - east - north + far


@lru_cache(maxsize=16_384)
def field(key: bytes, x_m: float, y_m: float, d_corr_m: float) -> float:
    """Return the unit Gaussian field F at a place of the horizontal plane.

    Each lattice is interpolated with bilinear weights, divided by the root of the sum of their squares: so the variance
    is exactly 1 everywhere, not only at the nodes.
    """
    x, y, total = x_m / d_corr_m, y_m / d_corr_m, 0.0
    for lattice, density in LATTICES:
        u, v = x * density, y * density
        i, j = floor(u), floor(v)
        u -= i
        v -= j
        constant, of_u, of_v, of_uv = _cell(key, lattice, i, j)
        squares = (1.0 - 2.0 * u * (1.0 - u)) * (1.0 - 2.0 * v * (1.0 - v))
        total += (constant + of_u * u + (of_v + of_uv * u) * v) / sqrt(squares)
    return total


def shadowing_db(key: bytes, a: Sequence[float], b: Sequence[float], sigma_db: float, d_corr_m: float) -> float:
    """Return the shadowing in dB between two places, normal with standard deviation `sigma_db`; exactly S_ab = S_ba.

    It is sigma (F(a) + F(b)) over the deviation of that sum, sqrt(2 + 2 exp(-distance / d_corr)): far apart sqrt 2, and
    2 where both ends stand in the same shadow. Two links that share one end, the others far apart, correlate by 0.5.
    `a` and `b` are positions in m, of which x and y count; `key` is made once for a run, not for each link.
    """
    if sigma_db == 0.0:
        return 0.0
    dx, dy = a[0] - b[0], a[1] - b[1]
    shared = exp(-sqrt(dx * dx + dy * dy) / d_corr_m)
    total = field(key, a[0], a[1], d_corr_m) + field(key, b[0], b[1], d_corr_m)
    return sigma_db * total / sqrt(2.0 + 2.0 * shared)


def shadowing_max_db(key: bytes, a: Sequence[float], sigma_db: float, d_corr_m: float) -> float:
    """Return a share of one end, not below 0: no shadowing between two places exceeds the sum of theirs."""
    if sigma_db == 0.0:
        return 0.0
    return max(0.0, sigma_db * field(key, a[0], a[1], d_corr_m) / sqrt(2.0))

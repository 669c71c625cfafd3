"""Shadowing as a function of position: what the surroundings take or give at a place, the same on every visit.

A unit Gaussian field F over the horizontal plane is the sum of three lattices, whose pitches and weights are tuned so
that its autocorrelation follows exp(-distance / d_corr) within 0.05. A node's value is a keyed draw of its lattice
and cell, so the field does not depend on the order of queries; its cache of cells changes nothing. The height is left
out: d_corr was measured along streets and corridors, and obstacles that cast a shadow there are upright.
"""

from __future__ import annotations

from functools import lru_cache
from math import exp, floor, sqrt
from typing import Final

from foosim.common.keyed_random import draw_words, gaussian

LATTICES: Final = ((0, 1.0 / 0.25), (1, 1.0 / 1.0), (2, 1.0 / 2.8))
"""Number, and nodes per correlation distance: the pitches are 0.25, 1 and 2.8 correlation distances."""
ROOT_WEIGHTS: Final[tuple[float, ...]] = (sqrt(0.3), sqrt(0.4), sqrt(0.3))
"""Square roots of each lattice's share of the variance."""
CELLS_KEPT: Final = 16_384
"""Of each lattice, at most: a robot that moves about in a cell reads it again and again."""
CELL_MAX: Final = 1 << 29
"""Of cells that are further away nothing is remembered."""
_LOW_32: Final = 0xFFFF_FFFF

Bilinear = tuple[float, float, float, float]
"""Coefficients of 1, u, v and u v within a cell."""


@lru_cache(maxsize=65_536)
def _node(key: bytes, lattice: int, i: int, j: int) -> float:
    """The value at a node: eight of one row share a draw."""
    row = draw_words(key, (i >> 3 & _LOW_32) << 32 | j & _LOW_32, lattice)
    return ROOT_WEIGHTS[lattice] * gaussian(row[i & 7])


class _Lattice:
    """One of the lattices: its nodes per metre of the plane in units of d_corr, and its cells computed so far."""

    __slots__ = ("_cells", "_key", "_number", "density")

    def __init__(self, key: bytes, number: int, density: float) -> None:
        self._key, self._number, self.density = key, number, density
        self._cells: dict[int, Bilinear] = {}
        """By one number for both of a cell's: a tuple of two costs more to make than all the rest."""

    def cell(self, i: int, j: int) -> Bilinear:
        """Return the coefficients of a cell, by its node that is nearest to the origin of its coordinates."""
        if not -CELL_MAX < i < CELL_MAX or not -CELL_MAX < j < CELL_MAX:
            return self._made(i, j)
        key = i * (2 * CELL_MAX) + j
        found = self._cells.get(key)
        if found is None:
            if len(self._cells) >= CELLS_KEPT:
                self._cells.clear()
            found = self._cells[key] = self._made(i, j)
        return found

    def _made(self, i: int, j: int) -> Bilinear:
        key, number = self._key, self._number
        here, east = _node(key, number, i, j), _node(key, number, i + 1, j)
        north, far = _node(key, number, i, j + 1), _node(key, number, i + 1, j + 1)
        return here, east - here, north - here, here - east - north + far


class Shadowing:
    """The shadowing of one condition: normal with `sigma_db`, correlated over `d_corr_m`, in the field of a key.

    `key` is made once for a run, not for each link.
    """

    __slots__ = ("_lattices", "d_corr_m", "sigma_db")

    def __init__(self, key: bytes, sigma_db: float, d_corr_m: float) -> None:
        self.sigma_db, self.d_corr_m = sigma_db, d_corr_m
        self._lattices = [_Lattice(key, number, density) for number, density in LATTICES]

    def field(self, x_m: float, y_m: float) -> float:
        """Return the unit Gaussian field F at a place of the horizontal plane.

        Each lattice is interpolated with bilinear weights, divided by the root of the sum of their squares: so the
        variance is exactly 1 everywhere, not only at the nodes.
        """
        x, y, total = x_m / self.d_corr_m, y_m / self.d_corr_m, 0.0
        for lattice in self._lattices:
            density = lattice.density
            u, v = x * density, y * density
            i, j = floor(u), floor(v)
            u -= i
            v -= j
            constant, of_u, of_v, of_uv = lattice.cell(i, j)
            squares = (1.0 - 2.0 * u * (1.0 - u)) * (1.0 - 2.0 * v * (1.0 - v))
            total += (constant + of_u * u + (of_v + of_uv * u) * v) / sqrt(squares)
        return total

    def between_db(self, one: float, other: float, apart_m: float) -> float:
        """Return the shadowing in dB between two places with these values of F, so far apart in the horizontal plane.

        It is sigma (F(a) + F(b)) over the deviation of that sum, sqrt(2 + 2 exp(-distance / d_corr)): far apart sqrt 2,
        and 2 where both ends stand in the same shadow; exactly S_ab = S_ba. Two links that share one end, the others
        far apart, correlate by 0.5.
        """
        shared = exp(-apart_m / self.d_corr_m)
        return self.sigma_db * (one + other) / sqrt(2.0 + 2.0 * shared)

    def most_db(self, one: float) -> float:
        """Return the share of one end with this F, not below 0: no shadowing between two places exceeds the sum."""
        return max(0.0, self.sigma_db * one / sqrt(2.0))

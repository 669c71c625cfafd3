"""Small-scale fading: the gain that multipath adds or takes in a block of time, drawn from a table of quantiles.

A block is as long as the channel stays the same, the coherence time; its number is a keyed counter, so that the gain
is a function of link and time. Gains are powers with mean 1. Tables have 4,096 cells and hold whole billionths, so that
the last bit of a mathematical library does not enter; within a cell the gain is interpolated in integers.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from math import exp, gamma, log, log10, sqrt
from typing import Final, Literal

from foosim.common.keyed_random import draw_words

Kind = Literal["none", "rayleigh", "rician", "nakagami"]

CELLS: Final = 4096
ONE: Final = 1_000_000_000
"""A gain of 1 in the units of a table."""
TAIL: Final = 2.0**-20
"""The ends of a table are the quantiles at this and at 1 minus this: no fade is deeper than some 60 dB."""

Law = Callable[[float], tuple[float, float]]
"""Distribution function and density of a gain."""


def _gamma_law(m: float) -> Law:
    """Of a gamma distributed gain with mean 1 and shape m. Source: Abramowitz and Stegun, 6.5.29."""
    scale = m**m / gamma(m)

    def law(gain: float) -> tuple[float, float]:
        power = scale * gain ** (m - 1.0) * exp(-m * gain)
        term = total = 1.0 / m
        n = m
        while term > 1e-17 * total:
            n += 1.0
            term *= m * gain / n
            total += term
        return total * power * gain, power

    return law


def _rician_law(k: float) -> Law:
    """Of the gain of a steady ray with k times the power of the scattered ones, mean 1.

    A Poisson mixture of gamma laws: with y = (1 + k) gain, sum_j e^-k k^j / j! P(j + 1, y).
    """

    def law(gain: float) -> tuple[float, float]:
        y = (1.0 + k) * gain
        chance, term = exp(-k), exp(-y)
        below = 1.0 - term
        total, density, left, j = chance * below, chance * term, 1.0 - chance, 0
        while left > 1e-15 and below > 1e-15:
            j += 1
            chance *= k / j
            term *= y / j
            below -= term
            total += chance * below
            density += chance * term
            left -= chance
        return total, density * (1.0 + k)

    return law


def _quantiles(law: Law) -> tuple[int, ...]:
    """CELLS + 1 quantiles in units of 1 / ONE, by Newton's iteration inside a bracket, each from the one before."""
    found = []
    low = 0.0
    x = 1e-9
    for p in (TAIL, *(cell / CELLS for cell in range(1, CELLS)), 1.0 - TAIL):
        bottom, top = low, 1e3
        for _ in range(200):
            below, density = law(x)
            bottom, top = (x, top) if below < p else (bottom, x)
            step = (p - below) / density if density > 0.0 else 0.0
            following = x + step
            if not bottom < following < top:
                following = sqrt(bottom * top) if bottom > 0.0 else top / 2.0
            done = abs(following - x) <= 1e-10 * x
            x = following
            if done:
                break
        low = x
        found.append(round(x * ONE))
    return tuple(found)


@lru_cache(maxsize=64)
def gain_quantiles(kind: Kind, parameter: float) -> tuple[int, ...]:
    """Return the table of a kind: `parameter` is Rician's K in dB, Nakagami's m; Rayleigh has none.

    4,097 gains in billionths, rising. m is in 0.5 to 100, and 1 is Rayleigh; K is in -40 to 20 dB, and the least is
    nearly Rayleigh, the greatest nearly steady.
    """
    if kind == "rayleigh":
        shares = (TAIL, *(cell / CELLS for cell in range(1, CELLS)), 1.0 - TAIL)
        return tuple(round(-log(1.0 - share) * ONE) for share in shares)
    if kind == "rician":
        assert -40.0 <= parameter <= 20.0, parameter
        return _quantiles(_rician_law(10.0 ** (parameter / 10.0)))
    assert kind == "nakagami" and 0.5 <= parameter <= 100.0, (kind, parameter)
    return _quantiles(_gamma_law(parameter))


def fading_db(key: bytes, counter: int, kind: Kind, parameter: float = 0.0) -> float:
    """Return the gain in dB of block `counter`; positive adds to the received power.

    `key` is the link's: the same in both directions where the channel shall be reciprocal.
    """
    if kind == "none":
        return 0.0
    table = gain_quantiles(kind, parameter)
    word = draw_words(key, counter)[0]
    cell = word >> 52
    low = table[cell]
    gain = low + (((table[cell + 1] - low) * (word & 0xF_FFFF_FFFF_FFFF)) >> 52)
    return 10.0 * log10(max(gain, 1) / ONE)


def nakagami_m(distance_m: float) -> float:
    """Return Nakagami's m by distance: 1.5 below 80 m, 0.75 beyond. Source: ns-3's defaults (0.75 again past 200 m)."""
    return 1.5 if distance_m < 80.0 else 0.75

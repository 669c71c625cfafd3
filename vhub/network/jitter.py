"""Quantiles of jitter: a table of 4,096 per shape, built by a fixed routine and interpolated to whole nanoseconds.

The upper sixteenth of a shape with a heavy tail is finer: each half of the remaining tail has 64 cells, so that a
straight line over any cell hardly differs from the law, however rare.

The routine uses only + - x / of IEEE doubles (its own exponential and logarithm), so that the table is the same on
every machine, whatever its mathematical library. Source of the series: Abramowitz and Stegun, Handbook of Mathematical
Functions, 6.5.29 (incomplete gamma).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import lru_cache
from itertools import pairwise
from typing import Final

from pydantic import TypeAdapter

from foosim.common.keyed_random import UNIT, gaussian
from foosim.deployment.network.impairments import (
    GammaJitter,
    Jitter,
    LognormalJitter,
    MixtureJitter,
    ParetoJitter,
    ShiftedExponentialJitter,
    TableJitter,
    UniformJitter,
)
from foosim.deployment.network.traces import read_table
from foosim.vhub.network.series_math import exp, ln, ln_gamma, power

CELLS: Final = 4096
TAIL_CELL: Final = CELLS - CELLS // 16
"""From here on the cells of a heavy tail are finer."""
HALF_CELLS: Final = 64
"""Cells of each half of the remaining tail."""
HALVES: Final = 48
"""How often the remaining tail is halved: rarer values than 2^-52 are as great as that one."""
GAMMA_HALVES: Final = 24
"""The same of a gamma distribution: beyond, P(a, x) rounds to 1 as a float."""
_TAIL_BITS: Final = 60
_TAIL_WORD: Final = TAIL_CELL << 52
_HALF_BITS: Final = HALF_CELLS.bit_length()


class _Gamma:
    """The regularised lower incomplete gamma function P(a, x) of one shape, and its inverse for ascending p."""

    def __init__(self, a: float) -> None:
        self.a = a
        self._ln_gamma = ln_gamma(a)
        self._density = 0.0
        """At the last x that was looked at."""

    def _power(self, x: float) -> float:
        """x^a e^-x / Gamma(a): the factor that P and the density share."""
        return exp(self.a * ln(x) - x - self._ln_gamma)

    def quantile(self, p: float, low: float, rise: float) -> float:
        """The x >= `low` with P(a, x) = p, where P(a, low) = p - `rise`: Newton's iteration inside a bracket.

        A step shorter than 1e-8 x is the last one: it leaves an error of about its square.
        """
        high = math.inf
        x = self._guess(low, rise)
        for _ in range(200):
            below, density = self._at(x)
            low, high = (x, high) if below < p else (low, x)
            step = (p - below) / density if density > 0.0 else math.inf
            if abs(step) <= 1e-8 * x:
                return x + step
            if low < x + step < high:
                x += step
            else:
                x = 2.0 * x if high == math.inf else low + (high - low) / 2.0
        return x

    def _guess(self, low: float, rise: float) -> float:
        """Where P has risen by `rise` above its value at `low`, by the first two terms of its Taylor series there."""
        if low == 0.0 or self._density == 0.0:
            return self.a
        step = rise / self._density
        bend = (self.a - 1.0) / low - 1.0
        return low + step * max(0.5, 1.0 - 0.5 * bend * step)

    def _at(self, x: float) -> tuple[float, float]:
        """P(a, x) by its series, and the density at x."""
        term = total = 1.0 / self.a
        n = self.a
        while term > 1e-17 * total:
            n += 1.0
            term *= x / n
            total += term
        power = self._power(x)
        self._density = power / x
        return total * power, self._density


FIRST: Final = 2.0**-20
LAST: Final = 1.0 - FIRST
"""The probabilities of the first and last quantile: those at 0 and 1 would be 0 and infinite."""


def _probabilities() -> tuple[float, ...]:
    return FIRST, *(cell / CELLS for cell in range(1, CELLS)), LAST


_ANY_JITTER: Final[TypeAdapter[Jitter]] = TypeAdapter(Jitter)


def quantiles_ns(jitter: Jitter, table: tuple[int, ...] = ()) -> tuple[int, ...]:
    """Return the quantiles, in ns, of any jitter: CELLS + 1, or TAIL_CELL and those of a heavy tail.

    `table` is the content of the file of one that has a file.
    """
    return _quantiles_of(_ANY_JITTER.dump_json(jitter, by_alias=True), table)


@lru_cache(maxsize=256)
def _quantiles_of(text: bytes, table: tuple[int, ...]) -> tuple[int, ...]:
    jitter = _ANY_JITTER.validate_json(text)
    if isinstance(jitter, GammaJitter):
        return gamma_quantiles_ns(jitter.mean_ns, jitter.sd_ns)
    if isinstance(jitter, MixtureJitter):
        return _mixture(jitter)
    if isinstance(jitter, TableJitter):
        return _from_table(jitter, table)
    return tuple(round(_quantile(jitter, above)) for above in _aboves(HALVES))


def _aboves(halves: int) -> Iterator[float]:
    """Yield the probability of more than each quantile of a heavy tail, all of them exact."""
    yield 1.0 - FIRST
    yield from ((CELLS - cell) / CELLS for cell in range(1, TAIL_CELL))
    for half in range(halves):
        yield from (2.0 ** -(4 + half) * (1.0 - place / (2 * HALF_CELLS)) for place in range(HALF_CELLS))
    yield 2.0 ** -(4 + halves)


def _quantile(jitter: UniformJitter | LognormalJitter | ShiftedExponentialJitter | ParetoJitter, above: float) -> float:
    """Return the number, in ns, that a law with a closed form exceeds with this probability."""
    if isinstance(jitter, UniformJitter):
        return jitter.width_ns * (1.0 - above)
    if isinstance(jitter, ShiftedExponentialJitter):
        return max(float(jitter.min_ns), -jitter.mean_ns * ln(above))
    if isinstance(jitter, ParetoJitter):
        scale = _lomax_scale(jitter.mean_ns, jitter.alpha, jitter.max_ns)
        return min(float(jitter.max_ns), scale * (power(above, -1.0 / jitter.alpha) - 1.0))
    ratio = jitter.sd_ns / jitter.mean_ns
    variance = ln(1.0 + ratio * ratio)
    normal = -gaussian(int(above * 2.0**64))
    return jitter.mean_ns * exp(math.sqrt(variance) * normal - variance / 2.0)


@lru_cache(maxsize=16)
def _lomax_scale(mean_ns: int, alpha: float, max_ns: int) -> float:
    """Return the scale with which a Lomax number, cut at the greatest, has this mean: by bisection.

    Uncut the mean is scale / (alpha - 1); what is above `max_ns` has the share (1 + max / scale)^(1 - alpha) of it.
    """

    def mean_of(scale: float) -> float:
        return scale / (alpha - 1.0) * (1.0 - power(1.0 + max_ns / scale, 1.0 - alpha))

    low = high = mean_ns * (alpha - 1.0)
    while mean_of(high) < mean_ns and high < 1e30:
        low, high = high, 2.0 * high
    for _ in range(100):
        middle = (low + high) / 2.0
        low, high = (middle, high) if mean_of(middle) < mean_ns else (low, middle)
    return high


def _mixture(jitter: MixtureJitter) -> tuple[int, ...]:
    """Return the quantiles of a mixture of uniform parts, by bisection of its distribution function."""
    parts = [(part.share, part.from_ns, max(part.to_ns, part.from_ns + 1)) for part in jitter.parts]

    def below(x_ns: int) -> float:
        return sum(share * min(1.0, max(0.0, (x_ns - low) / (high - low))) for share, low, high in parts)

    quantiles, low_ns = [], min(low for _, low, _ in parts)
    top_ns = max(high for _, _, high in parts)
    for p in _probabilities():
        high_ns = top_ns
        while low_ns < high_ns:
            middle_ns = (low_ns + high_ns) // 2
            low_ns, high_ns = (middle_ns + 1, high_ns) if below(middle_ns) < p else (low_ns, middle_ns)
        quantiles.append(low_ns)
    return tuple(quantiles)


TABLE_SCALE: Final = 8192
"""netem writes a standard deviation as this number."""


def _from_table(jitter: TableJitter, table: tuple[int, ...]) -> tuple[int, ...]:
    """Return mean + sd x entry / 8192 at each quantile, at least 0; between entries it is linear."""
    assert table, "the jitter's file was given"
    quantiles = []
    for p in _probabilities():
        place = p * (len(table) - 1)
        cell = min(int(place), len(table) - 2)
        entry = table[cell] + (table[cell + 1] - table[cell]) * (place - cell)
        quantiles.append(max(0, round(jitter.mean_ns + jitter.sd_ns * entry / TABLE_SCALE)))
    return tuple(quantiles)


@lru_cache(maxsize=256)
def gamma_quantiles_ns(mean_ns: int, sd_ns: int) -> tuple[int, ...]:
    """Return CELLS + 1 quantiles, in ns, of a gamma distribution; the ends are those at 2^-20 and at 1 - 2^-20.

    A first one at 0 would give narrow distributions a tail that they have not. Where the standard deviation is above
    the mean the tail is heavy.
    """
    assert mean_ns > 0 and sd_ns > 0
    shape = (mean_ns / sd_ns) * (mean_ns / sd_ns)
    scale_ns = sd_ns * (sd_ns / mean_ns)
    quantiles = []
    gamma = _Gamma(shape)
    x = p = 0.0
    for below in (1.0 - above for above in _aboves(GAMMA_HALVES)) if sd_ns > mean_ns else _probabilities():
        x = gamma.quantile(below, x, below - p)
        p = below
        quantiles.append(round(x * scale_ns))
    return tuple(quantiles)


def jitter_ns(jitter: Jitter | None, files: Mapping[str, bytes]) -> tuple[int, ...]:
    """Return the quantiles (ns) of a jitter, none without one; `files` has the table that it may name, by path."""
    if jitter is None:
        return ()
    text = files[jitter.file].decode("ascii", "replace") if isinstance(jitter, TableJitter) else ""
    return quantiles_ns(jitter, read_table(text) if text else ())


def interpolate_ns(quantiles_ns: tuple[int, ...], word: int) -> int:
    """Return the quantile at word / 2^64, linear within its cell, in integer arithmetic."""
    if word >= _TAIL_WORD and len(quantiles_ns) > CELLS + 1:
        return _in_tail(quantiles_ns, UNIT - 1 - word)
    cell = word >> 52
    rest = word & 0xFFFFFFFFFFFFF
    low = quantiles_ns[cell]
    return low + (((quantiles_ns[cell + 1] - low) * rest) >> 52)


def _in_tail(quantiles_ns: tuple[int, ...], above: int) -> int:
    """Return the quantile of which `above` / 2^64 is the probability of more, in a heavy tail."""
    bits = above.bit_length()
    first = TAIL_CELL + (_TAIL_BITS - bits) * HALF_CELLS
    if first >= len(quantiles_ns) - 1:
        return quantiles_ns[-1]
    size = bits - _HALF_BITS
    place, rest = divmod((1 << bits) - above, 1 << size)
    low = quantiles_ns[first + place]
    return low + ((quantiles_ns[first + place + 1] - low) * rest >> size) if rest else low


def moments_ns(quantiles_ns: tuple[int, ...]) -> tuple[float, float]:
    """Return mean and standard deviation, in ns, of what is drawn from quantiles."""
    shares, left = [1.0 / CELLS] * CELLS, 0.0
    if len(quantiles_ns) > CELLS + 1:
        halves = (len(quantiles_ns) - 1 - TAIL_CELL) // HALF_CELLS
        shares[TAIL_CELL:] = [2.0 ** -(5 + half) / HALF_CELLS for half in range(halves) for _ in range(HALF_CELLS)]
        left = 2.0 ** -(4 + halves)
    mean = square = 0.0
    for share, (low, high) in zip(shares, pairwise(quantiles_ns), strict=True):
        mean += share * (low + high) / 2.0
        square += share * (low * low + low * high + high * high) / 3.0
    mean, square = mean + left * quantiles_ns[-1], square + left * quantiles_ns[-1] * quantiles_ns[-1]
    return mean, math.sqrt(max(0.0, square - mean * mean))

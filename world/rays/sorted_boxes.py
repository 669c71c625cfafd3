"""Axis-aligned boxes, sorted: a query costs the count of near boxes instead of the count of all.

Boxes of like size are a class, in the order of their least coordinate along the axis on which they are spread most. A
query compares the boxes of each class that begin at most its greatest size before the query.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foosim.world.rays.boxes import Floats

Indices: TypeAlias = NDArray[np.intp]
Boxes: TypeAlias = tuple[Floats, Floats]
"""Their least and greatest coordinates (3, m)."""
FEW: Final = 256
"""The greatest count of boxes that are all compared: it costs less than sorting."""
GROWTH_BITS: Final = 2
"""The ratio of sizes in a class is below 2 to this power."""


class _Class:
    """Boxes of like size: their starts along the axis, in order, their numbers, and the greatest size."""

    def __init__(self, begins: Floats, members: Indices, size: float) -> None:
        order = np.argsort(begins[members], kind="stable")
        self.members = members[order]
        self.begins = begins[self.members]
        self.size = size


class SortedBoxes:
    """Boxes of shape (3, m) by their least and greatest coordinates."""

    def __init__(self, low: Floats, high: Floats) -> None:
        self._low, self._high = low, high
        self._classes: list[_Class] = []
        self.count = low.shape[1]
        if self.count <= FEW:
            return
        middles = low + high
        self._axis = int(np.argmax(middles.max(axis=1) - middles.min(axis=1)))
        begins, sizes = low[self._axis], high[self._axis] - low[self._axis]
        ranks = np.frexp(sizes)[1] // GROWTH_BITS
        for rank in np.unique(ranks).tolist():
            members = np.flatnonzero(ranks == rank)
            self._classes.append(_Class(begins, members, float(sizes[members].max())))

    def met(self, low: Floats, high: Floats) -> tuple[Indices, Indices]:
        """Return overlapping pairs of given boxes (3, n) and these, in the order of the given ones, then these."""
        if not self._classes:
            overlap = self._low[:, None, :] <= high[:, :, None]
            overlap &= self._high[:, None, :] >= low[:, :, None]
            given, found = (overlap[0] & overlap[1] & overlap[2]).nonzero()
            return given, found
        pairs = [self._met_of(one, low, high) for one in self._classes]
        given, found = (np.concatenate(column) for column in zip(*pairs, strict=True))
        order = np.argsort(given * self._low.shape[1] + found, kind="stable")
        return given[order], found[order]

    def _met_of(self, one: _Class, low: Floats, high: Floats) -> tuple[Indices, Indices]:
        axis = self._axis
        first = np.searchsorted(one.begins, low[axis] - one.size, side="left")
        last = np.searchsorted(one.begins, high[axis], side="right")
        counts = np.maximum(last - first, 0)
        given = np.repeat(np.arange(low.shape[1]), counts)
        place = np.arange(len(given)) - np.repeat(np.cumsum(counts) - counts, counts) + np.repeat(first, counts)
        found = one.members[place]
        for number in (axis, (axis + 1) % 3, (axis + 2) % 3):
            kept = (self._low[number][found] <= high[number][given]) & (self._high[number][found] >= low[number][given])
            given, found = given[kept], found[kept]
        return given, found


def met_among(several: Sequence[SortedBoxes], low: Floats, high: Floats) -> tuple[Indices, Indices]:
    """Return the pairs of `SortedBoxes.met` for several in a row, with consecutive numbers of boxes."""
    if len(several) == 1:
        return several[0].met(low, high)
    before, pairs = 0, []
    for one in several:
        given, found = one.met(low, high)
        pairs.append((given, found + before))
        before += one.count
    given, found = (np.concatenate(column) for column in zip(*pairs, strict=True))
    order = np.argsort(given, kind="stable")
    return given[order], found[order]

"""Boxes along the world's axes, sorted: to find those near a place costs what is near, not how many there are.

Boxes of like size are a class, in the order of their least coordinate along the axis on which they are spread most: of
each class those whose beginning is no more than its greatest size before a question's are compared.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from foosim.world.rays.boxes import Floats

Indices = NDArray[np.intp]
FEW: Final = 256
"""So many boxes at most are compared one and all: it costs less than sorting."""
GROWTH_BITS: Final = 2
"""A class has boxes that differ by less than 2 to this power in size."""


class _Class:
    """Boxes of like size: where they begin along the axis, in order, which they are, and the greatest size."""

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
        count = low.shape[1]
        if count <= FEW:
            return
        middles = low + high
        self._axis = int(np.argmax(middles.max(axis=1) - middles.min(axis=1)))
        begins, sizes = low[self._axis], high[self._axis] - low[self._axis]
        ranks = np.frexp(sizes)[1] // GROWTH_BITS
        for rank in np.unique(ranks).tolist():
            members = np.flatnonzero(ranks == rank)
            self._classes.append(_Class(begins, members, float(sizes[members].max())))

    def met(self, low: Floats, high: Floats) -> tuple[Indices, Indices]:
        """Return which of some boxes (3, n) overlap which of these: pairs in the order of the former, then these."""
        if not self._classes:
            is_met = np.ones((low.shape[1], self._low.shape[1]), np.bool_)
            for axis in range(3):
                is_met &= self._low[axis] <= high[axis][:, None]
                is_met &= self._high[axis] >= low[axis][:, None]
            asked, found = np.nonzero(is_met)
            return asked, found
        pairs = [self._met_of(one, low, high) for one in self._classes]
        asked, found = (np.concatenate(column) for column in zip(*pairs, strict=True))
        order = np.argsort(asked * self._low.shape[1] + found, kind="stable")
        return asked[order], found[order]

    def _met_of(self, one: _Class, low: Floats, high: Floats) -> tuple[Indices, Indices]:
        axis = self._axis
        first = np.searchsorted(one.begins, low[axis] - one.size, side="left")
        last = np.searchsorted(one.begins, high[axis], side="right")
        counts = np.maximum(last - first, 0)
        asked = np.repeat(np.arange(low.shape[1]), counts)
        place = np.arange(len(asked)) - np.repeat(np.cumsum(counts) - counts, counts) + np.repeat(first, counts)
        found = one.members[place]
        for number in (axis, (axis + 1) % 3, (axis + 2) % 3):
            kept = (self._low[number][found] <= high[number][asked]) & (self._high[number][found] >= low[number][asked])
            asked, found = asked[kept], found[kept]
        return asked, found

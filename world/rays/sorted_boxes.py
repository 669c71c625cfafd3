"""Boxes along the world's axes, sorted: to find those near a place costs what is near, not how many there are.

Boxes of like size are a class, in the order of their least coordinate along the axis on which they are spread most: of
each class those whose beginning is no more than its greatest size before a question's are compared.
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
        """Return which of some boxes (3, n) overlap which of these: pairs in the order of the former, then these."""
        if not self._classes:
            overlap = self._low[:, None, :] <= high[:, :, None]
            overlap &= self._high[:, None, :] >= low[:, :, None]
            asked, found = (overlap[0] & overlap[1] & overlap[2]).nonzero()
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


def met_among(several: Sequence[SortedBoxes], low: Floats, high: Floats) -> tuple[Indices, Indices]:
    """Return what `SortedBoxes.met` does, of several one after the other, whose numbers go on."""
    if len(several) == 1:
        return several[0].met(low, high)
    before, pairs = 0, []
    for one in several:
        asked, found = one.met(low, high)
        pairs.append((asked, found + before))
        before += one.count
    asked, found = (np.concatenate(column) for column in zip(*pairs, strict=True))
    order = np.argsort(asked, kind="stable")
    return asked[order], found[order]

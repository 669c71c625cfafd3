"""The absent entities in the frames of a layout."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import compress
from operator import itemgetter

import numpy as np
from numpy.typing import NDArray

from foosim.world.component_types.descriptions import ABSENT
from foosim.world.layout import Layout


class Presence:
    """The entities of one layout that are absent: the same object as long as they are the same."""

    def __init__(self, layout: Layout) -> None:
        leaving = [entity for entity in layout.entities if entity.can_leave]
        self._indices = [entity.index for entity in leaving]
        self._places = [entity.offsets[ABSENT] for entity in leaving]
        self._in_array = np.array(self._places, np.intp)
        self._flags_of: Callable[[Sequence[float]], object] = (
            itemgetter(*self._places) if leaving else lambda numbers: ()
        )
        self._flags: object = None
        self._absent: frozenset[int] = frozenset()

    def absent(self, numbers: Sequence[float] | NDArray[np.float64]) -> frozenset[int]:
        """Return the indices of absent entities in a frame of these numbers; an array takes a fraction of the time."""
        flags = numbers[self._in_array].tobytes() if isinstance(numbers, np.ndarray) else self._flags_of(numbers)
        if flags != self._flags:
            self._flags = flags
            if isinstance(numbers, np.ndarray):
                absent = frozenset(compress(self._indices, numbers[self._in_array].tolist()))
            else:
                absent = frozenset(compress(self._indices, map(numbers.__getitem__, self._places)))
            if absent != self._absent:
                self._absent = absent
        return self._absent

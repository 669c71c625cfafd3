"""The slots of many entities as an array with a row for each: one read and one write for all of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from operator import itemgetter
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foosim.world.components.view import Slot, SolvingView, WritableView

Floats: TypeAlias = NDArray[np.float64]


class Columns:
    """Slots of several entities, alike in their sizes: the numbers of one entity are a row."""

    def __init__(self, rows: Sequence[Sequence[Slot]]) -> None:
        places = [place for slots in rows for slot in slots for place in range(slot.at, slot.at + slot.size)]
        self._count = len(rows)
        self.width = len(places) // len(rows)
        assert all(sum(slot.size for slot in slots) == self.width for slots in rows), rows
        self._numbers: Callable[[Sequence[float]], Any] = itemgetter(*places, places[0])
        """With the first one once more, so that there are always several."""
        self._places = np.array(places).reshape(self._count, self.width)
        self._rows = [tuple(slots) for slots in rows]
        runs = [_run(slots) for slots in rows]
        self._runs = [run for run in runs if run is not None] if None not in runs else []

    def read(self, numbers: Sequence[float]) -> Floats:
        """Return the numbers, of shape (entities, numbers)."""
        return np.array(self._numbers(numbers)[:-1]).reshape(self._count, self.width)

    def read_at_start(self, view: SolvingView) -> Floats:
        """Return the numbers that they have at the start of the tick, of shape (entities, numbers)."""
        found: Floats = view.values[self._places]
        return found

    def write(self, view: WritableView, values: Floats) -> None:
        """Write all of them."""
        rows = values.tolist()
        if self._runs and np.isfinite(values).all():
            view.write_rows(self._runs, rows)
            return
        for slots, row in zip(self._rows, rows, strict=True):
            first = 0
            for slot in slots:
                view.write(slot, *row[first : first + slot.size])
                first += slot.size


def _run(slots: Sequence[Slot]) -> Slot | None:
    """Return slots as one where each follows the one before it and all may be written; None where they are not so."""
    ends = [slot.at + slot.size for slot in slots]
    is_run = all(slot.at == end for slot, end in zip(slots[1:], ends, strict=False))
    if not (is_run and all(slot.is_own for slot in slots)):
        return None
    return Slot(slots[0].at, ends[-1] - slots[0].at, slots[0].name, is_own=True)

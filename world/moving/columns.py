"""The slots of many entities as an array with a row for each: one read and one write for all of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from operator import itemgetter
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foosim.world.components.entities import MotionMounting
from foosim.world.components.view import Slot, WritableView
from foosim.world.layout import Entity

Floats: TypeAlias = NDArray[np.float64]


class Columns:
    """Slots of several entities, alike in their sizes: the numbers of one entity are a row."""

    def __init__(self, rows: Sequence[Sequence[Slot]]) -> None:
        sizes = [slot.size for slot in rows[0]]
        assert [[slot.size for slot in slots] for slots in rows] == [sizes] * len(rows), rows
        self.width = sum(sizes)
        starts = np.array([[slot.at for slot in slots] for slots in rows])
        self._rows = [tuple(slots) for slots in rows]
        self._runs_known: list[Slot] | None = None
        """Each row as one slot, where all are that; made when it is first needed."""
        steps = np.concatenate([np.arange(size) for size in sizes])
        self._take(np.repeat(starts, sizes, axis=1) + steps)

    def taken(self, rows: NDArray[np.intp]) -> Columns:
        """Return those of some of the entities, by their rows."""
        found, chosen = copy(self), rows.tolist()
        found._rows = [self._rows[row] for row in chosen]
        found._runs_known = [self._runs[row] for row in chosen] if self._runs else []
        found._take(self._places[rows])
        return found

    @property
    def _runs(self) -> list[Slot]:
        if self._runs_known is None:
            runs = [_run(slots) for slots in self._rows]
            self._runs_known = [run for run in runs if run is not None] if None not in runs else []
        return self._runs_known

    def _take(self, places: NDArray[np.int64]) -> None:
        self._count, self._places = len(places), places
        self._numbers: Callable[[Sequence[float]], Any] | None = None
        """With the first one once more, so that there are always several; made when it is first needed."""

    def read(self, numbers: Sequence[float]) -> Floats:
        """Return the numbers, of shape (entities, numbers)."""
        if self._numbers is None:
            places = self._places.ravel().tolist()
            self._numbers = itemgetter(*places, places[0])
        return np.array(self._numbers(numbers)[:-1]).reshape(self._count, self.width)

    def read_at_start(self, view: WritableView) -> Floats:
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


class EntityColumns:
    """The same fields of all entities that a motion moves: columns of any of them."""

    def __init__(self, at: MotionMounting, fields: Sequence[str]) -> None:
        self._rows = {entity.index: row for row, entity in enumerate(at.entities)}
        self._all = Columns([[at.slot(entity, field) for field in fields] for entity in at.entities])

    def of(self, entities: Sequence[Entity]) -> Columns:
        """Return those of these entities."""
        return self._all.taken(np.array([self._rows[entity.index] for entity in entities]))


def _run(slots: Sequence[Slot]) -> Slot | None:
    """Return slots as one where each follows the one before it and all may be written; None where they are not so."""
    ends = [slot.at + slot.size for slot in slots]
    is_run = all(slot.at == end for slot, end in zip(slots[1:], ends, strict=False))
    if not (is_run and all(slot.is_own for slot in slots)):
        return None
    return Slot(slots[0].at, ends[-1] - slots[0].at, slots[0].name, is_own=True)

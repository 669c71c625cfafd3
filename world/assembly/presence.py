"""Who is absent in the frames of a layout."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from operator import itemgetter

from foosim.world.forms.forms import ABSENT
from foosim.world.layout import Layout


class Presence:
    """The entities of one layout that are absent: the same object as long as they are the same."""

    def __init__(self, layout: Layout) -> None:
        leaving = [entity for entity in layout.entities if entity.can_leave]
        places = [entity.offsets[ABSENT] for entity in leaving]
        self._flags_of: Callable[[Sequence[float]], object] = itemgetter(*places) if places else lambda numbers: ()
        self._places = [(entity.index, entity.offsets[ABSENT]) for entity in leaving]
        self._flags: object = None
        self._absent: frozenset[int] = frozenset()

    def absent(self, numbers: Sequence[float]) -> frozenset[int]:
        """Return the indices of those who are absent in a frame of these numbers."""
        flags = self._flags_of(numbers)
        if flags != self._flags:
            self._flags = flags
            absent = frozenset([index for index, at in self._places if numbers[at] != 0.0])
            if absent != self._absent:
                self._absent = absent
        return self._absent

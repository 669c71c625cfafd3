"""Who is absent in the frames of a layout."""

from __future__ import annotations

from collections.abc import Sequence

from foosim.world.forms.forms import ABSENT
from foosim.world.layout import Layout


class Presence:
    """The entities of one layout that are absent: the same object as long as they are the same."""

    def __init__(self, layout: Layout) -> None:
        leaving = [entity for entity in layout.entities if entity.can_leave]
        self._places = [entity.offsets[ABSENT] for entity in leaving]
        self._indices = [entity.index for entity in leaving]
        self._flags = [0.0] * len(leaving)
        self._absent: frozenset[int] = frozenset()

    def absent(self, numbers: Sequence[float]) -> frozenset[int]:
        """Return the indices of those who are absent in a frame of these numbers."""
        flags = [numbers[at] for at in self._places]
        if flags != self._flags:
            self._flags = flags
            pairs = zip(self._indices, flags, strict=True)
            self._absent = frozenset([index for index, flag in pairs if flag != 0.0])
        return self._absent

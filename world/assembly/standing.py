"""Unmoved bodies: a body that a solve has not changed, to the last bit, is not solved until an edit or command.

A solve is a function of the state of an island and of the set-points of its motors. So the next solve of a body that
is alone, that the last one has not changed, and whose set-points follow from its state alone, would not change it
either. Its slot `unmoved` is 1 after such a solve.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence

from foosim.world.components.fitted import BoundActuator
from foosim.world.frame import Frame
from foosim.world.layout import Entity, Layout

UNMOVED = "unmoved"


class UnmovedBodies:
    """The bodies of a layout that may stay unsolved: those with the slot, whose actuators are `steady`, without rules
    of their own."""

    def __init__(
        self, layout: Layout, actuators: Mapping[int, Sequence[BoundActuator]], ruled: Collection[int]
    ) -> None:
        """`actuators` and `ruled` are by the entities' indices."""
        self._having = [(one, one.offsets[UNMOVED]) for one in layout.entities if UNMOVED in one.offsets]
        self._places = {
            entity.index: at
            for entity, at in self._having
            if entity.index not in ruled and all(one.actuator.steady for one in actuators.get(entity.index, ()))
        }

    def awake(
        self, bodies: Sequence[Entity], alone: Collection[int], numbers: Sequence[float], start: Sequence[float]
    ) -> Sequence[Entity]:
        """Return the bodies that are solved: `alone` are the islands of one body, `start` the numbers before commands
        reached them."""
        places, found = self._places, []
        if not places:
            return bodies
        for entity in bodies:
            at, first, last = places.get(entity.index, -1), entity.start, entity.split
            is_unmoved = at >= 0 and numbers[at] == 1.0 and entity.index in alone
            if not is_unmoved or numbers[first:last] != start[first:last]:
                found.append(entity)
        return found

    def note(self, solved: Iterable[Entity], numbers: list[float], before: Sequence[float]) -> None:
        """Set the slot of each solved body: whether the solve has left it unchanged."""
        for entity in solved if self._places else ():
            at = self._places.get(entity.index, -1)
            if at >= 0:
                numbers[at] = before[at]
                first, last = entity.start, entity.split
                numbers[at] = 1.0 if numbers[first:last] == before[first:last] else 0.0

    def wake_edited(self, before: Frame, numbers: list[float]) -> None:
        """Let bodies be solved that an order or a rule of the world has changed."""
        old = before.numbers
        for entity, at in self._having:
            if numbers[at] == 0.0:
                continue
            if numbers[entity.start : entity.split] != old[entity.start : entity.split]:
                numbers[at] = 0.0

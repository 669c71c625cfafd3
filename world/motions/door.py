"""Doors that slide between closed and open, as far as they are told, and wait while something is in the way."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from foosim.common.exact_math import cos, sin
from foosim.world.clearance.leaf import InTheWay, Leaf
from foosim.world.components.entities import MotionMounting, Motors
from foosim.world.components.view import Slot, SolvingView
from foosim.world.forms.registry import motion
from foosim.world.layout import Entity
from foosim.world.models.hazards.door import DoorObject

STATE: Final = ("position", "linear_velocity", "opened", "blocked")
"""The fields that this motion writes."""


@motion("door", needs=(*STATE, "open"), writes=STATE)
class Sliding:
    """The share `opened` comes nearer to `open` by speed x tick / travel, unless something is in the way."""

    def __init__(self, at: MotionMounting) -> None:
        self._tick_s = at.spec.tick_ns / 1e9
        self._in_the_way = InTheWay(at)
        self._slots = {its.index: [at.slot(its, field) for field in (*STATE, "open")] for its in at.entities}
        self._settings = at.settings(DoorObject)

    def move(self, entities: Sequence[Entity], motors: Sequence[Motors], view: SolvingView) -> None:
        """Advance these doors by a tick; they have no motors."""
        for entity in entities:
            self._move(self._settings[entity.index], self._slots[entity.index], view)

    def _move(self, its: DoorObject, slots: Sequence[Slot], view: SolvingView) -> None:
        here, velocity, (opened,), (was_blocked,), (target,) = map(view.read, slots)
        if opened == target and not (any(velocity) or was_blocked):
            return
        step = its.speed * self._tick_s / abs(its.travel)
        share = min(max(target, opened - step), opened + step)
        there = its.place_at(share)
        is_blocked = share != opened and self._in_the_way.stops(_leaf(its, here), _leaf(its, there), view.start)
        if is_blocked:
            share, there = opened, its.place_at(opened)
        speeds = [(new - old) / self._tick_s for new, old in zip(there, here, strict=True)]
        for slot, numbers in zip(slots, (there, speeds, (share,), (float(is_blocked),)), strict=False):
            view.write(slot, *numbers)


def _leaf(its: DoorObject, place: Sequence[float]) -> Leaf:
    x, y, z = place
    yaw = its.closed.yaw
    return Leaf(x, y, cos(yaw), sin(yaw), its.length / 2, its.width / 2, z, z + its.height)

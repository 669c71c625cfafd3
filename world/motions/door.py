"""Doors that slide between closed and open, as far as they are told, and wait while something is in the way."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from foosim.common.exact_math import cos, sin
from foosim.world.clearance.leaf import InTheWay, Leaf
from foosim.world.components.entities import MotionMounting, Motors
from foosim.world.components.view import SolvingView
from foosim.world.forms.registry import motion
from foosim.world.layout import Entity
from foosim.world.models.hazards.door import DoorObject

STATE: Final = ("position", "linear_velocity", "opened", "blocked")
"""The fields that this motion writes."""


@motion("door", needs=(*STATE, "open"), writes=STATE)
class Sliding:
    """The share `opened` comes nearer to `open` by speed x tick / travel, unless something is in the way."""

    def __init__(self, at: MotionMounting) -> None:
        self._at, self._tick_s = at, at.spec.tick_ns / 1e9
        self._in_the_way = InTheWay(at)

    def move(self, entities: Sequence[Entity], motors: Sequence[Motors], view: SolvingView) -> None:
        """Advance these doors by a tick; they have no motors."""
        for entity in entities:
            self._move(entity, view)

    def _move(self, entity: Entity, view: SolvingView) -> None:
        its = self._at.spec.settings_of(entity.name)
        assert isinstance(its, DoorObject), "the motion door moves doors"
        slot = {field: self._at.slot(entity, field) for field in (*STATE, "open")}
        (opened,), (target,) = view.read(slot["opened"]), view.read(slot["open"])
        step = its.speed * self._tick_s / abs(its.travel)
        share = min(max(target, opened - step), opened + step)
        here, there = view.read(slot["position"]), its.place_at(share)
        is_blocked = share != opened and self._in_the_way.stops(_leaf(its, here), _leaf(its, there), view.start)
        if is_blocked:
            share, there = opened, its.place_at(opened)
        view.write(slot["position"], *there)
        view.write(slot["linear_velocity"], *[(new - old) / self._tick_s for new, old in zip(there, here, strict=True)])
        view.write(slot["opened"], share)
        view.write(slot["blocked"], float(is_blocked))


def _leaf(its: DoorObject, place: Sequence[float]) -> Leaf:
    x, y, z = place
    yaw = its.closed.yaw
    return Leaf(x, y, cos(yaw), sin(yaw), its.length / 2, its.width / 2, z, z + its.height)

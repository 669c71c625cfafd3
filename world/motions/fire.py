"""Fires that grow: the radius r of one that burns becomes min(r + growth x tick, the greatest one)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from foosim.world.components.entities import MotionMounting, Motors
from foosim.world.components.view import SolvingView
from foosim.world.forms.registry import motion
from foosim.world.layout import Entity
from foosim.world.models.hazards.fire import FireObject

STATE: Final = ("radius", "joint_positions")
"""The fields that this motion reads and writes."""


@motion("fire", needs=STATE, writes=STATE)
class Growing:
    """The radius grows with time, up to the greatest one. What is out stays out."""

    def __init__(self, at: MotionMounting) -> None:
        self._tick_s = at.spec.tick_ns / 1e9
        self._slots = {its.index: tuple(at.slot(its, field) for field in STATE) for its in at.entities}
        self._settings = at.settings(FireObject)

    def move(self, entities: Sequence[Entity], motors: Sequence[Motors], view: SolvingView) -> None:
        """Advance these fires by a tick; they have no motors."""
        for entity in entities:
            radius_slot, sunk = self._slots[entity.index]
            its, (radius,) = self._settings[entity.index], view.read(radius_slot)
            if radius > 0.0:
                radius = min(radius + its.growth * self._tick_s, its.radius_max)
            view.write(radius_slot, radius)
            view.write(sunk, radius - its.radius_max)

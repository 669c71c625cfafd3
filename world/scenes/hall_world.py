"""A hall with mobile robots in the tick of a node: rovers with wheels, no rules, and what cannot be."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from foosim.world.components.fitted import actuators_of
from foosim.world.components.view import WritableView
from foosim.world.layout import Entity, Layout
from foosim.world.spec import WorldSpec

ROUNDING: Final = 1.000001
"""A way is no longer than its speed allows, but for rounding."""


class HallWorld:
    """The hall of one deployment, with the rovers of one layout."""

    def __init__(self, spec: WorldSpec, layout: Layout) -> None:
        hall = spec.hall
        fitted = {entity.index: actuators_of(spec, layout, entity) for entity in layout.rovers}
        self.actuators = {index: actuators for index, actuators in fitted.items() if actuators}
        self._x_max, self._y_max = hall.length / 2 - hall.rover.radius, hall.width / 2 - hall.rover.radius
        self._reach_m = hall.rover.drive.speed * spec.tick_ns / 1e9 * ROUNDING

    def apply_rules(self, numbers: list[float], layout: Layout) -> None:
        """A hall has no rules."""

    def stir(self, numbers: list[float]) -> None:
        """Let all rovers drive in curves of their own."""
        view = WritableView(0, numbers)
        for fitted in self.actuators.values():
            for one in fitted:
                one.actuator.stir(view)

    def plausible(self, entity: Entity, numbers: Sequence[float], before: Sequence[float]) -> bool:
        """Whether a rover is in the hall, no farther away than its wheels can have taken it."""
        start = entity.offsets["position"]
        x, y = numbers[start : start + 2]
        dx, dy = x - before[start], y - before[start + 1]
        near = dx * dx + dy * dy <= self._reach_m * self._reach_m
        return near and abs(x) <= self._x_max and abs(y) <= self._y_max

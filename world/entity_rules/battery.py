"""The battery of a robot: the costs of idling and moving, and the power of chargers. Empty, it stops the drives.

In a tick of dt the charge falls by idle power x dt + drag x way, and rises by power x dt for each charger within whose
radius the robot is, between 0 and the capacity. The way of a rover is that of its wheels, of any other robot the
distance between its places at the tick's start and end; a robot with a fixed base covers none.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import sqrt
from typing import TYPE_CHECKING, ClassVar, Final

from foosim.world.components.base import EntityRule
from foosim.world.components.entities import Marked, MarkKind
from foosim.world.components.surroundings import Surroundings
from foosim.world.components.view import Mounting, View, WritableView
from foosim.world.energy.battery import BatteryRuleSettings, cell_of, chargers_of, check_battery, is_rover
from foosim.world.forms.registry import rule
from foosim.world.models.rover import CHARGE

if TYPE_CHECKING:
    from foosim.world.frame import Frame

EMPTY: Final = "empty"


@rule("battery", BatteryRuleSettings, slots={"charge": 1}, shared=("charge",), settable={"charge": CHARGE})
class Battery(EntityRule):
    """The charge of one robot (J)."""

    mark_kinds: ClassVar = {EMPTY: MarkKind("lost", "empty batteries")}

    def __init__(self, settings: BatteryRuleSettings, at: Mounting) -> None:
        self._name, self._dt = at.robot.name, at.spec.tick_ns / 1e9
        cell = cell_of(settings, at)
        self._idle, self._drag, self._capacity = cell.idle, cell.drag, cell.capacity
        self._start = settings.charge * cell.capacity
        self._charge, self._robot = at.slot("charge"), at.robot
        self._is_rover = is_rover(at.spec, at.robot)
        self._field = f"{at.name}.charge" if f"{at.name}.charge" in at.robot.offsets else "charge"
        self._wheels = at.slot("wheel_speeds").at if self._is_rover else -1
        self._position = at.robot.offsets.get("position", -1)
        self._around = Surroundings(at.spec, at.layout)
        chargers = chargers_of(settings, at)
        self._standing = [(its.x or 0.0, its.y or 0.0, its.radius, its.power) for its in chargers if its.tag is None]
        self._tagged = [
            (entity, its.radius, its.power)
            for its in chargers
            if its.tag is not None
            for entity in self._around.tagged(its.tag)
            if entity.index != at.robot.index
        ]

    @staticmethod
    def check(settings: BatteryRuleSettings, at: Mounting) -> None:
        """Raise IncompatibleComponent for a battery that the robot cannot have."""
        check_battery(settings, at)

    def place(self, view: WritableView) -> None:
        """Charge it by the deployment's or the rover's own setting."""
        if not self._is_rover:
            view.write(self._charge, self._start)

    def set(self, field: str, value: float) -> Mapping[str, Sequence[float]]:
        """Return the charge of a share of its capacity."""
        return {field: [value * self._capacity]}

    def has_power(self, view: View) -> bool:
        """Whether there is any charge."""
        return view.numbers[self._charge.at] > 0.0

    def apply(self, view: WritableView) -> None:
        """Subtract the cost of a tick, and add the energy from chargers."""
        charge = view.numbers[self._charge.at] - self._idle * self._dt - self._drag * self._way(view)
        chargers = [*self._standing, *self._places(view)] if self._tagged else self._standing
        if chargers:
            x, y = self._place(view)
            for there_x, there_y, reach, power in chargers:
                dx, dy = x - there_x, y - there_y
                if dx * dx + dy * dy <= reach * reach:
                    charge += power * self._dt
        view.write(self._charge, min(max(charge, 0.0), self._capacity))

    def _way(self, view: WritableView) -> float:
        """Return how far it has gone in the tick (m)."""
        numbers, start, at = view.numbers, view.start, self._position
        if self._is_rover:
            wheels = self._wheels
            return (abs(numbers[wheels]) + abs(numbers[wheels + 1])) / 2.0 * self._dt
        if at < 0:
            return 0.0
        dx, dy, dz = numbers[at] - start[at], numbers[at + 1] - start[at + 1], numbers[at + 2] - start[at + 2]
        return sqrt(dx * dx + dy * dy + dz * dz)

    def _place(self, view: View) -> tuple[float, float]:
        at = self._position
        if at >= 0:
            return view.numbers[at], view.numbers[at + 1]
        place = self._around.position(view, self._robot)
        assert place is not None, "checked with the deployment"
        return place[0], place[1]

    def _places(self, view: View) -> Iterator[tuple[float, float, float, float]]:
        """Yield the places of chargers at the tick's start."""
        for entity, reach, power in self._tagged:
            place = self._around.position(view, entity)
            if place is not None:
                yield place[0], place[1], reach, power

    def marks(self, before: Frame, after: Frame) -> Iterator[Marked]:
        """Yield that it is empty from then on."""
        if before.at(self._name, self._field) > 0.0 >= after.at(self._name, self._field):
            yield after.tick, EMPTY, f"the battery of {self._name} is empty"

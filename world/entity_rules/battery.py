"""The battery of a rover: what standing and rolling take from it, and what a station beside it gives.

The charge falls by idle power x time + drag x way of the wheels, and rises by the charger's power x time for each
station whose middle is within its radius, between 0 and the capacity.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from foosim.world.components.entities import Marked, MarkKind
from foosim.world.components.view import Mounting, WritableView
from foosim.world.forms.registry import entity_rule
from foosim.world.forms.settings import EntityRuleSettings
from foosim.world.models.station import StationRobot
from foosim.world.parameters.hall import hall_of

if TYPE_CHECKING:
    from foosim.world.frame import Frame

EMPTY: Final = "empty"


class BatteryRuleSettings(EntityRuleSettings):
    """Takes from a rover's charge, and gives; the numbers are the hall's."""


@entity_rule(
    "battery",
    BatteryRuleSettings,
    needs=("charge", "wheel_speeds", "position"),
    writes=("charge",),
    kit="hall",
)
class Battery:
    """The charge of one rover."""

    mark_kinds: Final = {EMPTY: MarkKind("lost", "empty batteries")}

    def __init__(self, settings: BatteryRuleSettings, at: Mounting) -> None:
        hall = hall_of(at.spec)
        self._name, self._dt = at.robot.name, at.spec.tick_ns / 1e9
        battery, station = hall.rover.battery, hall.station
        self._idle, self._drag, self._capacity = battery.idle, battery.drag, battery.capacity
        self._reach, self._power = station.charge_radius, station.charge_power
        robots = [robot for _, robot in sorted(at.spec.robots.items())]
        self._chargers = [(robot.x, robot.y) for robot in robots if isinstance(robot, StationRobot)]
        self._charge, self._wheels, self._position = at.slot("charge"), at.slot("wheel_speeds"), at.slot("position")

    def apply(self, view: WritableView) -> None:
        """Take what a tick costs, and give what stations give."""
        numbers, dt, reach = view.numbers, self._dt, self._reach
        wheels, position = self._wheels.at, self._position.at
        x, y = numbers[position], numbers[position + 1]
        way = (abs(numbers[wheels]) + abs(numbers[wheels + 1])) / 2.0 * dt
        charge = numbers[self._charge.at] - self._idle * dt - self._drag * way
        for there_x, there_y in self._chargers:
            dx, dy = x - there_x, y - there_y
            if dx * dx + dy * dy <= reach * reach:
                charge += self._power * dt
        view.write(self._charge, min(max(charge, 0.0), self._capacity))

    def marks(self, before: Frame, after: Frame) -> Iterator[Marked]:
        """Yield that it is empty from then on."""
        if before.at(self._name, "charge") > 0.0 >= after.at(self._name, "charge"):
            yield after.tick, EMPTY, f"the battery of {self._name} is empty"

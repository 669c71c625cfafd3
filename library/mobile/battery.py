"""The battery of a robot: its settings, the rule that drains and charges it, and the sensor of its charge and voltage.

An empty battery stops the drives.

In a tick of dt the charge falls by idle power x dt + drag x way, and rises by power x dt for each charger within whose
radius the robot is, between 0 and the capacity. The way of a rover is that of its wheels, of any other robot the
distance between its places at the tick's start and end; a robot with a fixed base covers none.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import TYPE_CHECKING, Annotated, ClassVar, Final, Self

from msgspec import Struct
from pydantic import Field, model_validator

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.spec_base import SpecBase, default
from foosim.common.units import Quantity, custom_error
from foosim.library.mobile.hall_settings import Capacity, Drag, Load, Voltage, hall_of
from foosim.library.mobile.rover import CHARGE, Charge, RoverRobot
from foosim.library.mobile.station import StationRobot
from foosim.world.component_types.quantities import Share, Volts
from foosim.world.component_types.registry import rule, sensor
from foosim.world.component_types.settings import EntityRuleSettings, SensorSettings, Tag
from foosim.world.components.base import EntityRule, Sensor, slot
from foosim.world.components.entities import Marked, MarkKind
from foosim.world.components.surroundings import Surroundings
from foosim.world.components.view import IncompatibleComponent, Mounting, View, WritableView
from foosim.world.layout import Entity
from foosim.world.placing import Coordinate
from foosim.world.spec import WorldSpec

if TYPE_CHECKING:
    from foosim.world.frame import Frame


CHARGERS_MAX: Final = 64
Reach = Annotated[float, Quantity(units.LENGTH, "1 cm", "10 km")]


class Charger(SpecBase):
    """A place that charges each robot within `radius` of it, seen from above, with `power`.

    It is round about `x`, `y`; with a `tag`, round about each entity that has the tag, wherever that is.
    """

    x: Coordinate | None = None
    y: Coordinate | None = None
    tag: Tag | None = None
    radius: Reach
    power: Load

    @model_validator(mode="after")
    def _is_somewhere(self) -> Self:
        if (self.tag is None) is (self.x is None and self.y is None):
            raise custom_error(BadValue("a charger has x and y, or a tag"))
        return self


class BatteryRuleSettings(EntityRuleSettings):
    """Takes `idle` power from a robot's charge all the time and `drag` times its way; `chargers` give.

    It begins with the share `charge` of its `capacity`. The voltage falls evenly with the charge from `full` to
    `empty`. The drives of a robot whose battery is empty stop. A rover of a hall has the numbers of the hall.
    """

    capacity: Capacity | None = None
    idle: Load = default("0 W")
    drag: Drag = default("0 N")
    charge: Charge = default("100 %")
    full: Voltage = default("12.6 V")
    empty: Voltage = default("9 V")
    chargers: list[Charger] = Field(default=[], max_length=CHARGERS_MAX)

    @model_validator(mode="after")
    def _falls(self) -> Self:
        if not self.empty < self.full:
            raise custom_error(BadValue("the empty battery's voltage is not below the full one's", f"{self.empty:g} V"))
        return self


@dataclass(frozen=True, slots=True)
class Cell:
    """The numbers of one battery: capacity (J), power all the time (W), energy by way (J/m), voltages (V)."""

    capacity: float
    idle: float
    drag: float
    full: float
    empty: float


def cell_of(settings: BatteryRuleSettings | None, at: Mounting) -> Cell:
    """Return the battery of a robot that has these settings, or is a rover."""
    if is_rover(at.spec, at.robot):
        its = hall_of(at.spec).rover.battery
        return Cell(its.capacity, its.idle, its.drag, its.full, its.empty)
    assert settings is not None and settings.capacity is not None, "checked with the deployment"
    return Cell(settings.capacity, settings.idle, settings.drag, settings.full, settings.empty)


def chargers_of(settings: BatteryRuleSettings, at: Mounting) -> list[Charger]:
    """Return the chargers of a robot: for a rover the stations of its hall, in the order of their names."""
    if not is_rover(at.spec, at.robot):
        return settings.chargers
    station = hall_of(at.spec).station
    places = [robot for _, robot in sorted(at.spec.robots.items()) if isinstance(robot, StationRobot)]
    reach, power = station.charge_radius, station.charge_power
    return [Charger.model_construct(None, x=its.x, y=its.y, tag=None, radius=reach, power=power) for its in places]


def is_rover(spec: WorldSpec, robot: Entity) -> bool:
    """Whether a robot is a rover of a hall, whose battery is the hall's."""
    return isinstance(spec.robots[robot.name], RoverRobot)


def batteries_of(spec: WorldSpec, robot: Entity) -> dict[str, BatteryRuleSettings]:
    """Return the batteries that a robot has, by the names of their rules."""
    rules = sorted(spec.robots[robot.name].rules.items())
    return {label: its for label, its in rules if isinstance(its, BatteryRuleSettings)}


def check_battery(settings: BatteryRuleSettings, at: Mounting) -> None:
    """Raise IncompatibleComponent for a rover with numbers of its own, for another robot without a capacity, and for
    two batteries."""
    given = sorted(settings.model_fields_set - {"kind"})
    if is_rover(at.spec, at.robot) and given:
        valid = "its battery is that of hall.rover.battery, hall.station charges it"
        raise IncompatibleComponent((given[0],), f"not of a rover of the hall: {valid}", given[0])
    if not is_rover(at.spec, at.robot) and settings.capacity is None:
        raise IncompatibleComponent(("kind",), "a battery needs a capacity, for example 200 Wh", settings.kind)
    first, *more = batteries_of(at.spec, at.robot)
    if more and at.name != first:
        raise IncompatibleComponent(("kind",), f"a second battery: the first is {first}", settings.kind)


EMPTY: Final = "empty"


@rule("battery", BatteryRuleSettings, settable={"charge": CHARGE})
class BatteryRule(EntityRule):
    """The charge of one robot (J)."""

    mark_kinds: ClassVar = {EMPTY: MarkKind("lost", "empty batteries")}
    charge = slot(shared=True)

    def __init__(self, settings: BatteryRuleSettings, at: Mounting) -> None:
        self._name, self._dt = at.robot.name, at.spec.tick_ns / 1e9
        cell = cell_of(settings, at)
        self._idle, self._drag, self._capacity = cell.idle, cell.drag, cell.capacity
        self._start = settings.charge * cell.capacity
        self._robot = at.robot
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
            view.write(self.charge, self._start)

    def set(self, field: str, value: float) -> Mapping[str, Sequence[float]]:
        """Return the charge of a share of its capacity."""
        return {field: [value * self._capacity]}

    def has_power(self, view: View) -> bool:
        """Whether there is any charge."""
        return view.numbers[self.charge.at] > 0.0

    def apply(self, view: WritableView) -> None:
        """Subtract the cost of a tick, and add the energy from chargers."""
        charge = view.numbers[self.charge.at] - self._idle * self._dt - self._drag * self._way(view)
        chargers = [*self._standing, *self._places(view)] if self._tagged else self._standing
        if chargers:
            x, y = self._place(view)
            for there_x, there_y, reach, power in chargers:
                dx, dy = x - there_x, y - there_y
                if dx * dx + dy * dy <= reach * reach:
                    charge += power * self._dt
        view.write(self.charge, min(max(charge, 0.0), self._capacity))

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


class BatterySettings(SensorSettings):
    """The charge as a share of the capacity, and the voltage, of a robot with the rule `battery`."""


class Battery(Struct, frozen=True):
    """A robot's battery: `share` of its capacity, `voltage` in V."""

    share: Share
    voltage: Volts


@sensor("battery", BatterySettings, Battery)
class BatteryGauge(Sensor):
    """Charge of a battery as a share of its capacity, and its voltage, which falls evenly with the charge."""

    def __init__(self, settings: BatterySettings, at: Mounting) -> None:
        label, battery = next(iter(batteries_of(at.spec, at.robot).items()), ("", None))
        cell, own = cell_of(battery, at), f"{label}.charge"
        self._charge = at.robot.offsets[own if own in at.robot.offsets else "charge"]
        self._capacity_j = cell.capacity
        self._empty_v, self._span_v = cell.empty, cell.full - cell.empty

    @staticmethod
    def check(settings: BatterySettings, at: Mounting) -> None:
        """Raise IncompatibleComponent on a robot without a battery."""
        if not (is_rover(at.spec, at.robot) or batteries_of(at.spec, at.robot)):
            raise IncompatibleComponent(
                ("kind",), f"on a robot without a battery: {at.robot.name} has no rule battery", settings.kind
            )

    def sample(self, view: View) -> Battery:
        share = view.numbers[self._charge] / self._capacity_j
        return Battery(share, self._empty_v + share * self._span_v)

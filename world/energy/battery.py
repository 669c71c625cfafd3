"""What a battery of a robot is like: its settings, and the numbers of the battery that a robot has."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final, Self

from pydantic import Field, model_validator

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.spec_base import SpecBase, default
from foosim.common.units import Quantity, custom_error
from foosim.world.components.view import IncompatibleComponent, Mounting
from foosim.world.forms.settings import EntityRuleSettings, Tag
from foosim.world.layout import Entity
from foosim.world.models.rover import Charge, RoverRobot
from foosim.world.models.station import StationRobot
from foosim.world.parameters.hall import Capacity, Drag, Load, Voltage, hall_of
from foosim.world.placing import Coordinate
from foosim.world.spec import WorldSpec

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

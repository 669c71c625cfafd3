"""The world parameters of a hall with mobile robots: `hall:` of a deployment.

Frame of reference: x along the hall, y across it, z up, the origin on the floor in the middle. Every value is in SI
units here. Sources of the numbers are in deploy/warehouse.yaml.
"""

from collections.abc import Iterator
from typing import Annotated, Final

from foosim.common import units
from foosim.common.finding import Finding
from foosim.common.spec_base import Length, SpecBase
from foosim.common.units import Quantity
from foosim.world.spec import WorldSpec

HALL: Final = "hall"
Place = Annotated[float, Quantity(units.LENGTH, "-500 m", "500 m")]
Side = Annotated[float, Quantity(units.LENGTH, "1 m", "1000 m")]
WheelSpeed = Annotated[float, Quantity(units.SPEED, "1 mm/s", "20 m/s")]
WheelAcceleration = Annotated[float, Quantity(units.ACCELERATION, "1 mm/s2", "100 m/s2")]
Slip = Annotated[float, Quantity(units.PROBABILITY, "0 %", "50 %")]
Capacity = Annotated[float, Quantity(units.ENERGY, "1 J", "100 kWh")]
Load = Annotated[float, Quantity(units.POWER, "0 W", "100 kW")]
Drag = Annotated[float, Quantity(units.FORCE, "0 N", "10 kN")]
Voltage = Annotated[float, Quantity(units.VOLTAGE, "0 V", "1 kV")]


class HallWalls(SpecBase):
    """The walls around the hall: height above the floor, thickness outwards."""

    height: Length
    thickness: Length


class RoverDrive(SpecBase):
    """Two driven wheels, `track` apart: greatest speed and acceleration of their rims.

    A wheel rolls less far than it turns, each by a share of its own between none and `slip`.
    """

    track: Length
    speed: WheelSpeed
    acceleration: WheelAcceleration
    slip: Slip


class RoverBattery(SpecBase):
    """What a rover lives on: `idle` power always, and `drag` times the way of its wheels; the voltage falls evenly."""

    capacity: Capacity
    idle: Load
    drag: Drag
    full: Voltage
    empty: Voltage


class Rover(SpecBase):
    """A round rover on two wheels; its antenna stands on its middle, `antenna_height` above the floor."""

    radius: Length
    height: Length
    antenna_height: Length
    drive: RoverDrive
    battery: RoverBattery


class Station(SpecBase):
    """A base station: round, with an antenna; it charges every rover whose middle is within `charge_radius`."""

    radius: Length
    height: Length
    antenna_height: Length
    charge_radius: Length
    charge_power: Load


class Hall(SpecBase):
    """The whole hall: its bounds, which are walls, and the properties of its rovers and base stations."""

    length: Side
    width: Side
    walls: HallWalls
    rover: Rover
    station: Station


def hall_of(spec: WorldSpec) -> Hall:
    """Return the hall of a world that has one."""
    return spec.section(HALL, Hall)


def hall_findings(hall: Hall) -> Iterator[Finding]:
    """Yield the contradictions between the settings of a hall."""
    rover = hall.rover
    if 2 * rover.radius > min(hall.length, hall.width):
        yield Finding((HALL, "rover", "radius"), "more than half of the hall's least side")
    if rover.drive.track > 2 * rover.radius:
        what = "the wheels would be outside of the rover: more than twice its radius"
        yield Finding((HALL, "rover", "drive", "track"), what)
    if rover.battery.empty >= rover.battery.full:
        yield Finding((HALL, "rover", "battery", "empty"), "not below the full battery's voltage")

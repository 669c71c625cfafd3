"""The robots of a hall as a deployment declares them: rovers, and base stations."""

from typing import Annotated, Literal

from foosim.common import units
from foosim.common.spec_base import default
from foosim.common.units import Quantity
from foosim.world.robots.settings import RobotSettings

Place = Annotated[float, Quantity(units.LENGTH, "-500 m", "500 m")]
Heading = Annotated[float, Quantity(units.ANGLE, "-360 deg", "360 deg")]
Charge = Annotated[float, Quantity(units.PROBABILITY, "0 %", "100 %")]


class RoverRobot(RobotSettings):
    """A rover and where it starts. Its usual actuator is `drive`, of the kind `wheel_speeds`."""

    model: Literal["rover"]
    x: Place
    y: Place
    heading: Heading = default("0 deg")
    charge: Charge = default("100 %")


class StationRobot(RobotSettings):
    """A base station: an antenna at a place, and power for the rovers beside it."""

    model: Literal["station"]
    x: Place
    y: Place

"""The robots of a hall as a deployment declares them: rovers with their sensors, and base stations.

Neighbours: `deployment`, which holds them; `hall` has what all of them share; node/sensors and node/actuators.
"""

from collections.abc import Mapping
from fractions import Fraction
from types import MappingProxyType
from typing import Annotated, Any, Final, Literal

from pydantic import Field

from foosim.protocol import units
from foosim.protocol.hosts import Name
from foosim.protocol.table import Part
from foosim.protocol.units import Quantity

Rate = Annotated[Fraction, Quantity(units.RATE, "1 mHz", "10 kHz")]
Offset = Annotated[int, Quantity(units.TIME, "0 s", "1000 s")]
"""By how much later than a multiple of its period something happens: whole ticks, below the period."""
LengthNoise = Annotated[float, Quantity(units.LENGTH, "0 m", "1 m")]
AngleNoise = Annotated[float, Quantity(units.ANGLE, "0 deg", "180 deg")]
VoltageNoise = Annotated[float, Quantity(units.VOLTAGE, "0 V", "10 V")]
Range = Annotated[float, Quantity(units.LENGTH, "1 cm", "100 m")]
Place = Annotated[float, Quantity(units.LENGTH, "-500 m", "500 m")]
Heading = Annotated[float, Quantity(units.ANGLE, "-360 deg", "360 deg")]
Charge = Annotated[float, Quantity(units.PROBABILITY, "0 %", "100 %")]

RAYS_MAX: Final = 128


def _default(text: str, alias: str | None = None) -> Any:
    """A field with a default that is written, checked and documented as in a file."""
    return Field(default=text, alias=alias, validate_default=True)


class PoseSensor(Part):
    """Where a rover is: x, y (m) and heading (rad, from +x towards +y), with Gaussian noise on each: 3 float64."""

    kind: Literal["pose"]
    rate_hz: Rate = Field(alias="rate")
    offset_ns: Offset = _default("0 s", "offset")
    position_noise: LengthNoise
    heading_noise: AngleNoise


class OdometrySensor(Part):
    """How far the left and the right wheel have turned (m at the rim), with Gaussian noise on each: 2 float64."""

    kind: Literal["odometry"]
    rate_hz: Rate = Field(alias="rate")
    offset_ns: Offset = _default("0 s", "offset")
    noise: LengthNoise


class ProximitySensor(Part):
    """How far it is from a rover's hull to what stands in the way of each of `rays` rays (m), at most `range`.

    One float64 a ray, the first one ahead, the others evenly around to the left; Gaussian noise on what is hit.
    """

    kind: Literal["proximity"]
    rate_hz: Rate = Field(alias="rate")
    offset_ns: Offset = _default("0 s", "offset")
    rays: Annotated[int, Field(ge=1, le=RAYS_MAX)]
    range: Range
    noise: LengthNoise


class BatterySensor(Part):
    """The charge as a share of the capacity, and the voltage (V) with Gaussian noise: 2 float64."""

    kind: Literal["battery"]
    rate_hz: Rate = Field(alias="rate")
    offset_ns: Offset = _default("0 s", "offset")
    noise: VoltageNoise


RoverSensor = Annotated[
    PoseSensor | OdometrySensor | ProximitySensor | BatterySensor,
    Field(discriminator="kind"),
]


class RoverRobot(Part):
    """A rover and where it starts. Its actuator channel is `drive`: speed of the left and right wheel, 2 float64."""

    model: Literal["rover"]
    x: Place
    y: Place
    heading: Heading = _default("0 deg")
    charge: Charge = _default("100 %")
    sensors: dict[Name, RoverSensor] = Field(max_length=16)


class StationRobot(Part):
    """A base station: an antenna at a place, and power for the rovers beside it."""

    model: Literal["station"]
    x: Place
    y: Place

    @property
    def sensors(self) -> Mapping[str, RoverSensor]:
        """It has none."""
        return MappingProxyType({})

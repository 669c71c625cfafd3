"""The robots of a hall as a deployment declares them: rovers with their sensors, and base stations."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated, Final, Literal

from pydantic import Field

from foosim.common import units
from foosim.common.spec_base import AngleNoise, LengthNoise, Name, Offset, Rate, SpecBase, default
from foosim.common.units import Quantity

VoltageNoise = Annotated[float, Quantity(units.VOLTAGE, "0 V", "10 V")]
Range = Annotated[float, Quantity(units.LENGTH, "1 cm", "100 m")]
Place = Annotated[float, Quantity(units.LENGTH, "-500 m", "500 m")]
Heading = Annotated[float, Quantity(units.ANGLE, "-360 deg", "360 deg")]
Charge = Annotated[float, Quantity(units.PROBABILITY, "0 %", "100 %")]

RAYS_MAX: Final = 128


class PoseSensor(SpecBase):
    """Where a rover is: x, y (m) and heading (rad, from +x towards +y), with Gaussian noise on each: 3 float64."""

    kind: Literal["pose"]
    rate_hz: Rate = Field(alias="rate")
    offset_ns: Offset = default("0 s", "offset")
    position_noise: LengthNoise
    heading_noise: AngleNoise


class OdometrySensor(SpecBase):
    """How far the left and the right wheel have turned (m at the rim), with Gaussian noise on each: 2 float64."""

    kind: Literal["odometry"]
    rate_hz: Rate = Field(alias="rate")
    offset_ns: Offset = default("0 s", "offset")
    noise: LengthNoise


class ProximitySensor(SpecBase):
    """How far it is from a rover's hull to what stands in the way of each of `rays` rays (m), at most `range`.

    One float64 a ray, the first one ahead, the others evenly around to the left; Gaussian noise on what is hit.
    """

    kind: Literal["proximity"]
    rate_hz: Rate = Field(alias="rate")
    offset_ns: Offset = default("0 s", "offset")
    rays: Annotated[int, Field(ge=1, le=RAYS_MAX)]
    range: Range
    noise: LengthNoise


class BatterySensor(SpecBase):
    """The charge as a share of the capacity, and the voltage (V) with Gaussian noise: 2 float64."""

    kind: Literal["battery"]
    rate_hz: Rate = Field(alias="rate")
    offset_ns: Offset = default("0 s", "offset")
    noise: VoltageNoise


RoverSensor = Annotated[
    PoseSensor | OdometrySensor | ProximitySensor | BatterySensor,
    Field(discriminator="kind"),
]


class RoverRobot(SpecBase):
    """A rover and where it starts. Its actuator channel is `drive`: speed of the left and right wheel, 2 float64."""

    model: Literal["rover"]
    x: Place
    y: Place
    heading: Heading = default("0 deg")
    charge: Charge = default("100 %")
    sensors: dict[Name, RoverSensor] = Field(max_length=16)


class StationRobot(SpecBase):
    """A base station: an antenna at a place, and power for the rovers beside it."""

    model: Literal["station"]
    x: Place
    y: Place

    @property
    def sensors(self) -> Mapping[str, RoverSensor]:
        """It has none."""
        return MappingProxyType({})

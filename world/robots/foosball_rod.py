"""A motorised rod of the football table with its figures, as a deployment declares it."""

from typing import Literal

from pydantic import Field

from foosim.common.names import LineName, Team
from foosim.common.spec_base import AngleNoise, LengthNoise, Name, Offset, Rate, SpecBase, default


class RodSensor(SpecBase):
    """Reads a rod's slide (m) and angle (rad), with Gaussian noise on each: 2 float64."""

    kind: Literal["encoder"]
    rate_hz: Rate = Field(alias="rate")
    offset_ns: Offset = default("0 s", "offset")
    position_noise: LengthNoise
    angle_noise: AngleNoise


class RodRobot(SpecBase):
    """A motorised rod with its figures. Its actuator channel is `position`: slide (m) and angle (rad), 2 float64."""

    model: Literal["rod"]
    team: Team
    line: LineName
    sensors: dict[Name, RodSensor] = Field(max_length=16)

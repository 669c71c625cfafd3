"""The camera above the football table, as a deployment declares it."""

from typing import Literal

from pydantic import Field

from foosim.common.spec_base import LengthNoise, Name, Offset, Rate, SpecBase, default


class BallSensor(SpecBase):
    """Reads the ball's position x, y, z (m), with Gaussian noise on x and y and none on z: 3 float64."""

    kind: Literal["ball"]
    rate_hz: Rate = Field(alias="rate")
    offset_ns: Offset = default("0 s", "offset")
    noise: LengthNoise


class CameraRobot(SpecBase):
    """A robot without a body that sees the ball."""

    model: Literal["camera"]
    sensors: dict[Name, BallSensor] = Field(max_length=16)

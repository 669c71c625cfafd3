"""Base class, names and shared quantities of the parts of a deployment.

Quantities are strings with units in a file and SI numbers here; times are integer nanoseconds.
"""

from fractions import Fraction
from typing import Annotated, Any, Final

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

from foosim.common import limits, names, units
from foosim.common.units import Quantity

Name = Annotated[str, StringConstraints(pattern=names.NAME_PATTERN, max_length=limits.NAME_LENGTH_MAX)]
RobotName = Annotated[str, StringConstraints(pattern=names.ROBOT_NAME_PATTERN, max_length=limits.NAME_LENGTH_MAX)]
PartName = Annotated[str, StringConstraints(min_length=1, max_length=limits.PART_NAME_LENGTH_MAX)]
"""The name of a link or a joint, as it is in a robot's file: any characters."""
RATE_MIN: Final = "1 mHz"
Rate = Annotated[Fraction, Quantity(units.RATE, RATE_MIN, "10 kHz")]
Offset = Annotated[int, Quantity(units.TIME, "0 s", "1000 s")]
"""Offset of an event from the multiples of its period: below the period, whole ticks for lockstep clients."""
LengthNoise = Annotated[float, Quantity(units.LENGTH, "0 m", "1 m")]
Gravity = Annotated[float, Quantity(units.ACCELERATION, "0 m/s2", "100 m/s2")]
Length = Annotated[float, Quantity(units.LENGTH, "0.1 mm", "10 m")]
LengthOrNone = Annotated[float, Quantity(units.LENGTH, "0 m", "10 m")]
Position = Annotated[float, Quantity(units.LENGTH, "-10 m", "10 m")]
Mass = Annotated[float, Quantity(units.MASS, "1 mg", "100 kg")]
Speed = Annotated[float, Quantity(units.SPEED, "0 m/s", "100 m/s")]
Spin = Annotated[float, Quantity(units.SPIN, "0 rad/s", "1000 rad/s")]
Force = Annotated[float, Quantity(units.FORCE, "0 N", "10 kN")]
Torque = Annotated[float, Quantity(units.TORQUE, "0 N m", "1000 N m")]
Acceleration = Annotated[float, Quantity(units.ACCELERATION, "1 mm/s2", "10000 m/s2")]
AngularAcceleration = Annotated[float, Quantity(units.ANGULAR_ACCELERATION, "0.001 rad/s2", "1000000 rad/s2")]
Gain = Annotated[float, Field(ge=0, le=10_000)]
Coefficient = Annotated[float, Field(ge=0, le=10)]
Restitution = Annotated[float, Field(ge=0, le=1)]
RuleTime = Annotated[int, Quantity(units.TIME, "0 s", "1 h")]


def default(text: str, alias: str | None = None) -> Any:
    """Return a field whose default is written, checked and documented as in a file."""
    return Field(default=text, alias=alias, validate_default=True)


class SpecBase(BaseModel):
    """Base of all models of the deployment: unknown keys are refused, types are not guessed, values do not change.

    A model's validator is built when it is first used: each process would otherwise build some eighty that are parts of
    the deployment's, when it starts.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False, defer_build=True)

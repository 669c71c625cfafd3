"""Numbers of readings and commands, with their units: types of their fields."""

from typing import Annotated, TypeAlias

from msgspec import Meta

Metres: TypeAlias = Annotated[float, Meta(extra={"unit": "m"})]
Radians: TypeAlias = Annotated[float, Meta(extra={"unit": "rad"})]
MetresPerSecond: TypeAlias = Annotated[float, Meta(extra={"unit": "m/s"})]
MetresPerSecondSquared: TypeAlias = Annotated[float, Meta(extra={"unit": "m/s2"})]
RadiansPerSecond: TypeAlias = Annotated[float, Meta(extra={"unit": "rad/s"})]
NewtonSeconds: TypeAlias = Annotated[float, Meta(extra={"unit": "N s"})]
Newtons: TypeAlias = Annotated[float, Meta(extra={"unit": "N"})]
NewtonMetres: TypeAlias = Annotated[float, Meta(extra={"unit": "N m"})]
Degrees: TypeAlias = Annotated[float, Meta(extra={"unit": "deg"})]
Amperes: TypeAlias = Annotated[float, Meta(extra={"unit": "A"})]
Volts: TypeAlias = Annotated[float, Meta(extra={"unit": "V"})]
DegreesCelsius: TypeAlias = Annotated[float, Meta(extra={"unit": "degC"})]
Watts: TypeAlias = Annotated[float, Meta(extra={"unit": "W"})]
Share: TypeAlias = Annotated[float, Meta(extra={"unit": ""})]
"""Of a whole: 0 to 1."""
Count: TypeAlias = Annotated[float, Meta(extra={"unit": ""})]
Kilograms: TypeAlias = Annotated[float, Meta(extra={"unit": "kg"})]
JobNumber: TypeAlias = Annotated[float, Meta(extra={"unit": ""})]
"""The last field of a command that may be a job (`component_types/jobs.py`)."""
QuaternionPart: TypeAlias = Annotated[float, Meta(extra={"unit": ""})]

"""Settings that have a number for each field of a reading or command, with the unit of that field.

A deployment writes one for all fields, `std: 2 mm`, or names them: `std: {slide: 0.2 mm, spin: 0.5 deg}`. A name is
that of a field, or of a group of fields of one unit that the reading declares, such as `position` for x and y.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from math import isfinite
from typing import Annotated, Any, Final, TypeAlias

from pydantic import BeforeValidator, StrictFloat, StrictInt, WithJsonSchema

from foosim.common import units
from foosim.common.errors import BadValue, UnknownName
from foosim.common.units import Dimension, custom_error
from foosim.world.component_types.descriptions import NO_SLOTS, Component
from foosim.world.component_types.payloads import Field, PayloadCodec, field_at, many_of
from foosim.world.component_types.settings import ComponentSettings

Quantity: TypeAlias = str | StrictInt | StrictFloat
DIMENSIONS: Final[Mapping[str, Dimension]] = {
    dimension.base: dimension
    for dimension in (
        *(units.LENGTH, units.MASS, units.ANGLE, units.SPEED, units.SPIN, units.ACCELERATION, units.FORCE),
        *(units.TORQUE, units.ENERGY, units.POWER, units.VOLTAGE, units.CURRENT, units.TEMPERATURE),
    )
}
"""By the unit of a field."""
GROUPS: Final = "groups"
"""The class variable of a reading or command that has its groups of fields: names by name."""


def _written(value: object) -> object:
    """Refuse a value other than a quantity or quantities by name."""
    values = [*value.values()] if isinstance(value, dict) else [value]
    if not values or not all(isinstance(one, str | int | float) and not isinstance(one, bool) for one in values):
        raise custom_error(BadValue("not a quantity, nor quantities by the names of fields", value))
    return value


_SCHEMA: Final = {
    "anyOf": [
        {"type": "string"},
        {"type": "number"},
        {"type": "object", "additionalProperties": {"type": ["string", "number"]}},
    ],
    "description": "a quantity in the unit of the field: one for all fields, or quantities by their names",
}
PerField: TypeAlias = Annotated[Quantity | dict[str, Quantity], BeforeValidator(_written), WithJsonSchema(_SCHEMA)]


@dataclass(frozen=True, slots=True)
class Numbers:
    """The numbers of a reading or command: their fields, the groups of these, and the count of numbers.

    Fields at the end may have several numbers each, all as many.
    """

    fields: tuple[Field, ...]
    groups: Mapping[str, tuple[str, ...]]
    size: int

    def places(self, name: str) -> tuple[int, ...]:
        """Return the places of the numbers of a field or group; none for another name."""
        names = self.groups.get(name, (name,))
        return tuple(place for place in range(self.size) if self.field(place).name in names)

    def field(self, place: int) -> Field:
        """Return the field that a number belongs to."""
        return field_at(self.fields, self.size, place)


def codec_of(component: Component) -> PayloadCodec:
    """Return the codec of a component's readings or commands."""
    assert component.value is not None, f"{component.type_name} {component.name} carries nothing"
    return _codec(component.value, component.name)


_codec = cache(PayloadCodec)


def numbers_of(
    component: Component, settings: ComponentSettings, counts: Mapping[str, int] = NO_SLOTS
) -> Numbers | None:
    """Return the numbers of a component's readings or commands; None where these have other fields too, or an unknown
    count of numbers.

    `counts` are the counts of numbers of the robot's fields.
    """
    fields = codec_of(component).fields
    many = many_of(fields)
    if not all(field.is_number for field in fields[: len(fields) - many]) or (many and not component.array_length):
        return None
    size = len(fields) - many
    if many:
        length = component.array_length
        size += many * (length(settings, counts) if callable(length) else getattr(settings, length))
    return Numbers(fields, getattr(component.value, GROUPS, {}), size)


def payload_bytes(component: Component, settings: ComponentSettings, counts: Mapping[str, int]) -> int | None:
    """Return the greatest length of a component's payload (bytes); None where its type and settings do not limit it.

    `counts` are the counts of numbers of the robot's fields: a command has at most a number for each joint.
    """
    numbers = numbers_of(component, settings, counts)
    if numbers is not None:
        return 8 * numbers.size
    codec = codec_of(component)
    if codec.size is not None:
        return codec.size
    many = many_of(codec.fields)
    singles = codec.fields[: len(codec.fields) - many]
    is_of_joints = component.type_name == "actuator" and "joint_positions" in component.needs
    if not is_of_joints or not all(field.is_number for field in singles):
        return None
    joints = len(component.joints_named(settings) or ()) or counts["joint_positions"]
    return 8 * (len(singles) + many * joints)


def read_per_field(written: Any, numbers: Numbers, least: float | None = None) -> list[float | None]:
    """Return the quantity written for each number, in SI units; None for a number without one.

    Raises UnknownName for an unknown name, BadValue for a value other than a quantity of a field's unit, or below
    `least`.
    """
    if not isinstance(written, Mapping):
        return [_read(written, numbers.field(place), least) for place in range(numbers.size)]
    found: list[float | None] = [None] * numbers.size
    for name, quantity in written.items():
        places = numbers.places(name)
        if not places:
            raise UnknownName("no such field", name, [field.name for field in numbers.fields] + [*numbers.groups])
        for place in places:
            found[place] = _read(quantity, numbers.field(place), least)
    return found


def _read(quantity: Any, field: Field, least: float | None) -> float:
    dimension = DIMENSIONS.get(field.unit)
    if dimension is None and isinstance(quantity, str):
        raise BadValue(f"not a number, which {field.name} is", quantity)
    number = float(quantity if dimension is None else units.parse(quantity, dimension))
    if not isfinite(number) or (least is not None and number < least):
        raise BadValue("not finite" if least is None else f"less than the least that is valid, {least:g}", quantity)
    return number

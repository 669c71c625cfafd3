"""The limits of an actuator's commands: numbers beyond them are clamped, as real drives do it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import inf, isfinite
from operator import le
from typing import Any, Final, NamedTuple, TypeAlias

import msgspec

from foosim.world.component_types.descriptions import overrides
from foosim.world.component_types.failures import ContractError
from foosim.world.component_types.payloads import Field, PayloadCodec, field_at
from foosim.world.components.base import Actuator

Bound: TypeAlias = tuple[float, float]
NO_LIMITS: Final[Mapping[str, Bound]] = {}


class Clamped(NamedTuple):
    """A number of a command that was clamped: its name and unit, its value, and the limit that it has instead."""

    name: str
    unit: str
    value: float
    limit: float


NONE_CLAMPED: Final[Sequence[Clamped]] = ()


def limits_of(made: Any, fields: Sequence[Field]) -> Mapping[str, Bound]:
    """Return the least and the greatest value of fields of a component's values. Raises ContractError."""
    limits = made.limits()
    names = [field.name for field in fields]
    if not (isinstance(limits, Mapping) and {*limits} <= {*names} and all(map(_is_bound, limits.values()))):
        raise ContractError(
            made.limits, f"a mapping of fields ({', '.join(names)}) to least and greatest value", limits
        )
    return limits


def _is_bound(value: object) -> bool:
    return isinstance(value, tuple) and len(value) == 2 and all(isinstance(one, int | float) for one in value)


def bounds_of(made: Any, fields: Sequence[Field], size: int) -> list[Bound]:
    """Return the least and the greatest of each of `size` numbers: `bounds()` of a component, else its `limits()`."""
    bounds = made.bounds() if isinstance(made, Actuator) else None
    if bounds is not None:
        return list(bounds)
    limits = limits_of(made, fields)
    return [limits.get(field_at(fields, size, place).name, (-inf, inf)) for place in range(size)]


class CommandBounds:
    """The limits of one actuator. What it keeps follows from the actuator."""

    def __init__(self, made: Any, codec: PayloadCodec) -> None:
        """Raises ContractError for invalid limits."""
        self._made, self._codec, self._limits = made, codec, limits_of(made, codec.fields)
        self._within: Callable[[Any], Any] | None = made.within if overrides(type(made), "within") else None
        self._size = -1
        self._ends: tuple[tuple[float, ...], tuple[float, ...]] = ((), ())
        """How many numbers the last command had, with their least and greatest values."""

    def clamp(self, command: Any) -> tuple[Any, Sequence[Clamped]] | None:
        """Return a command within the limits, and which numbers were not.

        None of a command with too many numbers, too few, or a non-finite one, which modifiers may return.
        """
        if not self._codec.is_packed:
            return self._clamp_fields(command)
        numbers = self._codec.numbers(command)
        size = len(numbers)
        if size != self._size:
            bounds = bounds_of(self._made, self._codec.fields, size)
            self._size, self._ends = size, (tuple([low for low, _ in bounds]), tuple([high for _, high in bounds]))
        low, high = self._ends
        if len(low) != size or not all(map(isfinite, numbers)):
            return None
        within, left = command, numbers
        if self._within is not None:
            within = self._within(command)
            left = self._codec.numbers(within)
        if not (all(map(le, low, left)) and all(map(le, left, high))):
            clamped = [min(max(one, least), most) for one, least, most in zip(left, low, high, strict=True)]
            within = self._codec.from_numbers(clamped)
        if within is command:
            return command, NONE_CLAMPED
        names = self._names(size)
        pairs = enumerate(zip(numbers, self._codec.numbers(within), strict=True))
        fields = self._codec.fields
        beyond = [
            Clamped(names[place], field_at(fields, size, place).unit, value, limit)
            for place, (value, limit) in pairs
            if value != limit
        ]
        return within, beyond

    def _names(self, size: int) -> Sequence[str]:
        """Return what each number of a command is called."""
        if names := self._made.names():
            return tuple(names)
        found = [field_at(self._codec.fields, size, place) for place in range(size)]
        first = {field.name: place for place, field in reversed([*enumerate(found)])}
        return [
            f"{field.name}[{place - first[field.name]}]" if field.is_several else field.name
            for place, field in enumerate(found)
        ]

    def _clamp_fields(self, command: Any) -> tuple[Any, Sequence[Clamped]]:
        """Clamp the fields with limits of a command with other fields than numbers; these stay."""
        units = {field.name: field.unit for field in self._codec.fields}
        within: dict[str, Any] = {}
        beyond: list[Clamped] = []
        for name, (low, high) in self._limits.items():
            value = getattr(command, name)
            is_several = isinstance(value, tuple | list)
            numbers = list(value) if is_several else [value]
            clamped = [min(max(one, low), high) if isinstance(one, int | float) else one for one in numbers]
            pairs = [pair for pair in zip(numbers, clamped, strict=True) if pair[0] != pair[1]]
            found = [Clamped(name, units[name], *pair) for pair in pairs]
            if found:
                beyond += found
                limits = [type(one)(limit) for one, limit in zip(numbers, clamped, strict=True)]
                within[name] = type(value)(limits) if is_several else limits[0]
        return (msgspec.structs.replace(command, **within), beyond) if beyond else (command, NONE_CLAMPED)

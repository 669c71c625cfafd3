"""Payloads of packets: readings and commands to and from bytes.

A reading or command is a msgspec struct that its component brings. One of numbers is packed: each a little-endian
float64 in SI units, a tuple of numbers at the end as many of them as there are; several tuples at the end are of one
length. The number of a job is left out where it is 0, that of a plain command. Any other, as a command with tuples
before the number of its job, is MessagePack, a map of its fields. `echo`, and what players and clients send each other,
is any bytes.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, Final, TypeAlias

import msgspec
from msgspec import Struct, inspect

from foosim.common.errors import BadValue, Malformed, NotFinite
from foosim.world.component_types.jobs import JOB

FLOAT: Final = frozenset((float,))
PLAIN: Final = bytes(8)
"""The number of a job in a plain command."""
MANY_MAX: Final = 1 << 16
"""The greatest count of numbers in a tuple whose type has no bound of its own."""

Value: TypeAlias = Struct | bytes


@dataclass(frozen=True, slots=True)
class Field:
    """A field of a reading or command: its name and unit; whether it is one number, several, rows of several, or
    something else."""

    name: str
    unit: str
    is_number: bool
    is_several: bool = False
    is_rows: bool = False


class PayloadCodec:
    """Encodes and decodes the values of one type."""

    def __init__(self, kind: type[Struct], name: str, drawn_by: Any = None) -> None:
        """`name` is that of the component, for messages. Decoded values keep `drawn_by` where it is given."""
        self.kind: Final = kind
        self.name: Final = name
        self.drawn_by: Final = drawn_by
        self.fields: Final = tuple(_field(field) for field in _info(kind).fields)
        self._many = many_of(self.fields)
        self.has_job: Final = self.fields[-1].name == JOB and self.fields[-1].is_number
        """Whether its last number is that of a job."""
        count = len(self.fields) - self._many
        self.is_packed: Final = all(field.is_number for field in self.fields[:count])
        self._packed = struct.Struct(f"<{count}d")
        bounds = [_bounds(field.type) for field in _info(kind).fields[count:]]
        self._least, self._most = max((least for least, _ in bounds), default=0), min((m for _, m in bounds), default=0)
        """The least and the greatest length of each of its tuples."""
        self._other = msgspec.msgpack.Decoder(kind)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of its fields that are one number each."""
        return tuple(field.name for field in self.fields if field.is_number)

    @property
    def size(self) -> int | None:
        """The size of each payload (bytes), that of a plain command; None where sizes differ."""
        if not self.is_packed or self._least != self._most:
            return None
        return self._packed.size + 8 * self._many * self._most - 8 * self.has_job

    @property
    def unit(self) -> str:
        """The units of its fields, each once."""
        return ", ".join(dict.fromkeys(field.unit for field in self.fields if field.unit))

    def is_of_joints(self, field: Field) -> bool:
        """Whether a field of a component that selects joints has a number for each of them, or rows of such numbers."""
        return field.is_several if self.is_packed else field.is_rows

    def named(self, value: Any, joints: Sequence[str]) -> dict[str, Any]:
        """Return a value's fields by name; in fields with a number for each joint, the numbers by the joints' names."""
        found = {} if isinstance(value, bytes) else msgspec.structs.asdict(value)
        for field in self.fields if joints else ():
            numbers = found[field.name]
            if self.is_of_joints(field):
                rows = [dict(zip(joints, row, strict=False)) for row in (numbers if field.is_rows else [numbers])]
                found[field.name] = rows if field.is_rows else rows[0]
        return found

    def number_names(self, size: int, joints: Sequence[str]) -> list[str]:
        """Return what each of a value's `size` numbers is called: its field, and its joint as in `positions.elbow`."""
        single, names = len(self.fields) - self._many, []
        for place in range(size):
            field = field_at(self.fields, size, place)
            is_named = joints and self.is_of_joints(field)
            names.append(f"{field.name}.{joints[(place - single) % len(joints)]}" if is_named else field.name)
        return names

    def decode(self, payload: bytes) -> Any:
        """Return the value in a payload; raises Malformed for an invalid one, or one with a non-finite number."""
        if not self.is_packed:
            try:
                return self._other.decode(payload)
            except msgspec.DecodeError as error:
                raise Malformed(f"{self.name}: {error}") from None
        size, least = len(payload), self._packed.size
        if self.has_job and size == least - 8:
            payload, size = payload + PLAIN, least
        if size == least and not self._many:
            numbers = self._packed.unpack(payload)
            if not all(map(isfinite, numbers)):
                raise Malformed(f"{self.name} with non-finite numbers")
            return self.kind(*numbers)
        return self._decode_many(payload)

    def decode_finite(self, payload: bytes) -> Any:
        """Return the value in a payload; raises Malformed as `decode`, and for any other non-finite number."""
        value = self.decode(payload)
        if not self.is_packed and not _is_finite(msgspec.to_builtins(value)):
            raise Malformed(f"{self.name} with non-finite numbers")
        return value

    def _decode_many(self, payload: bytes) -> Any:
        if not self._many:
            raise Malformed(f"{len(payload)} bytes, {self.name} has {self._packed.size}")
        more, rest = divmod(len(payload) - self._packed.size, 8 * self._many)
        if rest or not self._least <= more <= self._most:
            each = f"{8 * self._many} for each of {self._least} to {self._most} numbers"
            what = f"{self.name} has {self._packed.size} and {each}"
            raise Malformed(f"{len(payload)} bytes, {what}")
        numbers = struct.unpack(f"<{len(payload) // 8}d", payload)
        if not all(map(isfinite, numbers)):
            raise Malformed(f"{self.name} with non-finite numbers")
        value = self.from_numbers(numbers)
        if self.drawn_by is not None:
            value.__dict__["drawn_by"] = self.drawn_by
        return value

    def encode(self, value: Any) -> bytes:
        """Return the payload of a value; raises BadValue for an invalid or non-finite number."""
        assert isinstance(value, self.kind), f"{self.name} is a {self.kind.__name__}, not a {type(value).__name__}"
        if not self.is_packed:
            try:
                return msgspec.msgpack.encode(value, enc_hook=_as_plain)
            except (TypeError, ValueError, OverflowError) as error:
                raise BadValue(f"{self.name}: {error}", value) from None
        numbers = self.numbers(value)
        more = (len(numbers) - len(self.fields) + self._many) // self._many if self._many else 0
        if self._many and not self._least <= more <= self._most:
            last = self.fields[-1].name
            raise BadValue(f"{self.name}.{last} is not {self._least} to {self._most} numbers", more)
        # The sum of finite numbers may be infinite; that of others is never finite.
        if not (FLOAT.issuperset(map(type, numbers)) and (isfinite(sum(numbers)) or all(map(isfinite, numbers)))):
            for place, number in enumerate(numbers):
                self._check(field_at(self.fields, len(numbers), place).name, number)
        payload = struct.pack(f"<{len(numbers)}d", *numbers) if self._many else self._packed.pack(*numbers)
        return payload[:-8] if self.has_job and payload[-8:] == PLAIN else payload

    def encode_checked(self, value: Any) -> bytes:
        """Return the payload of a value that may hold anything.

        Raises NotFinite for a non-finite number, BadValue for a value of another type than its field's.
        """
        payload = self.encode(value)
        if not self.is_packed:
            try:
                self._other.decode(payload)
            except msgspec.DecodeError as error:
                raise BadValue(f"{self.name}: {error}", value) from None
            if not _is_finite(msgspec.to_builtins(value, enc_hook=_as_plain)):
                raise NotFinite(f"{self.name} with non-finite numbers")
        return payload

    def encode_numbers(self, numbers: Sequence[float]) -> bytes:
        """Return the payload of a value's numbers; raises NotFinite for a non-finite one."""
        is_whole = not self._many and len(numbers) == len(self.fields)
        payload = self._packed.pack(*numbers) if is_whole else struct.pack(f"<{len(numbers)}d", *numbers)
        if not all(map(isfinite, numbers)):
            raise NotFinite(f"{self.name} with non-finite numbers", list(numbers))
        return payload

    def from_numbers(self, numbers: Sequence[float]) -> Any:
        """Return the value that has these numbers, in the order of its fields."""
        count = len(self.fields) - self._many
        if not self._many:
            return self.kind(*numbers)
        more = (len(numbers) - count) // self._many
        starts = range(count, count + self._many * more, more) if more else [count] * self._many
        return self.kind(*numbers[:count], *(tuple(numbers[start : start + more]) for start in starts))

    def nothing(self) -> Any:
        """Return a value of zeros and empty tuples: it cancels a job without its command."""
        return self.kind(*[0.0 if field.is_number else () for field in self.fields])

    def _check(self, field: str, number: Any) -> None:
        try:
            is_finite = isfinite(as_float(number))
        except OverflowError:
            is_finite = False
        except (TypeError, ValueError):
            raise BadValue(f"{self.name}.{field} is not a number", number) from None
        if not is_finite:
            raise NotFinite(f"{self.name}.{field} is not finite", number)

    def numbers(self, value: Any) -> list[Any]:
        """Return all numbers of a packed value, in the order of its fields; of others none. Raises BadValue."""
        if not self.is_packed:
            return []
        values = list(msgspec.structs.astuple(value))
        if not self._many:
            return values
        count = len(values) - self._many
        if self._many == 1 and isinstance(values[count], tuple):
            return [*values[:count], *values[count]]
        for field, several in zip(self.fields[count:], values[count:], strict=True):
            if not isinstance(several, tuple | list) and not _is_array(several):
                raise BadValue(f"{self.name}.{field.name} is not several numbers", several)
            if len(several) != len(values[count]):
                what = f"{self.name}.{field.name} is not as many numbers as {self.fields[count].name}"
                raise BadValue(f"{what}, {len(values[count])}", len(several))
        return [*values[:count], *(number for several in values[count:] for number in several)]


def as_float(value: Any) -> float:
    """Return a number as a float: one of Python, of numpy, or of any class with `__float__`. Raises
    TypeError and ValueError for other values, OverflowError for one beyond all floats."""
    if not hasattr(value, "__float__"):
        raise TypeError(f"a {type(value).__name__} is not a number")
    return float(value)


def _as_plain(value: Any) -> Any:
    """Return a number as a float and an array as a list; raises as `as_float`."""
    return [*value] if _is_array(value) and value.ndim else as_float(value)


def as_floats(values: Sequence[Any]) -> list[float] | None:
    """Return numbers as floats; None where one is no number."""
    try:
        return [as_float(one) for one in values]
    except (TypeError, ValueError, OverflowError):
        return None


def _is_array(value: Any) -> bool:
    """Whether that is an array of numpy, or another sequence of numbers."""
    return all(hasattr(value, method) for method in ("__len__", "__getitem__", "__array__"))


def many_of(fields: Sequence[Field]) -> int:
    """Return the count of fields at the end with several numbers each."""
    return next((number for number, field in enumerate(reversed(fields)) if not field.is_several), len(fields))


def field_at(fields: Sequence[Field], size: int, place: int) -> Field:
    """Return the field that one of a value's `size` numbers belongs to, by its place."""
    many = many_of(fields)
    single = len(fields) - many
    return fields[place] if place < single else fields[single + (place - single) * many // (size - single)]


def _is_finite(value: Any) -> bool:
    """Whether all numbers in a value of plain types are finite."""
    if isinstance(value, float):
        return isfinite(value)
    if isinstance(value, dict):
        return all(map(_is_finite, value.values()))
    return not isinstance(value, list | tuple) or all(map(_is_finite, value))


def _info(kind: type[Struct]) -> inspect.StructType:
    info = inspect.type_info(kind)
    assert isinstance(info, inspect.StructType), f"{kind} is no struct"
    assert info.fields, f"{kind.__name__} has no fields"
    return info


def _field(field: inspect.Field) -> Field:
    unit, found, depth = "", field.type, 0
    while isinstance(several := plain_type(found), inspect.VarTupleType):
        found, depth = several.item_type, depth + 1
    if isinstance(found, inspect.Metadata):
        unit = str((found.extra or {}).get("unit", ""))
    is_number = isinstance(plain_type(found), inspect.FloatType)
    return Field(field.name, unit, *(is_number and depth == levels for levels in range(3)))


def _bounds(kind: inspect.Type) -> tuple[int, int]:
    """Return the least and the greatest length of a tuple of numbers."""
    several = plain_type(kind)
    assert isinstance(several, inspect.VarTupleType)
    return several.min_length or 0, MANY_MAX if several.max_length is None else several.max_length


def plain_type(kind: inspect.Type) -> inspect.Type:
    """Return a type without its annotations."""
    while isinstance(kind, inspect.Metadata):
        kind = kind.type
    return kind

"""The tables of a capture: columns with types and units, and the values of a message as rows of a table.

Every type of row is a table: a field is a column, and a list or a structure is
JSON in a text. Beside them are `poses`, a row for each link and message of /tf, and `commands`, the packets with
commands of robots, with their numbers. Integers (times in ns, ticks, sequence numbers) are 64-bit and never rounded.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any, Final, Literal

import msgspec
from msgspec import inspect

from foosim.capture.foxglove import POSES
from foosim.capture.foxglove_reader import read_poses
from foosim.capture.mcap.format import Message
from foosim.capture.rows import PACKETS, ROW_TYPES, PacketRow, Row
from foosim.common.errors import Malformed, UnknownName, no_such
from foosim.common.json_text import encode_json
from foosim.deployment.channel_kinds import Channel, channels_of
from foosim.deployment.schema import Deployment
from foosim.world.component_types.payloads import plain_type
from foosim.world.component_types.per_field import codec_of

Kind = Literal["integer", "number", "text", "bytes", "boolean", "json"]
POSES_TABLE: Final = "poses"
COMMANDS_TABLE: Final = "commands"

Decode = Callable[[msgspec.json.Decoder[Any], Message], Any]
"""Decodes the row of a message, or raises with the file and the place of a damaged one."""


@dataclass(frozen=True, slots=True)
class Column:
    """One column: what its values are, and their unit, empty where there is none."""

    name: str
    kind: Kind
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Table:
    """One table: its topic, its columns, and the rows that a message of the topic gives."""

    name: str
    topic: str
    columns: tuple[Column, ...]
    rows: Callable[[Decode, Message], Iterable[tuple[Any, ...]]]


_UNITS: Final[Mapping[str, str]] = {
    "ns": "ns",
    "m": "m",
    "mm": "mm",
    "s": "s",
    "hz": "Hz",
    "bps": "bit/s",
    "ppm": "ppm",
    "bytes": "B",
    "size": "B",
    "db": "dB",
    "dbm": "dBm",
    "cdb": "0.01 dB",
    "cdbm": "0.01 dBm",
    "slide": "m",
    "spin": "rad",
    "left": "m/s",
    "right": "m/s",
    "tick": "tick",
    "period": "ticks",
}
"""By the last word of a column's name."""


def table_names() -> list[str]:
    """Return the names of the tables, the most used first."""
    rows = [topic.removeprefix("/") for topic in ROW_TYPES]
    first = [PACKETS.removeprefix("/"), POSES_TABLE, COMMANDS_TABLE]
    return [*first, *(name for name in rows if name not in first)]


def table_of(name: str, deployment: Deployment) -> Table:
    """Return a table by name; raises BadValue."""
    if name not in table_names():
        raise no_such(f"--what: not one of {', '.join(table_names())}", name, table_names())
    if name == POSES_TABLE:
        return Table(name, POSES, _POSE_COLUMNS, _pose_rows)
    if name == COMMANDS_TABLE:
        return Table(name, PACKETS, _command_columns(deployment), _Commands(deployment).rows)
    topic = f"/{name}"
    if topic == PACKETS:
        return Table(name, topic, (*_columns(PacketRow), Column("value", "json")), _PacketRows(deployment).rows)
    return _rows_table(name, topic, ROW_TYPES[topic])


# --- any kind of row -------------------------------------------------------------------------------------------------

_KINDS: Final[Mapping[type[inspect.Type], Kind]] = {
    inspect.IntType: "integer",
    inspect.FloatType: "number",
    inspect.StrType: "text",
    inspect.LiteralType: "text",
    inspect.BytesType: "bytes",
    inspect.BoolType: "boolean",
}


def _columns(kind: type[Row]) -> tuple[Column, ...]:
    info = inspect.type_info(kind)
    assert isinstance(info, inspect.StructType)
    return tuple(
        Column(
            field.name, _KINDS.get(type(plain_type(field.type)), "json"), _UNITS.get(field.name.rpartition("_")[2], "")
        )
        for field in info.fields
    )


def _values(row: Row, json: Iterable[int]) -> list[Any]:
    """Return the values of a row in the order of its columns; `json` are the places of values written as JSON."""
    values = list(msgspec.structs.astuple(row))
    for place in json:
        values[place] = encode_json(values[place]).decode()
    return values


def _json_places(columns: Sequence[Column]) -> list[int]:
    return [place for place, column in enumerate(columns) if column.kind == "json"]


def _rows_table(name: str, topic: str, kind: type[Row]) -> Table:
    columns = _columns(kind)
    decoder, json = msgspec.json.Decoder(kind), _json_places(columns)

    def rows(decode: Decode, message: Message) -> Iterator[tuple[Any, ...]]:
        yield tuple(_values(decode(decoder, message), json))

    return Table(name, topic, columns, rows)


# --- packets and commands --------------------------------------------------------------------------------------------


class _Decoded:
    """Decodes payloads of channels with a known type."""

    def __init__(self, deployment: Deployment) -> None:
        self._deployment = deployment
        self._channels: dict[tuple[str, str], Channel] = {}

    def channel(self, robot: str, channel: str) -> Channel:
        """Return a robot's channel; one of bytes when it has no such one."""
        pair = robot, channel
        if pair not in self._channels:
            try:
                self._channels |= channels_of(self._deployment, [pair])
            except UnknownName:
                self._channels[pair] = Channel(None, ())
        return self._channels[pair]

    def numbers(self, channel: Channel, payload: bytes) -> dict[str, Any]:
        """Return the values of a payload by name, those of joints by these; none for plain bytes and for an invalid
        payload."""
        codec, joints = channel
        try:
            return {} if codec is None else codec.named(codec.decode(payload), joints)
        except Malformed:
            return {}


class _PacketRows(_Decoded):
    """All packets. `value` has the numbers of a payload where its channel is a robot's sensor or actuator."""

    _decoder = msgspec.json.Decoder(PacketRow)
    _json = _json_places(_columns(PacketRow))

    def rows(self, decode: Decode, message: Message) -> Iterator[tuple[Any, ...]]:
        row = decode(self._decoder, message)
        sent, received = self.channel(row.source, row.channel), self.channel(row.destination, row.channel)
        numbers = self.numbers(received if sent.codec is None else sent, row.payload)
        yield (*_values(row, self._json), encode_json(numbers).decode() if numbers else None)


_COMMAND_FIELDS: Final = (
    *("sent_ns", "stamp_ns", "due_ns", "arrival_tick", "source", "destination", "channel", "sequence", "copy", "fate"),
    "cause",
)


def _value_columns(deployment: Deployment) -> dict[str, Column]:
    """Return the columns of the fields of all commands of a deployment's robots, in the order of their kinds.

    A value other than one number is JSON. A field with the name of a column of packets begins with `command_`.
    """
    kinds = {its.kind: its.component_type for robot in deployment.robots.values() for its in robot.actuators.values()}
    found: dict[str, Column] = {}
    for field in (field for _, one in sorted(kinds.items()) for field in codec_of(one).fields):
        name = f"command_{field.name}" if field.name in _COMMAND_FIELDS else field.name
        column = Column(name, "number" if field.is_number else "json", field.unit)
        known = found.get(field.name, column)
        is_number, unit = known.kind == column.kind == "number", known.unit if known.unit == column.unit else ""
        found[field.name] = Column(name, "number" if is_number else "json", unit)
    return found


def _command_columns(deployment: Deployment) -> tuple[Column, ...]:
    known = {column.name: column for column in _columns(PacketRow)}
    return (*(known[name] for name in _COMMAND_FIELDS), *_value_columns(deployment).values())


class _Commands(_Decoded):
    """Packets to robots on the channels that move them, with their values; a field that a robot has not is empty."""

    _decoder = msgspec.json.Decoder(PacketRow)
    _fields = attrgetter(*_COMMAND_FIELDS)

    def __init__(self, deployment: Deployment) -> None:
        super().__init__(deployment)
        self._columns = _value_columns(deployment)

    def rows(self, decode: Decode, message: Message) -> Iterator[tuple[Any, ...]]:
        row = decode(self._decoder, message)
        robot = self._deployment.robots.get(row.destination)
        if robot is not None and row.channel in robot.actuators:
            values = self.numbers(self.channel(row.destination, row.channel), row.payload)
            yield (*self._fields(row), *(_cell(column, values.get(name)) for name, column in self._columns.items()))


def _cell(column: Column, value: Any) -> Any:
    return value if value is None or column.kind == "number" else encode_json(msgspec.to_builtins(value)).decode()


# --- poses -----------------------------------------------------------------------------------------------------------

_POSE_COLUMNS: Final = (
    Column("time_ns", "integer", "ns"),
    Column("link", "text"),
    *(Column(name, "number", "m") for name in ("x", "y", "z")),
    *(Column(name, "number") for name in ("qx", "qy", "qz", "qw")),
)


def _pose_rows(decode: Decode, message: Message) -> Iterator[tuple[Any, ...]]:
    for pose in read_poses(message.data):
        yield (message.log_ns, pose.link, *pose.position, *pose.orientation)

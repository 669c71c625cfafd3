"""Readings and commands as vectors of numbers, for learning: columns with names, units and limits.

The columns are those of the declared sensors and actuators, in the order of (robot, channel), and within a channel
those of its fields. Values are in SI units. Readings and commands without a fixed count of numbers have no columns.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from math import inf, isfinite
from struct import Struct
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foosim.client.player import Packet
from foosim.common.errors import BadValue, UnknownName
from foosim.deployment.channel_kinds import joints_of
from foosim.deployment.schema import Deployment
from foosim.protocol.messages import Received
from foosim.world.component_types.payloads import field_at
from foosim.world.components.bounds import bounds_of
from foosim.world.components.fitted import BoundActuator, BoundSensor, actuators_of, sensors_of
from foosim.world.layout import build_layout

Vector: TypeAlias = NDArray[np.float64]
Pair: TypeAlias = tuple[str, str]
"""A robot and a channel of it."""
NEVER_S: Final = -1.0
"""The age of a reading before the first one."""
EVERYTHING: Final = ("*",)
Bounds: TypeAlias = tuple[float, float]
NO_BOUNDS: Final[Mapping[str, Bounds]] = {}


class Column(NamedTuple):
    """One number of a vector: its channel, field and unit, and the least and the greatest value.

    The field of a number of a joint is `FIELD.JOINT`.
    """

    robot: str
    channel: str
    field: str
    unit: str
    low: float
    high: float


class _Part(NamedTuple):
    """A channel's part of a vector."""

    pair: Pair
    fitted: Any
    start: int
    stop: int


def numbers_in(one: BoundSensor | BoundActuator) -> int:
    """Return the count of numbers of a reading or plain command; 0 without a fixed count of numbers."""
    made: Any = one.sensor if isinstance(one, BoundSensor) else one.actuator
    size = one.size or len(getattr(made, "bounds", tuple)() or ())
    return size - one.codec.has_job if size else 0


class _Table:
    """The columns of some channels, and where each channel's are."""

    def __init__(
        self,
        deployment: Deployment,
        fitted: Sequence[BoundSensor | BoundActuator],
        bounds: Mapping[str, Bounds] = NO_BOUNDS,
    ) -> None:
        for glob, (least, most) in bounds.items():
            if not least < most:
                raise BadValue(f"bounds of {glob}: the first is below the second", str((least, most)))
        columns: list[Column] = []
        self.parts: list[_Part] = []
        for one in fitted:
            made: Any = one.sensor if isinstance(one, BoundSensor) else one.actuator
            start, size = len(columns), numbers_in(one)
            called = one.codec.number_names(size, joints_of(deployment, one.robot, one.channel))
            for place, bound in enumerate(bounds_of(made, one.codec.fields, size)):
                (low, high), unit = bound, field_at(one.codec.fields, size, place).unit
                name = f"{one.robot}/{one.channel}.{called[place]}"
                for glob, (least, most) in bounds.items():
                    if fnmatchcase(name, glob):
                        if not max(low, least) < min(high, most):
                            raise BadValue(f"bounds of {glob}: {name} has {low:g} to {high:g}", str((least, most)))
                        low, high = max(low, least), min(high, most)
                columns.append(Column(one.robot, one.channel, called[place], unit, low, high))
            self.parts.append(_Part((one.robot, one.channel), one, start, len(columns)))
        self.columns = tuple(columns)
        names = [f"{column.robot}/{column.channel}.{column.field}" for column in columns]
        for glob in bounds:
            if not any(fnmatchcase(name, glob) for name in names):
                raise UnknownName("selects no robot/channel.field", glob, names)


def chosen(pairs: Sequence[Pair], globs: Sequence[str]) -> list[Pair]:
    """Return the (robot, channel) that globs of `robot/channel` select. Raises UnknownName for one that selects none.

    `*` selects everything, also nothing.
    """
    names = {f"{robot}/{channel}": (robot, channel) for robot, channel in pairs}
    for glob in globs:
        if glob != "*" and not any(fnmatchcase(name, glob) for name in names):
            raise UnknownName("selects no robot/channel", glob, names)
    return [pair for name, pair in sorted(names.items()) if any(fnmatchcase(name, glob) for glob in globs)]


class ReadingVector:
    """Readings as a vector. With `ages`, the age in s of each channel's reading follows the readings: -1 before the
    first one."""

    def __init__(self, deployment: Deployment, pairs: Sequence[Pair], *, ages: bool = False) -> None:
        """`pairs` are (robot, channel); those without columns are in `left_out`."""
        layout = build_layout(deployment)
        sensors = {
            (name, one.channel): one
            for name in sorted({name for name, _ in pairs if name in deployment.robots})
            for one in sensors_of(deployment, layout, layout[name])
        }
        fitted = [sensors[pair] for pair in sorted(set(pairs)) if pair in sensors and numbers_in(sensors[pair])]
        table = _Table(deployment, fitted)
        self.pairs = tuple(part.pair for part in table.parts)
        self.left_out = tuple(sorted(set(pairs) - set(self.pairs)))
        aged = [Column(*pair, "age", "s", NEVER_S, inf) for pair in self.pairs] if ages else []
        self.columns: tuple[Column, ...] = (*table.columns, *aged)
        self.sizes = {part.pair: 8 * (part.stop - part.start) for part in table.parts}
        """The bytes of a payload of each channel."""
        self._nothing = [bytes(size) for size in self.sizes.values()]
        self._ages = ages

    def join(self, newest: Mapping[Pair, Received], now_ns: int) -> Vector:
        """Return the vector of the newest packet of each channel, at a time (ns); 0 for channels without one."""
        found = [newest.get(pair) for pair in self.pairs]
        payloads = [nothing if one is None else one.payload for one, nothing in zip(found, self._nothing, strict=True)]
        if not self._ages:
            return np.frombuffer(b"".join(payloads)).copy()
        ages = np.array([NEVER_S if one is None else (now_ns - one.sent_ns) * 1e-9 for one in found])
        return np.concatenate((np.frombuffer(b"".join(payloads)), ages))


class CommandVector:
    """Commands as a vector: one packet for each channel."""

    def __init__(
        self,
        deployment: Deployment,
        robots: Sequence[str],
        globs: Sequence[str] = EVERYTHING,
        bounds: Mapping[str, Bounds] = NO_BOUNDS,
    ) -> None:
        """`globs` of `robot/channel` select among the actuators of these robots.

        `bounds` are least and greatest values by globs of `robot/channel.field`, within the limits of the actuators.
        Raises UnknownName for a glob that selects nothing, BadValue for invalid bounds.
        """
        layout = build_layout(deployment)
        fitted = {
            (name, one.channel): one
            for name in sorted(set(robots))
            for one in actuators_of(deployment, layout, layout[name])
        }
        table = _Table(
            deployment, [fitted[pair] for pair in chosen([*fitted], globs) if numbers_in(fitted[pair])], bounds
        )
        self.columns = table.columns
        self._cuts = [(*part.pair, 8 * part.start, 8 * part.stop) for part in table.parts]
        """The robot and channel of each packet, and its part of the vector's bytes."""
        self._lows = [column.low for column in self.columns]
        self._highs = [column.high for column in self.columns]
        self._pack = Struct(f"<{len(self.columns)}d").pack

    def packets(self, vector: Vector) -> list[Packet]:
        """Return the commands of a vector as packets, in the order of (robot, channel).

        Numbers beyond a column's limits are clipped to these. Raises BadValue for a vector of another shape, and for a
        non-finite number.
        """
        if vector.shape != (len(self.columns),):
            raise BadValue(f"an action of shape {vector.shape}; expected ({len(self.columns)},)")
        numbers: list[float] = vector.tolist()
        if not all(map(isfinite, numbers)):
            number, column = next(pair for pair in zip(numbers, self.columns, strict=True) if not isfinite(pair[0]))
            raise BadValue(f"{column.field} of {column.robot} is not finite", number)
        clipped = [
            low if number < low else high if number > high else number
            for number, low, high in zip(numbers, self._lows, self._highs, strict=True)
        ]
        packed = self._pack(*clipped)  # as a codec packs numbers
        return [Packet(robot, channel, packed[start:stop]) for robot, channel, start, stop in self._cuts]

"""What the bytes of a packet mean: typed values to and from payloads, by the kind of a robot's channel.

Numbers are little-endian float64 in SI units. `encoder` and `position` carry a rod's slide and spin, `ball` a position,
`echo` whatever was sent. To add a kind: a value type and a row in `_NUMBERS`.
Neighbours: the node's `sensors` and `actuators` are the other side of the same bytes.
"""

from __future__ import annotations

import struct
import sys
from collections.abc import Mapping
from math import isfinite
from typing import Any, Final, NamedTuple

from foosim.client.errors import UnknownName
from foosim.protocol.deployment import Deployment, RodRobot
from foosim.protocol.errors import BadValue, Malformed
from foosim.protocol.names import CHANNEL_ECHO, CHANNEL_NAMES_RESERVED, CHANNEL_POSITION

ANGLE_RAD_MAX: Final = 1000.0
"""The greatest angle that a rod's actuator takes."""
FLOAT_MAX: Final = sys.float_info.max


class RodPosition(NamedTuple):
    """Where a rod is: `slide` in m along world +y from its middle, `spin` in rad about +y, 0 with the feet down."""

    slide: float
    spin: float


class BallPosition(NamedTuple):
    """Where the ball is: `x`, `y`, `z` in m, in the world frame (origin on the floor in the middle, z up)."""

    x: float
    y: float
    z: float


class Command(NamedTuple):
    """Where a rod shall go: `slide` in m along world +y from its middle, `spin` in rad about +y."""

    slide: float
    spin: float


Value = RodPosition | BallPosition | Command | bytes

_NUMBERS: Final[Mapping[str, tuple[struct.Struct, Any]]] = {
    "encoder": (struct.Struct("<2d"), RodPosition),
    "ball": (struct.Struct("<3d"), BallPosition),
    CHANNEL_POSITION: (struct.Struct("<2d"), Command),
}
KINDS: Final = (*_NUMBERS, CHANNEL_ECHO)
COMMAND_KINDS: Final = tuple(kind for kind in _NUMBERS if kind in CHANNEL_NAMES_RESERVED)
"""What moves a robot: channels that are no sensor's."""


def channel_kind(deployment: Deployment, robot: str, channel: str) -> str:
    """Return the kind of an endpoint's channel, bytes for players and clients; raises UnknownName."""
    if robot in deployment.players or robot in deployment.clients:
        return CHANNEL_ECHO
    if robot not in deployment.robots:
        raise UnknownName("unknown robot", robot, deployment.robots)
    settings = deployment.robots[robot]
    if channel == CHANNEL_ECHO or (channel == CHANNEL_POSITION and isinstance(settings, RodRobot)):
        return channel
    if channel not in settings.sensors:
        built_in = [CHANNEL_ECHO, *([CHANNEL_POSITION] if isinstance(settings, RodRobot) else [])]
        raise UnknownName(f"{robot} has no such channel", channel, [*settings.sensors, *built_in])
    return settings.sensors[channel].kind


def value_fields(kind: str) -> tuple[str, ...]:
    """Return the names of the numbers that a kind carries; none for bytes."""
    fields: tuple[str, ...] = _NUMBERS[kind][1]._fields if kind in _NUMBERS else ()
    return fields


def decode_payload(kind: str, payload: bytes) -> Value:
    """Return the value that a payload holds; raises Malformed for another size or a number that is not finite."""
    if kind == CHANNEL_ECHO:
        return payload
    packed, make = _NUMBERS[kind]
    if len(payload) != packed.size:
        raise Malformed(f"{len(payload)} bytes, {kind} has {packed.size}")
    numbers = packed.unpack(payload)
    if not all(map(isfinite, numbers)):
        raise Malformed(f"{kind} with numbers that are not finite")
    value: Value = make(*numbers)
    return value


def encode_payload(kind: str, value: Value) -> bytes:
    """Return the payload of a value; raises BadValue for what is no number or not finite."""
    if kind == CHANNEL_ECHO:
        assert isinstance(value, bytes), f"echo carries bytes, not {type(value).__name__}"
        return value
    packed, make = _NUMBERS[kind]
    assert isinstance(value, make), f"{kind} carries {make.__name__}, not {type(value).__name__}"
    for field, number in zip(make._fields, value, strict=True):
        if not isinstance(number, int | float):
            raise BadValue(f"{kind}.{field} is not a number", number)
        if not abs(number) <= FLOAT_MAX:
            raise BadValue(f"{kind}.{field} is not finite", number)
    return packed.pack(*value)


def encode_command(deployment: Deployment, robot: str, command: Command) -> bytes:
    """Return the payload of a rod's command; raises UnknownName for what is no rod, BadValue out of its reach.

    A node refuses, and counts, what is out of reach; here the sender is told.
    """
    settings = deployment.robots.get(robot)
    if not isinstance(settings, RodRobot):
        rods = [name for name, other in deployment.robots.items() if isinstance(other, RodRobot)]
        raise UnknownName("no rod", robot, rods)
    payload = encode_payload(CHANNEL_POSITION, command)
    half_stroke = deployment.table.lines[settings.line].half_stroke
    if abs(command.slide) > half_stroke:
        raise BadValue(f"slide of {robot} is not within -{half_stroke} to {half_stroke} m", command.slide)
    if abs(command.spin) > ANGLE_RAD_MAX:
        raise BadValue(f"spin of {robot} is not within -{ANGLE_RAD_MAX} to {ANGLE_RAD_MAX} rad", command.spin)
    return payload

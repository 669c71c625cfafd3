"""Payloads of packets: typed values to and from bytes, by the kind of a robot's channel.

Numbers are little-endian float64 in SI units. `encoder` and `position` carry a rod's slide and spin, `ball` a position,
`pose`, `odometry`, `proximity` and `battery` a rover's measurements, `drive` the set-points of its wheels, `echo` any
bytes. To add a kind: a value type and a row in `_NUMBERS`.
"""

from __future__ import annotations

import struct
import sys
from collections.abc import Mapping
from math import isfinite
from typing import Any, Final, NamedTuple

from foosim.common.errors import BadValue, Malformed, UnknownName
from foosim.common.names import CHANNEL_DRIVE, CHANNEL_ECHO, CHANNEL_NAMES_RESERVED, CHANNEL_POSITION
from foosim.world.robots.foosball_rod import RodRobot
from foosim.world.robots.rover import RAYS_MAX
from foosim.world.spec import Robot, WorldSpec

ANGLE_RAD_MAX: Final = 1000.0
"""The greatest angle that a rod's actuator accepts."""
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
    """The set-point of a rod: `slide` in m along world +y from its middle, `spin` in rad about +y."""

    slide: float
    spin: float


class Pose(NamedTuple):
    """Where a rover is: `x` and `y` in m in the world frame, `heading` in rad from +x towards +y."""

    x: float
    y: float
    heading: float


class WheelTravel(NamedTuple):
    """How far a rover's wheels have turned since the start, in m at the rim."""

    left: float
    right: float


class Battery(NamedTuple):
    """A rover's battery: `share` of its capacity, `voltage` in V."""

    share: float
    voltage: float


class Ranges(NamedTuple):
    """The free space around a rover: a distance in m from its hull for each ray, the first ahead, then to the left."""

    ways: tuple[float, ...]


class Drive(NamedTuple):
    """The set-points of a rover's wheels in m/s; both positive is ahead, a faster right one turns left."""

    left: float
    right: float


Value = RodPosition | BallPosition | Pose | WheelTravel | Battery | Ranges | Command | Drive | bytes

_NUMBERS: Final[Mapping[str, Any]] = {
    "encoder": RodPosition,
    "ball": BallPosition,
    "pose": Pose,
    "odometry": WheelTravel,
    "battery": Battery,
    CHANNEL_POSITION: Command,
    CHANNEL_DRIVE: Drive,
}
_PACKED: Final = {kind: struct.Struct(f"<{len(value._fields)}d") for kind, value in _NUMBERS.items()}
PROXIMITY: Final = "proximity"
KINDS: Final = (*_NUMBERS, PROXIMITY, CHANNEL_ECHO)
COMMAND_KINDS: Final = tuple(kind for kind in _NUMBERS if kind in CHANNEL_NAMES_RESERVED)
"""The kinds of commands."""
COMMANDS: Final[Mapping[str, tuple[str, type[Command] | type[Drive]]]] = {
    "rod": (CHANNEL_POSITION, Command),
    "rover": (CHANNEL_DRIVE, Drive),
}
"""The channel and the type of commands, by model of robot."""


def command_channels(robot: Robot) -> list[str]:
    """Return the channels on which a robot takes commands: none or one."""
    return [COMMANDS[robot.model][0]] if robot.model in COMMANDS else []


def value_fields(kind: str) -> tuple[str, ...]:
    """Return the names of the numbers that a kind carries; none for bytes."""
    fields: tuple[str, ...] = _NUMBERS[kind]._fields if kind in _NUMBERS else ()
    return fields


def payload_struct(kind: str) -> struct.Struct:
    """Return the packing of a kind's numbers, for the sensor or actuator of that kind."""
    return _PACKED[kind]


def decode_payload(kind: str, payload: bytes) -> Value:
    """Return the value that a payload holds; raises Malformed for another size or a number that is not finite."""
    if kind == CHANNEL_ECHO:
        return payload
    if kind == PROXIMITY:
        return _ranges(payload)
    packed, make = _PACKED[kind], _NUMBERS[kind]
    if len(payload) != packed.size:
        raise Malformed(f"{len(payload)} bytes, {kind} has {packed.size}")
    numbers = packed.unpack(payload)
    if not all(map(isfinite, numbers)):
        raise Malformed(f"{kind} with numbers that are not finite")
    value: Value = make(*numbers)
    return value


def _ranges(payload: bytes) -> Ranges:
    if not payload or len(payload) % 8 or len(payload) > 8 * RAYS_MAX:
        raise Malformed(f"{len(payload)} bytes, {PROXIMITY} has 8 a ray, for 1 to {RAYS_MAX} rays")
    ways = struct.unpack(f"<{len(payload) // 8}d", payload)
    if not all(map(isfinite, ways)):
        raise Malformed(f"{PROXIMITY} with numbers that are not finite")
    return Ranges(ways)


def encode_payload(kind: str, value: Value) -> bytes:
    """Return the payload of a value; raises BadValue for a number that is none or not finite."""
    if kind == CHANNEL_ECHO:
        assert isinstance(value, bytes), f"echo carries bytes, not {type(value).__name__}"
        return value
    if kind == PROXIMITY:
        assert isinstance(value, Ranges), f"{kind} carries Ranges, not {type(value).__name__}"
        return struct.pack(f"<{len(value.ways)}d", *value.ways)
    packed, make = _PACKED[kind], _NUMBERS[kind]
    assert isinstance(value, make), f"{kind} carries {make.__name__}, not {type(value).__name__}"
    for field, number in zip(make._fields, value, strict=True):
        if not isinstance(number, int | float):
            raise BadValue(f"{kind}.{field} is not a number", number)
        if not -FLOAT_MAX <= number <= FLOAT_MAX:
            raise BadValue(f"{kind}.{field} is not finite", number)
    return packed.pack(*value)


def command_channel(spec: WorldSpec, robot: str, command: Command | Drive) -> str:
    """Return the channel of a robot's commands; raises UnknownName for a robot that takes no such command."""
    model = next(model for model, (_, kind) in COMMANDS.items() if isinstance(command, kind))
    settings = spec.robots.get(robot)
    if settings is None or settings.model != model:
        fitting = [name for name, other in spec.robots.items() if other.model == model]
        raise UnknownName(f"no {model}", robot, fitting)
    return COMMANDS[model][0]


def encode_command(spec: WorldSpec, robot: str, command: Command | Drive) -> bytes:
    """Return the payload of a robot's command; raises UnknownName for one that takes none, BadValue out of its bounds.

    A node refuses, and counts, commands out of a rod's bounds, and clips a rover's speeds to its drive's; here the
    sender gets an error.
    """
    payload = encode_payload(command_channel(spec, robot, command), command)
    if isinstance(command, Drive):
        speed = spec.hall.rover.drive.speed
        for side, wanted in zip(Drive._fields, command, strict=True):
            if abs(wanted) > speed:
                raise BadValue(f"{side} wheel of {robot} is not within -{speed} to {speed} m/s", wanted)
        return payload
    settings = spec.robots[robot]
    assert isinstance(settings, RodRobot)
    half_stroke = spec.table.lines[settings.line].half_stroke
    if abs(command.slide) > half_stroke:
        raise BadValue(f"slide of {robot} is not within -{half_stroke} to {half_stroke} m", command.slide)
    if abs(command.spin) > ANGLE_RAD_MAX:
        raise BadValue(f"spin of {robot} is not within -{ANGLE_RAD_MAX} to {ANGLE_RAD_MAX} rad", command.spin)
    return payload

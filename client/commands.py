"""Commands of robots as packets: on the channel of the actuator that takes them, checked by its limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, Final, NamedTuple

from msgspec import Struct

from foosim.common.errors import BadValue, UnknownName
from foosim.deployment.schema import Deployment
from foosim.world.components.fitted import NO_LIMITS, actuators_of
from foosim.world.forms.payloads import PayloadCodec
from foosim.world.forms.per_field import codec_of
from foosim.world.layout import Layout, build_layout

PLAIN: Final = (int, float, str, bytes, tuple, list, dict, type(None))
"""What is taken as it is; numbers of numpy are made floats."""
NO_NAMES: Final[Mapping[str, Any]] = MappingProxyType({})


class Taker(NamedTuple):
    """What takes commands of a robot: its channel, how they are packed, and the bounds of their fields.

    Of a robot whose model is made from a file, which a client does not have, the bounds are the node's to know.
    """

    channel: str
    codec: PayloadCodec
    limits: Mapping[str, tuple[float, float]]


class CommandEncoder:
    """Makes the packets of the commands of one deployment's robots."""

    def __init__(self, deployment: Deployment) -> None:
        self._deployment = self._known = deployment
        if deployment.lacks_files:
            files = deployment.asset_files
            there = {
                name: robot
                for name, robot in deployment.robots.items()
                if all(path in files for path in robot.asset_paths(files))
            }
            self._known = deployment.model_copy(update={"robots": there})
        self._layout: Layout | None = None
        self._takers: dict[str, tuple[Taker, ...]] = {}

    def encode(self, robot: str, command: Struct) -> tuple[str, bytes]:
        """Return the channel and the payload of a command.

        A node refuses and counts a command out of bounds, or clips it; here the sender gets an error. Raises
        UnknownName for a robot without an actuator that takes it, BadValue for what is not finite or out of bounds.
        """
        for one in self.actuators(robot):
            if isinstance(command, one.codec.kind):
                return one.channel, self._checked(robot, one, command)
        fitting = [name for name in self._deployment.robots if self._takes(name, command)]
        raise UnknownName(f"no robot that takes a {type(command).__name__}", robot, fitting)

    def encode_numbers(
        self, robot: str, channel: str, numbers: Sequence[Any], named: Mapping[str, Any] = NO_NAMES
    ) -> bytes:
        """Return the payload of the command with these numbers on a robot's channel. Raises as `encode` does."""
        one = self._actuator(robot, channel)
        names = [field.name for field in one.codec.fields]
        given = {**dict(zip(names, numbers, strict=False)), **named}
        if len(numbers) + len(named) != len(names) or {*given} != {*names}:
            said = ", ".join([*map(str, numbers), *named]) or "nothing"
            raise BadValue(f"{robot}'s {channel} takes {', '.join(names)}, each once", said)
        plain = {name: value if isinstance(value, PLAIN) else float(value) for name, value in given.items()}
        return self._checked(robot, one, one.codec.kind(**plain))

    def codec(self, robot: str, channel: str) -> PayloadCodec:
        """Return the codec of the commands on a robot's channel, which is an actuator's."""
        return self._actuator(robot, channel).codec

    def _actuator(self, robot: str, channel: str) -> Taker:
        return next(one for one in self.actuators(robot) if one.channel == channel)

    def actuators(self, robot: str) -> tuple[Taker, ...]:
        """Return what takes commands of a robot; of what is none, nothing."""
        if robot not in self._deployment.robots:
            return ()
        if robot not in self._takers:
            self._takers[robot] = self._takers_of(robot)
        return self._takers[robot]

    def _takers_of(self, robot: str) -> tuple[Taker, ...]:
        if robot not in self._known.robots:
            actuators = sorted(self._deployment.robots[robot].actuators.items())
            return tuple([Taker(name, codec_of(its.kind, "actuator"), NO_LIMITS) for name, its in actuators])
        if self._layout is None:
            self._layout = build_layout(self._known)
        fitted = actuators_of(self._known, self._layout, self._layout[robot])
        return tuple([Taker(one.channel, one.codec, one.actuator.limits()) for one in fitted])

    def _takes(self, robot: str, command: Struct) -> bool:
        return any(isinstance(command, one.codec.kind) for one in self.actuators(robot))

    def _checked(self, robot: str, one: Taker, command: Struct) -> bytes:
        payload = one.codec.encode(command)
        for name, (least, most) in one.limits.items():
            value = getattr(command, name)
            for number in value if isinstance(value, tuple | list) else (value,):
                if not least <= number <= most:
                    (unit,) = [field.unit for field in one.codec.fields if field.name == name]
                    raise BadValue(f"{name} of {robot} is not within {least} to {most} {unit}", number)
        return payload

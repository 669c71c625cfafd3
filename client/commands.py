"""Commands of robots as packets: on the channel of the actuator that takes them. Limits are the node's to apply."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, Final, NamedTuple

from msgspec import Struct

from foosim.common.errors import BadValue, UnknownName
from foosim.deployment.schema import Deployment
from foosim.world.forms.payloads import PayloadCodec
from foosim.world.forms.per_field import codec_of

NO_NAMES: Final[Mapping[str, Any]] = MappingProxyType({})


class Taker(NamedTuple):
    """What takes commands of a robot: its channel, and how they are packed."""

    channel: str
    codec: PayloadCodec


class CommandEncoder:
    """Makes the packets of the commands of one deployment's robots."""

    def __init__(self, deployment: Deployment) -> None:
        self._deployment = deployment
        self._takers: dict[str, tuple[Taker, ...]] = {}

    def encode(self, robot: str, command: Struct) -> tuple[str, bytes]:
        """Return the channel and the payload of a command.

        A node clamps numbers beyond the actuator's limits, and counts such commands. Raises UnknownName for a robot
        without an actuator that takes it, BadValue for numbers that are not finite, or not as many as the command has.
        """
        for one in self.actuators(robot):
            if isinstance(command, one.codec.kind):
                return one.channel, one.codec.encode_checked(command)
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
        return one.codec.encode_checked(one.codec.kind(**given))

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
        actuators = sorted(self._deployment.robots[robot].actuators.items())
        return tuple([Taker(name, codec_of(its.kind, "actuator")) for name, its in actuators])

    def _takes(self, robot: str, command: Struct) -> bool:
        return any(isinstance(command, one.codec.kind) for one in self.actuators(robot))

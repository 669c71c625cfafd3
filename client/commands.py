"""Commands of robots as packets: on the channel of the actuator that takes them. Limits are the node's to apply.

A command is numbers by name, numbers in their order, or the command's own type; one function turns each into bytes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Sized
from typing import Any, NamedTuple

from msgspec import Struct, structs

from foosim.client.player import Command
from foosim.common.errors import ABSENT, BadValue, UnknownName
from foosim.common.names import nearest_name
from foosim.deployment.channel_kinds import joints_of
from foosim.deployment.schema import Deployment
from foosim.world.component_types.payloads import Field, PayloadCodec
from foosim.world.component_types.per_field import codec_of


class Taker(NamedTuple):
    """What takes commands of a robot: its channel, how they are packed, and the names of its joints where a command has
    a number for each, or several rows of such numbers; none where a robot's file is missing."""

    robot: str
    channel: str
    codec: PayloadCodec
    joints: Sequence[str]

    @property
    def fields(self) -> Sequence[Field]:
        """The fields of a plain command: without the number of a job, which the client chooses."""
        return self.codec.fields[:-1] if self.codec.has_job else self.codec.fields

    @property
    def takes(self) -> str:
        """What it takes, in words: its fields with their units."""
        fields = [
            f"{field.name}{f' ({field.unit})' if field.unit else ''}{self._whose(field)}" for field in self.fields
        ]
        return f"{self.robot}/{self.channel} takes {', '.join(fields)}"

    def _whose(self, field: Field) -> str:
        """Return the joints of a field with a number, or a row of numbers, for each."""
        return f" of {', '.join(self.joints)}" if self.joints and self.codec.is_of_joints(field) else ""

    def wrong(self, what: str, value: object = ABSENT, nearest: str | None = None) -> BadValue:
        """Return the error of a command."""
        return BadValue(f"{self.takes}: {what}", value, None if nearest is None else repr(nearest))

    def pack(self, command: object) -> bytes:
        """Return the payload of a plain command. Raises BadValue for a command of another actuator."""
        return self.encode(self.value(command))

    def value(self, command: object) -> Any:
        """Return a plain command as a value of the actuator's type, with unchecked numbers; raises as `pack`."""
        codec = self.codec
        if not isinstance(command, codec.kind):
            if isinstance(command, Struct):
                raise self.wrong(f"a {type(command).__name__} is not one of these")
            values = self._named(command) if isinstance(command, Mapping) else self._ordered(command)
            command = codec.kind(**values)
        if self.joints and _is_several(codec):
            numbers = getattr(command, codec.fields[0].name)  # refused when it is packed, if it is a number
            if isinstance(numbers, Sized) and len(numbers) != len(self.joints):
                raise self._of_another_length(numbers)
        return command

    def encode(self, command: Any) -> bytes:
        """Return the payload of a value of the actuator's type. Raises BadValue."""
        codec = self.codec
        try:
            return codec.encode_checked(command)
        except BadValue as error:
            what = error.problem.removeprefix(f"{codec.name}.").removeprefix(f"{codec.name}: ")
            raise type(error)(f"{self.takes}: {what}", error.value) from None

    def _named(self, command: Mapping[Any, Any]) -> dict[str, Any]:
        """Return the values of fields, or of joints, by their names."""
        fields = [field.name for field in self.fields]
        if self.joints and _is_several(self.codec) and not any(name in fields for name in command):
            return {fields[0]: self._by_joint(command)}
        needed = [field.name for field in structs.fields(self.codec.kind) if field.required]
        self._check_names(command, fields, needed)
        found = dict(command)
        for field in self.fields if self.joints else ():
            numbers = found.get(field.name)
            if isinstance(numbers, Mapping) and field.is_several and self.codec.is_packed:
                found[field.name] = self._by_joint(numbers)
            elif isinstance(numbers, list | tuple) and field.is_rows:
                found[field.name] = [self._by_joint(row) if isinstance(row, Mapping) else row for row in numbers]
        return found

    def _by_joint(self, numbers: Mapping[Any, Any]) -> tuple[Any, ...]:
        """Return numbers by the names of joints in the order of these."""
        self._check_names(numbers, self.joints, self.joints)
        return tuple([numbers[joint] for joint in self.joints])

    def _check_names(self, command: Mapping[Any, Any], valid: Sequence[str], needed: Sequence[str]) -> None:
        for name in command:
            if name not in valid:
                raise self.wrong("no such name", name, nearest_name(name, valid))
        missing = [name for name in needed if name not in command]
        if missing:
            raise self.wrong(f"{', '.join(missing)} {'is' if len(missing) == 1 else 'are'} missing")

    def _ordered(self, command: object) -> dict[str, Any]:
        """Return the values of fields from numbers in their order."""
        if not _is_sequence(command):
            raise self.wrong("not numbers by name or in their order", command)
        values: list[Any] = [*command]  # type: ignore[misc]
        fields = self.fields
        if _is_several(self.codec) and not (len(values) == 1 and _is_sequence(values[0])):
            return {fields[0].name: tuple(values)}
        if len(values) != len(fields):
            raise self._of_another_length(values)
        return {field.name: value for field, value in zip(fields, values, strict=True)}

    def _of_another_length(self, values: Sized) -> BadValue:
        return self.wrong(f"{len(values)} number{'' if len(values) == 1 else 's'} given")


class CommandEncoder:
    """Makes the packets of the commands of one deployment's robots."""

    def __init__(self, deployment: Deployment) -> None:
        self._deployment = deployment
        self._takers: dict[str, tuple[Taker, ...]] = {}

    def encode(self, robot: str, command: Command) -> list[tuple[str, bytes]]:
        """Return the channels and the payloads of a robot's command, in the channels' order.

        Of a robot with several actuators a command is commands by actuator, or of a type that one of them takes. A
        node clamps numbers beyond the actuator's limits, and counts such commands. Raises UnknownName for a robot or
        an actuator that takes no such command, BadValue for unknown fields and invalid numbers.
        """
        takers = self.actuators(robot)
        if isinstance(command, Struct):
            for one in takers:
                if isinstance(command, one.codec.kind):
                    return [(one.channel, one.pack(command))]
            fitting = [name for name in self._deployment.robots if self._takes(name, command)]
            raise UnknownName(f"no robot that takes a {type(command).__name__}", robot, fitting)
        if not takers:
            commanded = [name for name, its in self._deployment.robots.items() if its.actuators]
            raise UnknownName("no robot that takes commands", robot, commanded)
        if isinstance(command, Mapping) and command and all(map(_is_command, command.values())):
            channels = {one.channel: one for one in takers}
            if len(takers) > 1 or all(name in channels for name in command):
                return [(name, self.actuator(robot, name).pack(its)) for name, its in sorted(command.items())]
        if len(takers) > 1:
            each = "; ".join(one.takes for one in takers)
            raise BadValue(f"{each}: a command of {robot} is commands by actuator", command)
        return [(takers[0].channel, takers[0].pack(command))]

    def actuator(self, robot: str, channel: str) -> Taker:
        """Return a robot's actuator. Raises UnknownName."""
        takers = {one.channel: one for one in self.actuators(robot)}
        if channel not in takers:
            each = "; ".join(one.takes for one in takers.values())
            raise UnknownName(f"{each}: {robot} has no such actuator", channel, takers)
        return takers[channel]

    def actuators(self, robot: str) -> tuple[Taker, ...]:
        """Return the actuators of a robot that take commands; none for other names."""
        if robot not in self._deployment.robots:
            return ()
        if robot not in self._takers:
            self._takers[robot] = self._takers_of(robot)
        return self._takers[robot]

    def _takers_of(self, robot: str) -> tuple[Taker, ...]:
        takers = []
        for channel, its in sorted(self._deployment.robots[robot].actuators.items()):
            codec = codec_of(its.component_type)
            joints = joints_of(self._deployment, robot, channel) if any(map(codec.is_of_joints, codec.fields)) else ()
            takers.append(Taker(robot, channel, codec, joints))
        return tuple(takers)

    def _takes(self, robot: str, command: Struct) -> bool:
        return any(isinstance(command, one.codec.kind) for one in self.actuators(robot))


def _is_several(codec: PayloadCodec) -> bool:
    """Whether a value is several numbers under one name, as a number for each joint."""
    return len(codec.fields) == 1 and codec.fields[0].is_several


def _is_command(value: object) -> bool:
    """Whether a value by an actuator's name may be its command: it is no number."""
    return isinstance(value, Struct | Mapping) or _is_sequence(value)


def _is_sequence(value: object) -> bool:
    """Whether that is a list, a tuple, an array: numbers in an order."""
    if isinstance(value, str | bytes):
        return False
    return isinstance(value, Sequence) or (hasattr(value, "__array__") and getattr(value, "ndim", 0) == 1)

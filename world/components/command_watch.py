"""Warns of commands that robots clamp or refuse: the first time for each robot, channel and number.

Their count is in the frames, and the commands are in the deliveries of the tick. So the warning comes once, with any
number of nodes and any owner.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from foosim.common.names import CHANNEL_ECHO
from foosim.world.components.bounds import Clamped
from foosim.world.components.fitted import BoundActuator, actuators_of
from foosim.world.components.view import ComponentError
from foosim.world.frame import Frame
from foosim.world.layout import Layout
from foosim.world.robot_packets import Delivered
from foosim.world.spec import WorldSpec

EVERY_TICKS: Final = 16
"""A robot whose commands are clamped at each tick, as those of a controller in saturation, is looked at this seldom."""
COUNTERS: Final = ("clamped", "refused")
UNSEEN: Final[Mapping[str, str]] = {
    "clamped": "a command is clamped as its modifiers leave it",
    "refused": "a packet is refused: the robot is out of service, or neither outbox nor actuator takes it",
}
"""The text for a command that its packet does not show."""


class CommandWatch:
    """Compares the counters of robots in committed frames."""

    def __init__(self, spec: WorldSpec, warn: Callable[[str], None]) -> None:
        self._spec, self._say = spec, warn
        self._layout: Layout | None = None
        self._places = np.zeros((0, 2), dtype=np.int64)
        self._actuators: dict[str, tuple[BoundActuator, ...]] = {}
        """Of robots whose counters have changed."""
        self._due: dict[int, int] = {}
        """Of robots, by their place, the tick from which commands are looked at again."""
        self._warned: set[tuple[str, str, str]] = set()
        """Robots, channels and numbers, or the fate of the whole command."""

    def committed(self, before: Frame, after: Frame, delivered: Callable[[], Sequence[Delivered]]) -> None:
        """Warn of what happened to commands in the tick between two frames; `delivered` returns what came in it."""
        layout = after.layout
        if layout is not before.layout:  # an entity that joins or leaves has new counters
            return
        if layout is not self._layout:
            self._layout, self._actuators, self._due = layout, {}, {}
            places = [[robot.offsets[counter] for counter in COUNTERS] for robot in layout.robots]
            self._places = np.array(places, dtype=np.int64).reshape(len(places), 2)
        more = after.values[self._places] > before.values[self._places]
        if not more.any():
            return
        due = [place for place in np.flatnonzero(more.any(axis=1)).tolist() if self._due.get(place, 0) <= after.tick]
        if not due:
            return
        packets: dict[str, list[Delivered]] = {}
        for packet in delivered():
            packets.setdefault(packet.destination, []).append(packet)
        for place in due:
            self._due[place] = after.tick + EVERY_TICKS
            robot, (is_clamped, is_refused) = layout.robots[place].name, more[place].tolist()
            self._warn(robot, after.tick - 1, packets.get(robot, []), (is_clamped, is_refused))

    def _warn(self, robot: str, tick: int, packets: Sequence[Delivered], grown: tuple[bool, bool]) -> None:
        found = [*self._found(robot, packets)]
        for fate, has_grown in zip(COUNTERS, grown, strict=True):
            if not has_grown:
                continue
            its = [(channel, number, text) for channel, kind, number, text in found if kind == fate]
            for channel, number, text in its or [("", fate, UNSEEN[fate])]:
                key = robot, channel, number
                if key not in self._warned:
                    self._warned.add(key)
                    where = f"{robot}, {channel}" if channel else robot
                    self._say(f"tick {tick}: {where}: {text}; further ones are counted")

    def _found(self, robot: str, packets: Sequence[Delivered]) -> Iterator[tuple[str, str, str, str]]:
        """Yield of commands the channel, what happens to them, to which number, and the text."""
        its = self._actuators_of(robot)
        for packet in packets:
            one = next((one for one in its if one.channel == packet.channel), None)
            if packet.channel == CHANNEL_ECHO:
                continue
            if one is None:
                channels = ", ".join(one.channel for one in its) or "none"
                yield (
                    packet.channel,
                    "refused",
                    "refused",
                    f"a packet is refused: there are the channels {channels}",
                )
                continue
            try:
                why, clamped = one.examine(packet.payload)
            except ComponentError:  # it is another one than after its modifiers, which the node has given the actuator
                continue
            if why:
                yield one.channel, "refused", "refused", f"a command of {packet.source} is refused: {why}"
            for number in clamped:
                yield one.channel, "clamped", number.name, f"{number_text(number)}, sent by {packet.source}"

    def _actuators_of(self, robot: str) -> tuple[BoundActuator, ...]:
        if robot not in self._actuators:
            assert self._layout is not None
            self._actuators[robot] = actuators_of(self._spec, self._layout, self._layout[robot])
        return self._actuators[robot]


def number_text(number: Clamped) -> str:
    """`a 2.5 rad is above its limit and is clamped to 2 rad`."""
    unit = f" {number.unit}" if number.unit else ""
    way = "above" if number.value > number.limit else "below"
    return f"{number.name} {number.value:g}{unit} is {way} its limit, and is clamped to {number.limit:g}{unit}"

"""The address of a packet's draws: a key, and a number under it; copy and block are the second counter.

A client's packet draws under the key of its link by its sequence number. A robot's packet draws under a key of its link
and its channel, by the tick of sending and its count within the channel at that tick. So a robot's other channels shift
none of its draws: its sequence number, in which all of them have a part, is no part of the address. A broadcast's turn
on the air is drawn under the keys of its sender's radio, by the same number.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from foosim.common import limits
from foosim.common.keyed_random import draw_key
from foosim.world.robot_packets import RobotPacket

COUNT_BITS: Final = 16
"""A robot sends at most 2^16 packets in a tick."""


def robot_number(tick: int, count: int) -> int:
    """Return the number of a robot's packet under the key of its link and channel."""
    return (tick << COUNT_BITS) + count


def counts_within_channels(packets: Iterable[RobotPacket]) -> list[int]:
    """Return the count of each packet of a tick: how many of its robot on its channel are before it."""
    counts: list[int] = []
    robot = ""
    seen: dict[str, int] = {}
    by_robot: dict[str, dict[str, int]] = {}
    for packet in packets:
        if packet.robot != robot:
            robot = packet.robot
            seen = by_robot.setdefault(robot, {})
        channel = packet.channel
        count = seen.get(channel, 0)
        seen[channel] = count + 1
        counts.append(count)
    return counts


class DrawKeys:
    """The keys of the draws of a link's packets, or of a radio's broadcasts."""

    __slots__ = ("_channels", "_purpose", "_seed", "by_channel", "key")

    def __init__(self, seed: int, *purpose: str, by_channel: bool) -> None:
        """`by_channel`: the packets are a robot's, and each channel has a key of its own."""
        self.key = draw_key(seed, *purpose)
        """That of a client's packets. What a link draws whatever is sent on it (its outages) comes from it, too."""
        self.by_channel = by_channel
        self._seed, self._purpose = seed, purpose
        self._channels: dict[str, bytes] = {}

    def of(self, channel: str) -> bytes:
        """Return the key of the draws of a channel's packets."""
        if not self.by_channel:
            return self.key
        found = self._channels.get(channel)
        if found is None:
            found = self._channels[channel] = draw_key(self._seed, *self._purpose, "channel", channel)
        return found

    def number(self, sequence: int, tick: int, count: int) -> int:
        """Return the number of a packet under its key, from what its row has."""
        return robot_number(tick, count) if self.by_channel else sequence


assert limits.ROBOT_PACKETS_PER_TICK_MAX <= 1 << COUNT_BITS

"""Who acts in a world that is stepped: agents, whose commands the caller gives, and players that act by themselves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from foosim.client.player import Packet
from foosim.client.playing import Acting
from foosim.common.errors import Malformed, UnknownName
from foosim.deployment.channel_kinds import channels_of
from foosim.deployment.schema import Deployment
from foosim.protocol.messages import Received, Sent
from foosim.simulation.carriers import Carrier

LEARNER: Final = "learner"
"""The agent of a deployment without players."""
Pair = tuple[str, str]


def agents_of(deployment: Deployment) -> list[str]:
    """Return the players that command a robot, by name; `learner` where there is none."""
    found = [
        name
        for name, player in sorted(deployment.players.items())
        if any(deployment.robots[robot].actuators for robot in player.robots if robot in deployment.robots)
    ]
    return found or [LEARNER]


class Agent:
    """A player that the caller controls: its robots, what it hears, and the newest readings of that."""

    def __init__(self, deployment: Deployment, name: str) -> None:
        """Raises UnknownName for another name than a player's or `learner`."""
        self.name = name
        player = deployment.players.get(name)
        if player is not None:
            self.robots = tuple(sorted(player.robots))
            self.hears = deployment.heard_by(name)
        elif name in deployment.clients:
            self.robots = tuple(sorted(deployment.robots))
            self.hears = [(robot, channel) for robot in self.robots for channel in deployment.robots[robot].sensors]
        else:
            raise UnknownName("no player that could be an agent", name, deployment.players)
        self.sequence = 0
        self.since = 0
        """The tick since which it exists; -1 while all its robots are absent."""
        self.malformed = 0
        """Readings since the last `reset` that do not fit their channel: the network has changed them."""
        self.channels = channels_of(deployment, self.hears)
        """By each (endpoint, channel) that it hears."""
        self.newest: dict[Pair, Received] = {}

    def begin(self, deployment: Deployment) -> None:
        """Forget what was heard and sent. The noise of pictures is that of the seed of `deployment`."""
        self.channels = channels_of(deployment, self.hears)
        self.sequence = self.malformed = self.since = 0
        self.newest = {}

    @property
    def exists(self) -> bool:
        """Whether it exists in the present frame."""
        return self.since >= 0

    def exist(self, since: int) -> None:
        """Be the agent that exists since a tick: another one than before has heard nothing."""
        if self.since != since >= 0:
            self.newest = {}
        self.since = since

    def take(self, packets: Sequence[Received], is_checked: bool) -> None:
        """Keep the newest packet of each channel by the number of its sender: they may arrive out of order.

        `is_checked`: packets whose bytes are no reading of their channel do not count.
        """
        newest = self.newest
        for packet in packets:
            pair = packet.source, packet.channel
            known = newest.get(pair)
            if pair not in self.channels or (known is not None and known.sequence >= packet.sequence):
                continue
            codec = self.channels[pair].codec
            if is_checked and codec is not None:
                try:
                    codec.decode(packet.payload)
                except Malformed:
                    self.malformed += 1
                    continue
            newest[pair] = packet

    def numbered(self, packets: Sequence[Packet], now_ns: int) -> list[Sent]:
        """Return packets as they are sent, with the client's numbers."""
        first = self.sequence + 1
        self.sequence += len(packets)
        return [
            Sent(number, one.destination, one.channel, now_ns, one.payload) for number, one in enumerate(packets, first)
        ]


class Resident:
    """A player of the deployment that acts by itself."""

    def __init__(self, deployment: Deployment, name: str) -> None:
        """Raises PlayerError for a player that cannot be loaded or made."""
        self.acting = Acting(deployment, name)
        self._sequence = 0

    def act(self, tick: int, now_ns: int, carrier: Carrier) -> list[Sent]:
        """Let it act at a tick on what has reached it. Raises PlayerError."""
        name = self.acting.name
        self.acting.exist(carrier.members[name].since, carrier.members[name].absent, tick)
        self.acting.newest.take(carrier.take(name))
        sent = []
        for one in self.acting.act(tick):
            self._sequence += 1
            sent.append(Sent(self._sequence, one.destination, one.channel, now_ns, one.payload))
        return sent

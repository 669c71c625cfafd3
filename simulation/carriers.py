"""Carriers of packets between robots and the clients of a stepped world: the emulated network, or a direct one.

A carrier is opened at each frame, with what the robots send, and closed, with what clients answer. Members are clients
that take part, by the classes of the vHub, so a player is due at the ticks at which it is due in a run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from foosim.deployment.schema import Deployment
from foosim.protocol.messages import Received, Sent
from foosim.vhub.network.memory import Joining
from foosim.vhub.network.packet import Flight, received
from foosim.vhub.state.existence import Existence
from foosim.vhub.state.hub_state import OUTBOX_SHIFT, HubState
from foosim.vhub.state.members import Member
from foosim.world.edits import Disrupt
from foosim.world.frame import Frame
from foosim.world.robot_packets import Delivered, RobotPacket


class Carrier(Protocol):
    """Carries packets. At each frame it is opened, then closed."""

    members: dict[str, Member]
    """The clients that take part."""

    def open(self, frame: Frame, packets: Sequence[RobotPacket], events: Sequence[Disrupt]) -> list[str]:
        """Take what the robots send at a frame, in (robot, index) order, and what happens to the network from it on;
        return the clients that are due, by name."""

    def take(self, client: str) -> list[Received]:
        """Remove and return what has reached a client, in order of arrival."""

    def close(self, frame: Frame, sent: Mapping[str, Sequence[Sent]]) -> list[Delivered]:
        """Take what clients send at the frame; return what reaches robots at it, in the order of delivery."""


class EmulatedNetwork:
    """The vHub's state, closed tick by tick as the vHub does: what is sent at a tick arrives at the next at best."""

    def __init__(self, deployment: Deployment, first_tick: int, joining: Sequence[Joining]) -> None:
        self.state = HubState(deployment, first_tick)
        self.members = self.state.members
        self._joining = {one.name: one for one in sorted(joining, key=lambda one: one.name)}
        self._released: dict[str, list[Flight]] = {}
        self._delivered: list[Delivered] = []

    def open(self, frame: Frame, packets: Sequence[RobotPacket], events: Sequence[Disrupt]) -> list[str]:
        """Close the world's phase of the tick."""
        state, tick = self.state, frame.tick
        if self._joining and state.hears_clients:
            for name in [name for name, one in self._joining.items() if one.suits(tick)]:
                state.join(self._joining.pop(name), tick)
        for name, flights in state.close_world(frame, packets, [], events).items():
            self._released.setdefault(name, []).extend(flights)
        return state.due_members(tick)

    def take(self, client: str) -> list[Received]:
        """Return what the network has released to a client."""
        return received(self._released.pop(client, ()))

    def close(self, frame: Frame, sent: Mapping[str, Sequence[Sent]]) -> list[Delivered]:
        """Close the clients' phase of the tick; return its deliveries, which are those of the closing before."""
        delivered = self._delivered
        self._delivered = self.state.close_robots(frame, sent).packets
        self.state.close_rest()
        return delivered


class Bypass:
    """Nothing in between: readings reach clients at the frame that they are of, commands the robots at the same one.

    What clients send each other arrives at the next frame.
    """

    def __init__(self, deployment: Deployment, first_tick: int, joining: Sequence[Joining]) -> None:
        self._tick_ns = deployment.tick_ns
        self._existence = Existence(deployment)
        self.members: dict[str, Member] = {}
        self._joining = {one.name: one for one in sorted(joining, key=lambda one: one.name)}
        self._receivers: dict[tuple[str, str], list[str]] = {}
        for one in self._joining.values():
            for source, channel in one.subscriptions:
                self._receivers.setdefault((source, channel), []).append(one.name)
        self._clients = frozenset(self._joining)
        self._waiting: dict[str, list[Received]] = {}
        self._to_clients: list[tuple[str, Received]] = []
        """What clients have sent to clients, by receiver."""
        self._to_robots: list[Delivered] = []
        self._robots = frozenset(deployment.robots)
        self._turns = {one.name: frozenset((s, c) for s, c in one.arrivals) for one in joining if one.arrivals}

    def open(self, frame: Frame, packets: Sequence[RobotPacket], events: Sequence[Disrupt]) -> list[str]:
        """Hand readings to their subscribers."""
        assert not events, "there is no network to which something could happen"
        tick = frame.tick
        if self._joining:
            for name in [name for name, one in self._joining.items() if one.suits(tick)]:
                self.members[name] = Member.of(self._joining.pop(name), tick)
                self._existence.look_again()
        for name in self._existence.turn_to(frame, self.members):
            if self.members[name].since == tick:
                self._waiting.pop(name, None)
        for name in self._turns:
            member = self.members.get(name)
            if member is not None and member.is_over(tick):
                member.called_tick = tick
        arrived, self._to_clients = self._to_clients, []
        for name, message in arrived:
            self._hand(name, message, tick)
        now_ns = tick * self._tick_ns
        for packet in packets:
            sequence = (tick << OUTBOX_SHIFT) + packet.index
            to = packet.destination
            if to in self._robots:
                self._to_robots.append(Delivered(now_ns, packet.robot, sequence, 0, to, packet.channel, packet.payload))
                continue
            names = self._receivers.get((packet.robot, packet.channel), ()) if not to else (to,)
            if names:
                message = Received(packet.robot, sequence, 0, packet.channel, now_ns, now_ns, packet.payload)
                for name in names:
                    self._hand(name, message, tick)
        return sorted([name for name, member in self.members.items() if member.is_due(tick)])

    def _hand(self, name: str, message: Received, tick: int) -> None:
        """Let a packet reach a client that takes part and exists."""
        member = self.members.get(name)
        if member is None or not member.has_existed_at(message.due_ns, self._tick_ns):
            return
        self._waiting.setdefault(name, []).append(message)
        calling = self._turns.get(name)
        if calling is not None and (message.source, message.channel) in calling:
            member.called_tick = tick

    def take(self, client: str) -> list[Received]:
        """Return what has reached a client."""
        return self._waiting.pop(client, [])

    def close(self, frame: Frame, sent: Mapping[str, Sequence[Sent]]) -> list[Delivered]:
        """Return the commands of the tick, in the order of their senders' names, and what robots sent to robots."""
        delivered, self._to_robots = self._to_robots, []
        now_ns = frame.tick * self._tick_ns
        for source, packets in sorted(sent.items()):
            for one in packets:
                to = one.destination
                if to in self._robots:
                    delivered.append(Delivered(now_ns, source, one.sequence, 0, to, one.channel, one.payload))
                    continue
                message = Received(source, one.sequence, 0, one.channel, now_ns, now_ns, one.payload)
                names = self._receivers.get((source, one.channel), ()) if not to else (to,)
                self._to_clients += [(name, message) for name in names if name in self._clients]
        delivered.sort(key=_order)
        return delivered


def _order(packet: Delivered) -> tuple[int, str, int, int]:
    return packet.due_ns, packet.source, packet.sequence, packet.copy

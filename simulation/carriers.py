"""Carriers of packets between robots and the clients of a stepped world: the emulated network, or a direct one.

A carrier is opened at each frame, with what the robots send, and closed, with what clients answer. Members are clients
that take part, by the classes of the vHub, so a player is due at the ticks at which it is due in a run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from foosim.deployment.network.rules import Network
from foosim.deployment.schema import Deployment
from foosim.protocol.messages import Received, Sent
from foosim.vhub.network.memory import Joining
from foosim.vhub.network.packet import Flight, received
from foosim.vhub.state.hub_state import HubState
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


class Bypass(EmulatedNetwork):
    """Nothing in between: readings reach clients at the frame that they are of, commands the robots at the same one.

    What clients send each other arrives at the next frame. That is what a network without rules does, whose deliveries
    count at the frame at which they are known.
    """

    def __init__(self, deployment: Deployment, first_tick: int, joining: Sequence[Joining]) -> None:
        super().__init__(deployment.model_copy(update={"network": Network()}), first_tick, joining)

    def close(self, frame: Frame, sent: Mapping[str, Sequence[Sent]]) -> list[Delivered]:
        """Return the commands of the tick."""
        super().close(frame, sent)
        return self._delivered

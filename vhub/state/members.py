"""A client in the vHub's state: ticks and numbers, without its session."""

from __future__ import annotations

from collections.abc import Mapping, Set

from msgspec import convert

from foosim.deployment.schema import Deployment
from foosim.vhub.network.memory import Joining, MemberState
from foosim.vhub.network.packet import Flight


def may_lockstep(deployment: Deployment, name: str) -> bool:
    """Whether the client may be in lockstep: only these delay the run."""
    declared = deployment.players.get(name) or deployment.clients.get(name)
    return declared is not None and declared.lockstep


def may_restart(deployment: Deployment, name: str) -> bool:
    """Whether a client's process is restarted after its end."""
    return name in deployment.players and deployment.players[name].restart


class Member:
    """One client. In lockstep it acts at ticks that leave the remainder `offset` by `period`; with `arrivals` at ticks
    at which a packet of such an (endpoint, channel) reaches it, or at which it has not been called for a period.
    """

    def __init__(self, state: MemberState) -> None:
        self.period = state.period
        self.subscriptions = state.subscriptions
        self.joined_tick = state.joined_tick
        self.sequence = state.sequence
        """Greatest sequence number that was admitted."""
        self.downlink = state.downlink
        """Number of the last message to the client."""
        self.active = state.active
        self.offset = state.offset
        self.arrivals = state.arrivals
        self.called_tick = state.called_tick
        """For a client that acts at arrival: the last tick at which it was called, -1 before the first."""
        self.since = state.since
        """The tick of the frame from which on it exists (`existence`); 0 from the start, -1 while it does not."""
        self.absent = state.absent
        """Those of its robots that are absent, in name order."""

    @classmethod
    def of(cls, joining: Joining, tick: int) -> Member:
        """Return the client that joins at a tick."""
        arrivals = tuple((source, channel) for source, channel in joining.arrivals)
        subscriptions = tuple((source, channel) for source, channel in joining.subscriptions)
        return cls(MemberState(joining.period, subscriptions, tick, offset=joining.offset, arrivals=arrivals))

    def state(self) -> MemberState:
        """Return its part of a snapshot."""
        return convert(self, MemberState, from_attributes=True)

    @property
    def exists(self) -> bool:
        """Whether it exists in the newest frame: one that does not takes part, and is neither called nor awaited."""
        return self.since >= 0

    def has_existed_at(self, time_ns: int, tick_ns: int) -> bool:
        """Whether it exists, and has since this time: packets due before are not its own."""
        return 0 <= self.since * tick_ns <= time_ns

    def is_due(self, tick: int) -> bool:
        """Whether it is due at a tick. For a client that acts at arrival, the tick's packets must be there."""
        if self.arrivals:
            return self.active and tick == self.called_tick
        return self.active and self.since >= 0 and self.period > 0 and tick % self.period == self.offset

    def may_be_due(self, tick: int, closed: int) -> bool:
        """Whether it may be due at a tick after the closed ones, regardless of arrivals: in each of the frames
        between it may exist again."""
        if self.arrivals:
            return self._is_over(tick, self.since if self.exists else closed + 1)
        return self.active and self.period > 0 and tick % self.period == self.offset

    def is_over(self, tick: int) -> bool:
        """Whether a client that acts at arrival has waited for a period since its last call, its join, or since it
        exists."""
        return self.exists and self._is_over(tick, self.since)

    def _is_over(self, tick: int, since: int) -> bool:
        return self.active and tick >= max(self.called_tick, self.joined_tick, since) + self.period

    def release_tick(self, tick: int) -> int:
        """Return the first tick, from `tick` on, at which its period allows a release to the client."""
        return tick if self.period == 0 or self.arrivals else tick + (self.offset - tick) % self.period


class Here:
    """Values derived from the members, computed anew where one joins, leaves, or begins or ceases to exist."""

    def __init__(self, deployment: Deployment, speaking: Set[tuple[str, str]]) -> None:
        """`speaking` are the robots and channels of sensors that may measure at any tick."""
        self._speaking = speaking
        clients = [*deployment.players, *deployment.clients]
        self._lockstep = tuple(name for name in clients if may_lockstep(deployment, name))
        self.is_complete = not self._lockstep
        """Whether all declared lockstep clients take part: one that does not may join at any tick."""
        self.on_arrival: dict[str, Member] = {}
        """Clients that act at arrival, in name order."""
        self.is_called_at_any_tick = False
        """Whether a client acts at the arrival of what may be measured at any tick."""
        self.receivers: dict[tuple[str, str], tuple[str, ...]] = {}
        """Subscribers of each (endpoint, channel) that exist, in name order."""

    def renew(self, members: Mapping[str, Member]) -> None:
        """Compute the values anew."""
        here = {name: member for name, member in sorted(members.items()) if member.active}
        self.is_complete = all(name in here for name in self._lockstep)
        self.on_arrival = {name: member for name, member in here.items() if member.arrivals}
        self.is_called_at_any_tick = any(
            pair in self._speaking for member in self.on_arrival.values() for pair in member.arrivals
        )
        heard: dict[tuple[str, str], list[str]] = {}
        for name, member in here.items():
            for pair in member.subscriptions if member.exists else ():
                heard.setdefault(pair, []).append(name)
        self.receivers = {pair: tuple(names) for pair, names in heard.items()}

    def calls(self, flight: Flight) -> bool:
        """Whether a packet's receiver acts at its arrival."""
        member = self.on_arrival.get(flight.destination)
        return member is not None and (flight.source, flight.channel) in member.arrivals

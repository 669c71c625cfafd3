"""A client that takes part, as the vHub's state knows it: in ticks and numbers, without its session.

Neighbours: `state`, which holds them; `sessions` is about their processes.
"""

from __future__ import annotations

from typing import Any

from foosim.protocol.deployment import Deployment


def may_lockstep(deployment: Deployment, name: str) -> bool:
    """Whether the run waits for this client: no other can hold it up."""
    declared = deployment.players.get(name) or deployment.clients.get(name)
    return declared is not None and declared.lockstep


class Member:
    """One client. Its ticks, where it is in lockstep, are those that leave the remainder `offset` by `period`."""

    def __init__(
        self,
        period: int,
        subscriptions: tuple[tuple[str, str], ...],
        joined_tick: int,
        sequence: int = 0,
        downlink: int = 0,
        active: bool = True,
        branched: int = 0,
        offset: int = 0,
    ) -> None:
        self.period = period
        self.offset = offset
        self.subscriptions = subscriptions
        self.joined_tick = joined_tick
        self.sequence = sequence
        """Greatest sequence number that was admitted."""
        self.downlink = downlink
        """Number of the last message to the client."""
        self.active = active
        self.branched = branched
        """The number of that message when the last branch began: what was said then behind it is void."""

    def is_due(self, tick: int) -> bool:
        return self.active and self.period > 0 and tick % self.period == self.offset

    def release_tick(self, tick: int) -> int:
        """Return the first tick, from `tick` on, at which something can be released to the client."""
        return tick if self.period == 0 else tick + (self.offset - tick) % self.period

    def as_written(self) -> list[Any]:
        """Return what its constructor takes, as the state is written down."""
        numbers = self.joined_tick, self.sequence, self.downlink, self.active, self.branched
        return [self.period, self.subscriptions, *numbers, self.offset]

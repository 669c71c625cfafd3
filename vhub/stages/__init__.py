"""The stages of a link, in their fixed order: a table that the hub walks.

Each stage is one file with a class that is made from a link's rule. It has two hooks, at sending and at arrival; a hook
that drops the packet returns the name of the cause. A stage that has nothing to do on a link is left out there. What a
stage remembers is a plain value in the link's state. To add one: its file, and its row here, at its place in the order
admit, policy, duty, queue, medium, channel, residual, mangle, delay, receiver.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Protocol

from foosim.protocol.deployment import LinkRule
from foosim.vhub.packet import Flight
from foosim.vhub.stages.delay import Delay
from foosim.vhub.stages.receiver import Receiver
from foosim.vhub.stages.residual import Residual


class Memory(Protocol):
    """What the stages of one link remember, part of the hub's state."""

    last_due_ns: int


class Stage(Protocol):
    """One step of the pipeline on one link."""

    def at_sending(self, flight: Flight, memory: Memory) -> str:
        """Judge a packet that is sent; return the cause of its drop, or an empty string."""

    def at_arrival(self, flight: Flight, hindered: str) -> str:
        """Judge a packet that arrives; return the cause of its drop, or an empty string.

        `hindered` is why its receiver does not take it; empty when it does.
        """


STAGES: Final[tuple[Callable[[LinkRule | None], Stage | None], ...]] = (
    Residual.for_rule,
    Delay.for_rule,
    Receiver.for_rule,
)

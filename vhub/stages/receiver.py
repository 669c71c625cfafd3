"""Receiver: who is down, or gone, when a packet arrives does not take it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from foosim.protocol.deployment import LinkRule
from foosim.vhub.packet import Flight

if TYPE_CHECKING:
    from foosim.vhub.stages import Memory

RECEIVER_DOWN = "rx_down"


class Receiver:
    """Is told of a robot's flag `down` in the newest frame before arrival, and of clients that have left."""

    @classmethod
    def for_rule(cls, rule: LinkRule | None) -> Receiver:
        return cls()

    def at_sending(self, flight: Flight, memory: Memory) -> str:
        return ""

    def at_arrival(self, flight: Flight, receiver_down: bool) -> str:
        return RECEIVER_DOWN if receiver_down else ""

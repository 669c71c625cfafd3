"""Receiver: who is down, or gone, or has got too much already, when a packet arrives does not take it."""

from __future__ import annotations

from typing import Final

from foosim.vhub.network.link_context import LinkSetup
from foosim.vhub.network.packet import Flight
from foosim.vhub.stages.stage import Stage

RECEIVER_DOWN: Final = "rx_down"
RECEIVER_FULL: Final = "rx_full"
"""What reaches a receiver at one tick is one message: what does not fit into it is lost, before anybody refuses it."""


class Receiver(Stage):
    """Is told of bodies that are out of service in the newest frame, of clients that have left, of full messages."""

    @classmethod
    def for_link(cls, setup: LinkSetup) -> Receiver:
        return cls()

    def at_arrival(self, flight: Flight, hindered: str) -> str:
        return hindered

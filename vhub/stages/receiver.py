"""Receiver: drops packets at arrival if the receiver is down, has left, or is over its limit."""

from __future__ import annotations

from typing import Final

from foosim.vhub.network.link_context import LinkSetup
from foosim.vhub.network.packet import Flight
from foosim.vhub.stages.stage import Stage

RECEIVER_DOWN: Final = "rx_down"
RECEIVER_FULL: Final = "rx_full"
"""The packets of a receiver at one tick are one message: those that exceed its size are dropped."""


class Receiver(Stage):
    """Drops packets for the reasons that the state finds at arrival: body out of service, client left, message full."""

    @classmethod
    def for_link(cls, setup: LinkSetup) -> Receiver:
        return cls()

    def at_arrival(self, flight: Flight, hindered: str) -> str:
        return hindered

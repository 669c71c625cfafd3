"""Admission: what is too long for the link, or comes from a body that is out of service, is not sent."""

from __future__ import annotations

from typing import Final

from foosim.vhub.packet import Flight
from foosim.vhub.setup import LinkSetup
from foosim.vhub.stages.stage import Stage

TOO_BIG: Final = "too_big"
NODE_DOWN: Final = "node_down"
NO_ROUTE: Final = "no_route"


class Admit(Stage):
    """Knows the longest payload, and whether the sender's body works."""

    def __init__(self, setup: LinkSetup) -> None:
        self._longest = setup.settings.payload_max
        self._source, self._world = setup.source, setup.world

    @classmethod
    def for_link(cls, setup: LinkSetup) -> Admit | None:
        if not setup.is_routed:
            return NoRoute(setup)
        return cls(setup) if setup.settings.payload_max is not None or setup.is_radio else None

    def at_sending(self, flight: Flight) -> str:
        if self._longest is not None and len(flight.payload) > self._longest:
            return TOO_BIG
        return NODE_DOWN if self._world.is_down(self._source) else ""


class NoRoute(Admit):
    """The ends have no radio in common, or not that of their rule."""

    def at_sending(self, flight: Flight) -> str:
        return NO_ROUTE

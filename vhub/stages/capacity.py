"""Capacity: bounds the packets in flight on a link; a further one replaces a random one.

That is how TigerBeetle's simulator bounds a path (src/testing/packet_simulator.zig). Who is evicted is drawn by the
packet that comes, known at once, and said at arrival.
"""

from __future__ import annotations

from typing import Final

from foosim.vhub.network.link_context import LinkSetup
from foosim.vhub.network.memory import LinkState
from foosim.vhub.network.packet import Flight
from foosim.vhub.stages.stage import Stage

EVICTED: Final = "evicted"
CAPACITY_BLOCK: Final = 3
"""The block of a packet's draws whose first word selects the packet that is replaced."""


class Capacity(Stage):
    """Keeps the packets in flight on a link."""

    def __init__(self, setup: LinkSetup, most: int) -> None:
        self._setup, self._most = setup, most

    @classmethod
    def for_link(cls, setup: LinkSetup) -> Capacity | None:
        most = setup.settings.capacity
        return None if most is None else cls(setup, most)

    def at_sending(self, flight: Flight) -> str:
        memory = self._setup.memory
        flying = [place for place, (_, _, evicted_by) in enumerate(memory.under_way) if not evicted_by]
        if len(flying) >= self._most:
            place = flying[self._setup.words(flight, CAPACITY_BLOCK)[0] * len(flying) >> 64]
            sequence, copy, _ = memory.under_way[place]
            by = flight.sequence, flight.copy, len(flying), flight.channel, flight.count
            memory.under_way[place] = sequence, copy, by
        memory.under_way.append((flight.sequence, flight.copy, ()))
        return ""

    def at_arrival(self, flight: Flight, hindered: str) -> str:
        for sequence, copy, evicted_by in self._setup.memory.under_way:
            if evicted_by and sequence == flight.sequence and copy == flight.copy:
                flight.decided_by = evicted_by
                return EVICTED
        return ""


def leave(memory: LinkState, flight: Flight) -> None:
    """Remove a packet that has arrived, or was dropped at arrival."""
    memory.under_way = [one for one in memory.under_way if one[0] != flight.sequence or one[1] != flight.copy]

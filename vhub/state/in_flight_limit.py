"""Bounds the bytes in flight in the whole run: all of them are in the state, and the state is one journal record.

Half of the bound is common; of the other half each sender has an even share. So a clog without end cannot fill the
journal, and a sender of little loses nothing to a sender of much.
"""

from __future__ import annotations

from foosim.common import limits
from foosim.common.limits import FLIGHT_HEAD_BYTES
from foosim.vhub.network.packet import Flight


class InFlightLimit:
    """Counts the bytes in flight; `senders` is the number of endpoints."""

    def __init__(self, senders: int) -> None:
        self._common_bytes = limits.TRANSIT_BYTES_MAX // 2
        self._share_bytes = self._common_bytes // max(1, senders)
        self._bytes = 0
        self._by_source: dict[str, int] = {}

    def takes(self, flight: Flight) -> bool:
        """Whether a packet fits; if so it is counted."""
        source, by_source = flight.source, self._by_source
        size = _size_of(flight)
        whole, own = self._bytes + size, by_source.get(source, 0) + size
        if whole > self._common_bytes and own > self._share_bytes:
            return False
        self._bytes, by_source[source] = whole, own
        return True

    def restored(self, flight: Flight) -> None:
        """Count a packet of a restored state."""
        size = _size_of(flight)
        self._bytes += size
        self._by_source[flight.source] = self._by_source.get(flight.source, 0) + size

    def arrived(self, flight: Flight) -> None:
        """Stop counting a packet that has its fate."""
        size = _size_of(flight)
        self._bytes -= size
        self._by_source[flight.source] -= size


def _size_of(flight: Flight) -> int:
    return FLIGHT_HEAD_BYTES + len(flight.payload) + len(flight.mangled)

"""Limits of bytes: of one tick's packets to a receiver, and of all packets in flight in the run.

A message to a receiver has a limit, and its readers refuse a larger one. Where more arrives, each source has an even
share of it, so that a flood costs other sources nothing; what exceeds a source's share is dropped. What is in flight is
in the state, and the state is one journal record: half of its bound is common, of the other half each sender has an
even share. So a clog without end cannot fill the journal, and a sender of little loses nothing to a sender of much.
"""

from __future__ import annotations

from collections.abc import Sequence

from foosim.common import limits
from foosim.common.limits import FLIGHT_HEAD_BYTES
from foosim.vhub.network.packet import Flight, size_of


class ReceiveBudget:
    """The budget of one tick, applied to its flights in order. `bytes_max` is the limit of each receiver.

    `is_shared`: one message goes to all receivers, so they share a budget.
    """

    def __init__(self, flights: Sequence[Flight], bytes_max: int, *, is_shared: bool) -> None:
        self._is_shared = is_shared
        self._left: dict[tuple[str, str], int] = {}
        """For receivers over budget: the rest of each source's share, in bytes."""
        self._shares: dict[str, int] = {}
        """For these, by receiver: the share of each source, in bytes."""
        whole = 0
        for flight in flights:
            whole += size_of(flight)
        if whole > bytes_max:
            self._share(flights, bytes_max)

    def _share(self, flights: Sequence[Flight], bytes_max: int) -> None:
        """Divide the budget of each receiver with too many bytes among its sources."""
        wanted: dict[str, dict[str, int]] = {}
        for flight in flights:
            of_receiver = wanted.setdefault("" if self._is_shared else flight.destination, {})
            of_receiver[flight.source] = of_receiver.get(flight.source, 0) + size_of(flight)
        for receiver, of_receiver in wanted.items():
            if sum(of_receiver.values()) > bytes_max:
                share = self._shares[receiver] = bytes_max // len(of_receiver)
                self._left.update({(receiver, source): share for source in of_receiver})

    def takes(self, flight: Flight) -> bool:
        """Whether a flight fits; one that does not is given the numbers that decided it."""
        if not self._left:
            return True
        key = "" if self._is_shared else flight.destination, flight.source
        left = self._left.get(key)
        if left is None:
            return True
        size = size_of(flight)
        if size > left:
            flight.decided_by = left, self._shares[key[0]]
            return False
        self._left[key] = left - size
        return True


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

"""How much is on its way in the whole run: all of it stands in the state, and the state in one record of the journal.

Half of what there may be is for whoever comes; of the other half each sender has an even share. So a clog without end
fills no journal, and who sends little loses nothing by who sends much.
"""

from __future__ import annotations

from typing import Final

from foosim.common import limits
from foosim.common.limits import FLIGHT_HEAD_BYTES
from foosim.vhub.network.packet import Flight

TRANSIT_FULL: Final = "transit_full"


class Transit:
    """What is on its way, in bytes; `senders` is how many endpoints there are."""

    def __init__(self, senders: int) -> None:
        self._common_bytes = limits.TRANSIT_BYTES_MAX // 2
        self._share_bytes = self._common_bytes // max(1, senders)
        self._bytes = 0
        self._by_source: dict[str, int] = {}

    def takes(self, flight: Flight) -> bool:
        """Whether there is room for one more, which is on its way then."""
        source, by_source = flight.source, self._by_source
        size = _size_of(flight)
        whole, own = self._bytes + size, by_source.get(source, 0) + size
        if whole > self._common_bytes and own > self._share_bytes:
            return False
        self._bytes, by_source[source] = whole, own
        return True

    def restored(self, flight: Flight) -> None:
        """One is on its way, as the state says that was written down."""
        size = _size_of(flight)
        self._bytes += size
        self._by_source[flight.source] = self._by_source.get(flight.source, 0) + size

    def arrived(self, flight: Flight) -> None:
        """One is on its way no more."""
        size = _size_of(flight)
        self._bytes -= size
        self._by_source[flight.source] -= size


def _size_of(flight: Flight) -> int:
    return FLIGHT_HEAD_BYTES + len(flight.payload) + len(flight.mangled)

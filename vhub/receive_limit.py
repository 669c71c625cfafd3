"""How much a receiver takes at one tick: as much as fits into one message, which its readers would refuse otherwise.

Where more arrives, each source has an even share of the message, so that a flood costs others nothing; what is beyond
its share is dropped. A function of what arrives alone.
"""

from __future__ import annotations

from collections.abc import Sequence

from foosim.vhub.network.packet import Flight, size_of


class Room:
    """What of some flights is taken, asked in their order. `bytes_max` is that of each receiver.

    `is_shared`: all of them are one receiver, since one message goes to all.
    """

    def __init__(self, flights: Sequence[Flight], bytes_max: int, *, is_shared: bool) -> None:
        self._is_shared = is_shared
        self._left: dict[tuple[str, str], int] = {}
        """Where too much arrives: what each source has left of its share."""
        self._shares: dict[str, int] = {}
        """There, by receiver: the share of each source, in bytes."""
        whole = 0
        for flight in flights:
            whole += size_of(flight)
        if whole > bytes_max:
            self._share(flights, bytes_max)

    def _share(self, flights: Sequence[Flight], bytes_max: int) -> None:
        """Find out to whom too much comes, and from whom."""
        wanted: dict[str, dict[str, int]] = {}
        for flight in flights:
            of_receiver = wanted.setdefault("" if self._is_shared else flight.destination, {})
            of_receiver[flight.source] = of_receiver.get(flight.source, 0) + size_of(flight)
        for receiver, of_receiver in wanted.items():
            if sum(of_receiver.values()) > bytes_max:
                share = self._shares[receiver] = bytes_max // len(of_receiver)
                self._left.update({(receiver, source): share for source in of_receiver})

    def takes(self, flight: Flight) -> bool:
        """Whether a flight is taken; one that is not is told by what."""
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

"""The order in which the packets of clients at one tick are judged: to robots first, since nodes wait for these.

The costly verdicts of a broadcast by radio to clients are computed while the nodes solve. No verdict changes by that: a
packet is judged first only on a link that shares nothing with any other (`Link.is_apart`), and where a link to a robot
does share something all packets are judged in their order.
"""

from __future__ import annotations

from collections.abc import Iterator

from foosim.vhub.network.packet import Flight


class SendOrder:
    """The packets of one closing, each in its place. A packet is a list of flights, one for each of its receivers."""

    def __init__(self) -> None:
        self.arrived: list[Flight] = []
        """Packets that reached robots by this closing."""
        self._dropped: list[list[Flight]] = [[]]
        """Drops of what was judged before the first packet that waits, of that packet, of the packets after it, etc."""
        self._waiting: list[tuple[int, list[Flight]]] = []

    @property
    def dropped(self) -> list[Flight]:
        """The list for drops of the next packet, if it is judged at once."""
        return self._dropped[-1]

    def defer(self, flights: list[Flight]) -> None:
        """Defer the next packet."""
        self._waiting.append((len(self._dropped), flights))
        self._dropped += [[], []]

    @property
    def waiting(self) -> Iterator[Flight]:
        """The deferred packets."""
        return (flight for _, flights in self._waiting for flight in flights)

    def take_waiting(self) -> list[tuple[list[Flight], list[Flight]]]:
        """Remove and return the deferred packets, in the order of sending, each with the list for its drops."""
        waiting, self._waiting = self._waiting, []
        return [(flights, self._dropped[place]) for place, flights in waiting]

    def fates(self) -> list[Flight]:
        """Return the packets that have their fate by this closing: drops in the order of sending, then arrivals."""
        assert not self._waiting, "fates of packets that were not judged"
        return [*(flight for dropped in self._dropped for flight in dropped), *self.arrived]

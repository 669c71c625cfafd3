"""The order in which what clients send at one tick is judged: first what goes to robots, the rest once that has left.

Nodes wait for what robots receive, nobody for what clients do. So the costly verdicts of a broadcast by radio are found
while nodes compute. No verdict changes by that: a packet is judged first only on a link that shares nothing with any
other (`Link.is_apart`), and where a link to a robot does share something all packets are judged in their order.
"""

from __future__ import annotations

from collections.abc import Iterator

from foosim.vhub.network.packet import Flight


class SendOrder:
    """The packets of one closing, each in its place. A packet is a list of flights, one for each of its receivers."""

    def __init__(self) -> None:
        self.arrived: list[Flight] = []
        """What has reached robots by this closing."""
        self._dropped: list[list[Flight]] = [[]]
        """Drops of what was judged before the first packet that waits, of that packet, of what came behind it, etc."""
        self._waiting: list[tuple[int, list[Flight]]] = []

    @property
    def dropped(self) -> list[Flight]:
        """Where drops of the next packet go, if it is judged at once."""
        return self._dropped[-1]

    def defer(self, flights: list[Flight]) -> None:
        """Have the next packet wait until the rest is judged."""
        self._waiting.append((len(self._dropped), flights))
        self._dropped += [[], []]

    @property
    def waiting(self) -> Iterator[Flight]:
        """What is not judged yet."""
        return (flight for _, flights in self._waiting for flight in flights)

    def take_waiting(self) -> list[tuple[list[Flight], list[Flight]]]:
        """Take the packets that wait, in the order of sending, each with the list to which its drops go."""
        waiting, self._waiting = self._waiting, []
        return [(flights, self._dropped[place]) for place, flights in waiting]

    def fates(self) -> list[Flight]:
        """Return what has its fate by this closing: drops in the order of sending, then what arrived."""
        assert not self._waiting, "fates of packets that were not judged"
        return [*(flight for dropped in self._dropped for flight in dropped), *self.arrived]

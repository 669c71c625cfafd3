"""What clients send at one tick, in the order of sending: first what robots may get by it, the rest when that is said.

Nodes wait for what robots get, nobody for what clients do: the costly verdicts of a broadcast by radio are found while
nodes compute. That changes no verdict: a packet goes first only by a link that shares nothing with any other
(`Link.is_apart`), and where a link to a robot does share something all are judged in their order.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from foosim.vhub.network.packet import Flight

Judge = Callable[[list[Flight], list[Flight]], None]
"""Judges a packet for all its receivers; what is dropped is appended to the second list."""


class Sendings:
    """The packets of one closing, each in its place."""

    def __init__(self, judge: Judge) -> None:
        self.arrived: list[Flight] = []
        """What has reached robots by this closing."""
        self._judge = judge
        self._dropped: list[list[Flight]] = [[]]
        """Of what was judged at once until one has to wait, of that one, of what came behind it, and so on."""
        self._waiting: list[tuple[int, list[Flight]]] = []

    def send(self, flights: list[Flight], *, now: bool) -> None:
        """Take the next packet, one flight for each of its receivers; judge it now, or when the rest is judged."""
        if now:
            self._judge(flights, self._dropped[-1])
        else:
            self._waiting.append((len(self._dropped), flights))
            self._dropped += [[], []]

    @property
    def waiting(self) -> Iterator[Flight]:
        """What is not judged yet."""
        return (flight for _, flights in self._waiting for flight in flights)

    def judge_rest(self) -> None:
        """Judge what has not been judged, in its order."""
        waiting, self._waiting = self._waiting, []
        for place, flights in waiting:
            self._judge(flights, self._dropped[place])

    def fates(self) -> list[Flight]:
        """Return what has its fate by this closing: drops in the order of sending, then what arrived."""
        assert not self._waiting, "fates of packets that were not judged"
        return [*(flight for dropped in self._dropped for flight in dropped), *self.arrived]

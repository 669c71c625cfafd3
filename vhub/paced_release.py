"""Paces the packets to free-running clients: in realtime at anchor + due, in fast at once and in tick order.

The anchor is the least of (arrival of Commit(k) - k T) over the last second, on the vHub's own clock: the best estimate
of the wall time of simulated time 0 that late commits do not distort. How late packets leave is counted.
"""

from __future__ import annotations

from bisect import insort
from collections import deque
from dataclasses import dataclass, replace
from typing import Final

from foosim.common.histogram import Lags
from foosim.vhub.network.packet import Flight

ANCHOR_WINDOW_NS: Final = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Release:
    """Flights that leave together for one client, as its downlink `number`, at wall time `at_ns`.

    Their latest was due at wall time `due_ns`; None where nothing is due by the clock. `since` and `absent` are the
    client's at the tick.
    """

    at_ns: int
    client: str
    number: int
    tick: int
    flights: list[Flight]
    due_ns: int | None = None
    since: int = 0
    absent: tuple[str, ...] = ()


class Releases:
    """Packets that wait for their release, by wall time. `factor` is simulated over wall time; 0 in fast."""

    def __init__(self, tick_ns: int) -> None:
        self.factor = 0.0
        self.paused = False
        self.lateness = Lags()
        """Lateness of packets, due to sent, of this process, without packets of the run's end."""
        self._tick_ns = tick_ns
        self._anchors: deque[tuple[int, int]] = deque()
        self._anchor_ns: int | None = None
        """The least of them."""
        self._waiting: list[Release] = []
        self._latest_ns: dict[str, int] = {}
        """When the last one of a client leaves, or has left."""

    def set_tempo(self, factor: float, paused: bool) -> None:
        """Apply a new pace: packets that wait leave at once, and the anchor is measured anew."""
        if factor != self.factor or paused != self.paused:
            self._anchors.clear()
            self._anchor_ns = None
            self._latest_ns.clear()
            self._waiting = [replace(release, at_ns=0, due_ns=None) for release in self._waiting]
        self.factor = factor
        self.paused = paused

    def committed(self, tick: int, now_ns: int) -> None:
        """Move the anchor by the arrival of a commit."""
        if not self.factor:
            return
        self._anchors.append((now_ns, now_ns - int(tick * self._tick_ns / self.factor)))
        while self._anchors[0][0] < now_ns - ANCHOR_WINDOW_NS:
            self._anchors.popleft()
        self._anchor_ns = min(anchor for _, anchor in self._anchors)

    def add(
        self,
        client: str,
        number: int,
        tick: int,
        flights: list[Flight],
        now_ns: int,
        since: int = 0,
        absent: tuple[str, ...] = (),
    ) -> None:
        """Queue the packets of a closed tick, `since` and `absent` for a client, never before earlier ones."""
        at_ns = max(now_ns, self._latest_ns.get(client, 0))
        due_ns = None
        if self.factor and self._anchor_ns is not None and flights:
            due_ns = self._anchor_ns + int(max(flight.due_ns for flight in flights) / self.factor)
            at_ns = max(at_ns, due_ns)
        self._latest_ns[client] = at_ns
        release = Release(at_ns, client, number, tick, flights, due_ns, since, absent)
        insort(self._waiting, release, key=lambda one: (one.at_ns, one.client, one.number))

    def take(self, now_ns: int, everything: bool = False) -> list[Release]:
        """Remove and return packets due by now, in order; at the end of the run `everything`."""
        due = [release for release in self._waiting if everything or release.at_ns <= now_ns]
        self._waiting = self._waiting[len(due) :]
        for release in due:
            if release.due_ns is not None and not everything:
                self.lateness.add(max(0, now_ns - release.due_ns), len(release.flights))
        return due

    def first_number(self, client: str) -> int | None:
        """Return the number of the oldest downlink that waits for a client."""
        return min((release.number for release in self._waiting if release.client == client), default=None)

    @property
    def waiting_tick(self) -> int | None:
        """The oldest tick with packets that wait."""
        return min((release.tick for release in self._waiting), default=None)

    @property
    def deadline_ns(self) -> int | None:
        return self._waiting[0].at_ns if self._waiting else None

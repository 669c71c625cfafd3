"""Policy: partitions, filters, and how old a packet may be.

A partition is checked when a packet is sent and when it arrives, so that packets in flight when it begins are lost,
unless the deployment has `in_flight_on_partition: deliver`.
"""

from __future__ import annotations

from typing import Final

from foosim.vhub.network.link_context import LinkSetup
from foosim.vhub.network.packet import Flight
from foosim.vhub.network.timeline import FOREVER_NS
from foosim.vhub.stages.explanation import Explanation, Seen, exact
from foosim.vhub.stages.stage import Stage

PARTITION: Final = "partition"
FILTERED: Final = "filtered"
EXPIRED: Final = "expired"


class Policy(Stage):
    """Drops packets while the link is cut or filtered, and packets that are too old."""

    def __init__(self, setup: LinkSetup) -> None:
        self._cuts, self._at_arrival = setup.cuts, setup.in_flight_dropped
        self._allow, self._ttl_ns = setup.settings.allow, setup.settings.ttl_ns

    @classmethod
    def for_link(cls, setup: LinkSetup) -> Policy | None:
        settings = setup.settings
        return cls(setup) if setup.cuts or settings.ttl_ns is not None or not settings.allow else None

    def _is_cut(self, time_ns: int) -> bool:
        return any(start_ns <= time_ns < end_ns for start_ns, end_ns in self._cuts)

    def at_sending(self, flight: Flight) -> str:
        if self._is_cut(flight.sent_ns):
            return PARTITION
        return "" if self._allow else FILTERED

    def at_arrival(self, flight: Flight, hindered: str) -> str:
        if self._at_arrival and self._is_cut(flight.due_ns):
            return PARTITION
        late = self._ttl_ns is not None and flight.due_ns - flight.sent_ns > self._ttl_ns
        return EXPIRED if late else ""

    def explain(self, seen: Seen, note: Explanation) -> None:
        row = seen.row
        event, text = _cut(seen, row.sent_ns)
        note.add("at sending {}", text, cut_at_sending=event, allow=self._allow, ttl_ns=self._ttl_ns)
        note.text += "" if self._allow else ", nothing may pass (allow is off)"
        if row.arrival_tick >= 0:
            event, text = _cut(seen, row.due_ns)
            note.add(", at arrival {}", text, cut_at_arrival=event)
            if self._ttl_ns is not None:
                note.text += f", {exact(row.due_ns - row.sent_ns)} old of at most {exact(self._ttl_ns)}"


def _cut(seen: Seen, at_ns: int) -> tuple[str, str]:
    """Return the event that cuts the link at a time, and a text of it."""
    cut = seen.timeline.cut_at(seen.row.source, seen.row.destination, at_ns)
    if cut is None:
        return "", "no partition"
    until = f" to {exact(cut.end_ns)}" if cut.end_ns < FOREVER_NS else " on"
    return cut.event, f"cut by {cut.event}, from {exact(cut.start_ns)}{until}"

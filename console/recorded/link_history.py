"""What each link of a captured run did up to any time: windows of seconds up to the slider, and the last drops.

Packets come in the order of the file; per link their times are sorted at a request, and a window is two
searches. A packet is offered when it was sent, delivered at the tick of its arrival, dropped at its sending or, where
it had come so far, at its arrival: as the totals of a running vHub count. Pure: neighbours are `capture_history`, which
reads, and `links`, which places them in the world.
"""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field
from typing import Any, Final

import msgspec
import numpy as np
from numpy.typing import NDArray

from foosim.capture.rows import CounterOrNone, Fate
from foosim.common.struct_types import Counter as Number
from foosim.vhub.links.fabric import link_name
from foosim.vhub.network.packet import DELIVERED, DROPPED

LINKS_MAX: Final = 4096
"""Number of links with counts; packets of further ones are in no window."""
DROPS_SHOWN: Final = 8
SHARE_DIGITS: Final = 6

LinkKey = tuple[str, str, str]
"""Source, destination, and the rule with its radio, as a running vHub names it."""


class PacketMark(msgspec.Struct, frozen=True, gc=False):
    """What of a row of /packets a window counts; the rest is passed over."""

    source: str
    sequence: Number
    destination: str
    sent_ns: Number
    due_ns: CounterOrNone
    arrival_tick: CounterOrNone
    fate: Fate
    cause: str
    rule: str
    radio: str = ""
    queue_ns: Number = 0


PACKET_MARKS: Final = msgspec.json.Decoder(PacketMark)


@dataclass(slots=True)
class Timed:
    """Times in ns, each with a number, put in order when they are looked at."""

    times: array[int] = field(default_factory=lambda: array("q"))
    values: array[int] = field(default_factory=lambda: array("q"))
    _sorted: tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]] | None = None

    def add(self, time_ns: int, value: int) -> None:
        self.times.append(time_ns)
        self.values.append(value)
        self._sorted = None

    def in_order(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        """Return times ascending, the values that belong to them, and the sums of these up to each, from 0 on."""
        if self._sorted is None:
            times = np.array(self.times, dtype=np.int64)
            order = np.argsort(times, kind="stable")
            values = np.array(self.values, dtype=np.int64)[order]
            self._sorted = times[order], values, np.concatenate(([0], np.cumsum(values)))
        return self._sorted

    def span(self, after_ns: int, until_ns: int) -> tuple[int, int]:
        """Return the range of them, in order, after one time and up to another, as first and stop."""
        times = self.in_order()[0]
        return int(times.searchsorted(after_ns, "right")), int(times.searchsorted(until_ns, "right"))


@dataclass(slots=True)
class LinkRecord:
    """One link: what was offered (with the wait in the queue, ns), delivered (with the delay, ns), dropped (with the
    number of the packet's row, by cause)."""

    offered: Timed = field(default_factory=Timed)
    delivered: Timed = field(default_factory=Timed)
    dropped: dict[str, Timed] = field(default_factory=dict)


class LinkHistory:
    """All links of a run. `add` takes rows in the order of the file."""

    def __init__(self, tick_ns: int) -> None:
        self._tick_ns = tick_ns
        self._links: dict[LinkKey, LinkRecord] = {}

    def add(self, mark: PacketMark, number: int) -> int:
        """Count a packet by the number of its row; return the time of its drop (ns), -1 for a delivered one."""
        key = mark.source, mark.destination, link_name(mark.rule, mark.radio)
        record = self._links.get(key)
        if record is None:
            if len(self._links) >= LINKS_MAX:
                return -1
            record = self._links[key] = LinkRecord()
        record.offered.add(mark.sent_ns, mark.queue_ns)
        if mark.fate == DELIVERED:
            record.delivered.add(mark.arrival_tick * self._tick_ns, mark.due_ns - mark.sent_ns)
        elif mark.fate == DROPPED:
            at_ns = mark.sent_ns if mark.arrival_tick < 0 else mark.arrival_tick * self._tick_ns
            record.dropped.setdefault(mark.cause, Timed()).add(at_ns, number)
            return at_ns
        return -1

    def windows(self, at_ns: int, window_ns: int, only: tuple[str, str] | None = None) -> list[dict[str, Any]]:
        """Return the figures of each link (or only that between two ends) in the time up to `at_ns`, by name.

        Links that were not used by then are left out.

        `delay_ms` is the mean of the arrivals in the window (null for none), `queue_ms` the wait of the newest packet
        in the queue, `loss` the lost share of packets with a fate.
        """
        found = []
        for (source, destination, rule), record in sorted(self._links.items()):
            if only is not None and only != (source, destination):
                continue
            first, last = record.offered.span(at_ns - window_ns, at_ns)
            if not last:
                continue
            arrived, arrived_to = record.delivered.span(at_ns - window_ns, at_ns)
            causes = {
                cause: count
                for cause, drops in sorted(record.dropped.items())
                if (count := _count(drops.span(at_ns - window_ns, at_ns)))
            }
            delivered, dropped = arrived_to - arrived, sum(causes.values())
            delays = record.delivered.in_order()[2]
            delay_ns = (int(delays[arrived_to]) - int(delays[arrived])) / delivered if delivered else None
            found.append(
                {
                    "from": source,
                    "to": destination,
                    "rule": rule,
                    "offered": last - first,
                    "delivered": delivered,
                    "dropped": dropped,
                    "loss": round(dropped / (dropped + delivered), SHARE_DIGITS) if dropped + delivered else 0.0,
                    "delay_ms": None if delay_ns is None else round(delay_ns / 1e6, 6),
                    "queue_ms": int(record.offered.in_order()[1][last - 1]) / 1e6,
                    "causes": causes,
                }
            )
        return found

    def totals(self, at_ns: int) -> dict[str, int]:
        """Return how many packets were offered, delivered and dropped by a time, and are under way."""
        offered = delivered = dropped = 0
        for record in self._links.values():
            offered += record.offered.span(-1, at_ns)[1]
            delivered += record.delivered.span(-1, at_ns)[1]
            dropped += sum(drops.span(-1, at_ns)[1] for drops in record.dropped.values())
        return {
            "offered": offered,
            "delivered": delivered,
            "dropped": dropped,
            "in_flight": offered - delivered - dropped,
            "refused": 0,
        }

    def drops(self, after_ns: int, until_ns: int) -> list[tuple[LinkKey, str, int]]:
        """Return the drops in a time: link, cause and count."""
        return [
            (key, cause, count)
            for key, record in sorted(self._links.items())
            for cause, drops in sorted(record.dropped.items())
            if (count := _count(drops.span(after_ns, until_ns)))
        ]

    def last_drops(self, source: str, destination: str, at_ns: int, count: int = DROPS_SHOWN) -> list[int]:
        """Return the numbers of the rows of the last packets that a link had dropped by a time, oldest first."""
        found: list[tuple[int, int]] = []
        for key, record in self._links.items():
            if key[:2] != (source, destination):
                continue
            for drops in record.dropped.values():
                times, numbers, _ = drops.in_order()
                _, stop = drops.span(-1, at_ns)
                start = max(0, stop - count)
                found += zip(times[start:stop].tolist(), numbers[start:stop].tolist(), strict=True)
        return [number for _, number in sorted(found)[-count:]]


def _count(span: tuple[int, int]) -> int:
    return span[1] - span[0]

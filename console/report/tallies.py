"""Counters of a report over the packets of a capture: plain sums, and samples of bounded size."""

from __future__ import annotations

from collections import Counter, OrderedDict
from typing import Final, Generic, TypeVar

import numpy as np

from foosim.capture.rows import PacketRow
from foosim.common.keyed_random import draw_key, draw_words
from foosim.vhub.stages.corruption import CRC_FAIL
from foosim.vhub.stages.residual import BURST_LOSS, RANDOM_LOSS

SAMPLES: Final = 512
RECENT: Final = 1024
"""Transmissions of a sender that are remembered, so that a broadcast is counted once for all its receivers."""

T = TypeVar("T")


class Reservoir(Generic[T]):
    """A uniform sample of a stream, all of it up to `most` items; the same for the same stream.

    Source: Vitter, "Random sampling with a reservoir" (1985), algorithm R.
    """

    def __init__(self, most: int, *purpose: str) -> None:
        self.count = 0
        self.kept: list[T] = []
        self._most, self._key = most, draw_key(0, "report", *purpose)

    def add(self, item: T) -> None:
        self.count += 1
        if len(self.kept) < self._most:
            self.kept.append(item)
            return
        place = draw_words(self._key, self.count)[0] * self.count >> 64
        if place < self._most:
            self.kept[place] = item


class Times:
    """Times in ns: their mean and maximum, and quantiles of a sample."""

    def __init__(self, *purpose: str) -> None:
        self.total = self.most = 0
        self._sample: Reservoir[int] = Reservoir(SAMPLES, *purpose)

    def add(self, time_ns: int) -> None:
        self.total += time_ns
        self.most = max(self.most, time_ns)
        self._sample.add(time_ns)

    @property
    def count(self) -> int:
        return self._sample.count

    @property
    def mean(self) -> float:
        return self.total / self.count if self.count else 0.0

    def quantile(self, share: float) -> float:
        """Return a quantile, linear between neighbours; 0 of nothing."""
        return float(np.quantile(self._sample.kept, share)) if self.count else 0.0


class Tally:
    """Packets by fate, losses by cause, and the delays of delivered packets."""

    def __init__(self, *purpose: str) -> None:
        self.fates: Counter[str] = Counter()
        self.causes: Counter[str] = Counter()
        self.delay = Times("delay", *purpose)

    def add(self, row: PacketRow) -> None:
        self.fates[row.fate] += 1
        if row.fate == "delivered":
            self.delay.add(row.due_ns - row.sent_ns)
        elif row.fate == "dropped":
            self.causes[row.cause] += 1

    @property
    def loss(self) -> float | None:
        """The lost share of packets with a fate; None without one."""
        judged = self.fates["delivered"] + self.fates["dropped"]
        return self.fates["dropped"] / judged if judged else None


class LinkAge:
    """The age of the newest information that has arrived on a link, integrated over time.

    Source: Kaul, Yates and Gruteser, "Real-time status: How often should one update?" (2012).
    """

    def __init__(self) -> None:
        self._newest_ns = self._first_due_ns = self._last_due_ns = -1
        self._area, self._worst_ns = 0.0, 0

    def add(self, sent_ns: int, due_ns: int) -> None:
        """Add a delivered packet, or a delivered copy of one."""
        if self._first_due_ns < 0:
            self._first_due_ns = self._last_due_ns = due_ns
        self._grow(due_ns)
        self._newest_ns = max(self._newest_ns, sent_ns)

    def _grow(self, now_ns: int) -> None:
        """Let the age grow with time: a trapezoid more of the area under the saw."""
        if self._newest_ns < 0 or now_ns <= self._last_due_ns:
            return
        span_ns = now_ns - self._last_due_ns
        self._area += span_ns * (self._last_due_ns - self._newest_ns + span_ns / 2.0)
        self._worst_ns = max(self._worst_ns, now_ns - self._newest_ns)
        self._last_due_ns = now_ns

    def until(self, end_ns: int) -> tuple[float, int] | None:
        """Return the mean and the greatest age (ns) from the first arrival to the end; None without an arrival."""
        if self._newest_ns < 0:
            return None
        self._grow(end_ns)
        span_ns = self._last_due_ns - self._first_due_ns
        at_once = self._last_due_ns - self._newest_ns
        return (self._area / span_ns if span_ns else float(at_once)), max(self._worst_ns, at_once)


class SenderTally:
    """The transmissions of one radio of an endpoint, or of one queue of a wire."""

    def __init__(self, *purpose: str) -> None:
        self.queue, self.access = Times("queue", *purpose), Times("access", *purpose)
        self.airtime_ns = self.retries = 0
        self._recent: OrderedDict[tuple[int, int], None] = OrderedDict()

    def add(self, row: PacketRow, *, sends_once: bool) -> None:
        if sends_once and row.published:
            key = row.sequence, row.copy
            if key in self._recent:
                return
            self._recent[key] = None
            if len(self._recent) > RECENT:
                self._recent.popitem(last=False)
        self.queue.add(row.queue_ns)
        self.access.add(row.access_ns)
        self.airtime_ns += row.airtime_ns
        self.retries += row.retries


class RuleTally(Tally):
    """The packets of one rule over one radio, and the rule's own part in their losses and delays."""

    def __init__(self, *purpose: str) -> None:
        super().__init__(*purpose)
        self.links: set[tuple[str, str]] = set()
        self.own = Times("own delay", *purpose)
        self._passed = 0
        """Packets that came as far as the rule's own loss and were not lost by it."""

    def add(self, row: PacketRow) -> None:
        super().add(row)
        self.links.add((row.source, row.destination))
        self._passed += row.due_ns >= 0 or row.cause == CRC_FAIL
        if row.fate == "delivered":
            spent_ns = row.phase_ns + row.queue_ns + row.access_ns + row.airtime_ns + row.propagation_ns + row.held_ns
            self.own.add(row.due_ns - row.sent_ns - spent_ns - row.model_ns)

    @property
    def own_loss(self) -> float:
        """The lost share of the packets that came as far as the rule's own loss."""
        lost = self.causes[RANDOM_LOSS] + self.causes[BURST_LOSS]
        return lost / (self._passed + lost) if self._passed + lost else 0.0

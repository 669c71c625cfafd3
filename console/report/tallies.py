"""Counters of a report over the packets of a capture: plain sums, and samples of bounded size."""

from __future__ import annotations

from array import array
from collections import Counter, OrderedDict
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from foosim.capture.rows import PacketRow
from foosim.common.keyed_random import draw_key, draw_words
from foosim.vhub.stages.corruption import CRC_FAIL
from foosim.vhub.stages.residual import BURST_LOSS, RANDOM_LOSS

SAMPLES: Final = 512
RECENT: Final = 1024
"""Transmissions of a sender that are remembered, so that a broadcast is counted once whatever its receivers."""
_RESIDUAL: Final = frozenset({RANDOM_LOSS, BURST_LOSS})


class Sample:
    """A uniform sample of a stream of numbers, all of them up to `SAMPLES`; the same for the same stream.

    Source: Vitter, "Random sampling with a reservoir" (1985), algorithm R.
    """

    def __init__(self, *purpose: str) -> None:
        self.count = 0
        self.total = 0
        self.most = 0
        self._key = draw_key(0, "report", *purpose)
        self.kept: array[int] = array("q")

    def add(self, value: int) -> None:
        self.count += 1
        self.total += value
        self.most = max(self.most, value)
        if len(self.kept) < SAMPLES:
            self.kept.append(value)
            return
        place = draw_words(self._key, self.count)[0] * self.count >> 64
        if place < SAMPLES:
            self.kept[place] = value

    @property
    def mean(self) -> float:
        return self.total / self.count if self.count else 0.0

    def quantile(self, share: float) -> float:
        """Return a quantile, linear between neighbours; 0 of nothing."""
        return float(np.quantile(np.array(self.kept), share)) if self.kept else 0.0


@dataclass(slots=True)
class LinkTally:
    """One directed link. Copies that the link made are not counted, but for the age of information."""

    offered: int = 0
    delivered: int = 0
    dropped: int = 0
    causes: Counter[str] = field(default_factory=Counter)
    delay_total_ns: int = 0
    delay_most_ns: int = 0
    _newest_ns: int = -1
    _last_due_ns: int = -1
    _first_due_ns: int = -1
    _area: float = 0.0
    _worst_ns: int = 0

    def add(self, row: PacketRow) -> None:
        if row.fate == "delivered":
            self._renew(row.sent_ns, row.due_ns)
        if row.copy:
            return
        self.offered += 1
        if row.fate == "delivered":
            delay_ns = row.due_ns - row.sent_ns
            self.delivered += 1
            self.delay_total_ns += delay_ns
            self.delay_most_ns = max(self.delay_most_ns, delay_ns)
        elif row.fate == "dropped":
            self.dropped += 1
            self.causes[row.cause] += 1

    def _renew(self, sent_ns: int, due_ns: int) -> None:
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

    def age_ns(self, end_ns: int) -> tuple[float, int] | None:
        """Return the mean and the greatest age of the newest that has come, from the first arrival to the end.

        None where nothing came. Source: Kaul, Yates and Gruteser, "Real-time status: How often should one update?"
        (2012).
        """
        if self._newest_ns < 0:
            return None
        self._grow(end_ns)
        span_ns = self._last_due_ns - self._first_due_ns
        at_once = self._last_due_ns - self._newest_ns
        return (self._area / span_ns if span_ns else float(at_once)), max(self._worst_ns, at_once)


class SenderTally:
    """One radio of an endpoint, or one queue of a wire: what was sent by it, each transmission once."""

    def __init__(self, *purpose: str) -> None:
        self.queue = Sample("queue", *purpose)
        self.access = Sample("access", *purpose)
        self.airtime_ns = 0
        self.retries = 0
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


class RuleTally:
    """What went by one rule over one radio."""

    def __init__(self, *purpose: str) -> None:
        self.offered = self.dropped = self.residual = self.passed = 0
        self.links: set[tuple[str, str]] = set()
        self.delay = Sample("delay", *purpose)
        self.own = Sample("own delay", *purpose)

    def add(self, row: PacketRow) -> None:
        if row.copy:
            return
        self.offered += 1
        self.links.add((row.source, row.destination))
        self.dropped += row.fate == "dropped"
        self.residual += row.cause in _RESIDUAL
        self.passed += row.due_ns >= 0 or row.cause == CRC_FAIL
        if row.fate == "delivered":
            delay_ns = row.due_ns - row.sent_ns
            self.delay.add(delay_ns)
            spent_ns = row.phase_ns + row.queue_ns + row.access_ns + row.airtime_ns + row.propagation_ns + row.held_ns
            spent_ns += row.model_ns
            self.own.add(delay_ns - spent_ns)


class BinTally:
    """The packets of one channel that were sent in one span of time."""

    def __init__(self, *purpose: str) -> None:
        self.delivered = self.dropped = 0
        self.delay = Sample(*purpose)

    def add(self, row: PacketRow) -> None:
        if row.fate == "delivered":
            self.delivered += 1
            self.delay.add(row.due_ns - row.sent_ns)
        elif row.fate == "dropped":
            self.dropped += 1

"""Ages at use, put together from a capture's rows or from closings that were judged again."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from foosim.capture.rows import AgeRow
from foosim.vhub.network.ages import add_counts, quantile
from foosim.vhub.network.memory import Age, Counts


@dataclass(frozen=True, slots=True)
class AgeAtUse:
    """How old the newest packet of a channel was when its receiver acted; 0 where it never was there."""

    uses: int = 0
    p50_ms: float = 0.0
    p99_ms: float = 0.0
    most_ms: float = 0.0


Channel = tuple[str, str, str]
"""Source, destination, and the channel's name."""


class AgeTallies:
    """The counts of all channels."""

    def __init__(self, tick_ns: int) -> None:
        self._tick_ns = tick_ns
        self._counts: dict[Channel, Counts] = {}

    def take_row(self, row: AgeRow) -> None:
        """Add a capture's row of one second."""
        counts = {age_ns // self._tick_ns: count for age_ns, count in zip(row.ages_ns, row.counts, strict=False)}
        add_counts(self._counts.setdefault((row.source, row.client, row.channel), {}), counts)

    def take(self, ages: Iterable[Age]) -> None:
        """Add the ages of a closing."""
        for age in ages:
            add_counts(self._counts.setdefault((age.source, age.client, age.channel), {}), age.counts)

    def result(self) -> dict[Channel, AgeAtUse]:
        """Return the ages of each channel, by name."""
        found = {}
        for channel, counts in sorted(self._counts.items()):
            if counts:
                figures = quantile(counts, 0.5), quantile(counts, 0.99), max(counts)
                found[channel] = AgeAtUse(sum(counts.values()), *(ticks * self._tick_ns / 1e6 for ticks in figures))
        return found

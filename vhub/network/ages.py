"""How old the newest packet of each channel is when its receiver acts: the *age at use*, counted by the vHub.

A link's delay is how late a packet comes; a controller's view is older by the time until its next turn, and by the age
of the newest packet. Ages are counted at each tick at which a lockstep client is due, and of a free-running
one at each tick that admits packets of it, for channels that it hears and has received. Ages are whole
ticks, since all is sent at the start of its tick. Part of the vHub's state.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from foosim.vhub.network.memory import Age, Counts, HeardState

_EXACT_BITS: Final = 6
"""Ages below 2^6 ticks are counted exactly, others to 1/32, which bounds the number of counts."""

LEFT_MAX: Final = 1_000
"""Number of channels without a subscription whose counts are kept for a client."""


def quantile(counts: Mapping[int, int], share: float) -> int:
    """Return the least age, in ticks, that this share of all counts is not above."""
    needed = share * sum(counts.values())
    seen = 0
    for age, count in sorted(counts.items()):
        seen += count
        if seen >= needed:
            return age
    return 0


def add_counts(counts: Counts, more: Mapping[int, int]) -> None:
    """Add counts to others."""
    for age, count in more.items():
        counts[age] = counts.get(age, 0) + count


class Ages:
    """The ages of all clients."""

    def __init__(self, tick_ns: int) -> None:
        self._tick_ns = tick_ns
        self._every = max(1, 1_000_000_000 // tick_ns)
        """Ticks from one row to the next: a second."""
        self._heard: dict[str, dict[tuple[str, str], HeardState]] = {}
        """By client, and by (endpoint, channel) in order; with the channels before its return."""

    def joins(self, client: str, subscriptions: Iterable[tuple[str, str]]) -> None:
        """Begin the ages of a client that joins: it has received nothing."""
        known = self._heard.get(client, {})
        heard = {pair: known.get(pair, HeardState(*pair, -1, True, {}, {})) for pair in set(subscriptions)}
        left = [(pair, state) for pair, state in known.items() if pair not in heard and (state.whole or state.recent)]
        self._heard[client] = dict(sorted([*heard.items(), *left[:LEFT_MAX]]))
        for pair, state in self._heard[client].items():
            state.sent_ns, state.is_heard = -1, pair in heard

    def reached(self, client: str, source: str, channel: str, sent_ns: int) -> None:
        """Record the arrival of a packet at a client."""
        pairs = self._heard.get(client)
        heard = None if pairs is None else pairs.get((source, channel))
        if heard is not None and sent_ns > heard.sent_ns and heard.is_heard:
            heard.sent_ns = sent_ns

    def used(self, client: str, tick: int) -> None:
        """Count the ages of a client that acts at a tick."""
        pairs = self._heard.get(client)
        if pairs is None:
            return
        for heard in pairs.values():
            sent_ns = heard.sent_ns
            if sent_ns >= 0:
                age = tick - sent_ns // self._tick_ns
                if age >> _EXACT_BITS:
                    rest = age.bit_length() - _EXACT_BITS
                    age = age >> rest << rest
                recent = heard.recent
                recent[age] = recent.get(age, 0) + 1

    def is_row_due(self, tick: int) -> bool:
        """Whether rows are due after the closing of a tick."""
        return (tick + 1) % self._every == 0

    def take(self, tick: int) -> list[Age]:
        """Return the counts since the last row, when another one is due after the closing of a tick."""
        if not self.is_row_due(tick):
            return []
        taken = self.unreported(tick)
        for pairs in self._heard.values():
            for heard in pairs.values():
                add_counts(heard.whole, heard.recent)
                heard.recent = {}
        return taken

    def unreported(self, tick: int) -> list[Age]:
        """Return the counts since the last row up to the closing of a tick, by client, source and channel.

        A run that ends before its first closing, whose tick is -1, has them at tick 0.
        """
        return [
            Age(max(tick, 0), client, heard.source, heard.channel, dict(heard.recent))
            for client, pairs in sorted(self._heard.items())
            for heard in pairs.values()
            if heard.recent
        ]

    def of(self, client: str, tick: int) -> list[Age]:
        """Return the ages of a client's channels, over the whole run up to the closing of its last tick."""
        found = []
        for heard in self._heard.get(client, {}).values():
            counts = dict(heard.whole)
            add_counts(counts, heard.recent)
            if counts:
                found.append(Age(tick, client, heard.source, heard.channel, counts))
        return found

    def means_ns(self) -> dict[str, float]:
        """Return the mean age of each channel at all its clients, over the whole run."""
        uses: dict[str, int] = {}
        sums: dict[str, int] = {}
        for pairs in self._heard.values():
            for heard in pairs.values():
                for counts in (heard.whole, heard.recent):
                    for age, count in counts.items():
                        uses[heard.channel] = uses.get(heard.channel, 0) + count
                        sums[heard.channel] = sums.get(heard.channel, 0) + age * count
        return {channel: sums[channel] * self._tick_ns / count for channel, count in uses.items()}

    def state(self) -> list[tuple[str, list[HeardState]]]:
        """Return the snapshot."""
        return [(client, list(map(_written, pairs.values()))) for client, pairs in sorted(self._heard.items())]

    def restore(self, state: Iterable[tuple[str, list[HeardState]]]) -> None:
        """Restore a snapshot."""
        for client, heard in state:
            self._heard[client] = {(one.source, one.channel): one for one in heard}


def _written(heard: HeardState) -> HeardState:
    whole, recent = dict(sorted(heard.whole.items())), dict(sorted(heard.recent.items()))
    return HeardState(heard.source, heard.channel, heard.sent_ns, heard.is_heard, whole, recent)

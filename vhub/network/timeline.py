"""The time line of a network: partitions, clogs and changed settings, as functions of simulated time.

It follows from the deployment's events and from requests during the run, in the order of time; every
random length is drawn from (seed, number of the event), so that the time line is the same wherever it is computed.
What lasts ends at the next `heal` at the latest.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from foosim.common.keyed_random import draw_key, draw_words
from foosim.deployment.network.impairments import Impairments
from foosim.deployment.network.rules import REST, Event, Network, selects
from foosim.vhub.network.series_math import exponential_ns

FOREVER_NS: Final = 2**62
HEALED: Final = ("partitions", "clogs", "settings")
"""What `heal` ends by kind; `all` is each of them."""


@dataclass(frozen=True, slots=True)
class Cut:
    """A time in which packets from one of `sources` to one of `destinations` do not pass."""

    start_ns: int
    end_ns: int
    groups: tuple[frozenset[str], ...]
    is_symmetric: bool
    event: str = ""
    """Whose it is: `event N` of the deployment, or `request N`, from 0 on."""

    def parts(self, source: str, destination: str) -> bool:
        """Whether a link is cut: its ends are in different groups, and, one way only, its source is in the first."""
        one = next((n for n, group in enumerate(self.groups) if source in group), None)
        other = next((n for n, group in enumerate(self.groups) if destination in group), None)
        if one is None or other is None or one == other:
            return False
        return self.is_symmetric or one == 0


@dataclass(frozen=True, slots=True)
class Hold:
    """A time in which packets of some links wait."""

    start_ns: int
    end_ns: int
    sources: frozenset[str]
    destinations: frozenset[str]


@dataclass(frozen=True, slots=True)
class Settings:
    """New settings of a rule for a time."""

    start_ns: int
    end_ns: int
    rule: str
    changes: Impairments


class Timeline:
    """Everything that events do to links."""

    def __init__(self, network: Network, seed: int, endpoints: Sequence[str]) -> None:
        self._endpoints = endpoints
        self._seed = seed
        self._events = [(event, f"event {number}") for number, event in enumerate(network.events)]
        """Each with what its draws are for: the same, whatever is added."""
        self._requests = 0
        self.cuts: list[Cut] = []
        self.holds: list[Hold] = []
        self.settings: list[Settings] = []
        self.version = 0
        """Grows with every change: links look again."""
        self._compile()

    def add(self, event: Event) -> None:
        """Add a requested event; it is not earlier than any judged packet."""
        self._events.append((event, f"request {self._requests}"))
        self._requests += 1
        self._compile()

    def _compile(self) -> None:
        """Walk back through time, so that the next heal of each kind is known; at one moment the last entry is last."""
        self.version += 1
        self.cuts, self.holds, self.settings = [], [], []
        heals: dict[str, int] = {}
        for event, purpose in sorted(self._events, key=lambda of: of[0].at_ns)[::-1]:
            if event.heal is not None:
                heals |= dict.fromkeys(HEALED if event.heal == "all" else (event.heal,), event.at_ns)
            else:
                self._take(event, purpose, heals)
        for line in (self.cuts, self.holds, self.settings):
            line.reverse()

    def _take(self, event: Event, purpose: str, heals: Mapping[str, int]) -> None:
        key = draw_key(self._seed, "network", purpose)
        start_ns, end_ns = event.at_ns, _end_ns(event, key)

        def healed(what: str) -> int:
            return min(end_ns, heals.get(what, FOREVER_NS))

        if event.partition is not None:
            groups = self._groups(event.partition)
            self.cuts.append(Cut(start_ns, healed("partitions"), groups, event.symmetric, purpose))
        elif event.clog is not None:
            ends = self._selected(event.clog.from_), self._selected(event.clog.to)
            self.holds.append(Hold(start_ns, healed("clogs"), *ends))
        elif event.set is not None:
            self.settings.append(Settings(start_ns, healed("settings"), event.set.link, event.set))

    def _selected(self, globs: Sequence[str]) -> frozenset[str]:
        return frozenset(name for name in self._endpoints if selects(globs, name))

    def _groups(self, groups: Iterable[Sequence[str]]) -> tuple[frozenset[str], ...]:
        """Return the members of each group; an endpoint is in the first that selects it, `rest` are all others."""
        left = set(self._endpoints)
        named: list[frozenset[str] | None] = []
        for globs in groups:
            if list(globs) == [REST]:
                named.append(None)
                continue
            members = frozenset(name for name in left if selects(globs, name))
            left -= members
            named.append(members)
        return tuple(frozenset(left) if group is None else group for group in named)

    # --- queries of links --------------------------------------------------------------------------------------------

    def cut_at(self, source: str, destination: str, at_ns: int) -> Cut | None:
        """Return what cuts a link at a time, the first to begin; None where nothing does."""
        found = [cut for cut in self.cuts if cut.start_ns <= at_ns < cut.end_ns and cut.parts(source, destination)]
        return min(found, key=lambda cut: (cut.start_ns, cut.end_ns), default=None)

    def holds_of(self, source: str, destination: str) -> list[tuple[int, int]]:
        """Return the times in which the link is clogged, by start."""
        return sorted(
            (hold.start_ns, hold.end_ns)
            for hold in self.holds
            if source in hold.sources and destination in hold.destinations
        )

    def changes_of(self, rule: str) -> list[Settings]:
        """Return the changed settings of a rule, in the order in which they apply."""
        return [change for change in self.settings if change.rule == rule]


def _end_ns(event: Event, key: bytes) -> int:
    """Return when an event ends by itself."""
    if event.until_ns is not None:
        return event.until_ns
    if event.lasts is None:
        return FOREVER_NS
    if not event.lasts.is_random:
        return event.at_ns + event.lasts.ns
    return event.at_ns + max(1, exponential_ns(event.lasts.ns, draw_words(key, 0)[0]))

"""The links of a run as pages show them: figures of the last seconds, places of the ends, what is
between.

The vHub counts from the start; a window is the difference of two counts, of which the older one is at most some
seconds of simulated time old. Pure.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from itertools import islice
from math import dist
from typing import Any, Final

from foosim.analysis.explain import Explained
from foosim.deployment.schema import Deployment
from foosim.vhub.line_of_sight.placement import World
from foosim.vhub.links.fabric import name_of
from foosim.world.frame import Frame
from foosim.world.scene import ORIGIN, Vector

WINDOW_S: Final = 5.0
SIGHTS_MAX: Final = 48
"""Lines of sight that are worked out for one message; the others are those of the messages before."""
AT_SENDER: Final = frozenset(
    {"too_big", "node_down", "no_route", "filtered", "duty_cycle", "queue_full", "queue_codel", "expired"}
)
AT_RECEIVER: Final = frozenset({"rx_down", "rx_full", "crc_fail", "snr", "collision"})
"""Causes by the end at which a packet is lost; by all others it is lost on its way."""

Key = tuple[str, str, str]
"""Source, destination, rule."""
Pair = tuple[str, str]


@dataclass(frozen=True, slots=True)
class Count:
    """Totals of a link since the start. Delays are those of all delivered packets, added up."""

    offered: int
    delivered: int
    dropped: int
    delay_ns: int
    causes: Mapping[str, int]


_NOTHING: Final = Count(0, 0, 0, 0, {})


class Windows:
    """Counts of the last seconds, and the figures of these seconds."""

    def __init__(self, window_s: float = WINDOW_S) -> None:
        self._window_s = window_s
        self._is_beginning = False
        """Whether the only count is one of the run's first seconds: all of it is in the window."""
        self._kept: deque[tuple[float, dict[Key, Count], bool]] = deque()
        """Simulated time in s, the counts then, and whether they are those of all links; the first is the one that the
        window begins with."""
        self.latest: dict[Key, Count] = {}
        """What has happened on each link since it was counted before; in the window, where that was the first time."""

    @property
    def length_s(self) -> float:
        """How long the window is: shorter where counts are not as old, 0 at the first count amid a run."""
        if len(self._kept) > 1:
            return self._kept[-1][0] - self._kept[0][0]
        return self._kept[0][0] if self._is_beginning else 0.0

    def take(self, at_s: float, counts: dict[Key, Count], *, are_all: bool = True) -> dict[Key, Count]:
        """Return what has happened on each link since the window began; time that goes back begins a new one, and so
        does a time without counts. Where not all links were counted, one that was not has its own
        beginning: its first count."""
        if self._kept and not 0.0 <= at_s - self._kept[-1][0] <= self._window_s:
            self._kept.clear()
        self._is_beginning = not self._kept and at_s <= self._window_s
        before = self._kept[-1][1] if self._kept else {}
        if len(self._kept) > 1 and self._kept[-1][0] == at_s:
            self._kept.pop()  # a paused run is counted on, for hours
        self._kept.append((at_s, counts, are_all))
        while len(self._kept) > 2 and self._kept[1][0] <= at_s - self._window_s:
            self._kept.popleft()
        self.latest = {key: _between(before.get(key, self._before(key)), count) for key, count in counts.items()}
        return {key: _between(self._before(key), count) for key, count in counts.items()}

    def _before(self, key: Key) -> Count:
        """Return a link's totals at the start of the window."""
        if self._is_beginning:
            return _NOTHING
        known = (counts.get(key, _NOTHING if are_all else None) for _, counts, are_all in self._kept)
        return next((count for count in known if count is not None), _NOTHING)


def _between(before: Count, after: Count) -> Count:
    """Return the difference of two counts; all of the later one, where the link has begun to count anew."""
    if after.offered < before.offered:
        before = _NOTHING
    causes = Counter(after.causes)
    causes.subtract(before.causes)
    return Count(
        after.offered - before.offered,
        after.delivered - before.delivered,
        after.dropped - before.dropped,
        after.delay_ns - before.delay_ns,
        {cause: count for cause, count in sorted(causes.items()) if count > 0},
    )


class Links:
    """The links of one deployment."""

    def __init__(self, deployment: Deployment, entities: Mapping[str, int]) -> None:
        """`entities`: the last link of each body in the scene (`Drawing.entities`)."""
        self._deployment = deployment
        self._world = World(deployment, deployment.network)
        self._profiles = deployment.profiles()
        self._windows = Windows()
        self._on_air: dict[Key, bool] = {}
        self._ends = {end: entities.get(self._world.body(end)) for end in deployment.endpoints()}
        """By endpoint: the last link of its body in the scene."""
        self._absent: frozenset[str] = frozenset()
        self._walls: dict[Pair, list[Vector]] = {}
        self._stale: deque[Pair] = deque()
        """Pairs whose line of sight was worked out longest ago come first."""
        self._placed = False

    def move(self, frame: Frame) -> None:
        """Take a frame: where antennas are."""
        self._world.turn_to(frame)
        self._absent = frozenset(entity.name for entity in frame.layout.entities if entity.is_absent(frame.numbers))
        self._placed = True

    def message(self, status: Mapping[str, Any]) -> dict[str, Any]:
        """Return the message `links` of a status."""
        rows = {(row[0], row[1], row[6]): row for row in status["links"]}
        counts = {key: Count(row[2], row[3], row[4], row[5] * row[3], row[8]) for key, row in rows.items()}
        in_all = max(status["links_in_all"], len(rows))
        at_s = status["ticks"] * status["tick_ns"] / 1e9
        seen = self._windows.take(at_s, counts, are_all=in_all == len(rows))
        self._look([key for key in rows if self._is_on_air(key)])
        links = [self._line(key, rows[key][7], count) for key, count in seen.items()]
        latest = self._windows.latest.items()
        drops = ((key, cause, lost) for key, count in latest for cause, lost in count.causes.items())
        return links_message(status["ticks"], round(self._windows.length_s, 1), in_all, links, drops)

    def _line(self, key: Key, queue_ns: int, count: Count) -> dict[str, Any]:
        source, destination, rule = key
        judged = count.delivered + count.dropped
        return {
            "from": source,
            "to": destination,
            "rule": rule,
            "offered": count.offered,
            "delivered": count.delivered,
            "dropped": count.dropped,
            "loss": round(count.dropped / judged, 6) if judged else None,
            "delay_ms": round(count.delay_ns / count.delivered / 1e6, 4) if count.delivered else None,
            "queue_ms": round(queue_ns / 1e6, 4),
            "causes": count.causes,
            **self._ends_of(key),
        }

    def with_ends(self, links: list[dict[str, Any]]) -> list[dict[str, Any]]:
        """Return links, which have `from`, `to` and `rule`, with the places of their ends and what is between."""
        keys = [(link["from"], link["to"], link["rule"]) for link in links]
        self._look([key for key in keys if self._is_on_air(key)])
        return [{**link, **self._ends_of(key)} for link, key in zip(links, keys, strict=True)]

    def _ends_of(self, key: Key) -> dict[str, Any]:
        source, destination, _ = key
        on_air = self._is_on_air(key)
        ends: dict[str, Any] = {
            "radio": on_air,
            "from_link": self._ends.get(source),
            "to_link": self._ends.get(destination),
            "walls": self._walls.get(_pair(source, destination), []) if on_air else [],
        }
        if on_air:
            ends |= {"from_at": self._site(source), "to_at": self._site(destination)}
        return ends

    def _site(self, endpoint: str) -> Vector | None:
        """Return the deployment's place of an endpoint without a body."""
        places = self._deployment.network.places
        if self._ends.get(endpoint) is not None or not any(fnmatchcase(endpoint, glob) for glob in places):
            return None
        return self._world.antenna(endpoint, ORIGIN)

    def _is_on_air(self, key: Key) -> bool:
        """Whether the packets of a link go by radio."""
        found = self._on_air.get(key)
        if found is None:
            source, destination, name = key
            rules = self._profiles.rules_for(source, destination)
            profiles = (self._profiles.of_rule(rule, source, destination) for rule in rules)
            found = any(profile.settings.is_on_air for profile in profiles if name_of(profile) == name)
            self._on_air[key] = found
        return found

    def _look(self, keys: list[Key]) -> None:
        """Work out the obstacles between the ends of some links, the oldest results first."""
        if not self._placed:
            return
        pairs = dict.fromkeys(_pair(source, destination) for source, destination, _ in keys)
        known = [pair for pair in self._stale if pair in pairs]
        new = [pair for pair in pairs if pair not in self._walls]
        order = deque([*new, *(pair for pair in known if pair in self._walls)])
        for pair in [*islice(order, SIGHTS_MAX)]:
            self._walls[pair] = self._crossed(*pair)
            order.rotate(-1)
        self._stale = order

    def _crossed(self, source: str, destination: str) -> list[Vector]:
        """Return the middle of each thing (m, world frame) that the line between two antennas crosses."""
        bodies = frozenset({self._world.body(source), self._world.body(destination)})
        if not self._absent.isdisjoint(bodies):
            return []
        a, b = sorted((self._world.antenna(source, ORIGIN), self._world.antenna(destination, ORIGIN)))
        way = dist(a, b)
        middles = [(found.entry_m + found.exit_m) / 2 / way for found in self._world.crossings(a, b, bodies)]
        return [
            (
                round(a[0] + share * (b[0] - a[0]), 3),
                round(a[1] + share * (b[1] - a[1]), 3),
                round(a[2] + share * (b[2] - a[2]), 3),
            )
            for share in middles
        ]


def _pair(source: str, destination: str) -> Pair:
    return (source, destination) if source <= destination else (destination, source)


def links_message(
    at: int, window_s: float, in_all: int, links: list[dict[str, Any]], drops: Iterable[tuple[Key, str, int]]
) -> dict[str, Any]:
    """Return the message `links`; `drops` are the packets that were lost, by link and cause."""
    lost: Counter[tuple[str, str, str]] = Counter()
    for (source, destination, _), cause, count in drops:
        lost[source, destination, cause] += count
    shown = []
    for (source, destination, cause), count in lost.items():
        where = "sender" if cause in AT_SENDER else "receiver" if cause in AT_RECEIVER else "way"
        shown.append({"from": source, "to": destination, "cause": cause, "where": where, "count": count})
    return {"type": "links", "at": at, "window_s": window_s, "in_all": in_all, "links": links, "drops": shown}


def drop_message(tick: int, explained: Explained) -> dict[str, Any]:
    """Return a dropped packet as a page shows it."""
    return {
        "tick": tick,
        "cause": explained.cause,
        "head": explained.head,
        "steps": [{"stage": step.stage, "outcome": step.outcome, "text": step.text} for step in explained.steps],
        "verdict": explained.verdict,
    }

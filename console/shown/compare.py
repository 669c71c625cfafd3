"""Two sources on one clock, and the distances of their common entities: run and what-if, simulation and reality.

A distance is that of two positions of the same name at the same simulated time. Where one of the two is not known (an
entity that was not there, a gap, a jump) there is no distance, and a series has a hole.
Pure: neighbours are `tracks` (poses between samples), `poses_csv`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import dist
from typing import Any, Final

from foosim.console.shown.tracks import Pose

POINTS: Final = 500
"""Points of a series over the whole time that both sources have."""
ENTITIES_SHOWN: Final = 200

Positions = Mapping[str, Pose]
Where = Callable[[int], Positions]
"""Gives the known poses of a source at a time in ns, by entity."""


@dataclass(frozen=True, slots=True)
class Distance:
    """How far apart an entity is in two sources, m."""

    name: str
    metres: float


def distances(one: Positions, other: Positions) -> list[Distance]:
    """Return the distance of each entity that both have, the largest first."""
    found = [Distance(name, dist(pose[0], other[name][0])) for name, pose in one.items() if name in other]
    return sorted(found, key=lambda distance: (-distance.metres, distance.name))


class Comparison:
    """The series of distances over the time that two sources share, made point by point as there is time for it."""

    def __init__(self, one: Where, other: Where, tick_ns: int) -> None:
        self._one, self._other = one, other
        self._tick_ns = tick_ns
        self._span = (0, -1)
        self._most: dict[int, float | None] = {}
        self._wanted: list[int] = []

    def over(self, first: int, last: int) -> None:
        """Take the ticks that both sources have; points that are known stay where the span has only grown."""
        if (first, last) == self._span:
            return
        self._span = first, last
        step = max(1, -(-(last - first) // POINTS))
        self._wanted = [tick for tick in range(first, last + 1, step) if tick not in self._most]
        keep = {*range(first, last + 1, step)}
        self._most = {tick: metres for tick, metres in self._most.items() if tick in keep}

    @property
    def is_complete(self) -> bool:
        """Whether all points are there."""
        return not self._wanted

    def work(self, points: int) -> None:
        """Make some further points."""
        for tick in self._wanted[:points]:
            found = distances(self._one(tick * self._tick_ns), self._other(tick * self._tick_ns))
            self._most[tick] = found[0].metres if found else None
        del self._wanted[:points]

    def as_json(self, tick: int) -> dict[str, Any]:
        """Return the distance of each entity at a tick, and the series of the largest, m."""
        time_ns = tick * self._tick_ns
        found = distances(self._one(time_ns), self._other(time_ns))
        return {**_content(tick, found, sorted(self._most.items())), "complete": self.is_complete}


class Course:
    """The series of distances along a source that is known only where it is, thinned as it gets long."""

    def __init__(self) -> None:
        self._points: list[tuple[int, float | None]] = []
        self._apart = 0
        """Ticks between points that are kept."""
        self._is_interrupted = False

    def interrupt(self) -> None:
        """Leave a hole before the next point: distances in between are unknown."""
        self._is_interrupted = bool(self._points)

    def take(self, tick: int, found: Sequence[Distance]) -> dict[str, Any]:
        """Take the distances at a tick and return all of them. Where time went back, later ones are dropped."""
        while self._points and self._points[-1][0] >= tick:
            self._points.pop()
        if self._is_interrupted and self._points and self._points[-1][0] + 1 < tick:
            self._points.append((self._points[-1][0] + 1, None))
        self._is_interrupted = False
        newest = tick, found[0].metres if found else None
        content = _content(tick, found, [*self._points, newest])
        known = [at for at, metres in self._points[-1:] if metres is not None]
        if not known or newest[1] is None or tick - known[0] >= self._apart:
            self._keep(newest)
        return {**content, "complete": True}

    def _keep(self, point: tuple[int, float | None]) -> None:
        if point[1] is None and [metres for _, metres in self._points[-2:]] == [None, None]:
            self._points.pop()  # a hole is known by its ends
        self._points.append(point)
        if len(self._points) > POINTS:
            first, last = self._points[0][0], self._points[-1][0]
            self._apart = max(1, 2 * (last - first) // POINTS)
            kept = (point for number, point in enumerate(self._points) if number % 2 == 0 or point[1] is None)
            self._points = [*kept][-POINTS:]


def _content(tick: int, found: Sequence[Distance], series: Iterable[tuple[int, float | None]]) -> dict[str, Any]:
    """Return the content of a message: the distance of each entity at a tick, and the series of the largest, m."""
    return {
        "at": tick,
        "entities": [{"name": one.name, "distance_m": round(one.metres, 6)} for one in found[:ENTITIES_SHOWN]],
        "series": [[at, None if metres is None else round(metres, 6)] for at, metres in series],
    }

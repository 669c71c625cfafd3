"""The distances of the common entities of two sources on one clock: run and what-if, simulation and reality.

A distance is that of two positions of the same name at the same simulated time. Where one of the two is not known (an
entity that was not there, a gap, a jump) there is no distance, and a series has a hole. Of two recordings the common
time is compared, point by point; of a source with its own clock, its moments while a browser looks.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from math import dist
from typing import Any, Final

from foosim.capture.mcap.checks import CaptureError
from foosim.console.clock.deck import Clock, Deck
from foosim.console.clock.leading import Leader
from foosim.console.shown.source import Feed
from foosim.console.shown.tracks import Positions, Where

PERIOD_S: Final = 0.25
POINTS_AT_ONCE: Final = 20
POINTS: Final = 500
"""Points of a series over the whole time that both sources have."""
ENTITIES_SHOWN: Final = 200
Open = Callable[[], Where]
"""Opens the compared source, in the thread of the comparison."""
Compare = Open | Leader
"""The other source of a comparison: a recording, or the leading source."""
InPool = Callable[..., Awaitable[Any]]
"""Calls a function in the thread of the comparison."""
Distance = tuple[str, float]
"""Name of an entity, and how far apart it is in two sources, m."""
Covers = Callable[[], tuple[int, int]]
"""Gives the first and the last tick of the clock at which the second source has something."""


async def compare(feed: Feed, clock: Clock, one: Compare, other: Open, covers: Covers) -> None:
    """Publish the distances between a clock's first source and another one, until cancelled."""
    pool = ThreadPoolExecutor(1, "compared")
    in_pool = partial(asyncio.get_running_loop().run_in_executor, pool)
    try:
        if isinstance(one, Leader):
            contents = _beside(one, await in_pool(other), in_pool)
        else:
            assert isinstance(clock, Deck), "a recording is compared on a deck"
            contents = _on_deck(clock, Comparison(await in_pool(one), await in_pool(other), clock.tick_ns), in_pool)
        async for content in contents:
            feed.publish({"type": "compared", "covers": covers(), **content})
    except CaptureError as error:
        feed.publish({"type": "note", "level": "error", "text": f"the comparison ends: {error}"})
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


async def _on_deck(deck: Deck, comparison: Comparison, in_pool: InPool) -> AsyncIterator[dict[str, Any]]:
    """Yield the comparison of two recordings."""

    def work(tick: int) -> dict[str, Any]:
        comparison.work(POINTS_AT_ONCE)
        return comparison.as_json(tick)

    contents: Any = None
    while True:
        comparison.over(deck.first, deck.last)
        now = deck.tick(), deck.first, deck.last
        if now != contents or not comparison.is_complete:
            yield await in_pool(work, now[0])
            contents = now
        await asyncio.sleep(PERIOD_S if comparison.is_complete else 0)


async def _beside(leader: Leader, other: Where, in_pool: InPool) -> AsyncIterator[dict[str, Any]]:
    """Yield the comparison of a running, leading source with another one."""
    course, compared_ns, gaps = Course(), -1, leader.gaps
    while True:
        seen = leader.seen()
        if seen is not None and seen[0] != compared_ns:
            if leader.gaps != gaps:
                course.interrupt()
            compared_ns, gaps = seen[0], leader.gaps
            found = await in_pool(lambda time_ns, poses: distances(poses, other(time_ns)), *seen)
            yield course.take(compared_ns // leader.clock.tick_ns, found)
        await asyncio.sleep(PERIOD_S)


# --- distances --------------------------------------------------------------------------------------------------------


def distances(one: Positions, other: Positions) -> list[Distance]:
    """Return the distance of each entity that both have, the largest first."""
    found = [(name, dist(pose[0], other[name][0])) for name, pose in one.items() if name in other]
    return sorted(found, key=lambda distance: (-distance[1], distance[0]))


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
            self._most[tick] = found[0][1] if found else None
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
        newest = tick, found[0][1] if found else None
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
        "entities": [{"name": name, "distance_m": round(metres, 6)} for name, metres in found[:ENTITIES_SHOWN]],
        "series": [[at, None if metres is None else round(metres, 6)] for at, metres in series],
    }

"""The distance between two sources on one clock, published point by point while it is computed.

Of two recordings all of the time that both have is compared; of a source that has its own clock, what it shows while
somebody looks.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Final, Protocol

from foosim.capture.mcap.checks import CaptureError
from foosim.console.clock.deck import Clock, Deck
from foosim.console.clock.leading import Leader
from foosim.console.shown.compare import Comparison, Course, Distance, Positions, Where, distances
from foosim.console.shown.source import Feed

TOLD_S: Final = 0.25
POINTS_AT_ONCE: Final = 20
Open = Callable[[], Where]
"""Opens the compared source, in the thread of the comparison."""
Compare = Open | Leader
"""The other source of a comparison: a recording, or the leading source."""
Covers = Callable[[], tuple[int, int]]
"""Gives the first and the last tick of the clock at which the second source has something."""


class Told(Protocol):
    """What tells the feed of distances until it is cancelled."""

    async def run(self, feed: Feed) -> None: ...


def compared(clock: Clock, one: Compare, other: Open, covers: Covers) -> Told:
    """Return the comparison of a clock's first source with another one."""
    if isinstance(one, Leader):
        return Accompanying(one, other, covers)
    assert isinstance(clock, Deck), "a recording is compared on a deck"
    return Comparing(clock, one, other, covers)


class Comparing:
    """Compares the deck's first source with another one, in a thread of its own."""

    def __init__(self, deck: Deck, one: Open, other: Open, covers: Covers) -> None:
        self._deck = deck
        self._open = one, other
        self._covers = covers

    async def run(self, feed: Feed) -> None:
        """Tell the feed until it is cancelled."""
        loop = asyncio.get_running_loop()
        pool = ThreadPoolExecutor(1, "compared")
        try:
            one, other = [await loop.run_in_executor(pool, opened) for opened in self._open]
            comparison = Comparison(one, other, self._deck.tick_ns)
            told: Any = None
            while True:
                head = self._deck.playhead
                comparison.over(head.first, head.last)
                now = head.tick(self._deck.clock_ns()), head.first, head.last
                if now != told or not comparison.is_complete:
                    content = await loop.run_in_executor(pool, self._work, comparison, now[0])
                    feed.tell({"type": "compared", "covers": self._covers(), **content})
                    told = now
                await asyncio.sleep(TOLD_S if comparison.is_complete else 0)
        except CaptureError as error:
            feed.tell({"type": "note", "level": "error", "text": f"the comparison ends: {error}"})
        finally:
            pool.shutdown(wait=False, cancel_futures=True)

    @staticmethod
    def _work(comparison: Comparison, tick: int) -> dict[str, Any]:
        comparison.work(POINTS_AT_ONCE)
        return comparison.as_json(tick)


class Accompanying:
    """Compares a running, leading source with another one, in a thread of its own."""

    def __init__(self, leader: Leader, other: Open, covers: Covers) -> None:
        self._leader, self._open, self._covers = leader, other, covers

    async def run(self, feed: Feed) -> None:
        """Tell the feed until it is cancelled."""
        loop = asyncio.get_running_loop()
        pool = ThreadPoolExecutor(1, "compared")
        course = Course()
        clock, compared_ns, gaps = self._leader.clock, -1, self._leader.gaps
        try:
            other = await loop.run_in_executor(pool, self._open)
            while True:
                seen = self._leader.seen()
                if seen is not None and seen[0] != compared_ns:
                    if self._leader.gaps != gaps:
                        course.interrupt()
                    compared_ns, gaps = seen[0], self._leader.gaps
                    found = await loop.run_in_executor(pool, self._distances, other, *seen)
                    content = course.take(compared_ns // clock.tick_ns, found)
                    feed.tell({"type": "compared", "covers": self._covers(), **content})
                await asyncio.sleep(TOLD_S)
        except CaptureError as error:
            feed.tell({"type": "note", "level": "error", "text": f"the comparison ends: {error}"})
        finally:
            pool.shutdown(wait=False, cancel_futures=True)

    @staticmethod
    def _distances(other: Where, time_ns: int, poses: Positions) -> list[Distance]:
        return distances(poses, other(time_ns))

"""The distance between two sources on one clock, published point by point while it is computed.

Of two recordings the common time is compared; of a source with its own clock, its moments while
a browser looks.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, Final

from foosim.capture.mcap.checks import CaptureError
from foosim.console.clock.deck import Clock, Deck
from foosim.console.clock.leading import Leader
from foosim.console.shown.compare import Comparison, Course, Where, distances
from foosim.console.shown.source import Feed

PERIOD_S: Final = 0.25
POINTS_AT_ONCE: Final = 20
Open = Callable[[], Where]
"""Opens the compared source, in the thread of the comparison."""
Compare = Open | Leader
"""The other source of a comparison: a recording, or the leading source."""
InPool = Callable[..., Awaitable[Any]]
"""Calls a function in the thread of the comparison."""
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
        head = deck.playhead
        comparison.over(head.first, head.last)
        now = head.tick(deck.clock_ns()), head.first, head.last
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

"""The distance between two sources that share a deck, told while it is made: a point of the series at a time.

Neighbours: `compare` (what a distance is), `deck` (the clock), `capture_source` and `poses_source`, which run it.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Final

from foosim.console.recorded.deck import Deck
from foosim.console.shown.compare import Comparison, Where
from foosim.console.shown.source import Feed
from foosim.vhub.mcap_checks import CaptureError

TOLD_S: Final = 0.25
POINTS_AT_ONCE: Final = 20


class Comparing:
    """Compares the deck's first source with another one, in a thread of its own."""

    def __init__(self, deck: Deck, one: Callable[[], Where], other: Callable[[], Where]) -> None:
        """`one` and `other` open what is compared, in that thread."""
        self._deck = deck
        self._open = one, other

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
                    feed.tell({"type": "compared", **content})
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

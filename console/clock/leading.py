"""A source that has a clock of its own, a live run or a replay, and that another source follows.

Its messages are passed on; its moments are the clock, and have the poses of its entities. Pure.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import isnan
from typing import Any

from foosim.console.clock.deck import Clock
from foosim.console.shown.source import About, Answered, Curve, Eyes, Feed, Moment, Source, Wanted
from foosim.console.shown.tracks import Positions


class HeardClock(Clock):
    """The time of the last received moment; before the first one it is 0."""

    def __init__(self, tick_ns: int, clock_ns: Callable[[], int]) -> None:
        super().__init__(tick_ns, clock_ns)
        self._time_ns = 0

    def heard(self, moment: Moment) -> None:
        """Take the time of a moment."""
        self._time_ns, self.paused = round(moment.tick * self.tick_ns), moment.paused
        self.jumps += moment.jump
        self.changed()

    def time_ns(self) -> int:
        return self._time_ns

    def wall_ns(self, time_ns: int) -> int | None:
        return None


class Leader:
    """A source that forwards another one's messages, and gives the time to its followers."""

    def __init__(self, source: Source, tick_ns: int, clock_ns: Callable[[], int]) -> None:
        """`tick_ns` is known before the source describes itself. `clock_ns` is a monotonic wall clock."""
        self.source = source
        self.clock = HeardClock(tick_ns, clock_ns)
        self.gaps = 0
        """The count of gaps in the moments: no browser looked, or time jumped."""
        self._is_looked_at = False
        self._places: dict[str, int] = {}
        """The rows of poses by the names of links, and by those of entities, whose last link it is."""
        self._moment: Moment | None = None
        self._feed: Feed

    @property
    def about(self) -> About:
        return self.source.about

    async def run(self, feed: Feed) -> None:
        self._feed = feed
        await self.source.run(self)

    def want(self, wanted: Wanted) -> None:
        self.gaps += not (self._is_looked_at and wanted.readers)
        self._is_looked_at = wanted.readers > 0
        self.source.want(wanted)

    def eyes(self) -> Eyes | None:
        return self.source.eyes()

    async def request(self, verb: str, arguments: Mapping[str, Any], who: str) -> Answered:
        return await self.source.request(verb, arguments, who)

    async def history(self, curve: Curve) -> tuple[str, str, list[tuple[float, float]]]:
        return await self.source.history(curve)

    # --- the feed of its source: followers get messages later than the leader's own feed -----------------------------

    def describe(self, about: About, scene: Mapping[str, Any]) -> None:
        """Forward the scene, in whose order poses come, and take the length of a tick."""
        self._feed.describe(about, scene)
        self.clock.tick_ns = about.tick_ns
        links = [link["name"] for link in scene["links"]]
        self._places = {name: row for row, name in enumerate(links)}
        self._places |= {body["name"]: body["links"][-1] for body in scene["bodies"] if body["links"]}
        self._moment = None

    def show(self, moment: Moment) -> None:
        self._feed.show(moment)
        self.gaps += moment.jump
        self._moment = moment
        self.clock.heard(moment)

    def publish(self, message: Mapping[str, Any]) -> None:
        self._feed.publish(message)

    def seen(self) -> tuple[int, Positions] | None:
        """Return time, ns, and poses of the newest moment; None before there is one."""
        moment = self._moment
        if moment is None:
            return None
        rows = moment.poses.tolist()
        places = ((name, rows[row]) for name, row in self._places.items())
        poses = {name: (tuple(pose[:3]), tuple(pose[3:])) for name, pose in places if not isnan(pose[0])}
        return self.clock.time_ns(), poses

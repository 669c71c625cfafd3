"""A replay on the replay plane (`foosim capture play`) as a source of the page.

Its connection belongs to a thread, which passes messages on to the event loop. The scene is that of the captured
deployment; poses have names of links.
"""

from __future__ import annotations

import asyncio
import queue
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from contextlib import suppress
from typing import Any, Final

import numpy as np

from foosim.client.replay_listener import Replay, ReplayGone
from foosim.common.errors import Refused
from foosim.common.json_text import decode_json
from foosim.console.clock.deck import Known, checked, needed
from foosim.console.shown.drawing import Drawing
from foosim.console.shown.source import About, Answered, Curve, Feed, Moment, Wanted
from foosim.deployment.schema import Deployment
from foosim.protocol.replay_messages import PlayedLine, PlayedPoses, PlayedRow, ReplayClock

ARGUMENTS: Final[Known] = {
    "play": {},
    "resume": {},
    "pause": {},
    "step": {"count": (int,)},
    "seek": {"tick": (int,)},
    "rate": {"pace": (str,)},
}
STREAMS: Final = ("poses", "clock", "log", "rows")
HEAR_S: Final = 0.02
"""How long the thread waits for messages before it looks for requests."""
ROW_MARKS: Final[Mapping[str, Callable[[Mapping[str, Any]], str]]] = {
    "epochs": lambda row: f"epoch {row['epoch']}",
    "recoveries": lambda row: f"{row['what']} {row['name']}: {row['reason']}",
}
"""The texts of rows that are marks."""
Request = tuple[str, Mapping[str, Any], "Future[dict[str, Any]]"]


class PlayedSource:
    """One replay."""

    def __init__(self, connect: Callable[[tuple[str, ...]], Replay]) -> None:
        """`connect` opens a connection that receives some streams; its errors are raised."""
        self._replay: Final = connect(STREAMS)
        status = self._replay.status()
        self.tick_ns: Final = int(status["tick_ns"])
        span = int(status["from_ns"]) // self.tick_ns, int(status["until_ns"]) // self.tick_ns
        deployment = self._replay.deployment
        self.about = About("replay", str(status["capture"]), deployment.world, self.tick_ns, tuple(ARGUMENTS), span)
        self._status: dict[str, Any] = {key: value for key, value in status.items() if key != "deployment"}
        self._drawing: Final = Drawing(deployment)
        self._numbers: Final = np.full(self._drawing.layout.size, np.nan)
        self._jumps = 0
        self._requests: queue.SimpleQueue[Request] = queue.SimpleQueue()
        self._ended = threading.Event()

    @property
    def deployment(self) -> Deployment:
        """What was captured."""
        return self._replay.deployment

    def close(self) -> None:
        """Close the connection of a source that will not run."""
        self._replay.close()

    def want(self, wanted: Wanted) -> None:
        """A replay sends the same for any number of browsers."""

    async def run(self, feed: Feed) -> None:
        feed.describe(self.about, self._drawing.content())
        loop = asyncio.get_running_loop()
        heard = loop.create_future()

        def in_loop(work: Callable[[], None]) -> None:
            loop.call_soon_threadsafe(work)

        def listen() -> None:
            try:
                self._listen(feed, in_loop)
            except Refused as error:
                text = str(error)
                in_loop(lambda: feed.publish({"type": "note", "level": "warning", "text": text}))
            finally:
                self._ended.set()
                self._refuse_all()
                self._replay.close()
                in_loop(lambda: None if heard.done() else heard.set_result(None))

        thread = threading.Thread(target=listen, name="replay", daemon=True)
        thread.start()
        try:
            await heard
        finally:
            self._ended.set()
            await asyncio.to_thread(thread.join)

    def _listen(self, feed: Feed, in_loop: Callable[[Callable[[], None]], None]) -> None:
        """Receive and send requests until the replay or this source ends. Raises Refused."""
        while not self._ended.is_set():
            ended = self._replay.ended  # what arrives during a request waits for the next `take`
            for item in self._replay.take(HEAR_S):
                in_loop(lambda item=item: self._publish(feed, item))  # type: ignore[misc]
            while not self._requests.empty():
                verb, arguments, answer = self._requests.get()
                try:
                    answer.set_result(self._replay.request(verb, **arguments))
                except Refused as error:
                    answer.set_exception(error)
            if ended:
                raise ReplayGone("the replay has ended")

    # --- messages ----------------------------------------------------------------------------------------------------

    def _publish(self, feed: Feed, item: Any) -> None:
        if isinstance(item, PlayedPoses):
            self._show(feed, item)
        elif isinstance(item, ReplayClock):
            self._publish_status(feed, item)
        elif isinstance(item, PlayedLine) and item.level != "info":
            self._mark(feed, item.time_ns, item.level, item.text)
        elif isinstance(item, PlayedRow) and item.topic in ROW_MARKS:
            text = ROW_MARKS[item.topic](decode_json(item.row))
            self._mark(feed, item.time_ns, item.topic.removesuffix("s"), text)

    def _mark(self, feed: Feed, time_ns: int, kind: str, text: str) -> None:
        feed.publish({"type": "marks", "marks": [{"tick": time_ns // self.tick_ns, "kind": kind, "text": text}]})

    def _show(self, feed: Feed, heard: PlayedPoses) -> None:
        link = self._replay.captured_link
        poses = self._drawing.known({link(pose.link): (pose.position, pose.orientation) for pose in heard.poses})
        clock = self._replay.clock
        jumps = self._jumps if clock is None else clock.jumps
        paused = clock is not None and clock.state == "paused"
        feed.show(Moment(heard.time_ns / self.tick_ns, poses, self._numbers, jumps != self._jumps, paused))
        self._jumps = jumps

    def _publish_status(self, feed: Feed, clock: ReplayClock) -> None:
        tick = clock.time_ns // self.tick_ns
        assert self.about.span is not None
        first, last = self.about.span
        feed.publish(
            {
                "type": "status",
                "status": {
                    "run": self._status.get("run", ""),
                    "world": self.about.world,
                    "seed": self._replay.deployment.seed,
                    "ticks": tick,
                    "first_tick": first,
                    "last_tick": last,
                    "tick_ns": self.tick_ns,
                    "state": {"playing": "running"}.get(clock.state, clock.state),
                    "pace": clock.rate,
                },
            }
        )

    # --- requests ----------------------------------------------------------------------------------------------------

    def eyes(self) -> None:
        """It has no frames."""

    async def request(self, verb: str, arguments: Mapping[str, Any], who: str) -> Answered:
        checked(verb, arguments, ARGUMENTS)
        if verb == "play":
            verb = "resume"
        content: dict[str, Any] = {}
        if verb == "step":
            content = {"count": arguments.get("count", 1)}
        elif verb == "seek":
            content = {"time_ns": needed(verb, arguments, "tick") * self.tick_ns}
        elif verb == "rate":
            content = {"pace": needed(verb, arguments, "pace")}
        answer: Future[dict[str, Any]] = Future()
        self._requests.put((verb, content, answer))
        if self._ended.is_set():
            self._refuse_all()
        status = await asyncio.wrap_future(answer)
        tick = int(status["time_ns"]) // self.tick_ns
        return Answered(f"{status['state']} at tick {tick}, {status['rate']}", tick)

    def _refuse_all(self) -> None:
        """Answer the open requests: the connection has ended."""
        with suppress(queue.Empty):
            while True:
                _, _, answer = self._requests.get_nowait()
                answer.set_exception(ReplayGone("the replay has ended"))

    async def history(self, curve: Curve) -> tuple[str, str, list[tuple[float, float]]]:
        return "", "", []

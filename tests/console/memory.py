"""A source in memory: a deployment's world at rest, told moments by the test, which sees what is asked of it."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from websockets.asyncio.client import ClientConnection, connect

from foosim.common.errors import Refused
from foosim.console.server.server import ConsoleServer, Tokens
from foosim.console.shown.drawing import HEAD, Drawing, Poser
from foosim.console.shown.scene_json import scene_content
from foosim.console.shown.source import About, Answered, Curve, Eyes, Feed, Moment, Source, Wanted
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.assembly.world import build_scene
from foosim.world.layout import build_layout

TABLE = Path(__file__).parent.parent.parent / "deploy" / "table.yaml"
TOKENS = Tokens("look", "touch")


def table() -> Deployment:
    """The football table as deployed."""
    return load_deployment(TABLE.read_text(), TABLE.name)


def table_with_spares(count: int = 1) -> Deployment:
    """The same with balls that can be added."""
    return load_deployment(apply_sets(TABLE.read_text(), TABLE.name, [f"table.spare_balls={count}"]), TABLE.name)


class MemorySource:
    """A world that a test moves."""

    def __init__(self, deployment: Deployment) -> None:
        self.about = About("live", "test", deployment.world, deployment.tick_ns, ("pause", "push"))
        self.wanted: list[Wanted] = []
        self.asked: list[tuple[str, Mapping[str, Any]]] = []
        self.frame = initial_frame(deployment)
        self.feed: Feed | None = None
        self.begun = asyncio.Event()
        self.turn_to(deployment)

    def turn_to(self, deployment: Deployment) -> None:
        """Have the world of a deployment."""
        self.deployment = deployment
        self.layout = build_layout(self.deployment)
        self.scene = build_scene(self.deployment, self.layout)
        self.poser = Poser(self.layout, self.scene)
        if self.feed is not None:
            self.describe()

    def describe(self) -> None:
        assert self.feed is not None
        self.feed.describe(self.about, scene_content(self.deployment, self.layout, self.scene))

    def eyes(self) -> Eyes:
        return self.frame.tick, partial(Drawing(self.deployment).picture, self.frame)

    async def run(self, feed: Feed) -> None:
        self.feed = feed
        self.describe()
        self.begun.set()
        await asyncio.Event().wait()

    def show(self, tick: int, jump: bool = False) -> Moment:
        """Tell a moment whose numbers are tick, tick + 1, ..."""
        assert self.feed is not None
        values = np.arange(tick, tick + self.layout.size, dtype=np.float64)
        moment = Moment(tick, self.poser.poses(values), values, jump)
        self.feed.show(moment)
        return moment

    def publish(self, **message: Any) -> None:
        assert self.feed is not None
        self.feed.publish(message)

    def want(self, wanted: Wanted) -> None:
        self.wanted.append(wanted)

    async def request(self, verb: str, arguments: Mapping[str, Any], who: str) -> Answered:
        self.asked.append((verb, arguments))
        if verb == "push":
            raise Refused("ball cannot be pushed")
        return Answered(f"{verb} done", 7)

    async def history(self, curve: Curve) -> tuple[str, str, list[tuple[float, float]]]:
        return ("the ball", "m", [(1.0, 2.0)]) if curve.id == "known" else ("", "", [])


class Heard:
    """A feed that keeps what it is told."""

    def __init__(self) -> None:
        self.abouts: list[About] = []
        self.scenes: list[Mapping[str, Any]] = []
        self.moments: list[Moment] = []
        self.published: list[Mapping[str, Any]] = []
        self._more = asyncio.Event()

    def describe(self, about: About, scene: Mapping[str, Any]) -> None:
        self.abouts.append(about)
        self.scenes.append(scene)
        self._more.set()

    def show(self, moment: Moment) -> None:
        assert len(moment.poses) == len(self.scenes[-1]["links"])
        self.moments.append(moment)
        self._more.set()

    def publish(self, message: Mapping[str, Any]) -> None:
        self.published.append(message)
        self._more.set()

    @property
    def tick(self) -> float:
        """That of the last moment, -1 before there is one."""
        return self.moments[-1].tick if self.moments else -1.0

    def of(self, kind: str) -> list[Mapping[str, Any]]:
        return [message for message in self.published if message["type"] == kind]

    async def until(self, reached: Callable[[], bool]) -> None:
        """Wait for a fact."""
        async with asyncio.timeout(60):
            while not reached():
                self._more.clear()
                await self._more.wait()


@asynccontextmanager
async def running(source: Source) -> AsyncIterator[Heard]:
    heard = Heard()
    task = asyncio.create_task(source.run(heard))
    try:
        yield heard
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task


@dataclass
class Console:
    """A server that listens, and its source."""

    source: MemorySource
    server: ConsoleServer
    port: int

    def address(self, path: str = "/ws", scheme: str = "ws") -> str:
        return f"{scheme}://127.0.0.1:{self.port}{path}"

    @asynccontextmanager
    async def browser(self, token: str = TOKENS.operate, origin: str | None = "") -> AsyncIterator[Browser]:
        """A WebSocket that has said hello."""
        said = f"http://127.0.0.1:{self.port}" if origin == "" else origin
        async with connect(self.address(), origin=said, compression=None, max_queue=2) as connection:  # type: ignore[arg-type]
            browser = Browser(connection)
            await browser.say(type="hello", token=token)
            yield browser


@dataclass
class Browser:
    """What a page's script does, without a page."""

    connection: ClientConnection

    async def say(self, **message: Any) -> None:
        await self.connection.send(json.dumps(message))

    async def hear(self, kind: str) -> dict[str, Any]:
        """The next message of a type; those before it are passed over."""
        async with asyncio.timeout(30):
            while True:
                payload = await self.connection.recv()
                if isinstance(payload, str) and (message := json.loads(payload))["type"] == kind:
                    assert isinstance(message, dict)
                    return message

    async def moment(self) -> tuple[tuple[int, ...], np.ndarray[Any, Any], np.ndarray[Any, Any]]:
        """Head, poses and values of the next binary message."""
        async with asyncio.timeout(30):
            while True:
                payload = await self.connection.recv()
                if isinstance(payload, bytes):
                    head = HEAD.unpack_from(payload)
                    numbers = np.frombuffer(payload, "<f4", offset=HEAD.size)
                    assert len(numbers) == 7 * head[6] + head[7]
                    return head, numbers[: 7 * head[6]].reshape(-1, 7), numbers[7 * head[6] :]


@asynccontextmanager
async def console(source: MemorySource) -> AsyncIterator[Console]:
    """A server on a port of its own, its source running."""
    server = ConsoleServer([source], TOKENS, "1")
    async with server.listening("127.0.0.1", 0) as port:
        running = asyncio.create_task(server.run_sources())
        await source.begun.wait()
        yield Console(source, server, port)
        running.cancel()

"""The console as a client of a live run: connects as the endpoint that the deployment declares for it, and gives jobs.

It connects when a browser looks, stays for all browsers, and reports the state of the jobs to pages. One that cannot
connect, as where another console has the endpoint, reports the reason, and tries again. Waiting is done in a thread of
its own, the only one that knows the client.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import Any, Final, TypeVar

from foosim.client.client import Client
from foosim.common.errors import BadValue, Failed, Refused
from foosim.console.live.desk import Desk
from foosim.console.shown.drawing import Drawing
from foosim.console.shown.source import Answered, Feed

VERBS: Final = ("send", "cancel")
AGAIN_S: Final = 5.0
"""Wall time after which a console that could not connect tries again; a request does so at once."""

T = TypeVar("T")
Join = Callable[[str], Client]
"""Connects as a declared client. Raises Refused."""


class Sending:
    """Gives jobs in one run."""

    def __init__(self, join: Join) -> None:
        self._join = join
        self._thread = ThreadPoolExecutor(1, "console-jobs")
        self._drawing: Drawing | None = None
        self._client: Client | None = None
        self._desk: Desk | None = None
        self._readers = 0
        self._is_wanted = asyncio.Event()
        """Set when there is something to connect for."""

    def turn_to(self, drawing: Drawing) -> tuple[str, ...]:
        """Serve this world from here on; return the verbs: none where the deployment has no endpoint of the console."""
        self._drawing = drawing
        self._thread.submit(self._leave)
        self._look()
        return VERBS if drawing.deployment.console else ()

    def want(self, readers: int) -> None:
        """Take note of how many browsers look."""
        self._readers = readers
        self._look()

    def _look(self) -> None:
        if self._readers and self._drawing is not None and self._drawing.deployment.console:
            self._is_wanted.set()

    async def run(self, feed: Feed) -> None:
        """Send and receive, and publish all changes, until cancelled."""
        last: dict[str, Any] = {}
        try:
            while True:
                await self._is_wanted.wait()
                message = await self._in_thread(self._turn)
                if message != last:
                    last = message
                    feed.publish(message)
                if message["problem"]:
                    self._is_wanted.clear()
                    with suppress(TimeoutError):
                        async with asyncio.timeout(AGAIN_S):
                            await self._is_wanted.wait()
                    self._look()
        finally:
            self._thread.submit(self._leave)
            self._thread.shutdown(wait=False)

    async def request(self, verb: str, arguments: Mapping[str, Any]) -> Answered:
        """Give a job, or cancel one. Raises Refused with the reason."""
        answered = await self._in_thread(lambda: self._request(verb, dict(arguments)))
        self._is_wanted.set()
        return answered

    async def _in_thread(self, work: Callable[[], T]) -> T:
        return await asyncio.get_running_loop().run_in_executor(self._thread, work)

    # --- in the thread -----------------------------------------------------------------------------------------------

    def _request(self, verb: str, arguments: dict[str, Any]) -> Answered:
        wanted = {"robot": str, "actuator": str, **({"numbers": dict} if verb == "send" else {})}
        if {name: type(value) for name, value in arguments.items()} != wanted:
            raise BadValue(f"{verb} takes {', '.join(wanted)}", arguments)
        desk = self._connected()
        text = (desk.send if verb == "send" else desk.cancel)(**arguments)
        assert self._client is not None, "connected"
        return Answered(text, max(self._client.tick, 0))

    def _connected(self) -> Desk:
        """Return the desk, connected. Raises Refused."""
        if self._desk is None:
            assert self._drawing is not None, "a world is described before its first request"
            deployment = self._drawing.deployment
            try:
                self._client = self._join(deployment.console)
            except Refused as refused:
                raise Failed(f"this console cannot send robots, its client is not connected: {refused}") from None
            self._desk = Desk(self._client, deployment, self._drawing.layout)
        return self._desk

    def _turn(self) -> dict[str, Any]:
        """Receive for a moment; return the message for pages."""
        jobs: list[dict[str, Any]] = []
        problem = ""
        try:
            desk = self._connected()
            desk.turn()
            jobs = desk.jobs()
        except Refused as refused:
            problem = str(refused)
            self._leave()
        return {"type": "jobs", "problem": problem, "jobs": jobs}

    def _leave(self) -> None:
        """Close the connection."""
        if self._client is not None:
            self._client.close()
        self._client = self._desk = None

"""The console as a client of a live run: connects as the endpoint that the deployment declares for it, gives jobs, and
drives robots.

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

from foosim.client.client import AGAIN_S, CalledJob, Client
from foosim.client.commands import CommandEncoder
from foosim.common.errors import BadValue, Failed, Refused, UnknownName
from foosim.console.shown.drawing import Drawing
from foosim.console.shown.scene_json import DRIVES, drive_of, jobs_of
from foosim.console.shown.source import Answered, Feed
from foosim.deployment.schema import Deployment
from foosim.world.component_types.jobs import JobState
from foosim.world.components.fitted import BoundActuator, actuators_of
from foosim.world.layout import Layout

TAKES: Final[Mapping[str, Mapping[str, type]]] = {
    "send": {"robot": str, "actuator": str, "numbers": dict},
    "cancel": {"robot": str, "actuator": str},
    "drive": {"robot": str, "ahead": int, "left": int},
}
"""The verbs, and the types of their arguments."""
VERBS: Final = (*TAKES,)
TURNING: Final = 0.5
"""Of the greatest turn rate, as with MORSE's keyboard."""
RETRY_S: Final = 5.0
"""Wall time after which a console that could not connect tries again; a request does so at once."""

WORDS: Final[Mapping[JobState, str]] = {
    JobState.NONE: "sent, not confirmed",
    JobState.RUNNING: "running",
    JobState.DONE: "done",
    JobState.FAILED: "failed",
    JobState.PREEMPTED: "preempted",
    JobState.CANCELLED: "cancelled",
}
UNSENT: Final = "not sent: the robot's job sensor has not been received"

T = TypeVar("T")
Join = Callable[[str], Client]
"""Connects as a declared client. Raises Refused."""


class Desk:
    """The jobs of one connection, which operators give by the page. One that begins anew finds the last job of the one
    before.
    """

    def __init__(self, client: Client, deployment: Deployment, layout: Layout) -> None:
        """Join, and receive all sensors that report jobs; `deployment` has the contents of its files."""
        self._client = client
        encoder = CommandEncoder(deployment)
        reported = {robot: jobs_of(deployment, robot) for robot in sorted(deployment.robots)}
        self._takers = {(robot, one): encoder.actuator(robot, one) for robot, its in reported.items() for one in its}
        drives = {robot: drive_of(deployment, robot) for robot in reported}
        self._drives = {robot: channel for robot, channel in drives.items() if channel}
        self._fitted: dict[tuple[str, str], BoundActuator] = {
            (robot, one.channel): one for robot, its in reported.items() if its or drives[robot]
            for one in actuators_of(deployment, layout, layout[robot])
        }  # fmt: skip
        self._kinds = {robot: deployment.robots[robot].actuators[its].kind for robot, its in self._drives.items()}
        self._called: dict[tuple[str, str], str] = {}
        """The last request to each actuator, in words."""
        client.listen((robot, channel) for robot, its in reported.items() for channel in its.values())

    def send(self, robot: str, actuator: str, numbers: Mapping[str, Any]) -> str:
        """Give a job, by the numbers of a command; return the request in words. It preempts the one that runs.

        Raises UnknownName for an actuator without jobs, BadValue for numbers that a command does not have or beyond its
        limits, NotJoined, RunEnded and ConnectionFailed.
        """
        taker = self._takers[self._found(robot, actuator)]
        names = [field.name for field in taker.fields]
        if {*numbers} != {*names}:
            raise taker.wrong(f"{', '.join(numbers) or 'nothing'} given")
        for name in names:
            if not isinstance(numbers[name], int | float):
                raise taker.wrong(f"{name} is not a number", numbers[name])
        _, beyond = self._fitted[robot, actuator].examine(taker.pack(numbers))
        if beyond:
            one = beyond[0]
            raise taker.wrong(f"{one.name} is beyond its limit of {one.limit:g} {one.unit}", one.value)
        self._client.robots[robot].actuators[actuator].call(**numbers)
        what = ", ".join(f"{field.name} {numbers[field.name]:g} {field.unit}" for field in taker.fields)
        self._called[robot, actuator] = what
        return f"{robot}/{actuator}: {what}"

    def cancel(self, robot: str, actuator: str) -> str:
        """Cancel the last job; return the request in words. Raises as `send`, BadValue without a job."""
        job = self._job(self._found(robot, actuator))
        if job is None or job.state.has_ended:
            raise BadValue(f"{robot}/{actuator}: no job of {self._client.name} to cancel")
        job.cancel()
        return f"{robot}/{actuator}: job {job.number} is cancelled" if job.number else f"{robot}/{actuator}: not sent"

    def drive(self, robot: str, ahead: int, left: int) -> str:
        """Drive a robot by keys, ahead or back and to the left or right, each 1, 0 or -1; return the command in words.

        The command holds until the next one. Raises UnknownName for a robot without such an actuator, BadValue for
        other numbers, NotJoined, RunEnded and ConnectionFailed.
        """
        if robot not in self._drives:
            raise UnknownName("no robot that is driven by speeds", robot, [*self._drives])
        if not {ahead, left} <= {-1, 0, 1}:
            raise BadValue("ahead and left are 1, 0 or -1", f"{ahead}, {left}")
        channel = self._drives[robot]
        limits = self._fitted[robot, channel].actuator.limits()
        shares = {DRIVES[self._kinds[robot]]: ahead, "angular": TURNING * left}
        numbers = {name: shares.get(name, 0.0) * most for name, (_, most) in limits.items()}
        self._client.robots[robot].actuators[channel].set(**numbers)
        return f"{robot}/{channel}: " + ", ".join(f"{name} {number:g}" for name, number in numbers.items())

    def turn(self) -> None:
        """Receive for a moment, and send due commands. Raises RunEnded, NotJoined and ConnectionFailed."""
        self._client.receive(AGAIN_S)

    def jobs(self) -> list[dict[str, Any]]:
        """Return the states of the jobs of this client, one for each actuator with a job, as pages read them."""
        found = ((pair, self._job(pair)) for pair in self._takers)
        return [self._reported(*pair, job) for pair, job in found if job is not None]

    def _reported(self, robot: str, actuator: str, job: CalledJob) -> dict[str, Any]:
        state = job.state
        words = WORDS[state] + (f" by {job.by}" if job.by else "") if job.number is not None or state else UNSENT
        what = self._called.get((robot, actuator), "")
        text = f"job{f' {job.number}' if job.number else ''}{f' to {what}' if what else ''}: {words}"
        names = {"robot": robot, "actuator": actuator, "number": job.number, "state": state.name.lower()}
        return {**names, "text": text, "ended": state.has_ended}

    def _job(self, pair: tuple[str, str]) -> CalledJob | None:
        return self._client.robots[pair[0]].actuators[pair[1]].job

    def _found(self, robot: str, actuator: str) -> tuple[str, str]:
        if (robot, actuator) not in self._takers:
            valid = ["/".join(pair) for pair in self._takers]
            raise UnknownName("no actuator with a job sensor", f"{robot}/{actuator}", valid)
        return robot, actuator


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
                        async with asyncio.timeout(RETRY_S):
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
        if {name: type(value) for name, value in arguments.items()} != TAKES[verb]:
            raise BadValue(f"{verb} takes {', '.join(TAKES[verb])}", arguments)
        desk = self._connected()
        text: str = getattr(desk, verb)(**arguments)
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

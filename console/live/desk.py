"""Jobs of the console as a client of the run: operators give them by the page, which shows their states.

It is used by one thread (`sending.py`), and knows neither browsers nor how the client has connected.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from foosim.client.client import AGAIN_S, CalledJob, Client
from foosim.client.commands import CommandEncoder
from foosim.common.errors import BadValue, UnknownName
from foosim.console.shown.scene_json import jobs_of
from foosim.deployment.schema import Deployment
from foosim.world.component_types.jobs import JobState
from foosim.world.components.fitted import BoundActuator, actuators_of
from foosim.world.layout import Layout

WORDS: Final[Mapping[JobState, str]] = {
    JobState.NONE: "sent, not confirmed",
    JobState.RUNNING: "running",
    JobState.DONE: "done",
    JobState.FAILED: "failed",
    JobState.PREEMPTED: "preempted",
    JobState.CANCELLED: "cancelled",
}
UNSENT: Final = "not sent: the robot's job sensor has not been received"


class Desk:
    """The jobs of one connection. One that begins anew finds the last job of the one before."""

    def __init__(self, client: Client, deployment: Deployment, layout: Layout) -> None:
        """Join, and receive all sensors that report jobs; `deployment` has the contents of its files."""
        self._client = client
        encoder = CommandEncoder(deployment)
        reported = {robot: jobs_of(deployment, robot) for robot in sorted(deployment.robots)}
        self._takers = {(robot, one): encoder.actuator(robot, one) for robot, its in reported.items() for one in its}
        self._fitted: dict[tuple[str, str], BoundActuator] = {
            (robot, one.channel): one for robot, its in reported.items() if its
            for one in actuators_of(deployment, layout, layout[robot])
        }  # fmt: skip
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

"""Jobs of an actuator on the side of the commander: commands with numbers, and their states by the job sensor.

It sends and receives nothing itself: players, simulations and the client library hand it samples, and send the commands
that are due. A player:

    self.jobs = Jobs(deployment, "dispatcher", "scout", "drive")    # in __init__
    self.jobs.hear(samples)                                         # in act
    if self.job is None:
        self.job = self.jobs.call(x=3.0, y=1.0)
    return self.jobs.commands(tick)
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import msgspec

from foosim.client.commands import CommandEncoder, Taker
from foosim.client.errors import JobCancelled, JobError, JobFailed, JobPreempted
from foosim.client.player import Commands, Samples
from foosim.common.errors import BadValue, UnknownName
from foosim.deployment.schema import Deployment
from foosim.world.component_types.jobs import JOB, JobState
from foosim.world.components.job_reading import Jobs as Reading
from foosim.world.components.job_reading import JobSettings

REPEAT_NS: Final = 100_000_000
"""Simulated time after which a command without a known effect is sent again."""
ENDS: Final[dict[JobState, type[JobError]]] = {
    JobState.FAILED: JobFailed,
    JobState.PREEMPTED: JobPreempted,
    JobState.CANCELLED: JobCancelled,
}


class Job:
    """One job: `number` is None as long as it has not been sent, `state` NONE as long as it is not known to be taken.

    `by` is the next commander, where known, of a preempted job; `why` is a sentence on
    why it has failed, where the actuator gives a reason.
    """

    def __init__(self, what: str, number: int | None, command: Any) -> None:
        """`what` names robot and actuator, for messages; `command` is its command."""
        self.what: Final = what
        self.number = number
        self.state = JobState.NONE
        self.by = self.why = ""
        self.is_cancelled = False
        """Whether it was called off; it may have ended otherwise before that arrives."""
        self.command: Final = command

    def cancel(self) -> None:
        """Call it off, from the next command on that is due; one that has ended stays as it is."""
        self.is_cancelled = True
        if self.number is None:
            self.state = JobState.CANCELLED

    def check(self) -> bool:
        """Return whether it is done. Raises JobFailed, JobPreempted or JobCancelled for one that ended otherwise."""
        error = ENDS.get(self.state)
        if error is None:
            return self.state == JobState.DONE
        more = f" by {self.by}" if self.by else f": {self.why}" if self.why else ""
        raise error(
            f"{self.what}: job {self.number or 'that was not sent'} has {_ENDED[self.state]}{more}",
            self.number,
            self.by,
        )


_ENDED: Final = {
    JobState.FAILED: "failed",
    JobState.PREEMPTED: "been preempted",
    JobState.CANCELLED: "been cancelled",
}


class Jobs:
    """The jobs that one sender gives to one actuator of a robot. A new one preempts the one before."""

    def __init__(self, deployment: Deployment, sender: str, robot: str, actuator: str) -> None:
        """Raises UnknownName for a robot, actuator or sender, BadValue for an actuator without jobs, or one of whose
        jobs no sensor reports."""
        self._taker: Taker = CommandEncoder(deployment).actuator(robot, actuator)
        its = deployment.robots[robot]
        self.what: Final = f"{robot}/{actuator}"
        kind = its.actuators[actuator].component_type
        self._failures: Mapping[float, str] = getattr(kind.factory, "FAILURES", {})
        if not kind.jobs:
            raise BadValue(f"{self.what} has no jobs", its.actuators[actuator].kind)
        self.senders: Final = deployment.senders_to(robot)
        if sender not in self.senders:
            raise UnknownName(f"{self.what} takes no jobs from it", sender, self.senders)
        reporting = {
            channel for channel, one in its.sensors.items() if isinstance(one, JobSettings) and one.actuator == actuator
        }
        if not reporting:
            raise BadValue(f"{robot} has no sensor of the kind job for its actuator", actuator)
        if sender in deployment.players:
            heard = {channel for endpoint, channel in deployment.heard_by(sender) if endpoint == robot}
            if reporting.isdisjoint(heard):
                raise BadValue(
                    f"{sender} does not hear {' or '.join(sorted(reporting))} of {robot}, the job sensor of", actuator
                )
            reporting &= heard
        self.heard: Final = (robot, min(reporting))
        """The (robot, channel) that reports their states."""
        self.sender, self.robot, self.actuator = sender, robot, actuator
        self._row = self.senders.index(sender)
        self._repeat_ticks = max(1, REPEAT_NS // deployment.tick_ns)
        self._reading: Reading | None = None
        self._open: list[Job] = []
        self._current: Job | None = None
        self._last = 0
        self._sent = self._due_tick = 0
        """The number that was sent last, and when it is sent again."""

    # --- requests ----------------------------------------------------------------------------------------------------

    def call(self, *numbers: Any, **named: Any) -> Job:
        """Begin a job, by the numbers of a command in their order or by name; it is sent by `commands`.

        Raises BadValue for unknown fields and invalid numbers.
        """
        if numbers and named:
            raise self._taker.wrong("numbers are given by name or in their order, not both")
        command = self._taker.value(named or numbers)
        self._taker.encode(command)
        if self._current is not None and self._current.number is None:  # it was never sent
            self._current.state = JobState.PREEMPTED
            self._current.by = self.sender
        self._current = Job(self.what, None, command)
        self._open.append(self._current)
        return self._current

    @property
    def job(self) -> Job | None:
        """The last job: the one that was called, else, after a restart, the sender's last one by the reading."""
        if self._current is None and self._reading is not None and self._reading.numbers[self._row] > 0.0:
            number = int(self._reading.numbers[self._row])
            self._current = Job(self.what, number, None)
            self._open.append(self._current)
            self._read(self._reading)
        return self._current

    @property
    def running(self) -> str:
        """The sender of the running job, by the newest reading; empty for none."""
        at = 0 if self._reading is None else int(self._reading.running)
        return self.senders[at - 1] if at else ""

    # --- packets ----------------------------------------------------------------------------------------------------

    def hear(self, samples: Samples) -> None:
        """Take the newest sample of the job sensor."""
        sample = samples.get(self.heard)
        reading = None if sample is None else sample.value
        if isinstance(reading, Reading) and reading is not self._reading and self._is_sound(reading):
            self._reading = reading
            self._read(reading)

    def _is_sound(self, reading: Reading) -> bool:
        """Whether a reading, which a network may have changed, can be one."""
        count, states = max(len(self.senders), 1), frozenset(JobState)
        return (
            len(reading.numbers) == len(reading.states) == count
            and reading.running in range(count + 1)
            and states.issuperset(reading.states)
        )

    def _read(self, reading: Reading) -> None:
        last, state = int(reading.numbers[self._row]), JobState(int(reading.states[self._row]))
        self._last = max(self._last, last)
        for job in self._open:
            if job.number is None or last < job.number:
                continue
            job.state = state if last == job.number else JobState.PREEMPTED
            if job.state == JobState.PREEMPTED:
                job.by = self.running
            elif job.state == JobState.FAILED:
                job.why = self._failures.get(reading.failure, "")
        self._open = [job for job in self._open if not job.state.has_ended]

    def due(self, tick: int) -> Any | None:
        """Return the command to send at a tick, with its job's number; None for none.

        It is sent again until a reading reports it as taken. The first one waits for a reading, which has the
        number of the last job before a restart; and a number is above that of the tick, so that none is used twice.
        """
        job = self._current
        if job is None or job.state.has_ended or not (job.is_cancelled or job.state == JobState.NONE):
            return None
        if job.number is None:
            if self._reading is None:
                return None
            self._last = job.number = max(self._last, tick) + 1
        number = -job.number if job.is_cancelled else job.number
        if number == self._sent and tick < self._due_tick:
            return None
        self._sent, self._due_tick = number, tick + self._repeat_ticks
        command = self._taker.codec.nothing() if job.command is None else job.command
        return msgspec.structs.replace(command, **{JOB: float(number)})

    def commands(self, tick: int) -> Commands:
        """Return the `due` command as a player returns it, and `Simulation.step` takes it."""
        command = self.due(tick)
        return {} if command is None else {self.robot: {self.actuator: command}}

    def payload(self, tick: int) -> bytes | None:
        """Return the `due` command as the payload of a packet to the actuator's channel."""
        command = self.due(tick)
        return None if command is None else self._taker.encode(command)

"""Errors of a client, whose text names the valid choices, and of players."""

from __future__ import annotations

from foosim.common.errors import Failed, Refused


class PacketError(Refused):
    """A packet, or a message with packets, that the wire does not take."""


class PlayerError(Failed):
    """A player that cannot be loaded, or that did something that players must not do."""


class Unanswered(KeyboardInterrupt):
    """Raised in a player that does not return, to end it; the text has the time that it had."""


class ConnectionRefused(Refused):
    """The vHub will not have this client, and why."""


class ConnectionFailed(Refused):
    """No answer at the address, or the connection to the vHub is gone."""


class NotJoined(Refused):
    """A call that needs `lockstep` or `listen` first, or that cannot follow it."""

    exit_code = 2


class RunEnded(Refused):
    """The run is over: nothing can be sent or received."""


class JobError(Refused):
    """A job that has ended otherwise than done: its number, None of one that was not sent, and who commanded the robot
    instead, where that is known."""

    def __init__(self, what: str, number: int | None, by: str = "") -> None:
        super().__init__(what)
        self.number, self.by = number, by


class JobFailed(JobError):
    """The actuator could not do it, refused it, or its robot went out of service."""


class JobPreempted(JobError):
    """A later command took its place."""


class JobCancelled(JobError):
    """Its sender has called it off."""


class JobUnfinished(Refused):
    """A job has not ended within the time of the wait."""

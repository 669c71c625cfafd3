"""Errors of a client, whose text names the valid choices, and of players."""

from __future__ import annotations

from foosim.common.errors import Failed, Refused


class PacketError(Refused):
    """A packet, or a message with packets, that the wire does not take."""


class PlayerError(Failed):
    """A player that cannot be loaded, or that did something that players must not do."""


class Unanswered(KeyboardInterrupt):
    """Raised in a player that does not return, to end it; the text says how long it was waited for."""


class ConnectionRefused(Refused):
    """The vHub will not have this client, and why."""


class ConnectionFailed(Refused):
    """No answer at the address, or the connection to the vHub is gone."""


class NotJoined(Refused):
    """A call that needs `lockstep` or `listen` first, or that cannot follow it."""

    exit_code = 2


class RunEnded(Refused):
    """The run is over: nothing can be sent or received."""

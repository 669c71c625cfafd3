"""What can be wrong on a client's side, as typed errors whose text names the valid choices.

Neighbours: `protocol.errors` has their base; the command turns them into exit codes.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from foosim.protocol.errors import BadValue, Failed, Refused, show
from foosim.protocol.names import nearest_name

CHOICES_MAX: Final = 24


class UnknownName(BadValue):
    """A robot, channel, destination or class that does not exist; the text lists those that do."""

    def __init__(self, what: str, value: str, choices: Iterable[str]) -> None:
        names = sorted(set(choices))
        nearest = nearest_name(value, names)
        shown = ", ".join(names[:CHOICES_MAX]) + (", ..." if len(names) > CHOICES_MAX else "")
        super().__init__(f"{what} (there are: {shown or 'none'})", value, None if nearest is None else show(nearest))


class PacketError(Refused):
    """A packet, or a message with packets, that the wire does not take."""


class PlayerError(Failed):
    """A player that cannot be loaded, or that did something that players must not do."""


class ConnectionRefused(Refused):
    """The vHub will not have this client, and why."""


class ConnectionFailed(Refused):
    """Nobody answered at the address, or the connection to the vHub is gone."""


class NotJoined(Refused):
    """Something was asked of a client that needs `lockstep` or `listen` first, or that cannot follow it."""

    exit_code = 2


class RunEnded(Refused):
    """The run is over: nothing can be sent, and nothing comes any more."""

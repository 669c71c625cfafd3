"""What is said where a client cannot take part, or cannot go on by its own fault.

Neighbours: `messages` has all else that clients say and are told, `vhub.door` and `client.core` take it.
"""

from __future__ import annotations

from foosim.protocol.message_types import Message, Name, Text


class ClientRefusal(Message, frozen=True, tag="clientrefusal"):
    """The vHub will not have this client, and why. `joins`: it answers a Join of one that was welcomed, not a hello."""

    name: Name
    boot: Name
    reason: Text
    joins: bool = False


class Failure(Message, frozen=True):
    """A player's own code has failed: its process ends, and no other one would do better. `reason` is a sentence."""

    name: Name
    boot: Name
    reason: Text

"""What a client says when it cannot go on by its own fault.

Neighbours: `messages` has all else that clients say, `vhub.door` takes it.
"""

from __future__ import annotations

from foosim.protocol.message_types import Message, Name, Text


class Failure(Message, frozen=True):
    """A player's own code has failed: its process ends, and no other one would do better. `reason` is a sentence."""

    name: Name
    boot: Name
    reason: Text

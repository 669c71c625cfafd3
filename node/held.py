"""What came of an epoch that a node does not know yet, until that begins.

Each thing is held once, however often it is said: who asks for what is not there yet asks many times. Where there is
too much, since others go on without this node, the oldest goes.
"""

from __future__ import annotations

from foosim.common import limits
from foosim.protocol.channels import Channel


class Held:
    """Messages by what they say, in order of arrival: (channel, whom its key names)."""

    def __init__(self) -> None:
        self._messages: dict[bytes, tuple[Channel, str]] = {}

    def __len__(self) -> int:
        return len(self._messages)

    def add(self, channel: Channel, name: str, payload: bytes) -> None:
        """Hold a message."""
        if len(self._messages) >= limits.HELD_MESSAGES_MAX:
            self._messages.pop(next(iter(self._messages)))
        self._messages[payload] = channel, name

    def take(self) -> list[tuple[Channel, str, bytes]]:
        """Give all back, and hold nothing any more."""
        taken = [(channel, name, payload) for payload, (channel, name) in self._messages.items()]
        self._messages.clear()
        return taken

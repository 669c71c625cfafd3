"""The state of a capture at a tick: epoch, layout, scene and clients, each as its last message.

A file that begins within a run repeats these messages, so that it can be read by itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import msgspec

from foosim.capture.foxglove import SCENE
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.mcap.format import Message
from foosim.capture.rows import CLIENTS, EPOCHS, LAYOUT, ClientRow

_ONE: Final = (EPOCHS, LAYOUT, SCENE)
"""Of these the last message is in force."""
HOLDING: Final = frozenset({*_ONE, CLIENTS})
_decoder: Final = msgspec.json.Decoder(ClientRow)


class ActiveState:
    """The messages of a capture that are in force after the taken ones. `name` is the capture's, for errors."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._last: dict[str, Message] = {}
        self._clients: dict[str, Message] = {}
        """The join of each present client, in the order of joining."""

    def take(self, message: Message) -> None:
        """Take the next message. Raises CaptureError for a damaged one."""
        if message.topic == CLIENTS:
            try:
                row = _decoder.decode(message.data)
            except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
                raise CaptureError(f"{self._name}: {message.topic} at {message.log_ns} ns: {error}") from None
            self._clients.pop(row.client, None)
            if row.event == "joins":
                self._clients[row.client] = message
        elif message.topic in _ONE:
            self._last[message.topic] = message

    def copy(self) -> ActiveState:
        """Return a copy."""
        copied = ActiveState(self._name)
        copied._last, copied._clients = dict(self._last), dict(self._clients)
        return copied

    def messages(self) -> Iterator[Message]:
        """Yield the messages that a new file begins with, in their order."""
        for topic in (EPOCHS, LAYOUT):
            if topic in self._last:
                yield self._last[topic]
        yield from self._clients.values()
        if SCENE in self._last:
            yield self._last[SCENE]

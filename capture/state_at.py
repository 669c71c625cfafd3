"""The state of a capture at a tick: epoch, layout, scene, clients and metrics, each as its last message.

A file that begins within a run repeats these messages, so that it can be read by itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import msgspec

from foosim.capture.foxglove import SCENE
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.mcap.format import Message
from foosim.capture.rows import CLIENTS, EPOCHS, LAYOUT, METRICS, ClientRow, MetricRow

_ONE: Final = (EPOCHS, LAYOUT, SCENE)
"""Of these the last message is in force."""
HOLDING: Final = frozenset({*_ONE, CLIENTS, METRICS})
_decoders: Final[dict[str, msgspec.json.Decoder[Any]]] = {
    CLIENTS: msgspec.json.Decoder(ClientRow),
    METRICS: msgspec.json.Decoder(MetricRow),
}


class ActiveState:
    """The messages of a capture that are in force after the taken ones. `name` is the capture's, for errors."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._last: dict[str, Message] = {}
        self._clients: dict[str, Message] = {}
        """The join of each present client, in the order of joining."""
        self._metrics: dict[str, Message] = {}
        """By name."""

    def take(self, message: Message) -> None:
        """Take the next message. Raises CaptureError for a damaged one."""
        if message.topic in _ONE:
            self._last[message.topic] = message
            return
        if message.topic not in _decoders:
            return
        try:
            row: ClientRow | MetricRow = _decoders[message.topic].decode(message.data)
        except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
            raise CaptureError(f"{self._name}: {message.topic} at {message.log_ns} ns: {error}") from None
        if isinstance(row, MetricRow):
            self._metrics[row.name] = message
        else:
            self._clients.pop(row.client, None)
            if row.event == "joins":
                self._clients[row.client] = message

    def copy(self) -> ActiveState:
        """Return a copy."""
        copied = ActiveState(self._name)
        copied._last, copied._clients, copied._metrics = dict(self._last), dict(self._clients), dict(self._metrics)
        return copied

    def messages(self) -> Iterator[Message]:
        """Yield the messages that a new file begins with, in their order."""
        for topic in (EPOCHS, LAYOUT):
            if topic in self._last:
                yield self._last[topic]
        yield from self._clients.values()
        yield from self._metrics.values()
        if SCENE in self._last:
            yield self._last[SCENE]

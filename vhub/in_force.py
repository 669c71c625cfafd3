"""What holds at a tick of a capture until something else of its kind comes: epoch, layout, scene, who takes part.

A file that begins within a run repeats these rows, as they were written, so that it can be read by itself.
Neighbours: `capture_cut` and `capture_file` write them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import msgspec

from foosim.vhub.mcap_checks import CaptureError
from foosim.vhub.mcap_file import Message
from foosim.vhub.rows import CLIENTS, EPOCHS, LAYOUT, ClientRow
from foosim.vhub.viewing import SCENE

_ONE: Final = (EPOCHS, LAYOUT, SCENE)
"""Of these the last one holds."""
HOLDING: Final = frozenset({*_ONE, CLIENTS})
_decoder: Final = msgspec.json.Decoder(ClientRow)


class InForce:
    """The messages of a capture, which has a name, that hold behind those that it took."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._last: dict[str, Message] = {}
        self._clients: dict[str, Message] = {}
        """Who takes part, in the order of coming."""

    def take(self, message: Message) -> None:
        """Take one more message; what it brings holds from here on. Raises CaptureError for a damaged one."""
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

    def copy(self) -> InForce:
        """Return the same, which takes no more."""
        copied = InForce(self._name)
        copied._last, copied._clients = dict(self._last), dict(self._clients)
        return copied

    def messages(self) -> Iterator[Message]:
        """Yield what is repeated at the start of a file, in its order."""
        for topic in (EPOCHS, LAYOUT):
            if topic in self._last:
                yield self._last[topic]
        yield from self._clients.values()
        if SCENE in self._last:
            yield self._last[SCENE]

"""The state of a capture at a tick: epoch, layout, scene and clients, each as its last message.

A file that begins within a run repeats these messages, so that it can be read by itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import Final

import msgspec

from foosim.capture.foxglove import SCENE
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.mcap.format import Book, Message
from foosim.capture.mcap.scan import last_message, scan
from foosim.capture.parts import files_from
from foosim.capture.rows import CLIENTS, EPOCHS, LAYOUT, ClientRow

_ONE: Final = (EPOCHS, LAYOUT, SCENE)
"""Of these the last message is in force."""
HOLDING: Final = frozenset({*_ONE, CLIENTS})
_decoder: Final = msgspec.json.Decoder(ClientRow)


class ActiveState:
    """The messages of a capture that are in force after those that it took. `name` is the capture's, for errors."""

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


class LatchedTopic:
    """Finds messages of a topic in a capture and the files behind it, without unpacking chunks that have none."""

    def __init__(self, path: Path, topic: str) -> None:
        """Raises CaptureError for what cannot be read."""
        self._topic = topic
        self._books = [(file, _book_of(file)) for file in files_from(path)]

    def before(self, time_ns: int) -> Message | None:
        """Return the last message before a time, None when there is none. Raises CaptureError."""
        for path, book in reversed(self._books):
            with path.open("rb") as stream:
                found = last_message(stream, book, self._topic, time_ns)
            if found is not None:
                return found
        return None


def _book_of(path: Path) -> Book:
    """Return the places of a file's chunks, with their times and topics."""
    try:
        with path.open("rb") as stream, mmap(stream.fileno(), 0, access=ACCESS_READ) as content:
            return scan(content, str(path)).book
    except (OSError, ValueError) as error:  # an empty file is no map
        raise CaptureError(f"{path}: cannot be read, {error}") from None

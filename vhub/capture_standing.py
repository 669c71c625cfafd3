"""What holds at a time of a capture, of topics that are said now and then: for who begins to read in its midst.

Chunks in which something of them stands are found by the indexes, without being unpacked. Neighbours: `mcap_scan`.
"""

from __future__ import annotations

from collections.abc import Collection
from mmap import ACCESS_READ, mmap
from pathlib import Path

from foosim.vhub.capture_parts import files_from
from foosim.vhub.mcap_checks import CaptureError
from foosim.vhub.mcap_file import Book, Message
from foosim.vhub.mcap_scan import read_messages, scan


class Standing:
    """Where messages of some topics stand in a capture and the files behind it."""

    def __init__(self, path: Path, topics: Collection[str]) -> None:
        """Raises CaptureError for what cannot be read."""
        self._topics = topics
        self._books = [(file, _book_of(file, topics)) for file in files_from(path)]

    def before(self, time_ns: int) -> Message | None:
        """Return the last message before a time, None when there is none. Raises CaptureError."""
        for path, book in reversed(self._books):
            for index in reversed(book.chunks):
                if index.message_start_time >= time_ns:
                    continue
                one = Book(channels=book.channels, chunks=[index])
                with path.open("rb") as stream:
                    found = list(read_messages(stream, one, self._topics))
                standing = [message for message in found if message.log_ns < time_ns]
                if standing:
                    return standing[-1]
        return None


def _book_of(path: Path, topics: Collection[str]) -> Book:
    """Return the channels of a file, and the chunks with something of the topics."""
    try:
        size = path.stat().st_size
        with (
            path.open("rb") as stream,
            mmap(stream.fileno(), size, access=ACCESS_READ) as whole,
            memoryview(whole) as content,
        ):
            book = scan(stream, size, str(path), content).book
    except (OSError, ValueError) as error:  # an empty file is no map
        raise CaptureError(f"{path}: cannot be read, {error}") from None
    wanted = {channel.id for channel in book.channels if channel.topic in topics}
    chunks = [index for index in book.chunks if wanted & index.message_index_offsets.keys()]
    return Book(channels=book.channels, chunks=chunks)

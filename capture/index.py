"""Index of a capture's rows, so that any of them is read at once: for the time slider, seeks, and resumed writers.

The index consists of the heads of chunks and their message indexes. No chunk is unpacked for it, except the last of a
file that was cut within its indexes. `refresh` reads what was written to a capture since, from where the last read
ended; files may be added (`capture.split_time`, a restarted writer). Unpacked chunks are kept while there is room.
"""

from __future__ import annotations

import struct
from array import array
from bisect import bisect_right
from collections import Counter, OrderedDict
from collections.abc import Iterable
from dataclasses import dataclass, field
from io import BytesIO
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import BinaryIO, Final, NamedTuple

import zstandard
from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode

from foosim.capture.mcap.checks import CaptureError
from foosim.capture.mcap.format import (
    CHUNK_BYTES_MAX,
    CHUNK_FIELDS,
    INDEX_FIELDS,
    MAGIC,
    MESSAGE_FIELDS,
    RECORD,
    Message,
    chunk_records,
    unpack_chunk,
)
from foosim.capture.parts import Part, opened, parts_from

CACHE_BYTES: Final = 64 * 1024 * 1024
"""Of unpacked chunks that are kept; the one that is read last always is."""
UNSYNCED_BYTES: Final = 8 * 1024 * 1024
"""More than is written between two syncs, a second apart: earlier bytes are on the disk."""
_DAMAGED: Final = (EndOfFile, struct.error, ValueError, zstandard.ZstdError, CaptureError)


class Chunk(NamedTuple):
    """A chunk: in which file, where its record begins and how long that is."""

    part: int
    offset: int
    length: int


@dataclass(slots=True)
class Places:
    """Offsets of the messages of one topic, in the order of the files."""

    log_ns: array[int] = field(default_factory=lambda: array("Q"))
    chunk: array[int] = field(default_factory=lambda: array("I"))
    """Number of the chunk."""
    at: array[int] = field(default_factory=lambda: array("I"))
    """Place of the record in the unpacked chunk."""

    def __len__(self) -> int:
        return len(self.log_ns)

    def newest(self, time_ns: int) -> int:
        """Return the number of the last message at or before a time, -1 for none; for topics in order of time."""
        return bisect_right(self.log_ns, time_ns) - 1


@dataclass(slots=True)
class _Part:
    """One file, as far as it was looked at."""

    path: Path
    number: int
    stop: int | None
    """Its bytes that count, where they are not all."""
    done: int = 0
    ended: bool = False
    names: dict[int, str] = field(default_factory=dict)
    """Topics by channel."""
    topics: dict[int, str] = field(default_factory=dict)
    """The requested ones."""
    last: int = -1
    """Number of its last chunk, -1 before the first."""
    taken: set[int] = field(default_factory=set)
    """Channels of that chunk whose messages were taken."""


class CaptureIndex:
    """The index of some topics over a capture's files. It belongs to one thread."""

    def __init__(self, path: Path, topics: Iterable[str], stop: int | None = None, *, to_damage: bool = False) -> None:
        """`stop`: bytes of the last file that count. With `to_damage` the index ends before the first damaged record.

        Raises CaptureError for what cannot be read.
        """
        self.path: Final = path
        self._stop, self._to_damage = stop, to_damage
        self._topics = frozenset(topics)
        self._cache: OrderedDict[int, bytes] = OrderedDict()
        self.generation = 0
        """Raised when the index begins anew."""
        self._begin()
        self.refresh()

    def _begin(self) -> None:
        self.generation += 1
        self.chunks: list[Chunk] = []
        self.places: dict[str, Places] = {topic: Places() for topic in self._topics}
        self.counts: Counter[str] = Counter()
        """Messages by topic."""
        self._topics_in: list[set[str]] = []
        """Those of each chunk."""
        self._parts: list[_Part] = []
        self._cache.clear()

    @property
    def finished(self) -> bool:
        """Whether the last file has its end."""
        return bool(self._parts) and self._parts[-1].ended

    def refresh(self) -> bool:
        """Look at what was written since; return whether there is more. Raises CaptureError.

        A file that became shorter, or was let go (`capture.last`), is another capture: the index begins anew.
        """
        before = len(self.chunks)
        found = parts_from(self.path)
        if not self._fits(found):
            self._begin()
            before = -1
        for part, (_, stop) in zip(self._parts, found, strict=False):
            part.stop = stop
        for number, (path, stop) in enumerate(found):
            if number == len(self._parts):
                is_last = number == len(found) - 1
                self._parts.append(_Part(path, number, self._stop if is_last else stop))
            self._look(self._parts[number])
            if not self._parts[number].ended:
                break
        return len(self.chunks) != before

    def _fits(self, found: list[Part]) -> bool:
        """Whether the files still begin with what was indexed."""
        try:
            return len(found) >= len(self._parts) and all(
                part.path == path and part.done <= (path.stat().st_size if stop is None else stop)
                for part, (path, stop) in zip(self._parts, found, strict=False)
            )
        except OSError:
            return False

    @property
    def last_file(self) -> Path:
        """The last file that was indexed."""
        return self._parts[-1].path

    def last(self, topic: str) -> bytes:
        """Return the last row of a topic, requested or not, empty without one. Raises CaptureError."""
        has = (number for number in reversed(range(len(self.chunks))) if topic in self._topics_in[number])
        found = b""
        if (number := next(has, None)) is not None:
            names = self._parts[self.chunks[number].part].names
            chunk = self._unpacked(number)
            for opcode, start, stop in chunk_records(chunk):
                if opcode == Opcode.MESSAGE and names[MESSAGE_FIELDS.unpack_from(chunk, start)[0]] == topic:
                    found = chunk[start + MESSAGE_FIELDS.size : stop]
        return found

    def whole_bytes(self) -> int:
        """Return how many bytes the last file has up to the end of its last whole chunk with its indexes.

        Chunks that were synced long ago are not read. Raises CaptureError.
        """
        part = self._parts[-1]
        chunks = [chunk for chunk in self.chunks if chunk.part == part.number]
        with opened(part.path) as (stream, size):
            stop = part.done
            for chunk in chunks:
                if chunk is chunks[-1] or chunk.offset + chunk.length > size - UNSYNCED_BYTES:
                    stop = _end_of_whole(stream, chunk)
                    if stop < 0:
                        return chunk.offset
        return stop

    def read(self, topic: str, number: int) -> Message:
        """Return a message of a topic by its number. Raises CaptureError for a chunk that is damaged."""
        places = self.places[topic]
        at = places.at[number]
        chunk = self._unpacked(places.chunk[number])
        try:
            _, length = RECORD.unpack_from(chunk, at)
            start = at + RECORD.size
            _, sequence, log_ns, publish_ns = MESSAGE_FIELDS.unpack_from(chunk, start)
        except struct.error as error:
            raise self._damaged(places.chunk[number], f"its index leads beyond its end, {error}") from None
        data = chunk[start + MESSAGE_FIELDS.size : start + length]
        return Message(topic, log_ns, publish_ns, sequence, data)

    def _unpacked(self, number: int) -> bytes:
        known = self._cache.get(number)
        if known is not None:
            self._cache.move_to_end(number)
            return known
        part, offset, length = self.chunks[number]
        path = self._parts[part].path
        try:
            with path.open("rb") as stream:
                stream.seek(offset + RECORD.size)
                content = unpack_chunk(stream.read(length - RECORD.size), f"{path}: byte {offset}")
        except OSError as error:
            raise CaptureError(f"{path}: cannot be read, {error.strerror}") from None
        except _DAMAGED as error:
            raise self._damaged(number, str(error)) from None
        self._cache[number] = content
        kept = sum(map(len, self._cache.values()))
        while kept > CACHE_BYTES and len(self._cache) > 1:
            _, dropped = self._cache.popitem(last=False)
            kept -= len(dropped)
        return content

    def _damaged(self, number: int, what: str) -> CaptureError:
        part, offset, _ = self.chunks[number]
        return CaptureError(f"{self._parts[part].path}: byte {offset}: a damaged chunk, {what}")

    # --- looking -----------------------------------------------------------------------------------------------------

    def _look(self, part: _Part) -> None:
        if part.ended:
            return
        with opened(part.path, part.stop) as (stream, size):
            if size < max(part.done, len(MAGIC)):
                return
            with mmap(stream.fileno(), size, access=ACCESS_READ) as whole, memoryview(whole) as content:
                self._walk(part, content, size)

    def _walk(self, part: _Part, content: memoryview, size: int) -> None:
        """Take the whole records after the taken ones."""
        if not part.done:
            if bytes(content[: len(MAGIC)]) != MAGIC:
                raise CaptureError(f"{part.path}: no MCAP file, it does not start with {MAGIC!r}")
            part.done = len(MAGIC)
        while not part.ended and part.done + RECORD.size <= size:
            opcode, length = RECORD.unpack_from(content, part.done)
            stop = part.done + RECORD.size + length
            if stop > size or (length > CHUNK_BYTES_MAX and opcode == Opcode.CHUNK):
                break
            try:
                start = part.done + RECORD.size
                known = start + CHUNK_FIELDS.size if opcode == Opcode.CHUNK else stop
                self._take(part, opcode, bytes(content[start:known]), length)
            except (EndOfFile, struct.error, ValueError) as error:
                if self._to_damage:
                    break
                raise CaptureError(f"{part.path}: byte {part.done}: a damaged record, {error}") from None
            part.done = stop
        if not part.ended:
            self._complete(part)
            part.ended = part.done == part.stop
            if part.stop is not None and not part.ended:
                raise CaptureError(
                    f"{part.path}: byte {part.done}: a damaged record, the next file continues at {part.stop}"
                )

    def _take(self, part: _Part, opcode: int, content: bytes, length: int) -> None:
        """Take a record of `length` bytes; of a chunk `content` is the head alone."""
        if opcode == Opcode.CHANNEL:
            self._declare(part, content)
        elif opcode == Opcode.CHUNK:
            if not part.taken:
                self._complete(part)
            CHUNK_FIELDS.unpack_from(content)
            self.chunks.append(Chunk(part.number, part.done, RECORD.size + length))
            self._topics_in.append(set())
            # The first chunk of a further file repeats rows of the file before.
            is_repeat = part.number > 0 and part.last < 0
            part.last = len(self.chunks) - 1
            part.taken = set(part.names) if is_repeat else set()
        elif opcode == Opcode.MESSAGE_INDEX:
            channel, size = INDEX_FIELDS.unpack_from(content)
            if channel not in part.names or part.last < 0:
                raise ValueError(f"an index of channel {channel}, which is undeclared")
            self._topics_in[-1].add(part.names[channel])
            if channel not in part.taken:
                pairs = array("Q")
                pairs.frombytes(content[INDEX_FIELDS.size : INDEX_FIELDS.size + size])
                self._note(part, channel, pairs)
        elif opcode == Opcode.MESSAGE:
            raise ValueError("a message outside of a chunk; foosim capture cut writes a capture with chunks")
        elif opcode == Opcode.DATA_END:
            if not part.taken:
                self._complete(part)
            part.ended = True

    def _declare(self, part: _Part, content: bytes) -> None:
        channel = records.Channel.read(ReadDataStream(BytesIO(content)))
        part.names[channel.id] = channel.topic
        if channel.topic in self._topics:
            part.topics[channel.id] = channel.topic

    def _note(self, part: _Part, channel: int, pairs: array[int]) -> None:
        """Take the messages of a channel in the last chunk, (time, place) each."""
        part.taken.add(channel)
        self.counts[part.names[channel]] += len(pairs) // 2
        if channel in part.topics:
            places = self.places[part.topics[channel]]
            places.log_ns.extend(pairs[::2])
            places.at.fromlist(pairs[1::2].tolist())
            places.chunk.fromlist([part.last] * (len(pairs) // 2))

    def _complete(self, part: _Part) -> None:
        """Take what the indexes of the last chunk lack: it has none, or they are still to be written."""
        missing = part.topics.keys() - part.taken
        if part.last < 0 or not missing:
            return
        try:
            found = _indexes_of(self._unpacked(part.last))
        except _DAMAGED as error:
            if self._to_damage:
                return
            raise self._damaged(part.last, str(error)) from None
        for channel in found.keys() & (part.names.keys() - part.taken):
            self._topics_in[part.last].add(part.names[channel])
            self._note(part, channel, found[channel])
        part.taken |= missing


def _indexes_of(chunk: bytes) -> dict[int, array[int]]:
    """Return the indexes of a chunk's messages, (time, place) each, by channel. Raises ValueError."""
    found: dict[int, array[int]] = {}
    for opcode, start, _ in chunk_records(chunk):
        if opcode == Opcode.MESSAGE:
            channel, _, log_ns, _ = MESSAGE_FIELDS.unpack_from(chunk, start)
            found.setdefault(channel, array("Q")).extend((log_ns, start - RECORD.size))
    return found


def _end_of_whole(stream: BinaryIO, chunk: Chunk) -> int:
    """Return where a chunk's indexes end; -1 where it or one of them is not what its writer wrote."""
    stream.seek(chunk.offset + RECORD.size)
    content = stream.read(chunk.length - RECORD.size)
    try:
        found = _indexes_of(unpack_chunk(content, ""))
    except _DAMAGED:
        return -1
    times = [pairs[::2] for pairs in found.values()]
    if not times or CHUNK_FIELDS.unpack_from(content)[:2] != (min(map(min, times)), max(map(max, times))):
        return -1
    expected = b""
    for channel, pairs in sorted(found.items()):
        size = len(pairs) * pairs.itemsize
        expected += RECORD.pack(Opcode.MESSAGE_INDEX, INDEX_FIELDS.size + size)
        expected += INDEX_FIELDS.pack(channel, size) + pairs.tobytes()
    return chunk.offset + chunk.length + len(expected) if stream.read(len(expected)) == expected else -1

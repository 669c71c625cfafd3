"""The whole records of an MCAP file that has no end, so that a writer can go on behind them.

A process that is killed leaves a record that is cut; a machine that loses its power may leave bytes that were never
written. Everything before is kept, chunk by chunk, each with its checksum; nothing behind is. Who is in a hurry looks
at the heads of old chunks only: what was synced long ago is there. Neighbours: `mcap_file` (the container),
`capture_writer` (goes on), `capture_recovery` (completes).
"""

from __future__ import annotations

import struct
from array import array
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from io import BytesIO
from typing import BinaryIO, Final
from zlib import crc32

import zstandard
from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode

from foosim.vhub.mcap_checks import CHECKS, CaptureError, Described, read_attachment, read_metadata
from foosim.vhub.mcap_file import (
    CHUNK_BYTES_MAX,
    CHUNK_FIELDS,
    CHUNK_HEAD_BYTES_MAX,
    IN_DATA,
    INDEX_FIELDS,
    MAGIC,
    MESSAGE_FIELDS,
    PLACE,
    RECORD,
    Book,
    Message,
    chunk_records,
    next_chunk,
    unpack_chunk,
)

NOTHING: Final = memoryview(b"")
UNSYNCED_BYTES: Final = 8 * 1024 * 1024
"""More than is written between two syncs, a second apart: what stands before that is on the disk."""


_DAMAGED: Final = (EndOfFile, struct.error, ValueError, KeyError, IndexError, CaptureError, zstandard.ZstdError)
"""What reading a record raises that is not what was written."""


@dataclass(slots=True)
class Scanned:
    """What a file holds up to its last whole record. `book.offset` is where that ends."""

    book: Book
    size: int
    finished: bool = False
    """Whether the file has an end: then there is nothing to go on with."""
    is_cut: bool = True
    """Whether nothing but one record that is cut stands behind the whole ones; else bytes there are damaged or void."""
    is_void: bool = False
    """Whether a whole chunk stands there with a message that does not hold."""
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    """The entries of each record of metadata, by its name."""
    last: dict[str, bytes] = field(default_factory=dict)
    """The last message of each topic."""
    to_index: dict[int, array[int]] = field(default_factory=dict)
    """What the last chunk holds by channel, (time, place) each, when the file was cut within its indexes."""

    @property
    def torn_bytes(self) -> int:
        """Bytes behind the last whole record."""
        return self.size - self.book.offset


@dataclass(frozen=True, slots=True)
class Void:
    """What does not hold of a file: messages of these topics, from a log time on, that a test names by their data."""

    topics: tuple[str, ...]
    from_ns: int
    is_void: Callable[[str, bytes], bool]


def scan(
    stream: BinaryIO, size: int, name: str, trusted: memoryview = NOTHING, void: Void | None = None
) -> Scanned:
    """Read a file's records up to the first that is cut or damaged, the first chunk with something void, or its end.

    `trusted` is the file's beginning of which only the heads of records are looked at, unless they are damaged. Raises
    CaptureError when it does not start as an MCAP file does, with as much as it has.
    """
    if trusted:
        with suppress(*_DAMAGED):
            found = _Scan(stream, size, name, void).run(trusted)
            if found.book.offset >= len(trusted):
                return found
        stream.seek(0)
    return _Scan(stream, size, name, void).run()


class _Scan:
    def __init__(self, stream: BinaryIO, size: int, name: str, void: Void | None) -> None:
        self._stream = stream
        self._name = name
        self._void = void
        self._found = Scanned(Book(), size)
        self._book = self._found.book
        self._described = Described()
        self._topics: dict[int, str] = {}
        self._chunk = b""
        """The records of the last chunk."""
        self._indexed = 0
        """How many of its messages are indexed."""
        self._places: dict[int, tuple[int, int, int]] = {}
        """By channel, the last message in a chunk that was not unpacked: the chunk's start and stop, its own place."""

    def run(self, trusted: memoryview = NOTHING) -> Scanned:
        start = self._stream.read(len(MAGIC))
        if not MAGIC.startswith(start):
            raise CaptureError(f"{self._name}: no MCAP file, it does not start as one")
        self._book.offset = len(MAGIC) if start == MAGIC else 0
        if self._book.offset and trusted:
            self._pass_over(trusted)
        while self._book.offset and self._next():
            continue
        found = self._found
        if found.is_cut and not found.finished and next_chunk(self._stream, self._book.offset + 1, found.size):
            found.is_cut = False
        self._look_at_the_last_chunk()
        self._read_places()
        return self._found

    def _pass_over(self, content: memoryview) -> None:
        """Take records by their heads, chunks without their content, up to the last that is whole."""
        book, stop = self._book, len(content)
        while (at := book.offset + RECORD.size) <= stop:
            opcode, length = RECORD.unpack_from(content, book.offset)
            if at + length > stop or opcode not in IN_DATA - {Opcode.DATA_END}:
                break
            if opcode == Opcode.CHUNK:
                head = bytes(content[at : at + CHUNK_HEAD_BYTES_MAX])
                if self._may_be_void(head):
                    break
                self._indexed = 0
                self._note_chunk(head, length)
            elif opcode == Opcode.MESSAGE_INDEX:
                self._pass_index(content, at, length)
            else:
                self._take(opcode, bytes(content[at : at + length]))
            book.offset = at + length
        self._stream.seek(book.offset)
        if book.chunks:  # further indexes of it may come
            last = book.chunks[-1]
            start, stop = last.chunk_start_offset + RECORD.size, last.chunk_start_offset + last.chunk_length
            self._chunk = unpack_chunk(bytes(content[start:stop]), self._name)

    def _pass_index(self, content: memoryview, at: int, length: int) -> None:
        channel, size = INDEX_FIELDS.unpack_from(content, at)
        (place,) = PLACE.unpack_from(content, at + length - PLACE.size)
        last = self._book.chunks[-1]
        start, stop = last.chunk_start_offset + RECORD.size, last.chunk_start_offset + last.chunk_length
        self._places[channel] = start, stop, place
        self._note_index(channel, size // (2 * PLACE.size), at - RECORD.size, RECORD.size + length)

    def _read_places(self) -> None:
        """Read the last messages of topics that had none in the chunks that were unpacked."""
        for channel, (start, stop, place) in self._places.items():
            if self._topics[channel] not in self._found.last:
                self._stream.seek(start)
                self._note_last(channel, unpack_chunk(self._stream.read(stop - start), self._name), place)

    def _next(self) -> bool:
        """Take the next record; False at the first that is not whole, and where the data end."""
        left = self._found.torn_bytes - RECORD.size
        head = self._stream.read(RECORD.size)
        if len(head) < RECORD.size:
            return False
        opcode, length = RECORD.unpack(head)
        if length > left:
            return False
        content = self._stream.read(length) if length <= CHUNK_BYTES_MAX else b""
        if len(content) < length or opcode not in IN_DATA:
            self._found.is_cut = False
            return False
        if opcode == Opcode.DATA_END:
            self._stream.seek(max(0, self._found.size - len(MAGIC)))
            self._found.finished = left > length and self._stream.read(len(MAGIC)) == MAGIC
            return False
        try:
            self._take(opcode, content)
        except _DAMAGED:
            self._found.is_cut = False
            return False
        if self._found.is_void:
            self._found.is_cut = False
            return False
        self._book.offset += RECORD.size + length
        return True

    def _take(self, opcode: int, content: bytes) -> None:
        book, offset, length = self._book, self._book.offset, RECORD.size + len(content)
        if opcode == Opcode.SCHEMA:
            book.schemas.append(records.Schema.read(_stream(content)))
        elif opcode == Opcode.CHANNEL:
            channel = records.Channel.read(_stream(content))
            book.channels.append(channel)
            book.counts[channel.id] = 0
            self._topics[channel.id] = channel.topic
        elif opcode == Opcode.ATTACHMENT:
            attachment = read_attachment(content)
            self._described.take(attachment)
            size, kind = len(attachment.data), attachment.media_type
            book.attachments.append(
                records.AttachmentIndex(offset, length, 0, 0, data_size=size, name=attachment.name, media_type=kind)
            )
        elif opcode == Opcode.METADATA:
            metadata = read_metadata(content)
            if metadata.name == CHECKS:
                self._check_described(metadata.metadata)
            book.metadata.append(records.MetadataIndex(offset=offset, length=length, name=metadata.name))
            self._found.metadata[metadata.name] = metadata.metadata
        elif opcode == Opcode.CHUNK:
            self._take_chunk(content)
        elif opcode == Opcode.MESSAGE_INDEX:
            self._take_index(content, offset, length)

    def _check_described(self, told: Mapping[str, str]) -> None:
        """Compare what stands before the first chunk with its digests. Raises ValueError."""
        place = self._stream.tell()
        self._stream.seek(0)
        before = crc32(self._stream.read(self._book.offset))
        self._stream.seek(place)
        self._described.check(told, before)

    def _take_chunk(self, content: bytes) -> None:
        chunk = unpack_chunk(content, self._name)
        self._found.is_void = self._may_be_void(content) and self._is_void(chunk)
        if not self._found.is_void:
            self._note_chunk(content, len(content))
            self._chunk, self._indexed = chunk, 0

    def _note_chunk(self, content: bytes, length: int) -> None:
        """Enter a chunk of so many bytes into the book; `content` is its beginning at least."""
        first_ns, last_ns, size, _, name_length = CHUNK_FIELDS.unpack_from(content)
        name = content[CHUNK_FIELDS.size : CHUNK_FIELDS.size + name_length].decode()
        book = self._book
        book.start_ns, book.end_ns = min(book.start_ns, first_ns), max(book.end_ns, last_ns)
        book.chunks.append(
            records.ChunkIndex(
                chunk_start_offset=book.offset,
                chunk_length=RECORD.size + length,
                compression=name,
                compressed_size=length - CHUNK_FIELDS.size - name_length - PLACE.size,
                uncompressed_size=size,
                message_start_time=first_ns,
                message_end_time=last_ns,
                message_index_offsets={},
                message_index_length=0,
            )
        )

    def _may_be_void(self, content: bytes) -> bool:
        """Whether a chunk, of which this is the beginning at least, is from times at which something is void."""
        return self._void is not None and CHUNK_FIELDS.unpack_from(content)[1] >= self._void.from_ns

    def _is_void(self, chunk: bytes) -> bool:
        """Whether a chunk holds something void."""
        void = self._void
        assert void is not None
        for opcode, start, stop in chunk_records(chunk):
            if opcode == Opcode.MESSAGE:
                topic = self._topics[MESSAGE_FIELDS.unpack_from(chunk, start)[0]]
                if topic in void.topics and void.is_void(topic, chunk[start + MESSAGE_FIELDS.size : stop]):
                    return True
        return False

    def _take_index(self, content: bytes, offset: int, length: int) -> None:
        """Count a channel's messages of the last chunk, and keep the last of them."""
        channel, size = INDEX_FIELDS.unpack_from(content)
        entries = array("Q", content[INDEX_FIELDS.size :])
        if size != 8 * len(entries) or not entries or channel not in self._topics:
            raise ValueError(f"an index of {size} bytes for channel {channel}")
        self._note_last(channel, self._chunk, entries[-1])
        self._note_index(channel, len(entries) // 2, offset, length)

    def _note_last(self, channel: int, chunk: bytes, at: int) -> None:
        opcode, start, stop = next(chunk_records(chunk[at:]))
        if opcode != Opcode.MESSAGE or MESSAGE_FIELDS.unpack_from(chunk, at + start)[0] != channel:
            raise ValueError(f"an index of channel {channel} that leads to something else")
        self._found.last[self._topics[channel]] = chunk[at + start + MESSAGE_FIELDS.size : at + stop]

    def _note_index(self, channel: int, count: int, offset: int, length: int) -> None:
        """Enter an index of so many messages in the last chunk into the book."""
        self._book.counts[channel] += count
        self._indexed += count
        last = self._book.chunks[-1]
        last.message_index_offsets[channel] = offset
        last.message_index_length += length

    def _look_at_the_last_chunk(self) -> None:
        """A chunk that is whole counts, also when the file was cut within its indexes: they are written again."""
        entries: dict[int, array[int]] = {}
        for opcode, start, stop in chunk_records(self._chunk):
            if opcode == Opcode.MESSAGE:
                channel, _, log_ns, _ = MESSAGE_FIELDS.unpack_from(self._chunk, start)
                entries.setdefault(channel, array("Q")).extend((log_ns, start - RECORD.size))
                self._found.last[self._topics[channel]] = self._chunk[start + MESSAGE_FIELDS.size : stop]
        if self._found.finished or self._indexed == sum(len(pairs) // 2 for pairs in entries.values()):
            return
        book, last = self._book, self._book.chunks[-1]
        for channel in last.message_index_offsets:
            book.counts[channel] -= len(entries[channel]) // 2
        last.message_index_offsets, last.message_index_length = {}, 0
        book.offset = last.chunk_start_offset + last.chunk_length
        self._found.to_index = entries


def read_messages(stream: BinaryIO, book: Book, topics: Collection[str]) -> Iterator[Message]:
    """Yield the messages of some topics, chunk by chunk, by the indexes; a last chunk without any is looked through.

    Raises CaptureError for a chunk that is damaged: those that `scan` trusted may be.
    """
    named = {channel.id: channel.topic for channel in book.channels if channel.topic in topics}
    for index in book.chunks:
        if index.message_index_offsets and not named.keys() & index.message_index_offsets.keys():
            continue
        stream.seek(index.chunk_start_offset + RECORD.size)
        place = f"byte {index.chunk_start_offset}"
        try:
            chunk = unpack_chunk(stream.read(index.chunk_length - RECORD.size), place)
            for opcode, start, stop in chunk_records(chunk):
                channel, sequence, log_ns, publish_ns = MESSAGE_FIELDS.unpack_from(chunk, start)
                if opcode == Opcode.MESSAGE and channel in named:
                    data = chunk[start + MESSAGE_FIELDS.size : stop]
                    yield Message(named[channel], log_ns, publish_ns, sequence, data)
        except _DAMAGED as error:
            raise CaptureError(f"{place}: a damaged chunk, {error}") from None


def _stream(content: bytes) -> ReadDataStream:
    return ReadDataStream(BytesIO(content))

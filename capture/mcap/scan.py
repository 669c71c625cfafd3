"""The whole records of an MCAP file, for a writer that resumes after them, and for readers of a few messages.

A process that is killed leaves a record that is cut; a machine that loses its power may leave bytes that were never
written. Everything before is kept, nothing behind is. Records are found by their heads: a chunk's content is read and
checked only where the file may not be on the disk.
"""

from __future__ import annotations

import struct
import sys
from array import array
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from io import BytesIO
from mmap import mmap
from typing import Final
from zlib import crc32

import zstandard
from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode

from foosim.capture.mcap.checks import CHECKS, CaptureError, Described, Span, read_attachment, read_metadata
from foosim.capture.mcap.format import (
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
    ByteSource,
    Message,
    chunk_records,
    next_chunk,
    unpack_chunk,
)

UNSYNCED_BYTES: Final = 8 * 1024 * 1024
"""More than is written between two syncs, a second apart: earlier bytes are on the disk."""
_DAMAGED: Final = (EndOfFile, struct.error, ValueError, KeyError, IndexError, CaptureError, zstandard.ZstdError)
"""What reading a record raises that is not what was written."""


@dataclass(slots=True)
class Scanned:
    """The contents of a file up to its last valid record, or chunk with its indexes, which ends at `book.offset`."""

    book: Book
    size: int
    finished: bool = False
    """Whether the file is finished, and cannot be resumed."""
    is_damaged: bool = False
    """Whether more than one truncated record follows the valid ones."""
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    """The entries of each record of metadata, by its name."""

    @property
    def torn_bytes(self) -> int:
        """Bytes behind what is whole."""
        return self.size - self.book.offset


def scan(content: mmap, name: str, trusted: int = sys.maxsize) -> Scanned:
    """Read a file's records up to the first that is cut or damaged, or its end.

    Of chunks that end before the byte `trusted` only the heads are read. Raises CaptureError for a file that does not
    start as an MCAP file does, with as much as it has.
    """
    return _Scan(content, name, trusted).run()


class _Scan:
    def __init__(self, content: mmap, name: str, trusted: int) -> None:
        self._content, self._name, self._trusted = content, name, trusted
        self._book = Book()
        self._found = Scanned(self._book, len(content))
        self._described = Described()
        self._indexed: dict[int, int] = {}
        """By channel, how many messages of the last chunk are indexed."""
        self._span: Span | None = None
        """Times of the last chunk, where it was read."""

    def run(self) -> Scanned:
        found, book, content = self._found, self._book, self._content
        start = content[: len(MAGIC)]
        if not MAGIC.startswith(start):
            raise CaptureError(f"{self._name}: no MCAP file, it does not start as one")
        if start != MAGIC:
            return found
        book.offset = len(MAGIC)
        try:
            while self._next():
                continue
        except _DAMAGED:
            found.is_damaged = True
        if not found.finished and book.chunks and not self._is_last_indexed():
            self._drop_last_chunk()
        if not found.finished and next_chunk(content, book.offset + 1, found.size) is not None:
            found.is_damaged = True
        book.start_ns = min((chunk.message_start_time for chunk in book.chunks), default=sys.maxsize)
        book.end_ns = max((chunk.message_end_time for chunk in book.chunks), default=0)
        return found

    def _next(self) -> bool:
        """Take the next record; False at one that is longer than the file, and where the data end."""
        at, size = self._book.offset + RECORD.size, self._found.size
        if at > size:
            return False
        opcode, length = RECORD.unpack_from(self._content, self._book.offset)
        if opcode not in IN_DATA:
            raise ValueError(f"a record of the kind {opcode:#04x}")
        if length > size - at:
            return False
        if length > CHUNK_BYTES_MAX:
            raise ValueError(f"a record of {length} bytes")
        if opcode == Opcode.MESSAGE_INDEX:
            self._take_index(at, length)
            self._book.offset = at + length
            return True
        span, self._span = self._span, None
        if span is not None:
            span.check()
        if opcode == Opcode.CHUNK:
            self._take_chunk(at, length)
        elif opcode == Opcode.DATA_END:
            self._found.finished = at + length < size and self._content[-len(MAGIC) :] == MAGIC
            return False
        else:
            self._take(opcode, self._content[at : at + length])
        self._book.offset = at + length
        return True

    def _take(self, opcode: int, content: bytes) -> None:
        book, offset, length = self._book, self._book.offset, RECORD.size + len(content)
        if opcode == Opcode.SCHEMA:
            book.schemas.append(records.Schema.read(_stream(content)))
        elif opcode == Opcode.CHANNEL:
            book.channels.append(records.Channel.read(_stream(content)))
            book.counts[book.channels[-1].id] = 0
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
                self._described.check(metadata.metadata, crc32(self._content[:offset]))
            book.metadata.append(records.MetadataIndex(offset=offset, length=length, name=metadata.name))
            self._found.metadata[metadata.name] = metadata.metadata

    def _take_chunk(self, at: int, length: int) -> None:
        head = self._content[at : at + min(length, CHUNK_HEAD_BYTES_MAX)]
        first_ns, last_ns, size, _, name_length = CHUNK_FIELDS.unpack_from(head)
        if at + length > self._trusted:
            unpack_chunk(self._content[at : at + length], self._name)
            self._span = Span(self._book.offset, first_ns, last_ns)
        self._indexed = {}
        self._book.chunks.append(
            records.ChunkIndex(
                chunk_start_offset=self._book.offset,
                chunk_length=RECORD.size + length,
                compression=head[CHUNK_FIELDS.size : CHUNK_FIELDS.size + name_length].decode(),
                compressed_size=length - CHUNK_FIELDS.size - name_length - PLACE.size,
                uncompressed_size=size,
                message_start_time=first_ns,
                message_end_time=last_ns,
                message_index_offsets={},
                message_index_length=0,
            )
        )

    def _take_index(self, at: int, length: int) -> None:
        """Count a channel's messages of the last chunk."""
        channel, size = INDEX_FIELDS.unpack_from(self._content, at)
        last = self._book.chunks[-1]
        if size != length - INDEX_FIELDS.size or channel in last.message_index_offsets:
            raise ValueError(f"an index of {size} bytes for channel {channel}")
        if self._span is not None:
            self._span.take(self._content[at : at + length])
        self._indexed[channel] = size // (2 * PLACE.size)
        self._book.counts[channel] += self._indexed[channel]
        last.message_index_offsets[channel] = self._book.offset
        last.message_index_length += RECORD.size + length

    def _is_last_indexed(self) -> bool:
        """Whether the last chunk is whole, and all its indexes are there."""
        last, content = self._book.chunks[-1], self._content
        start, found = last.chunk_start_offset, {}
        try:
            for channel, at in last.message_index_offsets.items():
                _, length = RECORD.unpack_from(content, at)
                found[channel] = array("Q", content[at + RECORD.size + INDEX_FIELDS.size : at + RECORD.size + length])
            chunk = unpack_chunk(content[start + RECORD.size : start + last.chunk_length], self._name)
            return found == _indexes_of(chunk)
        except _DAMAGED:
            self._found.is_damaged = True
            return False

    def _drop_last_chunk(self) -> None:
        """Go back to before the last chunk."""
        book = self._book
        book.offset = book.chunks.pop().chunk_start_offset
        book.metadata = [metadata for metadata in book.metadata if metadata.offset < book.offset]
        for channel, count in self._indexed.items():
            book.counts[channel] -= count
        self._indexed = {}


def _indexes_of(chunk: bytes) -> dict[int, array[int]]:
    """Return the indexes of a chunk's messages, (time, place) each, by channel. Raises ValueError."""
    entries: dict[int, array[int]] = {}
    for opcode, start, _ in chunk_records(chunk):
        if opcode == Opcode.MESSAGE:
            channel, _, log_ns, _ = MESSAGE_FIELDS.unpack_from(chunk, start)
            entries.setdefault(channel, array("Q")).extend((log_ns, start - RECORD.size))
    return entries


def read_messages(source: ByteSource, book: Book, topics: Collection[str]) -> Iterator[Message]:
    """Yield the messages of some topics, chunk by chunk, by the indexes.

    Raises CaptureError for a chunk that is damaged: those that `scan` trusted may be.
    """
    named = {channel.id: channel.topic for channel in book.channels if channel.topic in topics}
    for index in book.chunks:
        if not named.keys() & index.message_index_offsets.keys():
            continue
        source.seek(index.chunk_start_offset + RECORD.size)
        place = f"byte {index.chunk_start_offset}"
        try:
            chunk = unpack_chunk(source.read(index.chunk_length - RECORD.size), place)
            for opcode, start, stop in chunk_records(chunk):
                channel, sequence, log_ns, publish_ns = MESSAGE_FIELDS.unpack_from(chunk, start)
                if opcode == Opcode.MESSAGE and channel in named:
                    data = chunk[start + MESSAGE_FIELDS.size : stop]
                    yield Message(named[channel], log_ns, publish_ns, sequence, data)
        except _DAMAGED as error:
            raise CaptureError(f"{place}: a damaged chunk, {error}") from None


def last_message(source: ByteSource, book: Book, topic: str, before_ns: int = sys.maxsize) -> Message | None:
    """Return the last message of a topic before a time; None when there is none. Raises CaptureError."""
    for index in reversed(book.chunks):
        if index.message_start_time < before_ns:
            found = read_messages(source, Book(channels=book.channels, chunks=[index]), {topic})
            last = [message for message in found if message.log_ns < before_ns]
            if last:
                return last[-1]
    return None


def _stream(content: bytes) -> ReadDataStream:
    return ReadDataStream(BytesIO(content))

"""The MCAP container: chunks of messages written quickly, records read with bounded memory.

The format is https://mcap.dev/spec. The `mcap` library serialises here whatever is rare (schemas, channels, indexes,
summary); messages and chunks are packed by this module, since the library's `add_message` costs several times what a
hub has for a packet. A file that ends in the middle of a record is an unfinished one, and everything before is read.
Neither half opens files. Neighbours: `mcap_scan` (to go on with an unfinished file), `capture_writer`,
`capture_reader`.
"""

from __future__ import annotations

import struct
import sys
from array import array
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from importlib.metadata import version
from io import BytesIO
from typing import BinaryIO, Final, Protocol
from zlib import crc32

import msgspec
import zstandard
from mcap import records
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode

from foosim.vhub.rows import CaptureError

MAGIC: Final = b"\x89MCAP0\r\n"
MESSAGE: Final = int(Opcode.MESSAGE)
CHUNK_BYTES_MAX: Final = 64 * 1024 * 1024
"""A reader refuses a larger chunk, or any larger record: its memory is bounded by one of them."""
LIBRARY: Final = f"foosim {version('foosim')}, mcap {version('mcap')}"
COMPRESSION: Final = "zstd"
COMPRESSION_LEVEL: Final = 1
_MESSAGE: Final = struct.Struct("<BQHIQQ")
MESSAGE_FIELDS: Final = struct.Struct("<HIQQ")
RECORD: Final = struct.Struct("<BQ")
_INDEX: Final = struct.Struct("<BQHI")
INDEX_FIELDS: Final = struct.Struct("<HI")
_CHUNK: Final = struct.Struct("<BQQQQII4sQ")
CHUNK_FIELDS: Final = struct.Struct("<QQQII")
CHUNK_HEAD_BYTES_MAX: Final = CHUNK_FIELDS.size + 64  # its fields, and the name of a compression
_FOOTER_START: Final = struct.Struct("<BQQQ")
PLACE: Final = struct.Struct("<Q")

assert sys.byteorder == "little", "indexes are written as the machine has them"


class Record(Protocol):
    """A record that the library serialises."""

    def write(self, stream: RecordBuilder) -> None: ...


# --- writing ---------------------------------------------------------------------------------------------------------


@dataclass(slots=True)
class Book:
    """What the summary of a file says in the end: kept while it is written, found again in one that has none."""

    offset: int = 0
    """How many bytes the file has."""
    schemas: list[records.Schema] = field(default_factory=list)
    channels: list[records.Channel] = field(default_factory=list)
    chunks: list[records.ChunkIndex] = field(default_factory=list)
    attachments: list[records.AttachmentIndex] = field(default_factory=list)
    metadata: list[records.MetadataIndex] = field(default_factory=list)
    counts: dict[int, int] = field(default_factory=dict)
    """Messages by channel."""
    start_ns: int = sys.maxsize
    end_ns: int = 0
    """Times of the first and the last message."""


class McapWriter:
    """Packs an MCAP file; `write` takes the bytes, in order. Messages are collected until `end_chunk`.

    With the `book` of an unfinished file (`mcap_scan`) it goes on behind what that one has.
    """

    def __init__(self, write: Callable[[bytes], None], profile: str, book: Book | None = None) -> None:
        self._write = write
        self._book = book or Book()
        self._compressor = zstandard.ZstdCompressor(level=COMPRESSION_LEVEL)
        self._chunk = bytearray()
        self._index: dict[int, array[int]] = {channel.id: array("Q") for channel in self._book.channels}
        if book is None:
            self._put(MAGIC)
            self._put_record(records.Header(profile, LIBRARY))

    @property
    def chunk_bytes(self) -> int:
        """How large the chunk is that is being collected."""
        return len(self._chunk)

    @property
    def offset(self) -> int:
        """How many bytes the file has."""
        return self._book.offset

    @property
    def messages(self) -> int:
        """How many messages are in chunks that have ended."""
        return sum(self._book.counts.values())

    def add_channel(self, topic: str, message_encoding: str, schema: tuple[str, str, bytes]) -> int:
        """Declare a topic with its schema (name, encoding, data) and return the channel's number."""
        number = len(self._book.channels) + 1
        name, encoding, data = schema
        self._book.schemas.append(records.Schema(id=number, name=name, encoding=encoding, data=data))
        self._book.channels.append(
            records.Channel(id=number, topic=topic, message_encoding=message_encoding, schema_id=number, metadata={})
        )
        self._put_record(self._book.schemas[-1])
        self._put_record(self._book.channels[-1])
        self._index[number] = array("Q")
        self._book.counts[number] = 0
        return number

    def add_attachment(self, name: str, media_type: str, data: bytes) -> None:
        """Attach a file; it has no times, so that equal runs attach equally."""
        offset = self._book.offset
        length = self._put_record(
            records.Attachment(create_time=0, log_time=0, name=name, media_type=media_type, data=data)
        )
        self._book.attachments.append(
            records.AttachmentIndex(
                offset=offset,
                length=length,
                create_time=0,
                log_time=0,
                data_size=len(data),
                name=name,
                media_type=media_type,
            )
        )

    def add_metadata(self, name: str, content: Mapping[str, str]) -> None:
        """Add a table of texts."""
        offset = self._book.offset
        length = self._put_record(records.Metadata(name=name, metadata=dict(content)))
        self._book.metadata.append(records.MetadataIndex(offset=offset, length=length, name=name))

    def add_message(self, channel: int, log_ns: int, publish_ns: int, sequence: int, data: bytes) -> None:
        """Add a message to the chunk. The hot path: see the bench before changing it."""
        chunk = self._chunk
        self._index[channel].extend((log_ns, len(chunk)))
        chunk += _MESSAGE.pack(Opcode.MESSAGE, 22 + len(data), channel, sequence, log_ns, publish_ns)
        chunk += data

    def end_chunk(self) -> None:
        """Compress and write what is collected, with its indexes; nothing if it is empty."""
        if not self._chunk:
            return
        chunk, size, offset = bytes(self._chunk), len(self._chunk), self._book.offset
        times = [entries[::2] for entries in self._index.values() if entries]
        first_ns, last_ns = min(map(min, times)), max(map(max, times))
        data = self._compressor.compress(chunk)
        name = COMPRESSION.encode()
        head = _CHUNK.pack(
            Opcode.CHUNK,
            _CHUNK.size - RECORD.size + len(data),
            first_ns,
            last_ns,
            size,
            crc32(chunk),
            len(name),
            name,
            len(data),
        )
        indexes, offsets = self._message_indexes(offset + len(head) + len(data))
        self._put(head + data + indexes)
        self._count()
        self._book.chunks.append(
            records.ChunkIndex(
                chunk_start_offset=offset,
                chunk_length=len(head) + len(data),
                compression=COMPRESSION,
                compressed_size=len(data),
                uncompressed_size=size,
                message_start_time=first_ns,
                message_end_time=last_ns,
                message_index_offsets=offsets,
                message_index_length=len(indexes),
            )
        )
        self._book.start_ns = min(self._book.start_ns, first_ns)
        self._book.end_ns = max(self._book.end_ns, last_ns)
        self._chunk.clear()

    def drop_chunk(self) -> int:
        """Forget what is collected; return how many messages it had."""
        dropped = sum(len(entries) // 2 for entries in self._index.values())
        self._chunk.clear()
        for entries in self._index.values():
            del entries[:]
        return dropped

    def mark(self) -> tuple[int, int]:
        """Return where the file is between two records, for `rewind`."""
        return self._book.offset, len(self._book.metadata)

    def rewind(self, mark: tuple[int, int]) -> None:
        """Forget metadata and the end that were written behind a mark; the caller cuts them off."""
        self._book.offset, count = mark
        del self._book.metadata[count:]

    @property
    def summary_bytes(self) -> int:
        """How large the end of the file becomes, at most."""
        book = self._book
        declared = sum(len(schema.data) + 256 for schema in book.schemas)
        described = 256 * (len(book.attachments) + len(book.metadata) + 4)
        return declared + described + len(book.chunks) * (96 + 10 * len(book.channels))

    def index_last_chunk(self, entries: Mapping[int, array[int]]) -> None:
        """Write the indexes of the last chunk, behind which the file was cut: (time, place) of the messages."""
        for channel, pairs in entries.items():
            self._index[channel].extend(pairs)
        indexes, offsets = self._message_indexes(self._book.offset)
        self._put(indexes)
        self._count()
        last = self._book.chunks[-1]
        last.message_index_offsets, last.message_index_length = offsets, len(indexes)

    def _message_indexes(self, offset: int) -> tuple[bytes, dict[int, int]]:
        """Return the chunk's message index records, to be written at `offset`, and where each channel's is."""
        parts: list[bytes] = []
        offsets = {}
        for channel, entries in self._index.items():
            if entries:
                offsets[channel] = offset
                content = entries.tobytes()
                parts.append(_INDEX.pack(Opcode.MESSAGE_INDEX, 6 + len(content), channel, len(content)) + content)
                offset += len(parts[-1])
        return b"".join(parts), offsets

    def _count(self) -> None:
        """Note that what is collected is written."""
        for channel, entries in self._index.items():
            self._book.counts[channel] += len(entries) // 2
            del entries[:]

    def finish(self) -> None:
        """Write the last chunk and the summary, which makes the file whole."""
        self.end_chunk()
        self._put_record(records.DataEnd(0))
        summary_start = self._book.offset
        groups: tuple[tuple[Opcode, list[Record]], ...] = (
            (Opcode.SCHEMA, [*self._book.schemas]),
            (Opcode.CHANNEL, [*self._book.channels]),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, [*self._book.chunks]),
            (Opcode.ATTACHMENT_INDEX, [*self._book.attachments]),
            (Opcode.METADATA_INDEX, [*self._book.metadata]),
        )
        summary = b""
        offsets: list[Record] = []
        for opcode, group in groups:
            content = b"".join(map(_serialised, group))
            if content:
                offsets.append(records.SummaryOffset(opcode, summary_start + len(summary), len(content)))
            summary += content
        offset_start = summary_start + len(summary)
        summary += b"".join(map(_serialised, offsets))
        checksum = crc32(_FOOTER_START.pack(Opcode.FOOTER, 20, summary_start, offset_start), crc32(summary))
        self._put(summary)
        self._put_record(records.Footer(summary_start, offset_start, checksum))
        self._put(MAGIC)

    def _statistics(self) -> records.Statistics:
        return records.Statistics(
            attachment_count=len(self._book.attachments),
            channel_count=len(self._book.channels),
            channel_message_counts=self._book.counts,
            chunk_count=len(self._book.chunks),
            message_count=self.messages,
            message_start_time=self._book.start_ns if self._book.chunks else 0,
            message_end_time=self._book.end_ns,
            metadata_count=len(self._book.metadata),
            schema_count=len(self._book.schemas),
        )

    def _put_record(self, record: Record) -> int:
        content = _serialised(record)
        self._put(content)
        return len(content)

    def _put(self, content: bytes) -> None:
        self._write(content)
        self._book.offset += len(content)


def _serialised(record: Record) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    content: bytes = builder.end()  # type: ignore[no-untyped-call]
    return content


# --- reading ---------------------------------------------------------------------------------------------------------


class Message(msgspec.Struct, frozen=True, gc=False):
    """One message of a topic."""

    topic: str
    log_ns: int
    publish_ns: int
    sequence: int
    data: bytes


Content = Message | records.Metadata | records.Attachment


class McapFile:
    """Reads an MCAP file from start to end. What is read of a file without an end stands in `unfinished_bytes`."""

    def __init__(
        self, stream: BinaryIO, size: int, name: str, since_ns: int = 0, topics: frozenset[str] | None = None
    ) -> None:
        """`topics`: messages of others are passed by; None: all are read.


        `since_ns`: chunks whose last message is before that are passed by, if the file declares its channels first.
        A hub's chunks are in the order of their last messages; what is wanted of them may still be before that time.
        """
        self._stream, self._size, self._name = stream, size, name
        self._since_ns, self._wanted = since_ns, topics
        self.repeats = False
        """Whether the first chunk only says again what was said in another file: then it is passed by."""
        self._at = 0
        self._topics: dict[int, str | None] = {}
        """By channel; None where its messages are passed by."""
        self.profile = self.library = ""
        self._ended = self.finished = False
        """Whether the file's end was reached, and was an end."""
        self.unfinished_bytes = 0
        """Bytes behind the last whole record of an unfinished file."""
        self.chunk_starts: array[int] = array("Q")
        self.end_ns = 0
        """Times of the first message of each chunk so far, and of the last of all, passed by or not."""

    def contents(self) -> Iterator[Content]:
        """Yield messages, metadata and attachments in the order of the file."""
        if self._stream.read(len(MAGIC)) != MAGIC:
            raise CaptureError(f"{self._name}: no MCAP file, it does not start with {MAGIC!r}")
        self._at = len(MAGIC)
        while not self._ended:
            record = self._next_record()
            if record is None:
                self._end_unfinished()
                return
            opcode, content = record
            try:
                yield from self._read(opcode, content)
            except (EndOfFile, struct.error, ValueError, zstandard.ZstdError) as error:
                raise self._damaged(str(error) or "it is too short") from None
            self._at += RECORD.size + len(content)

    def _damaged(self, what: str) -> CaptureError:
        return CaptureError(f"{self._name}: byte {self._at}: a damaged record, {what}")

    def _end_unfinished(self) -> None:
        """Stop at a record that the file does not hold; a file with an end has no such record."""
        self.unfinished_bytes = self._size - self._at
        self._stream.seek(max(0, self._size - len(MAGIC)))
        if self._stream.read(len(MAGIC)) == MAGIC and self.unfinished_bytes:
            raise self._damaged("it is longer than the file")

    def _end(self, rest: bytes) -> None:
        """Stop at the footer, behind which there is only `rest`."""
        if not MAGIC.startswith(rest):
            raise ValueError("the file does not end behind its footer")
        self._ended = True
        self.finished = rest == MAGIC
        self.unfinished_bytes = 0 if self.finished else len(rest)

    def _next_record(self) -> tuple[int, bytes] | None:
        """Return opcode and content of the next record, None where the file ends within it."""
        while True:
            head = self._stream.read(RECORD.size)
            if len(head) < RECORD.size:
                return None
            opcode, length = RECORD.unpack(head)
            if length > self._size - self._at - RECORD.size:
                return None
            if length > CHUNK_BYTES_MAX:
                raise CaptureError(
                    f"{self._name}: byte {self._at}: a record of {length} bytes, at most {CHUNK_BYTES_MAX} are read"
                )
            is_chunk = opcode == Opcode.CHUNK and length >= CHUNK_FIELDS.size
            content = self._stream.read(CHUNK_FIELDS.size if is_chunk else length)
            if is_chunk and not self._is_passed(content):
                content += self._stream.read(length - len(content))
            elif is_chunk:
                self._at += RECORD.size + length
                self._stream.seek(self._at)
                continue
            return (opcode, content) if len(content) == length else None

    def _is_passed(self, head: bytes) -> bool:
        """Take the times of a chunk, and return whether it is passed by."""
        if len(head) < CHUNK_FIELDS.size:  # the file became shorter while it was read
            return False
        if self.repeats and self._topics:
            self.repeats = False
            return True
        start_ns, end_ns, *_ = CHUNK_FIELDS.unpack(head)
        self.chunk_starts.append(start_ns)
        self.end_ns = max(self.end_ns, end_ns)
        return bool(self._topics) and end_ns < self._since_ns

    def _read(self, opcode: int, content: bytes) -> Iterator[Content]:
        if opcode == Opcode.CHUNK:
            yield from self._messages(unpack_chunk(content, f"{self._name}: byte {self._at}"))
        elif opcode == Opcode.MESSAGE:
            yield from self._messages(RECORD.pack(opcode, len(content)) + content)
        elif opcode == Opcode.CHANNEL:
            self._declare(content)
        elif opcode == Opcode.METADATA:
            yield records.Metadata.read(_stream(content))
        elif opcode == Opcode.ATTACHMENT:
            yield records.Attachment.read(_stream(content))
        elif opcode == Opcode.HEADER:
            header = records.Header.read(_stream(content))
            self.profile, self.library = header.profile, header.library
        elif opcode == Opcode.FOOTER:
            self._end(self._stream.read(len(MAGIC) + 1))

    def _declare(self, content: bytes) -> None:
        channel = records.Channel.read(_stream(content))
        is_wanted = self._wanted is None or channel.topic in self._wanted
        self._topics[channel.id] = channel.topic if is_wanted else None

    def _messages(self, chunk: bytes) -> Iterator[Message]:
        """Yield the messages of a chunk. The hot path of all readers: see the bench before changing it."""
        topics, head, fields, size = self._topics, RECORD.unpack_from, MESSAGE_FIELDS.unpack_from, MESSAGE_FIELDS.size
        at, end = 0, len(chunk)
        while at < end:
            opcode, length = head(chunk, at)
            start = at + RECORD.size
            at = start + length
            if at > end:
                raise ValueError(f"a record of {length} bytes in a chunk with {end - start} left")
            if opcode == MESSAGE:
                channel, sequence, log_ns, publish_ns = fields(chunk, start)
                if channel not in topics:
                    raise ValueError(f"a message of channel {channel}, which is not declared")
                topic = topics[channel]
                if topic is not None:
                    yield Message(topic, log_ns, publish_ns, sequence, chunk[start + size : at])
            elif opcode == Opcode.CHANNEL:
                self._declare(chunk[start:at])


def unpack_chunk(content: bytes, place: str) -> bytes:
    """Return the records of a chunk; what it would unpack to is bounded before it is unpacked.

    Raises ValueError for a damaged one, CaptureError for one that is too large.
    """
    _, _, size, checksum, name_length = CHUNK_FIELDS.unpack_from(content)
    at = CHUNK_FIELDS.size + name_length
    compression = content[CHUNK_FIELDS.size : at].decode()
    (length,) = PLACE.unpack_from(content, at)
    data = content[at + PLACE.size :]
    if size > CHUNK_BYTES_MAX:
        raise CaptureError(f"{place}: a chunk of {size} bytes, at most {CHUNK_BYTES_MAX} are read")
    if length != len(data):
        raise ValueError(f"a chunk of {length} bytes in a record with room for {len(data)}")
    if compression == COMPRESSION:
        data = zstandard.ZstdDecompressor().stream_reader(data).read(size + 1)
    elif compression:
        raise ValueError(f"compression {compression!r}, read are {COMPRESSION!r} and none")
    if len(data) != size:
        raise ValueError(f"a chunk that unpacks to {len(data)} bytes or more instead of {size}")
    if checksum and crc32(data) != checksum:
        raise ValueError("a chunk whose checksum is wrong")
    return data


def chunk_records(chunk: bytes) -> Iterator[tuple[int, int, int]]:
    """Yield opcode, start and stop of each record in an unpacked chunk. Raises ValueError for one that is cut."""
    at, end = 0, len(chunk)
    while at < end:
        opcode, length = RECORD.unpack_from(chunk, at)
        at += RECORD.size
        if length > end - at:
            raise ValueError(f"a record of {length} bytes in a chunk with {end - at} left")
        yield opcode, at, at + length
        at += length


def _stream(content: bytes) -> ReadDataStream:
    return ReadDataStream(BytesIO(content))

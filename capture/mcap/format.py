"""The MCAP container: its format, and records read with bounded memory.

The format is https://mcap.dev/spec. A file that ends in the middle of a record is an unfinished one, and everything
before is read; where a whole chunk follows, the record is a damaged one. Nothing here opens files.
"""

from __future__ import annotations

import struct
import sys
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from importlib.metadata import version
from io import BytesIO
from typing import BinaryIO, Final, Protocol
from zlib import crc32

import msgspec
import zstandard
from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode

from foosim.capture.mcap.checks import CHECKS, CaptureError, Described, Span, compare, read_attachment, read_metadata

MAGIC: Final = b"\x89MCAP0\r\n"
MESSAGE: Final = int(Opcode.MESSAGE)
CHUNK_BYTES_MAX: Final = 64 * 1024 * 1024
"""A reader refuses a larger chunk, or any larger record: its memory is bounded by one of them."""
LIBRARY: Final = f"foosim {version('foosim')}, mcap {version('mcap')}"
COMPRESSION: Final = "zstd"
MESSAGE_FIELDS: Final = struct.Struct("<HIQQ")
RECORD: Final = struct.Struct("<BQ")
INDEX_FIELDS: Final = struct.Struct("<HI")
CHUNK_FIELDS: Final = struct.Struct("<QQQII")
PLACE: Final = struct.Struct("<Q")
FOOTER_FIELDS: Final = struct.Struct("<QQI")
_CRC: Final = struct.Struct("<I")
IN_DATA: Final = frozenset(
    {
        *(Opcode.HEADER, Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE, Opcode.CHUNK, Opcode.MESSAGE_INDEX),
        *(Opcode.ATTACHMENT, Opcode.METADATA, Opcode.DATA_END),
    }
)
IN_SUMMARY: Final = frozenset(
    {
        *(Opcode.SCHEMA, Opcode.CHANNEL, Opcode.STATISTICS, Opcode.CHUNK_INDEX, Opcode.ATTACHMENT_INDEX),
        *(Opcode.METADATA_INDEX, Opcode.SUMMARY_OFFSET, Opcode.FOOTER),
    }
)
"""Records before the end of the data, and records after it; any other is damaged."""
_SEARCH_BYTES: Final = 1 << 20

assert sys.byteorder == "little", "indexes are written as the machine has them"


@dataclass(slots=True)
class Book:
    """The contents of a file's summary: collected while it is written, or read again from an unfinished file."""

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


class Message(msgspec.Struct, frozen=True, gc=False):
    """One message of a topic."""

    topic: str
    log_ns: int
    publish_ns: int
    sequence: int
    data: bytes


Content = Message | records.Metadata | records.Attachment


class Damaged(CaptureError):
    """Bytes that differ from the written ones."""


class ByteSource(Protocol):
    """A file that is open for reading, or a map of one."""

    def seek(self, place: int, /) -> object: ...

    def read(self, size: int, /) -> bytes: ...


class McapFile:
    """Reads an MCAP file from start to end. `unfinished_bytes` follow the last whole record."""

    def __init__(
        self, stream: BinaryIO, size: int, name: str, since_ns: int = 0, topics: frozenset[str] | None = None
    ) -> None:
        """`topics`: messages of others are passed by; None: all are read.

        `since_ns`: chunks whose last message is before that are passed by, if the file declares its channels first.
        A hub's chunks are in the order of their last messages; wanted messages may still be before that time.
        """
        self._stream, self._size, self._name = stream, size, name
        self._since_ns, self._wanted = since_ns, topics
        self.repeats = False
        """Whether the first chunk repeats the state of another file, and is skipped."""
        self.at = 0
        """The offset of the present record, or of the damaged one."""
        self._crc: int | None = 0
        """Of all bytes so far, in the summary of its bytes so far; None after skipped bytes."""
        self._known = IN_DATA
        self._described = Described()
        self._span: Span | None = None
        """Times of the last chunk."""
        self._topics: dict[int, str | None] = {}
        """By channel; None where its messages are passed by."""
        self.profile = self.library = ""
        self._ended = self.finished = False
        """Whether the file's end was reached, and whether it is a regular end."""
        self.unfinished_bytes = 0
        """Bytes after the last whole record of an unfinished file."""
        self.chunk_starts: array[int] = array("Q")
        self.end_ns = 0
        """Times of the first message of each chunk so far, and of the last of all, passed by or not."""

    def contents(self) -> Iterator[Content]:
        """Yield messages, metadata and attachments in the order of the file."""
        if self._stream.read(len(MAGIC)) != MAGIC:
            raise CaptureError(f"{self._name}: no MCAP file, it does not start as one")
        self.at = len(MAGIC)
        self._crc = crc32(MAGIC)
        while not self._ended:
            record = self._next_record()
            if record is None:
                return
            opcode, head, content = record
            try:
                self._check(opcode, content)
                yield from self._read(opcode, content)
            except (EndOfFile, struct.error, ValueError, zstandard.ZstdError) as error:
                raise self._damaged(str(error) or "it is too short") from None
            self.at += RECORD.size + len(content)
            if opcode != Opcode.DATA_END:
                self._sum(head, content)

    @property
    def is_checked(self) -> bool:
        """Whether the digests of the records before the messages are there, and right."""
        return self._described.is_checked

    def _damaged(self, what: str) -> Damaged:
        return Damaged(f"{self._name}: byte {self.at}: a damaged record, {what}")

    def _sum(self, head: bytes, content: bytes) -> None:
        if self._crc is not None:
            self._crc = crc32(content, crc32(head, self._crc))

    def _check(self, opcode: int, content: bytes) -> None:
        """Compare a record's digests with the bytes before it. Raises ValueError."""
        if opcode == Opcode.MESSAGE_INDEX:
            if self._span is not None:
                self._span.take(content)
            return
        span, self._span = self._span, None
        if span is not None:
            self._check_span(span)
        if opcode == Opcode.CHUNK:
            self._span = Span(self.at, *CHUNK_FIELDS.unpack_from(content)[:2])
        elif opcode == Opcode.DATA_END:
            data_crc, self._crc, self._known = self._crc, 0, IN_SUMMARY
            if data_crc is not None:
                self._compare_data(data_crc, *_CRC.unpack(content))
        elif opcode == Opcode.FOOTER and self._crc is not None:
            crc = crc32(content[: -_CRC.size], crc32(RECORD.pack(opcode, len(content)), self._crc))
            compare("the summary", crc, FOOTER_FIELDS.unpack(content)[2])

    def _compare_data(self, computed: int, written: int) -> None:
        try:
            compare(f"{self._name}: bytes 0 to {self.at}", computed, written)
        except ValueError as error:
            raise Damaged(f"{error}: a byte without another checksum is damaged") from None

    def _check_span(self, span: Span) -> None:
        """Compare the times of a chunk with its indexes. Raises Damaged."""
        try:
            span.check()
        except ValueError as error:
            self.at = span.at
            raise self._damaged(str(error)) from None

    def _end_unfinished(self, what: str) -> None:
        """Stop at a torn record, which no whole record follows."""
        self.unfinished_bytes = self._size - self.at
        self._stream.seek(max(0, self._size - len(MAGIC)))
        if self._stream.read(len(MAGIC)) == MAGIC and self.unfinished_bytes:
            raise self._damaged(what)
        following = next_chunk(self._stream, self.at + 1, self._size)
        if following is not None:
            raise self._damaged(f"{what}, and a whole chunk follows at byte {following}")

    def _end(self, rest: bytes) -> None:
        """Stop at the footer, after which there is only `rest`."""
        if not MAGIC.startswith(rest):
            raise ValueError("the file does not end after its footer")
        self._ended = True
        self.finished = rest == MAGIC
        self.unfinished_bytes = 0 if self.finished else len(rest)

    def _next_record(self) -> tuple[int, bytes, bytes] | None:
        """Return opcode, head and content of the next record, None where the file ends within it."""
        while True:
            head = self._stream.read(RECORD.size)
            if len(head) < RECORD.size:
                self._end_unfinished("it is longer than the file")
                return None
            opcode, length = RECORD.unpack(head)
            if length > self._size - self.at - RECORD.size:
                self._end_unfinished("it is longer than the file")
                return None
            if opcode not in self._known:
                self._end_unfinished(f"its kind is {opcode:#04x}, which none has here")
                return None
            if length > CHUNK_BYTES_MAX:
                raise CaptureError(
                    f"{self._name}: byte {self.at}: a record of {length} bytes, at most {CHUNK_BYTES_MAX} are read"
                )
            is_chunk = opcode == Opcode.CHUNK and length >= CHUNK_FIELDS.size
            content = self._stream.read(CHUNK_FIELDS.size if is_chunk else length)
            if is_chunk and not self._is_passed(content):
                content += self._stream.read(length - len(content))
            elif is_chunk:
                self._check_passed(content)
                self.at += RECORD.size + length
                self._stream.seek(self.at)
                continue
            return (opcode, head, content) if len(content) == length else None

    def _check_passed(self, head: bytes) -> None:
        """Check what can be checked of a chunk that is passed by: its times, by its indexes."""
        self._crc = None
        try:
            self._check(Opcode.CHUNK, head)
        except ValueError as error:
            raise self._damaged(str(error)) from None

    def _is_passed(self, head: bytes) -> bool:
        """Take the times of a chunk, and return whether it is passed by unread."""
        if len(head) < CHUNK_FIELDS.size:  # the file became shorter while it was read
            return False
        if self.repeats and self._topics:
            return False
        start_ns, end_ns, *_ = CHUNK_FIELDS.unpack(head)
        self.chunk_starts.append(start_ns)
        self.end_ns = max(self.end_ns, end_ns)
        return bool(self._topics) and end_ns < self._since_ns

    def _read(self, opcode: int, content: bytes) -> Iterator[Content]:
        if opcode == Opcode.CHUNK and self.repeats and self._topics:
            self.repeats = False
        elif opcode == Opcode.CHUNK:
            yield from self._messages(unpack_chunk(content, f"{self._name}: byte {self.at}"))
        elif opcode == Opcode.MESSAGE:
            raise ValueError("a message outside of a chunk, which no checksum covers")
        elif opcode == Opcode.CHANNEL:
            self._declare(content)
        elif opcode == Opcode.METADATA:
            metadata = read_metadata(content)
            if metadata.name == CHECKS:
                if self._crc is None:
                    raise ValueError(f"metadata {CHECKS!r} follow a chunk")
                self._described.check(metadata.metadata, self._crc)
            yield metadata
        elif opcode == Opcode.ATTACHMENT:
            attachment = read_attachment(content)
            self._described.take(attachment)
            yield attachment
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
                    raise ValueError(f"a message of channel {channel}, which is undeclared")
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


def next_chunk(stream: ByteSource, start: int, stop: int) -> int | None:
    """Return where the first whole chunk begins between two places of a file, by its checksum; None without one.

    The place in the file is beyond this afterwards.
    """
    mark = _CRC.pack(len(COMPRESSION)) + COMPRESSION.encode()
    before = RECORD.size + CHUNK_FIELDS.size - _CRC.size  # of a chunk's head, before this mark
    while start < stop:
        stream.seek(start)
        piece = stream.read(min(stop - start, _SEARCH_BYTES))
        at = piece.find(mark, before)
        while at >= 0:
            if _is_chunk(stream, start + at - before, stop):
                return start + at - before
            at = piece.find(mark, at + 1)
        if len(piece) < _SEARCH_BYTES:
            return None
        start += len(piece) - before - len(mark)  # a head may stand across the end of the piece
    return None


def _is_chunk(stream: ByteSource, at: int, stop: int) -> bool:
    stream.seek(at)
    opcode, length = RECORD.unpack(stream.read(RECORD.size))
    if opcode != Opcode.CHUNK or not CHUNK_FIELDS.size <= length <= min(CHUNK_BYTES_MAX, stop - at - RECORD.size):
        return False
    try:
        unpack_chunk(stream.read(length), "")
    except (struct.error, ValueError, zstandard.ZstdError, CaptureError):
        return False
    return True


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

"""Packs an MCAP file: messages quickly, into chunks.

The `mcap` library serialises here whatever is rare (schemas, channels, indexes, summary); messages and chunks are
packed by this module, since the library's `add_message` costs several times what a hub has for a packet. It opens no
files.
"""

from __future__ import annotations

import struct
from array import array
from collections.abc import Callable, Mapping
from typing import Final, Protocol
from zlib import crc32

import zstandard
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode

from foosim.capture.mcap.checks import CHECKS, Described, sealed
from foosim.capture.mcap.format import COMPRESSION, LIBRARY, MAGIC, MESSAGE, RECORD, Book

COMPRESSION_LEVEL: Final = 1
_MESSAGE: Final = struct.Struct("<BQHIQQ")
_INDEX: Final = struct.Struct("<BQHI")
_CHUNK: Final = struct.Struct("<BQQQQII4sQ")
_FOOTER_START: Final = struct.Struct("<BQQQ")


class Record(Protocol):
    """A record that the library serialises."""

    def write(self, stream: RecordBuilder) -> None: ...


class McapWriter:
    """Packs an MCAP file; `write` takes the bytes, in order. Messages are collected until `end_chunk`."""

    def __init__(self, write: Callable[[bytes], None], profile: str) -> None:
        self._write = write
        self._book = Book()
        self._crc = 0
        self._described = Described()
        self._compressor = zstandard.ZstdCompressor(level=COMPRESSION_LEVEL)
        self._chunk = bytearray()
        self._index: dict[int, list[int]] = {}
        """For each channel the log time and the place in the chunk of each message, alternating."""
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
        """Declare a topic with its schema (name, encoding, data) and return the channel's number.

        Topics of one schema share it.
        """
        number = len(self._book.channels) + 1
        schemas = self._book.schemas
        known = next((one.id for one in schemas if (one.name, one.encoding, one.data) == schema), None)
        if known is None:
            name, encoding, data = schema
            schemas.append(records.Schema(id=number, name=name, encoding=encoding, data=data))
            self._put_record(schemas[-1])
        schema_id = number if known is None else known
        self._book.channels.append(
            records.Channel(id=number, topic=topic, message_encoding=message_encoding, schema_id=schema_id, metadata={})
        )
        self._put_record(self._book.channels[-1])
        self._index[number] = []
        self._book.counts[number] = 0
        return number

    def add_attachment(self, name: str, media_type: str, data: bytes) -> None:
        """Attach a file; it has no times, so that equal runs attach equally."""
        offset = self._book.offset
        attachment = records.Attachment(create_time=0, log_time=0, name=name, media_type=media_type, data=data)
        length = self._put_record(attachment)
        self._described.take(attachment)
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
        """Add a table of texts, with its digest."""
        offset = self._book.offset
        length = self._put_record(records.Metadata(name=name, metadata=sealed(name, content)))
        self._book.metadata.append(records.MetadataIndex(offset=offset, length=length, name=name))

    def add_checks(self) -> None:
        """Add the digests of the attachments and the checksum of the file so far, once all of them are there."""
        self.add_metadata(CHECKS, self._described.entries(self._crc))

    def add_message(self, channel: int, log_ns: int, publish_ns: int, sequence: int, data: bytes) -> None:
        """Add a message to the chunk. The hot path: see the bench before changing it."""
        chunk, index = self._chunk, self._index[channel]
        index.append(log_ns)
        index.append(len(chunk))
        chunk += _MESSAGE.pack(MESSAGE, 22 + len(data), channel, sequence, log_ns, publish_ns)
        chunk += data

    def end_chunk(self) -> None:
        """Compress and write the collected messages, with their indexes; nothing without messages."""
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
        """Drop the collected messages; return their number."""
        dropped = sum(len(entries) // 2 for entries in self._index.values())
        self._chunk.clear()
        for entries in self._index.values():
            del entries[:]
        return dropped

    def mark(self) -> tuple[int, int, int]:
        """Return where the file is between two records, for `rewind`."""
        return self._book.offset, self._crc, len(self._book.metadata)

    def rewind(self, mark: tuple[int, int, int]) -> None:
        """Remove metadata and the end after a mark from the book; the caller cuts the file."""
        self._book.offset, self._crc, count = mark
        del self._book.metadata[count:]

    @property
    def summary_bytes(self) -> int:
        """How large the end of the file becomes, at most."""
        book = self._book
        declared = sum(len(schema.data) + 256 for schema in book.schemas)
        described = 256 * (len(book.attachments) + len(book.metadata) + 4)
        return declared + described + len(book.chunks) * (96 + 10 * len(book.channels))

    def _message_indexes(self, offset: int) -> tuple[bytes, dict[int, int]]:
        """Return the chunk's message index records, to be written at `offset`, and where each channel's is."""
        parts: list[bytes] = []
        offsets = {}
        for channel, entries in self._index.items():
            if entries:
                offsets[channel] = offset
                content = array("Q", entries).tobytes()
                parts.append(_INDEX.pack(Opcode.MESSAGE_INDEX, 6 + len(content), channel, len(content)) + content)
                offset += len(parts[-1])
        return b"".join(parts), offsets

    def _count(self) -> None:
        """Note that the collected messages are written."""
        for channel, entries in self._index.items():
            self._book.counts[channel] += len(entries) // 2
            del entries[:]

    def finish(self) -> None:
        """Write the last chunk and the summary, which makes the file whole."""
        self.end_chunk()
        self._put_record(records.DataEnd(self._crc))
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
        self._crc = crc32(content, self._crc)


def _serialised(record: Record) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    content: bytes = builder.end()  # type: ignore[no-untyped-call]
    return content

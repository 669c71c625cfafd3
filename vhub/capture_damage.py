"""What of a finished capture is damaged, and which of its ticks are whole: for people who have no other copy.

Readers refuse such a file at the first wrong byte. This walks over all of it, record by record, and where a length is
wrong from one whole chunk to the next. Neighbours: `mcap_file`, `mcap_checks` (what is compared), `capture_cut` (takes
out what is before the damage).
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import BinaryIO, Final
from zlib import crc32

import msgspec
import zstandard
from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode

from foosim.protocol.units import format_ns
from foosim.vhub.capture_parts import files_from
from foosim.vhub.capture_reader import TICK_MARKS, deployment_of, read_about
from foosim.vhub.mcap_checks import CHECKS, CaptureError, Described, Span, compare, read_attachment, read_metadata
from foosim.vhub.mcap_file import (
    CHUNK_BYTES_MAX,
    CHUNK_FIELDS,
    FOOTER_FIELDS,
    IN_DATA,
    IN_SUMMARY,
    MAGIC,
    MESSAGE_FIELDS,
    RECORD,
    chunk_records,
    next_chunk,
    unpack_chunk,
)
from foosim.vhub.rows import TICK

_DAMAGED: Final = (EndOfFile, struct.error, ValueError, zstandard.ZstdError, msgspec.DecodeError, CaptureError)
_CRC: Final = struct.Struct("<I")


@dataclass(frozen=True, slots=True)
class Broken:
    """Bytes of a file that are not what was written, and how that is known."""

    file: str
    byte: int
    bytes: int
    what: str

    def __str__(self) -> str:
        return f"{self.file}: byte {self.byte}, {self.bytes} bytes: {self.what}"


@dataclass(frozen=True, slots=True)
class Damage:
    """What is broken in a finished capture; `ticks` are the spans, first and last, whose rows of /tick are whole.

    `until_ns` is the simulated time up to which all is whole that `foosim-replay cut` needs; None where it needs more.
    """

    path: str
    broken: tuple[Broken, ...]
    ticks: tuple[tuple[int, int], ...]
    until_ns: int | None

    def __str__(self) -> str:
        lines = [f"capture {self.path} is finished and damaged; it is left as it is", *map(str, self.broken)]
        whole = " and ".join(f"{first} to {last}" for first, last in self.ticks)
        lost = sum(after[0] - before[1] - 1 for before, after in pairwise(self.ticks))
        lines.append(f"ticks {whole} are whole, {lost} between them are lost" if whole else "no tick is whole")
        if self.until_ns is not None:
            time = format_ns(self.until_ns).replace(" ", "")
            lines.append(f"what is before the damage: foosim-replay cut {self.path} --to {time} -o PART")
        return "\n  ".join(lines)


def damage_of(path: Path) -> Damage | None:
    """Return what is damaged in a capture that has its end; None where nothing is, or it has none.

    Raises CaptureError for a file that cannot be read.
    """
    try:
        files = files_from(path)
    except CaptureError:
        files = [path]
    if not _has_magic_end(files[-1]):
        return None
    walks = [_Walk(file) for file in files]
    broken = tuple(place for walk in walks for place in walk.broken)
    if not broken:
        return None
    ticks: list[tuple[int, int]] = []
    for tick in sorted({tick for walk in walks for tick in walk.ticks}):
        if ticks and tick == ticks[-1][1] + 1:
            ticks[-1] = ticks[-1][0], tick
        else:
            ticks.append((tick, tick))
    return Damage(str(path), broken, tuple(ticks), _until_ns(path, walks, ticks))


def _has_magic_end(path: Path) -> bool:
    """Whether a file ends as a finished one does."""
    try:
        with path.open("rb") as stream:
            stream.seek(max(0, path.stat().st_size - len(MAGIC)))
            return stream.read() == MAGIC
    except OSError as error:
        raise CaptureError(f"{path}: cannot be read, {error.strerror}") from None


def _until_ns(path: Path, walks: list[_Walk], ticks: list[tuple[int, int]]) -> int | None:
    """Return the time of the last tick that another whole one follows, before what is broken first."""
    first = next(walk for walk in walks if walk.broken)
    last = max((tick for walk in walks[: walks.index(first)] for tick in walk.ticks), default=-1)
    last = max(last, first.before)
    if not ticks or last <= ticks[0][0]:
        return None
    try:
        return (last - 1) * deployment_of(read_about(path)).tick_ns
    except CaptureError:
        return None


class _Walk:
    """One pass over one file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.broken: list[Broken] = []
        self.ticks: list[int] = []
        self.before = -1
        """The last tick before what is broken first."""
        self._channels: dict[int, str] = {}
        self._described = Described()
        self._span: Span | None = None
        self._crc = 0
        self._known = IN_DATA
        self._in_summary = False
        """Whether the end of the data is passed: the checksum is of the summary alone then."""
        try:
            with path.open("rb") as stream:
                self._go(stream, path.stat().st_size)
        except OSError as error:
            raise CaptureError(f"{path}: cannot be read, {error.strerror}") from None

    def _go(self, stream: BinaryIO, size: int) -> None:
        if stream.read(len(MAGIC)) != MAGIC:
            raise CaptureError(f"{self.path}: no MCAP file, it does not start as one")
        at, stop = len(MAGIC), size - len(MAGIC)
        self._crc = crc32(MAGIC)
        while at < stop:
            try:
                opcode, content = _record(stream, at, stop, self._known)
                following = at + RECORD.size + len(content)
                self._check_span(at, opcode)
                self._take(at, opcode, content)
            except _DAMAGED as error:
                following = self._following(stream, at, stop)
                self._note(at, following - at, str(error) or "it is too short")
            if self._known is IN_DATA or self._in_summary:
                self._sum(stream, at, following)
            self._in_summary = self._known is IN_SUMMARY
            at = following

    def _following(self, stream: BinaryIO, at: int, stop: int) -> int:
        """Return where reading goes on behind a broken record: at the next one, where its length leads to one."""
        stream.seek(at)
        head = stream.read(RECORD.size)
        if len(head) == RECORD.size:
            _, length = RECORD.unpack(head)
            following = at + RECORD.size + length
            if following == stop or (following < stop and self._is_record(stream, following, stop)):
                return int(following)
        chunk = next_chunk(stream, at + 1, stop)
        return stop if chunk is None else chunk

    def _is_record(self, stream: BinaryIO, at: int, stop: int) -> bool:
        try:
            _record(stream, at, stop, IN_DATA | IN_SUMMARY)
        except ValueError:
            return False
        return True

    def _note(self, at: int, size: int, what: str) -> None:
        if not self.broken:
            self.before = self.ticks[-1] if self.ticks else -1
        self.broken.append(Broken(str(self.path), at, size, what))
        self._span = None

    def _sum(self, stream: BinaryIO, at: int, stop: int) -> None:
        stream.seek(at)
        while at < stop and (piece := stream.read(min(stop - at, 1 << 20))):
            self._crc = crc32(piece, self._crc)
            at += len(piece)

    def _check_span(self, at: int, opcode: int) -> None:
        """Behind the indexes of a chunk, compare its times with them; its rows are whole all the same."""
        span = self._span
        if span is None or opcode == Opcode.MESSAGE_INDEX:
            return
        self._span = None
        try:
            span.check()
        except ValueError as error:
            self._note(span.at, at - span.at, str(error))

    def _take(self, at: int, opcode: int, content: bytes) -> None:
        """Compare one record with what is known of it. Raises what `_DAMAGED` names."""
        if opcode == Opcode.MESSAGE_INDEX:
            if self._span is not None:
                self._span.take(content)
            return
        if opcode == Opcode.CHUNK:
            self._span = Span(at, *CHUNK_FIELDS.unpack_from(content)[:2])
            self._take_chunk(unpack_chunk(content, "it"))
        elif opcode == Opcode.CHANNEL and self._known is IN_DATA:
            channel = records.Channel.read(_stream(content))
            self._channels[channel.id] = channel.topic
        elif opcode == Opcode.ATTACHMENT:
            self._described.take(read_attachment(content))
        elif opcode == Opcode.METADATA:
            metadata = read_metadata(content)
            if metadata.name == CHECKS and not self.broken:
                self._described.check(metadata.metadata, self._crc)
        elif opcode == Opcode.DATA_END:
            self._known = IN_SUMMARY
            data_crc, self._crc = self._crc, 0
            if not self.broken:
                compare("all before it", data_crc, *_CRC.unpack(content))
        elif opcode == Opcode.FOOTER:
            crc = crc32(content[: -_CRC.size], crc32(RECORD.pack(opcode, len(content)), self._crc))
            compare("the summary", crc, FOOTER_FIELDS.unpack(content)[2])

    def _take_chunk(self, chunk: bytes) -> None:
        ticks = []
        for opcode, start, stop in chunk_records(chunk):
            if opcode == Opcode.MESSAGE:
                channel = MESSAGE_FIELDS.unpack_from(chunk, start)[0]
                if self._channels.get(channel) == TICK:
                    ticks.append(TICK_MARKS.decode(chunk[start + MESSAGE_FIELDS.size : stop]).tick)
        self.ticks += ticks


def _record(stream: BinaryIO, at: int, stop: int, known: frozenset[Opcode]) -> tuple[int, bytes]:
    """Return kind and content of the record at a byte. Raises ValueError where none is."""
    stream.seek(at)
    head = stream.read(RECORD.size)
    if len(head) < RECORD.size:
        raise ValueError("a record that is cut")
    opcode, length = RECORD.unpack(head)
    if opcode not in known:
        raise ValueError(f"a record of the kind {opcode:#04x}, which none has here")
    if length > min(stop - at - RECORD.size, CHUNK_BYTES_MAX):
        raise ValueError("a record that is longer than the file")
    return opcode, stream.read(length)


def _stream(content: bytes) -> ReadDataStream:
    return ReadDataStream(BytesIO(content))

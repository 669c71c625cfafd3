"""The files of one capture: their names, which of them belong together, and all of them read as one.

`run.mcap` continues in `run_0001.mcap`, `run_0002.mcap` and so on, by size, by time, or because its writer was started
again. Each can be read by itself: it has the description of the run, and its first chunk repeats the state at its first
frame; a reader that comes from the file before skips that chunk. A reader reads the given file and all that follow.
"""

from __future__ import annotations

import os
import re
import struct
from array import array
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, Final, NamedTuple
from zlib import crc32

from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode

from foosim.capture.mcap.checks import CHECKS, CaptureError, compare, read_metadata
from foosim.capture.mcap.format import MAGIC, RECORD, Content, Damaged, McapFile, Message, chunk_records

FOOTER: Final = struct.Struct("<BQQQI8s")
"""The last record of an MCAP file, and the magic bytes after it."""
_AFTER_FOOTER: Final = 4 + len(MAGIC)
"""Its checksum, which is over the bytes before it, and the magic bytes."""
METADATA: Final = "foosim"
END_METADATA: Final = "foosim.end"
PART, AFTER, LAST = "part", "part_after", "last"
"""Entries of the metadata `foosim` of a file of several: its number from 0, the file before, and the time that is kept
where only the last is."""
AFTER_BYTES: Final = "part_after_bytes"
"""Entry of a file that a restarted writer began: the bytes that count of the file before, which lacks its end."""
ORIGIN, ORIGIN_TICK, ORIGIN_DIGEST, ORIGIN_CHAIN = "from", "from_tick", "from_digest", "from_chain"
"""Where the run of a capture began, when not with frame 0: entries of the metadata `foosim`."""
NEXT: Final = "continues_in"
"""The next file: an entry of the metadata `foosim.end`."""
FAILED_RUN: Final = "failed"
"""An entry there where the run failed."""


def part_path(path: Path, number: int) -> Path:
    """Return where the file of a number is of the capture that begins at `path`."""
    return path.with_name(f"{path.stem}_{number:04d}{path.suffix}") if number else path


def first_path(path: Path, number: int) -> Path | None:
    """Return where the capture begins whose file of this number is at `path`; None when it is called otherwise."""
    if not number:
        return path
    ending = f"_{number:04d}"
    stem = path.stem.removesuffix(ending)
    return path.with_name(stem + path.suffix) if stem and stem != path.stem else None


def parts_at(path: Path) -> dict[int, Path]:
    """Return the files named as parts of the capture that begins at `path`, by their number, ascending."""
    form = re.compile(rf"{re.escape(path.stem)}_(\d{{4,}}){re.escape(path.suffix)}")
    found = {0: path} if os.path.lexists(path) else {}
    try:
        names = os.listdir(path.parent)
    except OSError:
        names = []
    for name in names:
        match = form.fullmatch(name)
        if match is not None and part_path(path, number := int(match[1])).name == name and number:
            found[number] = path.with_name(name)
    return dict(sorted(found.items()))


def first_there(path: Path) -> Path:
    """Return the first file of the capture that begins at `path`; one that keeps its last alone lets files go."""
    return next(iter(parts_at(path).values()), path)


class Part(NamedTuple):
    """One of the files, and its bytes that count, None where all do."""

    path: Path
    stop: int | None


@contextmanager
def opened(path: Path, stop: int | None = None) -> Iterator[tuple[BinaryIO, int]]:
    """Give a file to read, and its size in bytes, `stop` where that is given.

    Raises CaptureError where it cannot be read, or is shorter.
    """
    try:
        with path.open("rb") as stream:
            size = path.stat().st_size
            if stop is not None and size < stop:
                raise CaptureError(f"{path}: ends at byte {size}, the next file continues at byte {stop}")
            yield stream, size if stop is None else stop
    except OSError as error:
        raise CaptureError(f"{path}: cannot be read, {error.strerror}") from None


def head_of(path: Path) -> dict[str, str]:
    """Return the metadata at a file's beginning; empty where its description is cut. Raises CaptureError."""
    head: dict[str, str] = {}
    with opened(path) as (stream, size):
        for content in McapFile(stream, size, str(path)).contents() if size >= len(MAGIC) else ():
            if isinstance(content, Message) or (isinstance(content, records.Metadata) and content.name == CHECKS):
                return head
            if isinstance(content, records.Metadata) and content.name == METADATA:
                head = content.metadata
    return {}


def number_of(path: Path, head: dict[str, str], entry: str = PART) -> int:
    """Return an integer of a file's metadata. Raises CaptureError when it is none."""
    text = head[entry]
    if not (text.isascii() and text.isdigit() and len(text) < 19):
        raise CaptureError(f"{path}: its {entry} is no number, {text!r}")
    return int(text)


def whole_path(path: Path) -> Path:
    """Return where the capture begins that a file is of. Raises CaptureError when it cannot be read."""
    head = head_of(path) if path.exists() else {}
    return first_path(path, number_of(path, head)) or path if PART in head else path


def files_from(path: Path) -> list[Path]:
    """Return a file and the ones that follow, as `parts_from` does."""
    return [part.path for part in parts_from(path)]


def parts_from(path: Path) -> list[Part]:
    """Return a file and the ones that follow. If the first was removed (`capture.last`), the first that is left.

    Raises CaptureError when one of them is missing, or is of another run.
    """
    if not os.path.lexists(path) and (kept := parts_at(path)):
        path, missing = next(iter(kept.values())), path
        if LAST not in head_of(path):
            raise CaptureError(f"{missing}: is missing, {path.name} follows it")
    head = head_of(path)
    number = number_of(path, head) if PART in head else 0
    first = first_path(path, number)
    following = {} if first is None else {at: file for at, file in parts_at(first).items() if at > number}
    if following and PART not in head and has_end(path):  # others of like names
        following = {}
    parts = [Part(path, None)]
    for at, file in following.items():
        other = head_of(file)
        if not other and at == max(following):  # it was just begun
            break
        is_next = other.get("run") == head.get("run") and other.get(PART) == str(at)
        if not is_next and PART not in head and len(parts) == 1:
            break
        assert first is not None
        if at != number + len(parts):
            raise CaptureError(f"{part_path(first, number + len(parts))}: is missing, {file.name} follows it")
        if not is_next:
            raise CaptureError(f"{file}: does not follow {parts[-1].path.name}: it is of another run, or another part")
        if AFTER_BYTES in other:
            parts[-1] = Part(parts[-1].path, number_of(file, other, AFTER_BYTES))
        parts.append(Part(file, None))
    return parts


def end_of(path: Path) -> dict[str, str] | None:
    """Return the metadata at a file's end, by its summary; None for an unfinished file. Raises CaptureError."""
    try:
        with opened(path) as (stream, size):
            footer = size - FOOTER.size
            stream.seek(max(0, footer))
            tail = stream.read(FOOTER.size)
            if len(tail) < FOOTER.size or not tail.endswith(MAGIC):
                return None
            opcode, _, start, _, written, _ = FOOTER.unpack(tail)
            if opcode != Opcode.FOOTER or start > footer:
                raise ValueError("it does not end with a footer")
            stream.seek(start)
            summary = stream.read(footer - start) if start else b""
            compare("all of it", crc32(tail[:-_AFTER_FOOTER], crc32(summary)), written)
            return _end_in(stream, summary, size)
    except (EndOfFile, struct.error, ValueError) as error:
        raise Damaged(f"{path}: a damaged summary, {error}") from None


def has_end(last: Path) -> bool:
    """Whether a capture has its end, which is in its last file. Raises CaptureError."""
    end = end_of(last)
    return end is not None and NEXT not in end


def is_complete(first: Path) -> bool:
    """Whether there is a capture that begins at `first`, and it has its end; not where that cannot be read."""
    files = parts_at(first)
    try:
        return bool(files) and has_end(files[max(files)])
    except CaptureError:
        return False


def _end_in(stream: BinaryIO, summary: bytes, size: int) -> dict[str, str]:
    for opcode, start, stop in chunk_records(summary):
        if opcode != Opcode.METADATA_INDEX:
            continue
        index = records.MetadataIndex.read(ReadDataStream(BytesIO(summary[start:stop])))
        if index.name == END_METADATA:
            if not RECORD.size <= index.length <= size - index.offset:
                raise ValueError(f"metadata of {index.length} bytes at byte {index.offset}")
            stream.seek(index.offset + RECORD.size)
            content = stream.read(index.length - RECORD.size)
            return read_metadata(content).metadata
    return {}


class Joined:
    """Reads a file and the next ones as one MCAP file, from start to end; else as `McapFile` does."""

    def __init__(self, path: Path, since_ns: int = 0, topics: frozenset[str] | None = None) -> None:
        """`since_ns`: chunks from long before that time are skipped, if possible; so are other topics."""
        self.finished = False
        """Whether the last of them has an end."""
        self.unfinished_bytes = 0
        self.chunk_starts: array[int] = array("Q")
        self.end_ns = 0
        """Times of the first message of each chunk so far, and of the last of all, passed by or not."""
        self._path = path
        self._since_ns = since_ns
        self._topics = topics
        self._first: McapFile | None = None

    @property
    def profile(self) -> str:
        return "" if self._first is None else self._first.profile

    @property
    def is_checked(self) -> bool:
        """Whether the first file has the digests of the records before its messages, and they are right."""
        return self._first is not None and self._first.is_checked

    @property
    def library(self) -> str:
        return "" if self._first is None else self._first.library

    def contents(self) -> Iterator[Content]:
        """Yield the messages of all files, metadata and attachments of the first one, and the end of the last."""
        parts = parts_from(self._path)
        if len(parts) == 1:
            yield from self._read(parts[0])
            return
        before, end, has_end = parts[0].path, None, True
        for part in parts:
            is_behind, end = part is not parts[0], None
            for content in self._read(part):
                if isinstance(content, records.Metadata) and content.name == END_METADATA:
                    end = content
                elif not is_behind:
                    yield content
                elif isinstance(content, Message):
                    if not has_end:
                        raise CaptureError(f"{before}: it has no end, and {part.path.name} follows it")
                    yield content
            before, has_end = part.path, end is not None or part.stop is not None
        if end is not None:
            yield end

    def _read(self, part: Part) -> Iterator[Content]:
        path = part.path
        with opened(path, part.stop) as (stream, size):
            is_behind = self._first is not None
            file = McapFile(stream, size, str(path), self._since_ns, self._topics)
            file.repeats = is_behind
            file.chunk_starts = self.chunk_starts
            self._first = self._first or file
            yield from file.contents()
            if is_behind and file.chunk_starts and not file.is_checked:
                raise CaptureError(f"{path}: it lacks its metadata {CHECKS!r}")
            if part.stop is not None and file.unfinished_bytes:
                raise Damaged(f"{path}: byte {file.at}: a damaged record, it is longer than the file")
        self.finished, self.unfinished_bytes = file.finished, file.unfinished_bytes
        self.end_ns = max(self.end_ns, file.end_ns)

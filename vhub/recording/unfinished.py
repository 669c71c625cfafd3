"""Reads an unfinished capture's file: how far it is, and where a writer resumes it."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from mmap import ACCESS_READ, mmap
from pathlib import Path

from foosim.capture.mcap.checks import CaptureError
from foosim.capture.mcap.format import Book
from foosim.capture.mcap.scan import UNSYNCED_BYTES, Scanned, last_message, scan
from foosim.capture.parts import END_METADATA, METADATA, NEXT
from foosim.capture.rows import EPOCHS, FRAME, PACKETS, TICK
from foosim.common.errors import Malformed
from foosim.common.json_text import decode_json
from foosim.vhub.network.packet import IN_FLIGHT


@dataclass(slots=True)
class Progress:
    """How far a file is. What is -1 has not been written."""

    tick: int = -1
    """The last tick with a row of its own."""
    frame: int = -1
    epoch: int = -1
    in_flight: bool = False
    """Whether the packets in flight at the end of the run are written."""


@dataclass(frozen=True, slots=True)
class Left:
    """An unfinished file: its contents, how far it is, and where it is truncated to resume (`book.offset`)."""

    path: Path
    found: Scanned
    done: Progress
    torn_bytes: int


def look(file: int, path: Path) -> Left:
    """Read an open file. Raises CaptureError for a finished file without a next one."""
    size = os.fstat(file).st_size
    found, done = Scanned(Book(), size), Progress()
    if size:
        with mmap(file, size, access=ACCESS_READ) as content:
            found = scan(content, str(path), size - UNSYNCED_BYTES)
            done = progress(lambda topic: getattr(last_message(content, found.book, topic), "data", b""))
    torn_bytes = found.torn_bytes
    if found.finished:
        if NEXT not in found.metadata.get(END_METADATA, {}):
            raise CaptureError(f"{path}: is finished; a capture is never overwritten")
        found.book.offset, torn_bytes = found.book.metadata.pop().offset, 0  # resumed here instead of in the next file
    return Left(path, found, done, torn_bytes)


def run_of(left: Left) -> str | None:
    """Return the run of a file; None where its metadata has none."""
    return left.found.metadata.get(METADATA, {}).get("run")


def progress(last: Callable[[str], bytes]) -> Progress:
    """Return how far a file is, by the last row of each topic, which is empty where there is none."""
    in_flight = _row(last(PACKETS)).get("fate") == IN_FLIGHT
    return Progress(
        _number(last(TICK), "tick"), _number(last(FRAME), "tick"), _number(last(EPOCHS), "epoch"), in_flight
    )


def _row(data: bytes) -> dict[str, object]:
    try:
        row = decode_json(data)
    except Malformed:
        return {}
    return row if isinstance(row, dict) else {}


def _number(data: bytes, field: str) -> int:
    number = _row(data).get(field, -1)
    return number if isinstance(number, int) else -1

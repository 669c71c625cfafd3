"""What a writer that ended uncleanly left of a capture's file: how far it is, and where to go on with it.

Everything up to the last whole chunk stays. Bytes that are damaged, not just cut, and what is further than the journal,
are given up only where the journal has it.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from mmap import ACCESS_READ, mmap
from pathlib import Path

from foosim.capture.mcap.checks import CaptureError
from foosim.capture.mcap.repair import NOTHING, UNSYNCED_BYTES, Scanned, Void, scan
from foosim.capture.parts import END_METADATA, METADATA, NEXT
from foosim.capture.rows import EPOCHS, FRAME, PACKETS, TICK
from foosim.common.errors import Malformed
from foosim.common.json_text import decode_json
from foosim.vhub.network.packet import IN_FLIGHT
from foosim.vhub.state.resume import Captured


@dataclass(slots=True)
class Progress:
    """How far a file is. What is -1 has not been written."""

    tick: int = -1
    """The last tick with a row of its own."""
    frame: int = -1
    epoch: int = -1
    in_flight: bool = False
    """Whether what was in flight at the end of the run is written."""


@dataclass(frozen=True, slots=True)
class Journalled:
    """What a journal has: all ticks from `tick` on. `end`, when there is one, is its last tick and epoch.

    `at_once`: a run waits, and what was synced long ago is not looked through.
    """

    tick: int
    end: Captured | None = None
    at_once: bool = False


@dataclass(frozen=True, slots=True)
class Left:
    """One file that was left: what it holds, how far it is, and where it is cut to go on (`book.offset`)."""

    path: Path
    found: Scanned
    done: Progress
    torn_bytes: int

    @property
    def problem(self) -> str:
        """Why bytes behind the last whole chunk cannot just be cut off; empty where they can."""
        if self.found.is_cut:
            return ""
        why = "damaged" if not self.found.is_void else "further than its journal, whose end is lost"
        return f"{self.path}: byte {self.found.book.offset}: {why}; {self.torn_bytes} bytes from there on would be lost"


def look(file: int, path: Path, tick_ns: int, journal: Journalled) -> Left:
    """Return what an open file holds. Raises CaptureError when it has its end, which is not that it goes on elsewhere.

    The place in the file is somewhere else behind this.
    """
    void = None if journal.end is None else _behind(journal.end, tick_ns)
    size = os.fstat(file).st_size
    with os.fdopen(os.dup(file), "rb") as stream:
        if journal.at_once and size > UNSYNCED_BYTES:
            with mmap(file, size - UNSYNCED_BYTES, access=ACCESS_READ) as old, memoryview(old) as trusted:
                found = scan(stream, size, str(path), trusted, void)
        else:
            found = scan(stream, size, str(path), NOTHING, void)
    torn_bytes = found.torn_bytes
    if found.finished:
        if NEXT not in found.metadata.get(END_METADATA, {}):
            raise CaptureError(f"{path}: is finished; a capture is never overwritten")
        found.book.offset, torn_bytes = found.book.metadata.pop().offset, 0  # it goes on here instead
    return Left(path, found, _progress(found), torn_bytes)


def run_of(left: Left) -> str | None:
    """Return the run that a file is of; None where it does not say."""
    return left.found.metadata.get(METADATA, {}).get("run")


def _behind(end: Captured, tick_ns: int) -> Void:
    """Return what a capture has behind the end of a journal."""
    fields = {TICK: ("tick", end.tick), EPOCHS: ("epoch", end.epoch)}

    def is_void(topic: str, data: bytes) -> bool:
        name, last = fields[topic]
        return _number(data, name) > last

    return Void(tuple(fields), max(0, end.tick) * tick_ns, is_void)


def _progress(found: Scanned) -> Progress:
    """Return how far a file is, by the last rows of its topics."""
    return Progress(
        _last_number(found, TICK, "tick"),
        _last_number(found, FRAME, "tick"),
        _last_number(found, EPOCHS, "epoch"),
        _last_row(found, PACKETS).get("fate") == IN_FLIGHT,
    )


def _last_row(found: Scanned, topic: str) -> dict[str, object]:
    return _row(found.last.get(topic, b"{}"))


def _row(data: bytes) -> dict[str, object]:
    try:
        row = decode_json(data)
    except Malformed:
        return {}
    return row if isinstance(row, dict) else {}


def _last_number(found: Scanned, topic: str, field: str) -> int:
    return _number(found.last.get(topic, b"{}"), field)


def _number(data: bytes, field: str) -> int:
    number = _row(data).get(field, -1)
    return number if isinstance(number, int) else -1

"""The bytes of a journal: a file's head, its records, and what tells a torn end from damage.

A file begins with its head: which opening of the journal it is of, on which start of the machine, and its number. A
record has a checksum over its payload, its place, the opening and a *mark*: up to where, when it was appended, all was
known to be on the disk. So bytes of another place or another journal are no record.

A record that is bad ends a journal only if nothing says that it was whole once. A killed process leaves the last record
cut. A machine that loses its power may lose any pages that were not synced, also some in front of others that it kept.
So a whole record behind a bad one tells: on the same start of the machine nothing was lost, the bad one is damaged; on
another, it is damaged if the mark is behind it.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import blake2b
from typing import Final, Self
from zlib import crc32

SIGNATURE: Final = b"foosim journal 2\n"
_HEAD: Final = struct.Struct("<8s8sII")
HEAD_BYTES: Final = len(SIGNATURE) + _HEAD.size
_FRAMING: Final = struct.Struct("<8sIIII")
FRAMING_BYTES: Final = _FRAMING.size
_PLACED: Final = struct.Struct("<8sIIIII")

Place = tuple[int, int]
"""A file's number, and a byte in it; what is further is greater."""


@dataclass(frozen=True, slots=True)
class Head:
    """What a file begins with. `opening` is random, `machine` a hash of the start of the machine; none is zeros."""

    opening: bytes
    machine: bytes
    serial: int

    def pack(self) -> bytes:
        fields = self.opening, self.machine, self.serial
        return SIGNATURE + _HEAD.pack(*fields, crc32(_HEAD.pack(*fields, 0)))

    @classmethod
    def unpack(cls, start: bytes) -> Self | None:
        """Return the head that a file begins with; None when it is damaged."""
        opening, machine, serial, checksum = _HEAD.unpack_from(start, len(SIGNATURE))
        return cls(opening, machine, serial) if crc32(_HEAD.pack(opening, machine, serial, 0)) == checksum else None


def machine_hash(start: str) -> bytes:
    """Return the hash of a start of a machine by its name, which may be empty."""
    return blake2b(start.encode(), digest_size=8).digest() if start else bytes(8)


def pack_record(head: Head, at: int, synced: Place, payload: bytes) -> bytes:
    """Return a record, to stand at a byte of the file with that head; all up to `synced` is on the disk."""
    length = len(payload)
    return _FRAMING.pack(head.opening, *synced, length, _checksum(head, at, synced, payload)) + payload


def _checksum(head: Head, at: int, synced: Place, payload: bytes | memoryview) -> int:
    """CRC of all that a record says; a run of zeros, as some file systems leave after a crash, has no opening."""
    return crc32(payload, crc32(_PLACED.pack(head.opening, head.serial, at, *synced, len(payload))))


def record_bytes(framing: bytes) -> int:
    """Return how long the payload behind a framing says it is; 0 for one that is cut."""
    return int(_FRAMING.unpack(framing)[3]) if len(framing) == FRAMING_BYTES else 0


@dataclass(frozen=True, slots=True)
class Whole:
    """A whole record: where its payload is in what was looked at, and its mark."""

    start: int
    stop: int
    synced: Place


def whole_record(head: Head, content: bytes | memoryview, at: int, offset: int = 0) -> Whole | None:
    """Return the record at a byte of a file, of which `content` is what stands from `offset` on; None for a bad one."""
    start = at - offset + FRAMING_BYTES
    if start > len(content):
        return None
    opening, serial, byte, length, checksum = _FRAMING.unpack_from(content, start - FRAMING_BYTES)
    if opening != head.opening or length > len(content) - start:
        return None
    payload = memoryview(content)[start : start + length]
    if _checksum(head, at, (serial, byte), payload) != checksum:
        return None
    return Whole(start, start + length, (serial, byte))


def whole_records(head: Head, content: bytes, at: int) -> Iterator[Whole]:
    """Yield the whole records of a file from a byte on, wherever they stand; `content` is the whole file."""
    while (at := content.find(head.opening, at)) >= 0:
        found = whole_record(head, content, at)
        if found is not None:
            yield found
        at = at + 1 if found is None else found.stop


def is_damage(same_machine: bool, bad: Place, behind: Iterator[Whole]) -> int:
    """Return how many of the whole records behind a bad one say that it was whole once; 0: the journal ends there."""
    marks = [whole.synced for whole in behind]
    return len(marks) if marks and (same_machine or max(marks) > bad) else 0

"""The bytes of a journal: a file's head, its records, and the distinction of a torn end from damage.

A file begins with its head: the opening of the journal, the boot of the machine, and the number of the file. A record
has a checksum over its payload, its position, the opening and a *mark*: the position up to which, when it was appended,
everything was known to be on the disk. So bytes of another position or another journal are no valid record.

An invalid record ends a journal unless it was valid once. A killed process leaves the last record cut. A machine that
loses power may lose any pages that were not synced, also some before others that it kept. So a valid record after an
invalid one decides: on the same boot nothing was lost, and the invalid one is damaged; on another boot, it is damaged
if the mark is after it.
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
"""A position: the number of a file, and a byte in it."""


@dataclass(frozen=True, slots=True)
class Head:
    """The head of a file. `opening` is random, `machine` a hash of the boot of the machine, or zeros."""

    opening: bytes
    machine: bytes
    serial: int

    def pack(self) -> bytes:
        fields = self.opening, self.machine, self.serial
        return SIGNATURE + _HEAD.pack(*fields, crc32(_HEAD.pack(*fields, 0)))

    @classmethod
    def unpack(cls, start: bytes) -> Self | None:
        """Return the head of a file; None when it is damaged."""
        opening, machine, serial, checksum = _HEAD.unpack_from(start, len(SIGNATURE))
        return cls(opening, machine, serial) if crc32(_HEAD.pack(opening, machine, serial, 0)) == checksum else None


def machine_hash(start: str) -> bytes:
    """Return the hash of a boot of a machine by its name, which may be empty."""
    return blake2b(start.encode(), digest_size=8).digest() if start else bytes(8)


def pack_record(head: Head, at: int, synced: Place, payload: bytes) -> bytes:
    """Return a record for a byte of the file with that head; everything up to `synced` is on the disk."""
    length = len(payload)
    return _FRAMING.pack(head.opening, *synced, length, _checksum(head, at, synced, payload)) + payload


def _checksum(head: Head, at: int, synced: Place, payload: bytes | memoryview) -> int:
    """Return the CRC of a record; a run of zeros, as some file systems leave after a crash, has no opening."""
    return crc32(payload, crc32(_PLACED.pack(head.opening, head.serial, at, *synced, len(payload))))


def record_bytes(framing: bytes) -> int:
    """Return the length of the payload in a framing; 0 for a cut one."""
    return int(_FRAMING.unpack(framing)[3]) if len(framing) == FRAMING_BYTES else 0


@dataclass(frozen=True, slots=True)
class Whole:
    """A valid record: the position of its payload in the content, and its mark."""

    start: int
    stop: int
    synced: Place


def whole_record(head: Head, content: bytes | memoryview, at: int, offset: int = 0) -> Whole | None:
    """Return the record at a byte of a file, whose bytes from `offset` on are `content`; None for an invalid one."""
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
    """Yield the valid records of a file from a byte on, at any position; `content` is the whole file."""
    while (at := content.find(head.opening, at)) >= 0:
        found = whole_record(head, content, at)
        if found is not None:
            yield found
        at = at + 1 if found is None else found.stop


def is_damage(same_machine: bool, bad: Place, following: Iterator[Whole]) -> int:
    """Return how many valid records after an invalid one show that it was valid once; 0: the journal ends there."""
    marks = [whole.synced for whole in following]
    return len(marks) if marks and (same_machine or max(marks) > bad) else 0

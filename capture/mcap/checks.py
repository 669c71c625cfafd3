"""Checksums and digests in an MCAP file, by which a reader detects damage.

A chunk and an attachment have a checksum of their own, metadata the entry `digest`. After the attachments follows the
metadata `foosim.digests`: a digest of each attachment, and the checksum of all bytes before. The end has the checksum
of everything before it, and one of the summary. The times in a chunk's head are compared with the chunk's indexes.
So a file without an end is checked, too, and a partly read one.
"""

from __future__ import annotations

import struct
from array import array
from collections.abc import Mapping
from hashlib import blake2b
from io import BytesIO
from typing import Final
from zlib import crc32

from mcap import records
from mcap.data_stream import ReadDataStream

from foosim.common.errors import Refused

CHECKS: Final = "foosim.digests"
"""Name of the metadata with the digests of the attachments."""
BEFORE: Final = "before_crc32"
"""Its entry with the checksum of all bytes before it."""
DIGEST: Final = "digest"
"""The entry of each record of metadata with a digest of its others."""
_SEALED: Final = "foosim."
"""How the names of metadata begin that must have a digest."""
_INDEX: Final = struct.Struct("<HI")
_CRC: Final = struct.Struct("<I")


class CaptureError(Refused):
    """A capture cannot be written or read: the file, the place in it, and the defect."""


def digest_of(data: bytes) -> str:
    """Return BLAKE2b of 32 bytes, in hex (`b2sum -l 256`)."""
    return blake2b(data, digest_size=32).hexdigest()


def sealed(name: str, entries: Mapping[str, str]) -> dict[str, str]:
    """Return a record's entries of metadata with their digest."""
    return {**entries, DIGEST: _digest(name, entries)}


def read_metadata(content: bytes) -> records.Metadata:
    """Return a record of metadata without its digest. Raises ValueError for a wrong digest."""
    found = records.Metadata.read(ReadDataStream(BytesIO(content)))
    entries = dict(found.metadata)
    written = entries.pop(DIGEST, None)
    if written is None and found.name.startswith(_SEALED):
        raise ValueError(f"metadata {found.name!r} lacks its digest")
    if written is not None and written != (computed := _digest(found.name, entries)):
        raise ValueError(f"metadata {found.name!r} has digest {computed}, written was {written!r}")
    return records.Metadata(name=found.name, metadata=entries)


def _digest(name: str, entries: Mapping[str, str]) -> str:
    digest = blake2b(digest_size=16)
    for text in (name, *(text for entry in sorted(entries.items()) for text in entry)):
        content = text.encode()
        digest.update(_CRC.pack(len(content)) + content)
    return digest.hexdigest()


def read_attachment(content: bytes) -> records.Attachment:
    """Return an attachment. Raises ValueError when its checksum is wrong."""
    found: records.Attachment = records.Attachment.read(ReadDataStream(BytesIO(content)))
    (written,) = _CRC.unpack_from(content, len(content) - _CRC.size)
    compare(f"attachment {found.name!r}", crc32(memoryview(content)[: -_CRC.size]), written)
    return found


def compare(what: str, computed: int, written: int) -> None:
    """Raise ValueError when a checksum differs from the written one; 0 is none."""
    if written not in (0, computed):
        raise ValueError(f"{what}: checksum {computed:08x}, written was {written:08x}")


class Described:
    """The attachments so far, for the metadata `CHECKS` after them."""

    def __init__(self) -> None:
        self.digests: dict[str, str] = {}
        self.is_checked = False
        """Whether that metadata has come, and all before it is intact."""

    def take(self, attachment: records.Attachment) -> None:
        """Note one more attachment."""
        self.digests[attachment.name] = digest_of(attachment.data)

    def entries(self, before: int) -> dict[str, str]:
        """Return the entries of `CHECKS` after bytes with this checksum."""
        return {**self.digests, BEFORE: f"{before:08x}"}

    def check(self, written: Mapping[str, str], before: int) -> None:
        """Compare with the values of `CHECKS`. Raises ValueError for the first that differs."""
        for name, value in sorted(self.entries(before).items()):
            if written.get(name) != value:
                what = "the file up to here" if name == BEFORE else f"attachment {name!r}"
                raise ValueError(f"{what} has digest {value}, written was {written.get(name, 'none')!r}")
        missing = sorted(written.keys() - self.digests.keys() - {BEFORE})
        if missing:
            raise ValueError(f"attachment {missing[0]!r} is missing")
        self.is_checked = True


class Span:
    """The times of the chunk at an offset, by its head and by its indexes."""

    def __init__(self, at: int, first_ns: int, last_ns: int) -> None:
        self.at = at
        self._head = first_ns, last_ns
        self._first_ns: list[int] = []
        self._last_ns: list[int] = []

    def take(self, index: bytes) -> None:
        """Note an index record. Raises ValueError for any other content."""
        channel, size = _INDEX.unpack_from(index)
        entries = array("Q", index[_INDEX.size :])
        if size != 8 * len(entries) or not entries or len(entries) % 2:
            raise ValueError(f"an index of {size} bytes for channel {channel}")
        times = entries[::2]
        self._first_ns.append(min(times))
        self._last_ns.append(max(times))

    def check(self) -> None:
        """Compare, when all indexes have come. Raises ValueError; a chunk without any is not checked."""
        if self._first_ns and (found := (min(self._first_ns), max(self._last_ns))) != self._head:
            first_ns, last_ns = self._head
            head = f"the chunk at byte {self.at} is from {first_ns} to {last_ns} ns"
            raise ValueError(f"{head}, its indexes from {found[0]} to {found[1]} ns")

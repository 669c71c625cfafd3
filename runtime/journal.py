"""Journals: append-only files of framed records, which a process writes before it publishes.

One record is one `write`. A killed process loses nothing that was appended; a dead machine at most what `fdatasync`,
called each second in a thread, had not reached. The first record of a file is the writer's checkpoint, so that older
files can be removed. `flock` excludes a second writer. `vhub.state.records` and `supervisor.records` define the
records.

When a file is full, `append` does not begin the next one by itself: the checkpoint is the state after the last appended
record only when no decision waits to be appended. The shell knows when, and calls `rotate_if_full`.

A file begins with its head: the opening of the journal, the boot of the machine, and the number of the file. A record
has a checksum over its payload, its position, the opening and a *mark*: the position up to which, when it was appended,
everything was known to be on the disk. So bytes of another position or another journal are no valid record.

An invalid record ends a journal unless it was valid once. A killed process leaves the last record cut. A machine that
loses power may lose any pages that were not synced, also some before others that it kept. So a valid record after an
invalid one decides: on the same boot nothing was lost, and the invalid one is damaged; on another boot, it is damaged
if the mark is after it.
"""

from __future__ import annotations

import fcntl
import os
import re
import struct
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from hashlib import blake2b
from pathlib import Path
from typing import Final, Self
from zlib import crc32

from foosim.common import limits
from foosim.common.closable import Closable
from foosim.common.errors import Failed
from foosim.runtime.process import machine_start

_SERIAL: Final = re.compile(r"(\d{6,})\.journal")


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


class JournalError(Failed):
    """A journal cannot be written or read: the file and the defect."""


class JournalDamaged(JournalError):
    """A record is invalid that was valid once: the file, the byte, and the number of valid records before it in the
    file.

    No run resumes from such a journal.
    """

    exit_code = 3

    def __init__(self, what: str, path: Path, byte: int, records: int) -> None:
        super().__init__(what)
        self.path, self.byte, self.records = path, byte, records


def journal_files(folder: Path, stem: str) -> list[Path]:
    """Return the files of a journal, oldest first; there may be none."""
    return [path for _, path in _numbered(folder, stem)]


def remove_journal(folder: Path, stem: str) -> None:
    """Remove the files of a journal whose run has ended in order."""
    for path in [*journal_files(folder, stem), folder / f"{stem}.lock"]:
        path.unlink(missing_ok=True)


def _numbered(folder: Path, stem: str) -> list[tuple[int, Path]]:
    found = []
    for path in folder.glob(f"{stem}-*.journal"):
        match = _SERIAL.fullmatch(path.name.removeprefix(f"{stem}-"))
        if match is not None:
            found.append((int(match[1]), path))
    return sorted(found)


class Records(Iterator[bytes]):
    """The records of one file, in order, up to the end of the file or of the journal.

    After the last one `left_bytes` is the number of bytes after the last valid record: 0 in a whole file. A torn tail,
    as a killed machine leaves, is no error. Raises JournalDamaged at an invalid record that was valid once.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.count = 0
        """How many records were read."""
        self.head: Head | None = None
        """None if the file's beginning never reached the disk."""
        try:
            with path.open("rb") as file:
                self._size = os.fstat(file.fileno()).st_size
                start = file.read(HEAD_BYTES)
        except OSError as error:
            raise JournalError(f"{path}: cannot be read, {error.strerror}") from None
        if len(start) == HEAD_BYTES and start.startswith(SIGNATURE):
            self.head = Head.unpack(start)
            if self.head is None:
                raise JournalDamaged(f"{path}: byte {len(SIGNATURE)}: the head of the file is damaged", path, 0, 0)
        elif any(start) and not SIGNATURE.startswith(start[: len(SIGNATURE)]):
            shown = start[: len(SIGNATURE)]
            raise JournalError(f"{path}: no journal of this version, its first bytes are {shown!r}, not {SIGNATURE!r}")
        self.valid_bytes = 0 if self.head is None else HEAD_BYTES
        """Where the next record starts."""
        self._records = iter(()) if self.head is None else self._read(self.head)

    @property
    def left_bytes(self) -> int:
        return self._size - self.valid_bytes

    @property
    def same_machine(self) -> bool:
        """Whether the machine was not booted since the journal was opened: then the disk has lost nothing."""
        return self.head is not None and any(self.head.machine) and self.head.machine == machine_hash(machine_start())

    def __next__(self) -> bytes:
        return next(self._records)

    def after(self, at: int) -> Iterator[Whole]:
        """Yield the valid records from a byte on, at any position."""
        return iter(()) if self.head is None else whole_records(self.head, self.path.read_bytes(), at)

    def damaged(self, following: int) -> JournalDamaged:
        """Return the error for an invalid record that, by the number of valid records after it, was valid once."""
        count = f"{following} whole record{'s' if following > 1 else ''}"
        text = f"{self.path}: byte {self.valid_bytes}: record {self.count + 1} is damaged, {count} after it"
        return JournalDamaged(text, self.path, self.valid_bytes, self.count)

    def _read(self, head: Head) -> Iterator[bytes]:
        """Yield valid records; a length beyond the file's end is never allocated."""
        with self.path.open("rb") as file:
            file.seek(self.valid_bytes)
            while self.left_bytes:
                content = file.read(FRAMING_BYTES)
                content += file.read(min(record_bytes(content), self.left_bytes - len(content)))
                whole = whole_record(head, content, self.valid_bytes, self.valid_bytes)
                if whole is None:
                    break
                self.valid_bytes += whole.stop
                self.count += 1
                yield content[whole.start : whole.stop]
        if self.left_bytes:
            bad = head.serial, self.valid_bytes
            following = is_damage(self.same_machine, bad, self.after(self.valid_bytes))
            if following:
                raise self.damaged(following)


def read_journal(folder: Path, stem: str) -> Iterator[bytes]:
    """Yield the records of all files of a journal, in order; each file but the first starts with its head again.

    A torn end is followed by the records of the next opening. Raises JournalDamaged.
    """
    opening = b""
    torn: tuple[int, Records] | None = None
    """The first file of that opening without an end, and its number."""
    for serial, path in _numbered(folder, stem):
        records = Records(path)
        head = records.head
        if head is not None and head.opening != opening:
            opening, torn = head.opening, None
        elif head is not None and torn is not None:
            bad = torn[0], torn[1].valid_bytes
            following = is_damage(records.same_machine, bad, records.after(HEAD_BYTES))
            if following:
                raise torn[1].damaged(following)
            continue
        yield from records
        if head is None or records.left_bytes:
            torn = torn or (serial, records)


def read_newest(folder: Path, stem: str) -> Iterator[bytes]:
    """Yield the records of a journal's newest file that has any: its checkpoint replaces the files before it."""
    for path in reversed(journal_files(folder, stem)):
        records = Records(path)
        first = next(records, None)
        if first is not None:
            yield first
            yield from records
            return


def read_whole(records: Iterable[bytes]) -> tuple[list[bytes], JournalDamaged | None]:
    """Return the records up to a damaged one, and its error; None without damage."""
    whole: list[bytes] = []
    try:
        whole.extend(records)
    except JournalDamaged as damaged:
        return whole, damaged
    return whole, None


def lock_journal(folder: Path, stem: str) -> int:
    """Take the lock of a journal, held until it is closed; the kernel frees it when the process ends.

    Raises JournalError when another process has it.
    """
    path = folder / f"{stem}.lock"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    except OSError as error:
        raise JournalError(f"{path}: cannot be opened, {error.strerror}") from None
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        holder = os.pread(lock, 20, 0).decode(errors="replace").strip()
        os.close(lock)
        raise JournalError(f"{path}: the journal is being written by another process ({holder})") from None
    except OSError as error:
        os.close(lock)
        raise JournalError(f"{path}: cannot be locked, {error.strerror}") from None
    return lock


class Journal(Closable):
    """The one writer of a journal: files `STEM-000001.journal`, ... in `folder`; a new one at every opening.

    Raises JournalError when another process writes it or the disk refuses. After a failed write every further one
    fails, because a gap would be worse than an end.
    """

    def __init__(
        self, folder: Path, stem: str, bytes_max: int = limits.JOURNAL_BYTES_MAX, sync_every_s: float = 1.0
    ) -> None:
        self.folder = folder
        self.stem = stem
        self._bytes_max = bytes_max
        self._sync_every_s = sync_every_s
        self._error: JournalError | None = None
        self._lock_file = self._lock()
        self._closed_files: list[tuple[int, int]] = []
        """Serial and last tick of files that are full, oldest first."""
        self._serial = max((serial for serial, _ in _numbered(folder, stem)), default=0)
        self._mutex = threading.Lock()
        """Guards the data shared with the syncing thread: `_file`, `_retired`, dirty bytes."""
        self._retired: list[int] = []
        self._dirty = self._folder_dirty = False
        self._file = self._size = 0
        self._opening, self._machine = os.urandom(8), machine_hash(machine_start())
        self._written: Place = (self._serial + 1, 0)
        self._synced: Place = self._written
        """The written position of the journal, and the position that is known to be on the disk."""
        self._begin_file()
        self._stop = threading.Event()
        self._syncer = threading.Thread(target=self._sync_each_interval, name=f"sync-{stem}", daemon=True)
        self._syncer.start()

    # --- writing -----------------------------------------------------------------------------------------------------

    def append(self, record: bytes) -> None:
        """Write one record; after that a killed process does not lose it."""
        if self._error is not None:
            raise self._error
        if len(record) > limits.JOURNAL_BYTES_MAX:
            most = f"a file of it has {limits.JOURNAL_BYTES_MAX} at most"
            self._error = JournalError(f"{self.path}: cannot be written, a record has {len(record)} bytes, {most}")
            raise self._error
        start = b"" if self._size else self._head.pack()
        self._write(start + pack_record(self._head, self._size + len(start), self._synced, record))

    def rotate_if_full(self, head: Callable[[], bytes], tick: int) -> bool:
        """Begin a new file with the record `head()` if this one is full; return whether it was.

        Call it when every decision is appended. `tick` is the last one in the files so far.
        """
        if self._size < self._bytes_max:
            return False
        if self._error is not None:
            raise self._error
        first_record = head()
        self._closed_files.append((self._serial, tick))
        self._begin_file()
        self.append(first_record)
        return True

    def forget_before(self, tick: int) -> None:
        """Remove the files without records from `tick` on, up to which the capture is synced."""
        done = [serial for serial, last_tick in self._closed_files if last_tick < tick]
        if not done:
            return
        self._closed_files = self._closed_files[len(done) :]
        try:
            for serial, path in _numbered(self.folder, self.stem):
                if serial <= done[-1]:
                    path.unlink(missing_ok=True)
        except OSError as error:
            raise self._failed("cannot remove a file that is done with", error) from None

    @property
    def path(self) -> Path:
        """The current file."""
        return self.folder / f"{self.stem}-{self._serial:06d}.journal"

    def close(self) -> None:
        """Sync and close the files; a second call does nothing."""
        if self._stop.is_set():
            return
        self._stop.set()
        self._syncer.join()
        with self._mutex:
            self._retired.append(self._file)
        self._sync()
        os.close(self._lock_file)
        if self._error is not None:
            raise self._error

    # --- files -------------------------------------------------------------------------------------------------------

    def _lock(self) -> int:
        """Take the lock, held while the journal is open, and write the holder into it."""
        lock = lock_journal(self.folder, self.stem)
        try:
            os.ftruncate(lock, 0)
            os.pwrite(lock, f"pid {os.getpid()}\n".encode(), 0)
        except OSError as error:
            os.close(lock)
            raise JournalError(f"{self.folder / self.stem}.lock: cannot be written, {error.strerror}") from None
        return lock

    def _begin_file(self) -> None:
        """Begin a new file, which must not exist; the previous one is passed to the syncing thread."""
        self._serial += 1
        try:
            file = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND | os.O_CLOEXEC, 0o644)
        except OSError as error:
            raise self._failed("cannot be created", error) from None
        with self._mutex:
            if self._file:
                self._retired.append(self._file)
            self._file = file
            self._folder_dirty = True
        self._size = 0
        self._head = Head(self._opening, self._machine, self._serial)
        self._written = self._serial, 0

    def _write(self, content: bytes) -> None:
        """Append by one `write`; if a full disk takes a part of it, that part is cut off."""
        written = 0
        try:
            while written < len(content):
                written += os.write(self._file, content[written:] if written else content)
        except OSError as error:
            failure = self._failed("cannot be written", error)
            with suppress(OSError):
                os.ftruncate(self._file, self._size)
            raise failure from None
        self._size += written
        self._dirty = True  # before the syncing thread can see how far it is
        self._written = self._serial, self._size

    def _failed(self, what: str, error: OSError) -> JournalError:
        failure = JournalError(f"{self.path}: {what}, {error.strerror}")
        self._error = self._error or failure
        return failure

    # --- syncing -----------------------------------------------------------------------------------------------------

    def _sync_each_interval(self) -> None:
        while not self._stop.wait(self._sync_every_s):
            self._sync()

    def _sync(self) -> None:
        """Sync the written records and the names of new files; close full files."""
        written = self._written
        with self._mutex:
            retired, self._retired = self._retired, []
            dirty = retired if not self._dirty or self._file in retired else [*retired, self._file]
            folder_dirty, self._dirty, self._folder_dirty = self._folder_dirty, False, False
        try:
            for file in dirty:
                os.fdatasync(file)
            if folder_dirty:
                self._sync_folder()
            self._synced = written
        except OSError as error:
            self._failed("cannot be synced", error)
        for file in retired:
            os.close(file)

    def _sync_folder(self) -> None:
        folder = os.open(self.folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)

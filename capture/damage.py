"""What of a finished capture is damaged, and which of its ticks are whole: for people who have no other copy.

Readers refuse such a file at the first wrong byte. This walks over all of it, record by record, and where a length is
wrong from one whole chunk to the next.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import BinaryIO

import msgspec

from foosim.capture.mcap.checks import CaptureError
from foosim.capture.mcap.format import IN_DATA, IN_SUMMARY, MAGIC, RECORD, Damaged, McapFile, Message, next_chunk
from foosim.capture.parts import files_from
from foosim.capture.reader import TICK_MARKS, deployment_of, read_about
from foosim.capture.rows import TICK
from foosim.common.units import format_ns


@dataclass(frozen=True, slots=True)
class Broken:
    """Damaged bytes of a file, and the check that found them."""

    file: str
    byte: int
    bytes: int
    what: str

    def __str__(self) -> str:
        return f"{self.file}: byte {self.byte}, {self.bytes} bytes: {self.what}"


@dataclass(frozen=True, slots=True)
class Damage:
    """What is broken in a finished capture; `ticks` are the spans, first and last, whose rows of /tick are whole.

    `until_ns` is the simulated time up to which all is whole that `foosim capture cut` needs; None where it needs more.
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
            lines.append(f"what is before the damage: foosim capture cut {self.path} --to {time} -o PART")
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
        self.broken: list[Broken] = []
        self.ticks: list[int] = []
        self.before = -1
        """The last tick before what is broken first."""
        try:
            with path.open("rb") as stream:
                self._go(stream, path)
        except OSError as error:
            raise CaptureError(f"{path}: cannot be read, {error.strerror}") from None

    def _go(self, stream: BinaryIO, path: Path) -> None:
        size = path.stat().st_size
        file, stop = McapFile(stream, size, str(path), topics=frozenset({TICK})), size - len(MAGIC)
        contents, following = file.contents(), 0
        while following < stop:
            try:
                for content in contents:
                    if isinstance(content, Message):
                        self.ticks.append(TICK_MARKS.decode(content.data).tick)
                break
            except (CaptureError, msgspec.DecodeError) as error:
                if not file.at:  # it does not start as an MCAP file does
                    raise
                if not self.broken:
                    self.before = self.ticks[-1] if self.ticks else -1
                following = _following(stream, file.at, stop)
                what = error.what if isinstance(error, Damaged) else str(error)
                self.broken.append(Broken(str(path), file.at, following - file.at, what))
                contents = file.contents_behind(following)


def _following(stream: BinaryIO, at: int, stop: int) -> int:
    """Return where reading continues after a broken record: at the next one, if its length leads to one."""
    following = _behind(stream, at, stop)
    if following == stop or (following is not None and _behind(stream, following, stop) is not None):
        return following
    chunk = next_chunk(stream, at + 1, stop)
    return stop if chunk is None else chunk


def _behind(stream: BinaryIO, at: int, stop: int) -> int | None:
    """Return where the record at a byte ends; None where none is."""
    stream.seek(at)
    head = stream.read(RECORD.size)
    if len(head) < RECORD.size:
        return None
    opcode, length = RECORD.unpack(head)
    end = int(at + RECORD.size + length)
    return end if end <= stop and (opcode in IN_DATA or opcode in IN_SUMMARY) else None

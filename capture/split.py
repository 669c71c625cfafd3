"""The files of a capture that is written: when the next one begins, its metadata, and which old files are removed.

By size or time a file begins with a captured frame that would be there anyway. A restarted writer begins one with the
last existing frame, which the first chunk repeats. So all rows of all files are the rows of one file.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from foosim.capture.contents import CUT, CUT_CHAIN, CUT_DIGEST, CUT_TICK
from foosim.capture.left import Left
from foosim.capture.parts import AFTER, AFTER_BYTES, LAST, ORIGIN_TICK, PART, head_of, number_of, part_path, parts_at
from foosim.capture.state_at import ActiveState
from foosim.common.units import format_ns
from foosim.deployment.schema import Capture


@dataclass(frozen=True, slots=True)
class _File:
    path: Path
    first_tick: int
    bytes: int


class Split:
    """The files of one capture; the last is being written."""

    def __init__(self, path: Path, capture: Capture, tick_ns: int) -> None:
        self.number = 0
        self.in_force = ActiveState(str(path))
        self._path = path
        self._tick_ns = tick_ns
        self._every = capture.frames_every
        self._bytes_max, self._span_ns, self._last_ns = capture.split_bytes, capture.split_ns, capture.last_ns
        self._is_split = capture.is_split
        self._first_tick = -1
        self._described_bytes = 0
        self._earlier: list[_File] = []
        """The existing files, in order."""

    @property
    def path(self) -> Path:
        """The file that is being written."""
        return part_path(self._path, self.number)

    @property
    def earlier_bytes(self) -> int:
        """Size of the files before it, in bytes."""
        return sum(file.bytes for file in self._earlier)

    def follow(self, left: Left) -> None:
        """Continue with the file after the existing ones. Raises CaptureError for an invalid one."""
        for number, path in parts_at(self._path).items():
            if number <= left.number:
                head = head_of(path)
                begin = next((entry for entry in (CUT_TICK, ORIGIN_TICK) if entry in head), None)
                first_tick = 0 if begin is None else number_of(path, head, begin)
                self._earlier.append(_File(path, first_tick, path.stat().st_size))
        self.number, self.in_force = left.number + 1, left.in_force

    def wrote(self, tick: int) -> None:
        """Record that a closing is written, or repeated at the beginning of a file."""
        if self._first_tick < 0:
            self._first_tick = tick

    def is_due(self, tick: int, size: int) -> bool:
        """Whether the present file, with its size in bytes, ends before a tick.

        It is never as short as what describes it.
        """
        if not self._is_split or tick % self._every or not 0 <= self._first_tick < tick:
            return False
        is_long = self._span_ns is not None and (tick - self._first_tick) * self._tick_ns >= self._span_ns
        return is_long or (self._bytes_max is not None and size >= max(self._bytes_max, 2 * self._described_bytes))

    def first_entries(self) -> dict[str, str]:
        """Return the own metadata of the first file."""
        return {**self._kept, PART: "0"} if self._is_split else {}

    def entries(self, number: int, stop: int | None) -> dict[str, str]:
        """Return the own metadata of a further file; `stop`: the bytes that count of one before without an end."""
        own = {**self._kept, PART: str(number), AFTER: part_path(self._path, number - 1).name}
        return own if stop is None else {**own, AFTER_BYTES: str(stop)}

    def begin_entries(self, tick: int, digest: bytes, chain: bytes) -> dict[str, str]:
        """Return the metadata of the frame that a further file begins with."""
        assert chain, "a closing has the chain up to its frame"
        return {CUT: self._path.name, CUT_TICK: str(tick), CUT_DIGEST: digest.hex(), CUT_CHAIN: chain.hex()}

    @property
    def _kept(self) -> dict[str, str]:
        return {} if self._last_ns is None else {LAST: format_ns(self._last_ns)}

    def begin_next(self, tick: int, size: int, described_bytes: int) -> list[Path]:
        """Record that the next file begins at a tick, and the size of the one before; return the files to remove.

        Of the files before stays what has something of the last `capture.last`.
        """
        self._earlier.append(_File(self.path, self._first_tick, size))
        self.number, self._described_bytes, self._first_tick = self.number + 1, described_bytes, -1
        gone: list[Path] = []
        while self._last_ns is not None and len(self._earlier) > 1:
            if self._earlier[1].first_tick * self._tick_ns > tick * self._tick_ns - self._last_ns:
                break
            gone.append(self._earlier.pop(0).path)
        return gone

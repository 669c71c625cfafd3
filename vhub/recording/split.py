"""Decides when a capture continues in a new file, what that file begins with, and which old files are removed.

A file begins with a captured frame that would be there anyway, so all rows of all files are those of one that is not
split.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from foosim.capture.contents import CUT, CUT_CHAIN, CUT_DIGEST, CUT_TICK
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.parts import AFTER, LAST, ORIGIN_TICK, PART, head_of, number_of, part_path, parts_at
from foosim.capture.state_at import ActiveState
from foosim.common.units import format_ns
from foosim.deployment.schema import Capture
from foosim.vhub.state.records import Closing


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

    def take_over(self, number: int, described_bytes: int, *, is_empty: bool) -> None:
        """Resume with the file of this number; `is_empty`: it has no tick. Raises CaptureError for an invalid file."""
        self.number, self._described_bytes = number, described_bytes
        for known, path in parts_at(self._path).items():
            if known > number:
                break
            head = head_of(path)
            if PART not in head or number_of(path, head) != known:
                raise CaptureError(f"{path}: is not the file of number {known} of {self._path}")
            begin = next((entry for entry in (CUT_TICK, ORIGIN_TICK) if entry in head), None)
            first_tick = 0 if begin is None else number_of(path, head, begin)
            if known < number:
                self._earlier.append(_File(path, first_tick, path.stat().st_size))
            else:
                self._first_tick = -1 if is_empty else first_tick

    def begin(self, number: int, described_bytes: int) -> None:
        """Record that a file is begun, with its length before the first row."""
        self.number, self._described_bytes, self._first_tick = number, described_bytes, -1

    def wrote(self, tick: int) -> None:
        """Record that a closing is written."""
        if self._first_tick < 0:
            self._first_tick = tick

    def is_due(self, tick: int, size: int) -> bool:
        """Whether the present file, with its size in bytes, ends before a tick.

        It is never as short as what describes it.
        """
        if tick % self._every or not 0 <= self._first_tick < tick:
            return False
        is_long = self._span_ns is not None and (tick - self._first_tick) * self._tick_ns >= self._span_ns
        return is_long or (self._bytes_max is not None and size >= max(self._bytes_max, 2 * self._described_bytes))

    def entries(self, closing: Closing | None = None) -> dict[str, str]:
        """Return the own metadata of the first file, or of the next one, which begins with a closing."""
        own = {} if self._last_ns is None else {LAST: format_ns(self._last_ns)}
        if closing is None:
            return {**own, PART: "0"}
        assert closing.chain, "a closing knows the chain up to its frame"
        own |= {PART: str(self.number + 1), AFTER: self.path.name, CUT: self._path.name}
        digest, chain = closing.digest.hex(), closing.chain.hex()
        return {**own, CUT_TICK: str(closing.frame.tick), CUT_DIGEST: digest, CUT_CHAIN: chain}

    def begin_next(self, tick: int, size: int, described_bytes: int) -> list[Path]:
        """Record that the next file begins at a tick, and the size of the one before; return the files to remove.

        Of the files before stays what has something of the last `capture.last`.
        """
        self._earlier.append(_File(self.path, self._first_tick, size))
        self.begin(self.number + 1, described_bytes)
        gone: list[Path] = []
        while self._last_ns is not None and len(self._earlier) > 1:
            if self._earlier[1].first_tick * self._tick_ns > tick * self._tick_ns - self._last_ns:
                break
            gone.append(self._earlier.pop(0).path)
        return gone

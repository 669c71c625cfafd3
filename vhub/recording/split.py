"""When a capture goes on in another file, what that one begins with, and which old files are let go.

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
    """The files of one capture, of which the last is written."""

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
        """Those that are there, in their order."""

    @property
    def path(self) -> Path:
        """The file that is written."""
        return part_path(self._path, self.number)

    @property
    def earlier_bytes(self) -> int:
        """How many bytes the files before have."""
        return sum(file.bytes for file in self._earlier)

    def take_over(self, number: int, described_bytes: int, *, is_empty: bool) -> None:
        """Go on with the file of this number; `is_empty`: it has no tick. Raises CaptureError for one that is none."""
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
        """Note that a file is begun, which is so long before its first row."""
        self.number, self._described_bytes, self._first_tick = number, described_bytes, -1

    def wrote(self, tick: int) -> None:
        """Note that a closing is written."""
        if self._first_tick < 0:
            self._first_tick = tick

    def is_due(self, tick: int, size: int) -> bool:
        """Whether the file that is written, of so many bytes, ends before a tick.

        It is never as short as what describes it.
        """
        if tick % self._every or not 0 <= self._first_tick < tick:
            return False
        is_long = self._span_ns is not None and (tick - self._first_tick) * self._tick_ns >= self._span_ns
        return is_long or (self._bytes_max is not None and size >= max(self._bytes_max, 2 * self._described_bytes))

    def entries(self, closing: Closing | None = None) -> dict[str, str]:
        """Return what the first file says of itself beside the rest; or the next one, which begins with a closing."""
        own = {} if self._last_ns is None else {LAST: format_ns(self._last_ns)}
        if closing is None:
            return {**own, PART: "0"}
        assert closing.chain, "a closing knows the chain up to its frame"
        own |= {PART: str(self.number + 1), AFTER: self.path.name, CUT: self._path.name}
        digest, chain = closing.digest.hex(), closing.chain.hex()
        return {**own, CUT_TICK: str(closing.frame.tick), CUT_DIGEST: digest, CUT_CHAIN: chain}

    def go_on(self, tick: int, size: int, described_bytes: int) -> list[Path]:
        """Note that the next file is begun at a tick, the one before having so many bytes; return what is let go.

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

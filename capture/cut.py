"""Cuts a part out of a capture: a capture of its own, from a captured frame to a time.

The state at that frame is repeated at the start, as it was written: the layout, the epoch, the clients that take part,
the scene. Deployment, files and metadata are copied; the metadata have the beginning of the cut. A run can
begin with any of its frames; a verification starts where the run began, or with the first frame if that is requested.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from msgspec.structs import replace as replace_message

from foosim.capture.contents import CUT, CUT_CHAIN, CUT_DIGEST, CUT_REASON, CUT_TICK, check_new
from foosim.capture.file import CaptureFile, described_as, one_file
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.mcap.format import Message
from foosim.capture.reader import DECODERS, Scan, chain_at_start, deployment_of, read_about
from foosim.capture.rows import CLIENTS, EPOCHS, FRAME, LAYOUT, RECOVERIES, TICK
from foosim.capture.state_at import ActiveState
from foosim.common.errors import BadValue
from foosim.common.units import format_ns
from foosim.world.frame import chain_next

_BEFORE_TICK: Final = frozenset({EPOCHS, LAYOUT, CLIENTS, RECOVERIES})
"""Rows of a closing that precede its row of /tick."""


@dataclass(frozen=True, slots=True)
class Cut:
    """What a cut has: ticks of the first and last frame that have a row of /tick, messages, bytes of the file."""

    path: Path
    first_tick: int
    last_tick: int
    tick_ns: int
    messages: int
    bytes: int


@dataclass(slots=True)
class _Start:
    """The latched state at the last tick that was read."""

    in_force: ActiveState
    tick: int = -1
    digest: bytes = b""
    chain: bytes = b""

    def take(self, scan: Scan, message: Message) -> None:
        """Add a message to the active state."""
        if message.topic == TICK:
            row = scan.decode(DECODERS[TICK], message)
            self.digest = bytes.fromhex(row.digest)
            self.chain = chain_next(self.chain, self.digest) if self.tick >= 0 else chain_at_start(scan.about)
            self.tick = row.tick
        else:
            self.in_force.take(message)


def cut_capture(path: Path, out: Path, from_ns: int | None = None, to_ns: int | None = None) -> Cut:
    """Write the part of a capture between two simulated times (None: its start, its end) to a new file.

    It begins with the newest captured frame at or before `from_ns`, or else with the first one; it has all that was
    recorded of the ticks up to `to_ns`. Raises BadValue for times that the capture does not have, CaptureError when it
    cannot be read, has no frame, or `out` exists, Failed when `out` cannot be written.
    """
    if from_ns is not None and to_ns is not None and to_ns < from_ns:
        raise BadValue(f"--to: before --from, which is {format_ns(from_ns)}", format_ns(to_ns))
    check_new(out)
    start, tick_ns, last_tick = _find_start(path, from_ns, to_ns)
    stop_tick = last_tick if to_ns is None else min(last_tick, to_ns // tick_ns)
    cut = {CUT: path.name, CUT_TICK: str(start.tick), CUT_DIGEST: start.digest.hex(), CUT_CHAIN: start.chain.hex()}
    with one_file(out, described_as(read_about(path), cut)) as file:
        _Copy(path, file, start, tick_ns, stop_tick).run()
        file.finish({"reason": CUT_REASON, "last_tick": str(stop_tick)})
    return Cut(out, start.tick, stop_tick, tick_ns, file.mcap.messages, file.mcap.offset)


def _find_start(path: Path, from_ns: int | None, to_ns: int | None) -> tuple[_Start, int, int]:
    """Return the frame to begin with and the state in force there, the tick in ns, and the last tick."""
    tick_ns = deployment_of(read_about(path)).tick_ns
    scan = Scan(path)
    start, held = (_Start(ActiveState(str(path))) for _ in range(2))
    for message in scan.messages():
        if message.topic != FRAME:
            held.take(scan, message)
            if to_ns is not None and start.tick >= 0 and held.tick * tick_ns > to_ns:
                break  # later messages may be damaged: none of them is needed
        elif start.tick < 0 or (from_ns is not None and held.tick * tick_ns <= from_ns):
            start = replace(held, in_force=held.in_force.copy())
    if start.tick < 0:
        raise CaptureError(f"{path}: no frame to begin with")
    if from_ns is not None and from_ns > held.tick * tick_ns:
        raise BadValue(f"--from: the capture ends at {held.tick * tick_ns / 1e9:g} s", format_ns(from_ns))
    if to_ns is not None and to_ns < start.tick * tick_ns:
        raise BadValue(f"--to: the capture begins at {start.tick * tick_ns / 1e9:g} s", format_ns(to_ns))
    return start, tick_ns, held.tick


class _Copy:
    """One pass over the whole capture that writes the cut."""

    def __init__(self, path: Path, file: CaptureFile, start: _Start, tick_ns: int, stop_tick: int) -> None:
        self._path = path
        self._file = file
        self._start = start
        self._tick_ns = tick_ns
        self._stop_tick = stop_tick
        self._tick = -1
        self._begun = False
        self._head: list[Message] = []
        """Rows of a closing whose row of /tick has not come yet."""

    def run(self) -> None:
        scan = Scan(self._path)
        for message in scan.messages():
            if not self._take(scan, message):
                break

    def _take(self, scan: Scan, message: Message) -> bool:
        """Write a message that belongs to the cut; False after the last one."""
        if message.topic == TICK:
            self._tick = scan.decode(DECODERS[TICK], message).tick
            if self._tick > self._stop_tick:
                return False
            self._begin_tick()
        if message.topic in _BEFORE_TICK:
            self._head.append(message)
        elif self._begun:
            self._put(message)
        return True

    def _begin_tick(self) -> None:
        """Write the rows before a row of /tick; before the first one of the cut, the active state."""
        head, self._head = self._head, []
        if self._begun:
            for message in head:
                self._put(message)
        elif self._tick >= self._start.tick:
            self._begun = True
            at_ns = self._start.tick * self._tick_ns
            recoveries = [message for message in head if message.topic == RECOVERIES]
            for message in (*self._start.in_force.messages(), *recoveries):
                self._put(message, at_ns)

    def _put(self, message: Message, at_ns: int | None = None) -> None:
        self._file.copy(message if at_ns is None else replace_message(message, log_ns=at_ns, publish_ns=at_ns))

"""Watches the disk space of the vHub's capture, and of its journal, without which no run continues.

It reports once that disk space is low, and when the run has to end: while the rest still fits. While the
last `fdatasync` of a capture lasts, nothing else moves: progress of the disk is what the kernel
has written of a block device. Without such an account (a network file system, memory) the call itself counts: it
ends, or fails, when the kernel returns.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Final

from foosim.capture.writer import CaptureState, CaptureWriter
from foosim.protocol.run_status import CLOSING, NOT_RECORDED
from foosim.runtime.disk import JournalRoom, Level

_STATES: Final = {Level.FINE: "on", Level.LOW: "low", Level.FULL: "full", Level.OUT: "ended"}
DEVICES: Final = Path("/sys/dev/block")
WRITES, SECTORS_WRITTEN = 4, 6
"""Where a device's `stat` has how many writes it has completed, and how many sectors with them."""
COUNT_NS: Final = 1_000_000_000


class DiskProgress:
    """The disk of one existing file or folder."""

    def __init__(self, path: Path, devices: Path = DEVICES) -> None:
        device = path.stat().st_dev
        self._account = devices / f"{os.major(device)}:{os.minor(device)}" / "stat"
        self._counted = 0
        self._count_ns = 0

    def look(self, is_syncing: bool, now_ns: int) -> int:
        """Return a number that changes while a sync of the file (`is_syncing`) makes progress."""
        if not is_syncing:
            return 0
        try:
            fields = self._account.read_text("ascii").split()
            return int(fields[WRITES]) + int(fields[SECTORS_WRITTEN])
        except (OSError, ValueError, IndexError):
            if now_ns >= self._count_ns:
                self._counted, self._count_ns = self._counted + 1, now_ns + COUNT_NS
            return self._counted


class RoomWatch:
    """Watches one capture (or none) and the folder of one journal."""

    def __init__(self, capture: CaptureWriter | None, journals: Path, reserve: int) -> None:
        self.ends: tuple[str, str] | None = None
        """What has failed, and why, when the run must end."""
        self._capture = capture
        self._journal = JournalRoom(journals, reserve)
        self._level = Level.FINE
        self._disk = None if capture is None else DiskProgress(capture.path.parent)

    def look(self, now_ns: int) -> list[tuple[str, str]]:
        """Return new log lines as (level, text)."""
        entries = []
        while self._capture is not None and self._capture.states:
            entries += self._entries(self._capture.states.popleft(), self._capture.stops_world)
        warning, why = self._journal.look(now_ns)
        if why:
            self.ends = ("room for the journal", why)
        return [*entries, ("warning", warning)] if warning else entries

    def _entries(self, state: CaptureState, stops_world: bool) -> list[tuple[str, str]]:
        """Handle a new state of the capture."""
        before, self._level = self._level, state.level
        if state.level is Level.LOW:
            then = "the run ends" if stops_world else "the run continues without its capture"
            return [("warning", f"room gets little, at the reserve {then}: {state.text}")]
        if stops_world:
            if before < Level.FULL:
                self.ends = ("the capture", state.text)
            return [("error", f"not captured further: {state.text}")] if state.level is Level.OUT else []
        return [("error", f"the run continues without its capture: {state.text}")]

    def disk_progress(self, now_ns: int) -> int:
        """Return a number that changes while a sync of the capture makes progress."""
        if self._capture is None or self._disk is None:
            return 0
        return self._disk.look(self._capture.is_syncing, now_ns)

    @property
    def recording(self) -> dict[str, Any]:
        """The state of the recording, for the status and the result of the run."""
        if self._capture is None:
            return NOT_RECORDED
        state, counts = self._capture.state, self._capture.statistics()
        is_closing = self._capture.is_closing and state.level <= Level.LOW
        return {
            "state": CLOSING if is_closing else _STATES[state.level],
            "problem": state.text,
            "offered": counts.offered,
            "written": counts.written,
            "refused": counts.refused,
            "bytes": counts.bytes,
        }

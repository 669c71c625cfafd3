"""Captures in Python: their content, and whether the recomputed world equals the captured one."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

from foosim.capture import reader
from foosim.capture.info import CaptureInfo, capture_info
from foosim.simulation.verify import Verified, verify_capture


class Capture(reader.CaptureData):
    """A capture, opened: its frames, packets, poses and rows read on demand."""

    def info(self) -> CaptureInfo:
        """Return it in short: ticks, chain, packets by fate. Raises CaptureError."""
        return capture_info(self.path)

    def verify(self, nodes: int = 1) -> Verified:
        """Compute the world again on some nodes, and compare each tick: `equal` is the result.

        Raises CaptureError for a capture that cannot be read or is a cut.
        """
        return verify_capture(self.path, nodes)


def open_capture(path: Path | str) -> Capture:
    """Open a capture, also an unfinished one. Raises CaptureError for a file that is damaged or not a capture."""
    found = reader.open_capture(path)
    return Capture(**{field.name: getattr(found, field.name) for field in fields(found)})

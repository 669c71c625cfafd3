"""Whether a disk that is brought up to date goes on: what shows that a capture is being closed while one `fdatasync` of
it lasts, for which nothing else moves.

Of a block device the kernel tells what it has written. Of what has no such account (a network file system, memory) the
call itself counts: it ends, or fails, when the kernel says so.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

DEVICES: Final = Path("/sys/dev/block")
WRITES, SECTORS_WRITTEN = 4, 6
"""Where a device's `stat` has how many writes it has completed, and how many sectors with them."""
COUNT_NS: Final = 1_000_000_000


class DiskProgress:
    """The disk of one existing file."""

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

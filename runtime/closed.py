"""What is known of a process whose connection has ended: that it was silent before, or that it was heard until then.

The session tells of the end alone. A process that ends closes its connection; one that is stopped, or cut off, is
silent until its lease runs out.
"""

from __future__ import annotations

from typing import Final

CLOSED: Final = "its connection closed"
SILENT_NS: Final = 750_000_000
"""Whose lease has run out was silent for longer: a lease, less the quarter of it between two words of a session."""


def closed(silent_ns: int, what: str = "nothing was heard of it") -> str:
    """Return why a process is lost whose connection has ended, after `what` had held for so long."""
    return CLOSED if silent_ns < SILENT_NS else f"{CLOSED}: {what} for {silent_ns / 1e9:.1f} s"

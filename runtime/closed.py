"""The reason of a lost connection: its process was silent before, or sent messages until then.

The session reports only the end. A process that ends closes its connection; a process that is stopped, or cut off, is
silent until its lease expires.
"""

from __future__ import annotations

from typing import Final

CLOSED: Final = "its connection closed"
SILENT_NS: Final = 750_000_000
"""The shortest silence before a lease expires: the lease, less the quarter of it between two messages of a session."""


def closed(silent_ns: int, what: str = "nothing was heard of it") -> str:
    """Return the reason of a loss by a closed connection, after a silence of so long."""
    return CLOSED if silent_ns < SILENT_NS else f"{CLOSED}: {what} for {silent_ns / 1e9:.1f} s"

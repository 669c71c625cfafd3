"""Detects standstills of a process's own loop: stopped, without a processor, machine asleep, or busy in a turn.

Such a process has read no messages meanwhile, so every deadline that it keeps for another process is suspended for
that time. The loop detects a standstill from its own monotonic clock, since it knows when its next turn was due. Pure.
"""

from __future__ import annotations

from typing import Final

STOOD_NS: Final = 20_000_000
"""A turn that is late by at most this is no standstill."""
REPORTED_NS: Final = 1_000_000_000
"""A standstill of at least this is logged. Its connections may have closed meanwhile (`settings.LEASE_MS`), without a
failure of the other processes."""


class Standstill:
    """The time of a loop's last turn."""

    def __init__(self, now_ns: int) -> None:
        self._looked_ns = now_ns

    def look(self, due_ns: int, now_ns: int) -> int:
        """Begin a turn that was due at `due_ns`; return the length (ns) of the standstill before it, 0 for none.

        A turn that ends after the next one was due counts as a standstill, too.
        """
        late_ns = now_ns - max(due_ns, self._looked_ns)
        self._looked_ns = now_ns
        return late_ns if late_ns > STOOD_NS else 0


def standstill_text(stood_ns: int) -> str:
    """Return the log line of a standstill; empty for a short one."""
    return (
        f"event loop was blocked for {stood_ns / 1e9:.1f} s; peer deadlines extended" if stood_ns >= REPORTED_NS else ""
    )


CLOSED: Final = "its connection closed"
SILENT_NS: Final = 750_000_000
"""The shortest silence before a lease expires: the lease, less the quarter of it between two messages of a session."""


def closed(silent_ns: int, what: str = "nothing was heard of it") -> str:
    """Return the reason of a loss by a closed connection, after a silence of `silent_ns`.

    A process that ends closes its connection; one that is stopped, or cut off, is silent until its lease expires.
    """
    return CLOSED if silent_ns < SILENT_NS else f"{CLOSED}: {what} for {silent_ns / 1e9:.1f} s"

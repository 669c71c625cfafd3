"""How long a process's own loop stood still: stopped, without the processor, its machine asleep, or busy in a turn.

Such a process has not looked, so it cannot know what others did meanwhile, and blames nobody for that time: every
deadline that it keeps for another one rests. It sees this by its own monotonic clock alone, since its loop knows when
it was to look again at the latest. Pure.
"""

from __future__ import annotations

from typing import Final

STOOD_NS: Final = 20_000_000
"""A loop that looks again later than it meant to by no more than this has not stood still."""
REPORTED_NS: Final = 1_000_000_000
"""One that stood still for so long says so. Its connections may have closed, which is no fault of the others either:
`session_settings.LEASE_MS`."""


class Standstill:
    """When a loop looked last."""

    def __init__(self, now_ns: int) -> None:
        self._looked_ns = now_ns

    def look(self, due_ns: int, now_ns: int) -> int:
        """The loop looks, and meant to at `due_ns` at the latest: return how long it stood still, 0 for hardly at all.

        A turn that takes long past the time at which the next one was due counts, too.
        """
        late_ns = now_ns - max(due_ns, self._looked_ns)
        self._looked_ns = now_ns
        return late_ns if late_ns > STOOD_NS else 0


def standstill_text(stood_ns: int) -> str:
    """Return what people are told of it; empty when it is too short for that."""
    return f"stood still for {stood_ns / 1e9:.1f} s: no other process is blamed" if stood_ns >= REPORTED_NS else ""

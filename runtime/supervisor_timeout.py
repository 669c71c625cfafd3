"""How long a process goes on without its supervisor: it holds, and ends when none comes back.

Pure: the caller tells who is there and what time it is.
"""

from __future__ import annotations

from typing import Final

from foosim.deployment.schema import Deployment

UNKNOWN_NS: Final = 30_000_000_000
"""The time while the deployment is not known."""


class Orphan:
    """Since when the supervisor is gone."""

    def __init__(self) -> None:
        self._gone_ns: int | None = None

    @property
    def is_alone(self) -> bool:
        """Whether the supervisor is gone."""
        return self._gone_ns is not None

    def hear(self, is_alive: bool, now_ns: int) -> None:
        """The supervisor has come or gone."""
        self._gone_ns = None if is_alive else now_ns

    def rest(self, stood_ns: int, now_ns: int) -> None:
        """Our own loop stood still for so long: that does not count (`standstill`)."""
        if self._gone_ns is not None:
            self._gone_ns = min(now_ns, self._gone_ns + stood_ns)

    def is_over(self, deployment: Deployment | None, now_ns: int) -> bool:
        """Whether it has been gone for too long."""
        limit_ns = UNKNOWN_NS if deployment is None else deployment.deadlines.orphan_ns
        return self._gone_ns is not None and now_ns - self._gone_ns >= limit_ns

"""The timeout of a process that has lost its supervisor. It waits, and ends at the timeout. Pure."""

from __future__ import annotations

from typing import Final

from foosim.deployment.schema import Deadlines, Deployment

UNKNOWN_NS: Final = Deadlines().orphan_ns
"""The timeout before the deployment has been received."""


class SupervisorTimeout:
    """The time since the loss of the supervisor."""

    def __init__(self) -> None:
        self._lost_ns: int | None = None

    @property
    def is_alone(self) -> bool:
        """Whether the supervisor is gone."""
        return self._lost_ns is not None

    def hear(self, is_alive: bool, now_ns: int) -> None:
        """The presence of the supervisor has begun or ended."""
        self._lost_ns = None if is_alive else now_ns

    def rest(self, stood_ns: int, now_ns: int) -> None:
        """Exclude a standstill of this process from the timeout."""
        if self._lost_ns is not None:
            self._lost_ns = min(now_ns, self._lost_ns + stood_ns)

    def is_over(self, deployment: Deployment | None, now_ns: int) -> bool:
        """Whether the timeout has expired."""
        limit_ns = UNKNOWN_NS if deployment is None else deployment.deadlines.orphan_ns
        return self._lost_ns is not None and now_ns - self._lost_ns >= limit_ns

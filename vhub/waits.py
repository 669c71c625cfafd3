"""Whom the closing of a tick waited for, and for how long: what makes a late tick's culprit known.

A closing waits for the nodes' samples once its commit is there, and for the clients' Dones once their Go is said. Time
in which the hub itself was busy counts for nobody else. Neighbours: `core` closes ticks, `supervisor.progress` is told.
"""

from __future__ import annotations

from foosim.protocol.messages import DONE_OF, SAMPLES_OF


class Waits:
    """The waits of the closing at hand. `node` and `client` are those whose samples and Done came last."""

    def __init__(self) -> None:
        self.node = self.client = ""
        self._busy_ns = 0
        self._begun_ns = -1
        self._world_ns = 0

    def took(self, begun_ns: int, ended_ns: int) -> None:
        """A turn of the hub took this long."""
        self._busy_ns += max(0, ended_ns - begun_ns)

    def begin(self, now_ns: int) -> None:
        """The commit of the tick is there; only the first call counts."""
        if self._begun_ns < 0:
            self._begun_ns = now_ns - self._busy_ns

    def close_world(self, now_ns: int) -> None:
        """All samples are there."""
        self._world_ns = now_ns - self._busy_ns

    def close(self, now_ns: int, least_ns: int) -> str:
        """All Dones are there: return what was waited for longest, as heartbeats say it; '' if less than `least_ns`."""
        samples_ns = self._world_ns - self._begun_ns
        dones_ns = now_ns - self._busy_ns - self._world_ns
        self._begun_ns = -1
        if max(samples_ns, dones_ns) < least_ns:
            return ""
        return SAMPLES_OF + self.node if samples_ns > dones_ns else DONE_OF + self.client

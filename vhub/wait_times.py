"""Accounts for the time that a closing waits for others, so that a late tick is attributed to the process at fault.

A closing waits for the nodes' samples once its commit has come, and for the clients' Dones once their Go has been sent.
Time in which the vHub itself was busy is attributed to no other process.
"""

from __future__ import annotations

from foosim.protocol.messages import DONE_OF, SAMPLES_OF


class WaitTimes:
    """Wait times of the present closing. `node` and `client` are the last ones to send samples and Done."""

    def __init__(self) -> None:
        self.node = self.client = ""
        self._busy_ns = 0
        self._begun_ns = -1
        self._world_ns = 0

    def took(self, begun_ns: int, ended_ns: int) -> None:
        """Count a turn of the vHub's loop as busy time."""
        self._busy_ns += max(0, ended_ns - begun_ns)

    def begin(self, now_ns: int) -> None:
        """The commit of the tick has come; only the first call counts."""
        if self._begun_ns < 0:
            self._begun_ns = now_ns - self._busy_ns

    def close_world(self, now_ns: int) -> None:
        """All samples have come."""
        self._world_ns = now_ns - self._busy_ns

    def close(self, now_ns: int, least_ns: int) -> str:
        """All Dones have come: return the longest wait's cause as heartbeats name it; empty if below `least_ns`."""
        samples_ns = self._world_ns - self._begun_ns
        dones_ns = now_ns - self._busy_ns - self._world_ns
        self._begun_ns = -1
        if max(samples_ns, dones_ns) < least_ns:
            return ""
        return SAMPLES_OF + self.node if samples_ns > dones_ns else DONE_OF + self.client

"""The clocks of a rehearsal's processes: one monotonic clock per process, as on separate machines.

They differ in offset and slightly in rate, so times of two processes are not comparable.
"""

from __future__ import annotations

from dataclasses import dataclass

MILLION = 1_000_000


@dataclass
class Clock:
    """One process's clock: its reading at virtual time 0, and its rate error."""

    offset_ns: int = 0
    drift_ppm: int = 0

    def at(self, virtual_ns: int) -> int:
        """Return its reading at a virtual time."""
        return virtual_ns + self.offset_ns + virtual_ns * self.drift_ppm // MILLION

    def when(self, clock_ns: int) -> int:
        """Return the first virtual time at which its reading is at least this."""
        passed_ns = clock_ns - self.offset_ns
        if not self.drift_ppm:
            return passed_ns
        return -(-passed_ns * MILLION // (MILLION + self.drift_ppm))

"""The clocks of a rehearsal's processes: each has a monotonic one of its own, as machines have.

They differ in where they began and a little in their speed; no two processes may compare them.
"""

from __future__ import annotations

from dataclasses import dataclass

MILLION = 1_000_000


@dataclass
class Clock:
    """One process's clock: what it shows at virtual time 0, and how much faster it goes."""

    offset_ns: int = 0
    drift_ppm: int = 0

    def at(self, virtual_ns: int) -> int:
        """Return what it shows at a virtual time."""
        return virtual_ns + self.offset_ns + virtual_ns * self.drift_ppm // MILLION

    def when(self, clock_ns: int) -> int:
        """Return the first virtual time at which it shows at least this."""
        passed_ns = clock_ns - self.offset_ns
        if not self.drift_ppm:
            return passed_ns
        return -(-passed_ns * MILLION // (MILLION + self.drift_ppm))

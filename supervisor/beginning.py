"""The time until the first commit of a run that is started or resumed: only `deadlines.start` counts.

All processes of such a run are started at about the same time, some of them slowly. A supervisor that alone was started
again finds processes that live: they say heartbeats before a hello, and the deadlines of a running world hold for them.
A run that is resumed and does not come to a commit is abandoned, not ended: its journals and its capture stay as they
are, so that it can be resumed once more. Pure.
"""

from __future__ import annotations

from foosim.deployment.schema import Deployment


class Beginning:
    """Whether processes are being started, and what that makes of a deadline."""

    def __init__(self, deployment: Deployment, first_tick: int) -> None:
        self.tick = first_tick
        """The last tick that was committed before everything was started."""
        self.goes_on = False
        """Whether the run had come to an epoch before."""
        self.found_living = False
        """Whether a process was heard that takes part since before this supervisor was started."""
        self.abandoned = ""
        """Why the run, which was resumed, does not go on."""
        self._first_tick = first_tick
        self._start_ns = deployment.deadlines.start_ns

    def go_on(self, tick: int) -> None:
        """The run goes on from this tick, at which its journal ends."""
        self.tick, self.goes_on = tick, True

    def lasts(self, tick: int) -> bool:
        """Whether processes are still being started while frame `tick` is the last one."""
        return tick <= self._first_tick or (tick <= self.tick and not self.found_living)

    def patience_ns(self, tick: int, deadline_ns: int) -> int:
        """Return how long to wait at frame `tick` where a running world waits for `deadline_ns`."""
        return max(deadline_ns, self._start_ns) if self.lasts(tick) else deadline_ns

    def abandons(self, tick: int, reason: str) -> bool:
        """Whether a run that cannot go on from frame `tick`, for this reason, is left as it was when it was resumed."""
        if self.goes_on and not self.found_living and tick <= self.tick:
            self.abandoned = reason
        return bool(self.abandoned)

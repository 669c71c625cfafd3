"""The vHub that is gone: the run waits for it to come back, and ends in order when it does not.

Nodes just lack deliveries, so nothing is given up and no epoch begins. It comes back by the handshake, as a process
that was started again and goes on from its journal, or is heard again, when only its connection or its loop had stood.
Neighbours: `watch` finds that it is silent, `recovery` has the account, `core` asks whether the wait is over.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from foosim.protocol import channels
from foosim.protocol.actions import Publish
from foosim.supervisor.account import Recovered
from foosim.supervisor.departures import Departures

if TYPE_CHECKING:
    from foosim.supervisor.core import SupervisorCore

SAID_NS: Final = 500_000_000
"""How long what it said last may take after the news that it is gone: that does not mean that it is back."""


class Absence:
    """Whether the vHub is away, and since when."""

    def __init__(self, core: SupervisorCore) -> None:
        self.is_away = False
        self.players = Departures(core)
        self._core = core
        self._since_ns = 0
        self._reason = ""
        self._lost_at = 0, 0
        """The epoch and the tick at which it went."""
        self._gap_ns = 0
        """The longest time between two commits since it is gone."""
        self._entry: Recovered | None = None
        self._tick = -1
        """Where it stood when it was lost for not going on; -1 when it was lost for anything else."""

    def lose(self, reason: str, now_ns: int) -> None:
        """The vHub is gone: a run that goes on waits for it, and says for how long in its account."""
        core = self._core
        process = core.roster.by_name.get(channels.VHUB)
        if process is not None:
            core.roster.lose(process)
        if self.is_away:
            return
        self._since_ns, self._reason, self._lost_at = now_ns, reason, (core.epoch, core.frame.tick)
        if not core.is_open:  # it is waited for as those are who have not come yet
            if core.take_over is not None:
                core.take_over.lose_hub()
            core.say("warning", f"lost the vHub: {reason}; the run has not started, and waits for it")
            return
        told = None if process is None else process.heartbeat
        self._tick = told.tick if told is not None and "overdue" in reason else -1
        self.is_away, self._gap_ns = True, 0
        core.say("warning", f"lost the vHub: {reason}; the run waits for it at tick {core.frame.tick}")

    def as_json(self, now_ns: int) -> dict[str, Any]:
        """Return why the vHub was lost last, at which tick, and how many seconds of wall time ago."""
        return {"reason": self._reason, "tick": self._lost_at[1], "for_s": round((now_ns - self._since_ns) / 1e9, 1)}

    def hear(self, now_ns: int) -> None:
        """The vHub that is lost is heard of: it is back, unless that was said before it went, or it still stands."""
        core = self._core
        process = core.roster.by_name[channels.VHUB]
        told = process.heartbeat
        goes_on = self._tick < 0 or (told is not None and told.tick > self._tick)
        if core.end is None and goes_on and now_ns > max(self._since_ns, process.gone_ns) + SAID_NS:
            process.lost = False
            if core.is_open:  # else it says itself that it is ready, until it is told of an epoch
                self.ready(now_ns)

    def ready(self, now_ns: int) -> None:
        """The vHub takes part: tell it what it does not know."""
        core = self._core
        core.say_epoch()
        core.actions.append(Publish(channels.TEMPO, channels.SUPERVISOR, core.tempo()))
        if self.is_away:
            self.is_away = False
            self._note()
            core.watch.begun(now_ns)
            core.say("info", f"the vHub is back after {(now_ns - self._since_ns) / 1e9:.2f} s")

    def committed(self, before_ns: int, now_ns: int) -> None:
        """A frame is committed, the one before it was at `before_ns`."""
        self.players.committed(before_ns, now_ns)
        if self.is_away:  # what was on its way when it went, or the first that it made possible
            self._gap_ns = max(self._gap_ns, now_ns - before_ns)
        elif self._entry is not None:
            self._entry.outage_ns, self._entry = max(self._gap_ns, now_ns - before_ns), None

    def rest(self, stood_ns: int) -> None:
        """The supervisor stood still for so long: that is no time in which the vHub could be heard."""
        self._since_ns += stood_ns

    def is_over(self, now_ns: int) -> bool:
        """Whether the vHub was away for longer than a run waits; then the run is over, which is said."""
        core = self._core
        wait_ns = core.beginning.patience_ns(core.frame.tick, core.deployment.deadlines.vhub_back_ns)
        if not self.is_away or now_ns < self._since_ns + wait_ns:
            return False
        self._note()
        core.finish(f"lost vhub: {self._reason}; it did not come back within {wait_ns / 1e9:g} s", failed=True)
        return True

    def _note(self) -> None:
        """Put it into the account, when it is over: the world stood still until now."""
        self._entry = self._core.recovery.note("vhub", channels.VHUB, self._reason, *self._lost_at)

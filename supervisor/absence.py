"""The vHub that is gone: the run waits for it to come back, and ends in order when it does not.

Nodes just lack deliveries, so nothing is given up and no epoch begins. It comes back by the handshake, as a process
that was started again and goes on from its journal, or is heard again, when only its connection or its loop had stood.
Neighbours: `watch` finds that it is silent, `recovery` has the account, `core` asks whether the wait is over.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from foosim.protocol import channels
from foosim.protocol.actions import Journal, Publish
from foosim.protocol.codec import encode
from foosim.supervisor.account import Recovered
from foosim.supervisor.records import RecoveredRecord

if TYPE_CHECKING:
    from foosim.supervisor.core import SupervisorCore

SAID_NS: Final = 500_000_000
"""How long what it said last may take after the news that it is gone: that does not mean that it is back."""


class Absence:
    """Whether the vHub is away, and since when."""

    def __init__(self, core: SupervisorCore) -> None:
        self.is_away = False
        self._core = core
        self._since_ns = 0
        self._gap_ns = 0
        """The longest time between two commits since it is gone."""
        self._entry: Recovered | None = None

    def go_on(self) -> None:
        """The supervisor was started again while the vHub was away: it is here by the first commit."""
        known = self._core.recovery.recovered
        self._entry = next((entry for entry in known if entry.what == "vhub" and entry.outage_ns < 0), None)

    def lose(self, reason: str, now_ns: int) -> None:
        """The vHub is gone."""
        core = self._core
        process = core.roster.by_name.get(channels.VHUB)
        if process is not None:
            core.roster.lose(process)
        if self.is_away:
            return
        self.is_away, self._since_ns, self._gap_ns = True, now_ns, 0
        if not core.is_open:
            core.say("warning", f"lost the vHub: {reason}; the run has not started, and waits for it")
            return
        if self._entry is None:  # else it went again before anything was committed
            self._entry = Recovered("vhub", channels.VHUB, reason, core.frame.tick, core.epoch)
            core.recovery.recovered.append(self._entry)
            core.actions.append(Journal(encode(RecoveredRecord(self._entry))))
        core.say("warning", f"lost the vHub: {reason}; the run waits for it at tick {core.frame.tick}")

    def hear(self, now_ns: int) -> None:
        """The vHub that is lost is heard of: it is back, unless that was said before it went."""
        core = self._core
        process = core.roster.by_name[channels.VHUB]
        if core.end is None and now_ns > max(self._since_ns, process.gone_ns) + SAID_NS:
            process.lost = False
            self.ready(now_ns)

    def ready(self, now_ns: int) -> None:
        """The vHub takes part: tell it what it does not know."""
        core = self._core
        core.say_epoch()
        core.actions.append(Publish(channels.TEMPO, channels.SUPERVISOR, core.tempo()))
        if self.is_away:
            self.is_away = False
            core.watch.begun(now_ns)
            core.say("info", f"the vHub is back after {(now_ns - self._since_ns) / 1e9:.2f} s")

    def committed(self, before_ns: int, now_ns: int) -> None:
        """A frame is committed, the one before it was at `before_ns`."""
        entry = self._entry
        if entry is not None:
            self._gap_ns = max(self._gap_ns, now_ns - before_ns)
            if not self.is_away:
                entry.outage_ns, self._entry = self._gap_ns, None
                self._core.actions.append(Journal(encode(RecoveredRecord(entry))))

    def is_over(self, now_ns: int) -> bool:
        """Whether the vHub was away for longer than a run waits; then the run is over, which is said."""
        core = self._core
        if not self.is_away or not core.is_open or now_ns < self._since_ns + core.deployment.deadlines.vhub_back_ns:
            return False
        wait_s = core.deployment.deadlines.vhub_back_ns / 1e9
        reason = "" if self._entry is None else f"{self._entry.reason}; "
        core.finish(f"lost vhub: {reason}it did not come back within {wait_s:g} s", failed=True)
        return True

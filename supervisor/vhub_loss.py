"""Loss of the vHub and of players: the run waits for a lost vHub, and records the duration of the outage.

Nodes only lack deliveries meanwhile, so no robot moves and no epoch begins. The vHub returns by the handshake, as a
process that was restarted and resumed from its journal, or by a heartbeat, when only its connection or its loop had
stalled. The vHub itself deals with lost players and reports them in its heartbeats.
"""

from __future__ import annotations

from collections import Counter
from typing import Any

from foosim.protocol import channels
from foosim.supervisor.progress import ProgressMonitor
from foosim.supervisor.records import Recovered
from foosim.supervisor.roster import IN_FLIGHT_NS, Process
from foosim.supervisor.state import RunState


class VhubLoss:
    """Waits for a vHub that was lost."""

    def __init__(self, state: RunState, progress: ProgressMonitor) -> None:
        self._state = state
        self._progress = progress
        self._since_ns = 0
        self._reason = ""
        self._lost_at = 0, 0
        """The epoch and the tick at which it was lost."""
        self._gap_ns = 0
        """The longest time between two commits since then."""
        self._entry: Recovered | None = None
        self._tick = -1
        """Its tick when it was lost for making no progress; -1 when it was lost for another reason."""

    def lose(self, reason: str, now_ns: int) -> None:
        """The vHub is lost: an open run waits for it, and has the outage in its account."""
        state = self._state
        process = state.roster.by_name.get(channels.VHUB)
        if process is not None:
            state.roster.lose(process)
        if state.is_vhub_away:
            return
        self._since_ns, self._reason, self._lost_at = now_ns, reason, (state.epoch, state.frame.tick)
        if not state.is_open:  # the run waits for it as for any missing process
            state.log("warning", f"lost the vHub: {reason}; the run has not started, and waits for it")
            return
        heartbeat = None if process is None else process.heartbeat
        self._tick = heartbeat.tick if heartbeat is not None and "overdue" in reason else -1
        state.is_vhub_away, self._gap_ns = True, 0
        state.log("warning", f"lost the vHub: {reason}; the run waits for it at tick {state.frame.tick}")

    def as_json(self, now_ns: int) -> dict[str, Any]:
        """Return why the vHub was lost last, at which tick, and how many seconds of wall time ago."""
        return {"reason": self._reason, "tick": self._lost_at[1], "for_s": round((now_ns - self._since_ns) / 1e9, 1)}

    def on_heartbeat(self, process: Process, now_ns: int) -> None:
        """A lost vHub sends a heartbeat: it is back, unless that predates its loss or its tick does not advance."""
        state, heartbeat = self._state, process.heartbeat
        advances = self._tick < 0 or (heartbeat is not None and heartbeat.tick > self._tick)
        if state.end is None and advances and now_ns > max(self._since_ns, process.closed_ns) + IN_FLIGHT_NS:
            process.lost = False
            if state.is_open:  # else it repeats that it is ready, until it gets an epoch
                self.on_ready(now_ns)

    def on_ready(self, now_ns: int) -> None:
        """The vHub is ready: send it the epoch and the pace."""
        state = self._state
        state.publish_epoch()
        state.publish_tempo()
        if state.is_vhub_away:
            state.is_vhub_away = False
            self.note()
            self._progress.begun(now_ns)
            state.log("info", f"the vHub is back after {(now_ns - self._since_ns) / 1e9:.2f} s")

    def committed(self, before_ns: int, now_ns: int) -> None:
        """A frame is committed, the one before it was at `before_ns`."""
        if self._state.is_vhub_away:  # from deliveries that were in flight
            self._gap_ns = max(self._gap_ns, now_ns - before_ns)
        elif self._entry is not None:  # the first one since the vHub is back
            self._entry.outage_ns, self._entry = max(self._gap_ns, now_ns - before_ns), None

    def on_standstill(self, stood_ns: int) -> None:
        """Extend the vHub's deadline by a standstill of the supervisor's loop."""
        self._since_ns += stood_ns

    def timeout(self, now_ns: int) -> str:
        """Return why the run ends when the vHub was away for longer than a run waits; else an empty string."""
        state = self._state
        wait_ns = state.wait_ns(state.deployment.deadlines.vhub_back_ns)
        if not state.is_vhub_away or now_ns < self._since_ns + wait_ns:
            return ""
        self.note()
        return f"lost vhub: {self._reason}; it did not come back within {wait_ns / 1e9:g} s"

    def note(self) -> None:
        """Record the loss, with the outage until now."""
        self._entry = self._state.note_recovery("vhub", channels.VHUB, self._reason, *self._lost_at)


class PlayerLosses:
    """Adds to the account which players were away, as the vHub reports it.

    Its heartbeats have the players that are away, and numbered past absences; a restarted vHub reports from
    its journal once more what the one before did.
    """

    def __init__(self, state: RunState) -> None:
        self._state = state
        self._boot = ""
        """The start of the vHub that has reported last."""
        self._last_number = 0
        """The number of its last entry."""
        self._known: Counter[tuple[str, str, str, int]] = Counter()
        """The account when this supervisor first heard of this start of the vHub, which reports that once more."""
        self._gaps_ns: dict[str, int] = {}
        """Of the players that are away: the longest time between two commits since."""
        self._open: list[tuple[Recovered, int]] = []

    def on_report(self, hub: Process) -> None:
        """Add the entries of a vHub's report that the journal lacks."""
        state, absences = self._state, hub.report.get("absences")
        if absences is None or not state.is_open or state.end is not None:
            return
        if absences["boot"] != hub.boot:
            return  # a late report of a vHub before this one
        if hub.boot != self._boot:
            self._boot, self._last_number = hub.boot, 0
            self._known = Counter((entry.what, entry.name, entry.reason, entry.tick) for entry in state.recovered)
        gaps_ns, self._gaps_ns = self._gaps_ns, {name: self._gaps_ns.get(name, 0) for name in absences["away"]}
        for number, what, name, reason, tick in absences["over"]:
            if number <= self._last_number:
                continue
            self._last_number = number
            if self._known[what, name, reason, tick] > 0:
                self._known[what, name, reason, tick] -= 1
                continue
            entry = state.note_recovery(what, name, reason, state.epoch, tick)
            self._open.append((entry, gaps_ns.get(name, 0)))

    def committed(self, before_ns: int, now_ns: int) -> None:
        """A frame is committed, the one before it was at `before_ns`."""
        for name, gap_ns in self._gaps_ns.items():
            self._gaps_ns[name] = max(gap_ns, now_ns - before_ns)
        for entry, gap_ns in self._open:
            entry.outage_ns = max(gap_ns, now_ns - before_ns)
        self._open.clear()

"""Who is waited for, who is late, who is lost.

Who is waited for is who has all its inputs and has not answered (node: order and deliveries; vHub: commit, samples and
Dones; lockstep client: Go). Only that one can be late or overdue. A late tick is blamed on who took the longest on the
way from the last commit to its own, on a clock that stands still while the supervisor itself was busy; ticks that only
catch up keep the name of who made them late.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

from foosim.common import limits
from foosim.deployment.schema import Deployment
from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.protocol.messages import CAPTURE, DONE_OF, JOIN_OF, SAMPLES_OF, Heartbeat
from foosim.runtime.standstill import TOLD_NS, told
from foosim.supervisor.roster import Process, Roster

if TYPE_CHECKING:
    from foosim.supervisor.core import SupervisorCore

DOUBT_NS: Final = 1_000_000_000
"""For how long behind a standstill of the supervisor connections end that it has itself kept silent on."""
CUT_SEEN_NS: Final = 1_500_000_000
"""By then the connection of a process that is cut off has closed: a lease, and what it takes to notice its end."""
LATE_EVERY_NS: Final = 1_000_000_000
"""How often late ticks are logged at most."""


class Watch:
    """When each input of the last ticks came, by the supervisor's clock less what it was busy itself."""

    def __init__(self, deployment: Deployment, roster: Roster, now_ns: int) -> None:
        self.deployment = deployment
        self.roster = roster
        self.now_ns = now_ns
        self.ended_ns = 0
        self.late = ""
        """The process that the last late tick waited for."""
        self.late_tick = -1
        self._busy_ns = 0
        self._begun_ns = self._progress_ns = now_ns
        self._doubt_ns = 0
        """Until when the end of a connection may come of the supervisor's own standstill."""
        self._named = ""
        self._lag_ns = 0
        self._late_ticks = 0
        self._late_said_ns = now_ns - LATE_EVERY_NS
        self._released: dict[int, int] = {}
        self._delivered: dict[int, int] = {0: now_ns}
        self._committed: dict[int, tuple[int, int]] = {}
        """Of each frame: when it was committed, and how long the supervisor had been busy until then."""
        self._parts: dict[int, dict[str, int]] = {}
        self._told: dict[int, str] = {}
        """By tick: whom its deliveries waited for, as the vHub said."""

    # --- what came when ----------------------------------------------------------------------------------------------

    def took(self, begun_ns: int, ended_ns: int) -> None:
        """A turn of the supervisor took this long."""
        self._busy_ns += max(0, ended_ns - begun_ns)

    def begun(self, now_ns: int) -> None:
        """An epoch begins."""
        self._begun_ns = self._progress_ns = now_ns

    def rest(self, core: SupervisorCore, stood_ns: int, now_ns: int) -> None:
        """The supervisor's own loop stood still for so long: no deadline of another one runs then (`standstill`)."""
        for process in self.roster.by_name.values():
            process.heard_ns = min(now_ns, process.heard_ns + stood_ns)
        self._begun_ns = min(now_ns, self._begun_ns + stood_ns)
        self._progress_ns = min(now_ns, self._progress_ns + stood_ns)
        self.ended_ns = min(now_ns, self.ended_ns + stood_ns)
        core.absence.rest(stood_ns)
        core.closing.rest(stood_ns, now_ns)
        if core.take_over is not None:
            core.take_over.rest(stood_ns)
        if stood_ns >= TOLD_NS:
            self._doubt_ns = now_ns + DOUBT_NS
            core.say("warning", told(stood_ns))

    def doubts(self, process: Process, now_ns: int) -> bool:
        """Whether a connection that has ended says nothing of its process, which is lost when it stays silent.

        One that ends a second time, or whose successor is here, is beyond doubt.
        """
        process.in_doubt = now_ns < self._doubt_ns and not process.in_doubt
        return process.in_doubt

    def set_back(self, tick: int, now_ns: int) -> None:
        """The run goes on from an earlier tick: nothing has come for those behind it."""
        for known in (self._released, self._delivered, self._committed, self._parts, self._told):
            for behind in [each for each in known if each > tick]:
                known.pop(behind)
        self._released.pop(tick, None)
        self.begun(now_ns)

    def released(self, tick: int, now_ns: int) -> None:
        self._released[tick] = now_ns - self._busy_ns
        before = (tick - 1, tick - 2)
        if not any(earlier in self._released and earlier + 1 not in self._committed for earlier in before):
            self._progress_ns = now_ns  # nothing was waited for until now

    def delivered(self, tick: int, now_ns: int) -> None:
        self._delivered[tick] = now_ns - self._busy_ns

    def told(self, heartbeat: Heartbeat) -> None:
        """The vHub says whom its closing waited for: the deliveries of the tick after are late because of it."""
        names = _names(heartbeat.waiting_for)
        if names:
            self._told[heartbeat.tick + 1] = names[0]
            self._told.pop(heartbeat.tick + 1 - limits.KEPT_TICKS, None)

    def part(self, tick: int, node: str, now_ns: int) -> None:
        """A node's part of the frame after `tick` has come."""
        self._parts.setdefault(tick, {})[node] = now_ns - self._busy_ns

    def committed(self, frame_tick: int, lag_ns: int, due_ns: int, now_ns: int) -> str:
        """A frame is committed, of a tick that was due to be released at `due_ns`; return what is to be logged."""
        if lag_ns > self._lag_ns:
            self.late = self._waited_for(frame_tick - 1, due_ns, now_ns)
            self.late_tick = frame_tick
        self._lag_ns = lag_ns
        self._committed[frame_tick] = now_ns - self._busy_ns, self._busy_ns
        self._progress_ns = now_ns
        self._named = ""
        for known in (self._released, self._delivered, self._committed, self._parts):
            known.pop(frame_tick - limits.KEPT_TICKS, None)
        return self._late_line(frame_tick, lag_ns, now_ns)

    def _late_line(self, frame_tick: int, lag_ns: int, now_ns: int) -> str:
        """Return a line about late ticks, once a second at most."""
        if lag_ns < self.deployment.tick_ns:
            return ""
        self._late_ticks += 1
        if now_ns - self._late_said_ns < LATE_EVERY_NS:
            return ""
        self._late_said_ns, count, self._late_ticks = now_ns, self._late_ticks, 0
        return f"tick {frame_tick}: lag {lag_ns / 1e6:.1f} ms, waited for {self.late} ({count} late ticks)"

    def _waited_for(self, tick: int, due_ns: int, now_ns: int) -> str:
        """Return who took the longest between the commit of frame `tick` and that of the next one."""
        before, busy_before_ns = self._committed.get(tick, (self._begun_ns - self._busy_ns, self._busy_ns))
        begun = max(before, due_ns - busy_before_ns)
        released = max(begun, self._released.get(tick, begun))
        delivered = max(begun, self._delivered.get(tick, begun))
        spans = {SUPERVISOR: self._busy_ns - busy_before_ns + released - begun}
        hub = self._told.get(tick, VHUB)
        spans[hub] = spans.get(hub, 0) + delivered - begun
        for node, came in self._parts.get(tick, {}).items():
            spans[node] = spans.get(node, 0) + came - max(released, delivered)
        return max(sorted(spans), key=lambda name: spans[name])

    # --- who is waited for -------------------------------------------------------------------------------------------

    def waiting_for(self, core: SupervisorCore) -> list[str]:
        """Return who is being waited for: processes and lockstep clients, in name order."""
        if not core.is_open:
            missing = self.roster.missing(core.frame.layout.digest)
            clients = self._hub_waits_for() if missing == [VHUB] else []
            return clients or missing
        tick = core.frame.tick
        if tick >= core.released:
            return []
        if tick not in self._delivered:
            return self._hub_waits_for() or [VHUB]
        return core.missing_nodes

    def _hub_waits_for(self) -> list[str]:
        """Return the clients or nodes that the vHub says it waits for."""
        hub = self.roster.by_name.get(VHUB)
        return [] if hub is None or hub.heartbeat is None else _names(hub.heartbeat.waiting_for)

    def _has_sensed(self, name: str) -> bool:
        """Whether a node that the vHub waits for has said what its robots measure: it is at that tick, or further.

        Then perhaps the vHub does not hear it, which shows when its connection closes.
        """
        node, hub = self.roster.by_name.get(name), self.roster.by_name.get(VHUB)
        if node is None or node.role != "node" or node.heartbeat is None or hub is None or hub.heartbeat is None:
            return False
        return hub.heartbeat.waiting_for.startswith(SAMPLES_OF) and node.heartbeat.tick >= hub.heartbeat.tick

    def lost(self, core: SupervisorCore, now_ns: int) -> dict[str, str]:
        """Return who is lost, and why."""
        self.now_ns = now_ns
        deadlines = self.deployment.deadlines
        if core.epoch == 0:
            return self._late_to_start(core, now_ns)
        tick = core.frame.tick
        heartbeat_ns = core.beginning.patience_ns(tick, deadlines.heartbeat_ns)
        silent = self.roster.silent(now_ns, heartbeat_ns)
        if silent:
            return dict.fromkeys(silent, f"no heartbeat for {heartbeat_ns / 1e9:g} s")
        if core.take_over is not None:
            return {}  # nobody is waited for yet
        if core.absence.is_away:
            self._progress_ns = now_ns  # nothing goes on without it, and nobody else is to blame
            return {}
        names = [name for name in self.waiting_for(core) if name in core.members or name not in self.deployment.nodes]
        if all(name in self.deployment.players or name in self.deployment.clients for name in names):
            self._progress_ns = max(self._progress_ns, now_ns - deadlines.tick_named_ns)  # the vHub has their deadline
            return {}
        waited = ", ".join(names)
        overdue_ns = now_ns - self._progress_ns
        lost_ns = core.beginning.patience_ns(tick, deadlines.tick_lost_ns)
        if names and all(map(self._has_sensed, names)):
            lost_ns = max(lost_ns, CUT_SEEN_NS)
        if self._waits_for_capture(names):
            lost_ns = max(lost_ns, deadlines.close_ns)
        if overdue_ns > lost_ns:
            return dict.fromkeys(names, f"tick {tick} is overdue by {overdue_ns / 1e9:.1f} s")
        if overdue_ns > deadlines.tick_named_ns and waited != self._named:
            self._named = waited
            core.say("warning", f"tick {tick} waits for {waited} since {overdue_ns / 1e9:.1f} s")
        return {}

    def _waits_for_capture(self, names: list[str]) -> bool:
        """Whether the vHub, which alone is waited for, says that it waits for its disk."""
        hub = self.roster.by_name.get(VHUB)
        told = None if hub is None else hub.heartbeat
        return names == [VHUB] and told is not None and told.waiting_for == CAPTURE

    def _late_to_start(self, core: SupervisorCore, now_ns: int) -> dict[str, str]:
        """Give local processes and players their time to start; what is started by hand is waited for."""
        local = {name for name, node in self.deployment.nodes.items() if node.launch == "local"}
        local |= {VHUB, *self.deployment.players}
        missing = [name for name in self.waiting_for(core) if name in local]
        if not missing or now_ns - self._begun_ns <= self.deployment.deadlines.start_ns:
            return {}
        return dict.fromkeys(missing, f"not ready within {self.deployment.deadlines.start_ns / 1e9:g} s")


def losses(lost: Mapping[str, str]) -> str:
    """Return who is lost and why as a reason to end."""
    return "lost " + "; ".join(f"{name}: {why}" for name, why in lost.items())


def _names(waiting_for: str) -> list[str]:
    """Return the names in what a heartbeat of the vHub says that it waits for."""
    for what in (DONE_OF, SAMPLES_OF, JOIN_OF):
        if waiting_for.startswith(what):
            return [name for name in waiting_for.removeprefix(what).split(", ") if name]
    return []

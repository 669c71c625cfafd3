"""Progress of a run: which process is waited for, which is late, which is lost, and whether the capture gets closed.

A process is waited for when it has all its inputs and has not answered (node: order and deliveries; vHub: commit,
samples and Dones; lockstep client: Go). Only such a process can be late or overdue. A late tick is blamed on the
process with the longest share of the time from the last commit to its own, on a clock that stops while the
supervisor itself is busy; ticks that only catch up keep the blame of the tick that made them late.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from foosim.common import limits
from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.protocol.messages import CAPTURE, DONE_OF, JOIN_OF, SAMPLES_OF, Heartbeat
from foosim.runtime.roles.standstill import REPORTED_NS, standstill_text
from foosim.supervisor.roster import Process
from foosim.supervisor.state import RunState

DOUBT_NS: Final = 1_000_000_000
"""After a standstill of the supervisor, connections that it kept silent end within this time."""
CUT_SEEN_NS: Final = 1_500_000_000
"""By then the connection of a cut-off process has closed: a lease, and the time to notice its end."""
LATE_EVERY_NS: Final = 1_000_000_000
"""How often late ticks are logged at most."""


class ProgressMonitor:
    """Times of the inputs of the last ticks, by the supervisor's clock less its own busy time."""

    def __init__(self, state: RunState, now_ns: int) -> None:
        self._state = state
        self.now_ns = now_ns
        """The time of the last call of `lost`."""
        self.late = ""
        """The process that the last late tick waited for."""
        self.late_tick = -1
        self._busy_ns = 0
        self._begun_ns = self._progress_ns = now_ns
        self._doubt_ns = 0
        """Until when a connection may close because of the supervisor's own standstill."""
        self._named = ""
        self._lag_ns = 0
        self._late_ticks = 0
        self._late_logged_ns = now_ns - LATE_EVERY_NS
        self._released: dict[int, int] = {}
        self._delivered: dict[int, int] = {0: now_ns}
        self._committed: dict[int, tuple[int, int]] = {}
        """Of each frame: when it was committed, and how long the supervisor had been busy until then."""
        self._parts: dict[int, dict[str, int]] = {}
        self._late_by: dict[int, str] = {}
        """By tick: which process its deliveries waited for, as the vHub reported."""

    # --- arrivals ----------------------------------------------------------------------------------------------------

    def took(self, begun_ns: int, ended_ns: int) -> None:
        """Count a turn of the supervisor as its own busy time."""
        self._busy_ns += max(0, ended_ns - begun_ns)

    def begun(self, now_ns: int) -> None:
        """An epoch begins: nothing is overdue."""
        self._begun_ns = self._progress_ns = now_ns

    def on_standstill(self, stood_ns: int, now_ns: int) -> None:
        """Extend the deadlines of other processes by a standstill of the supervisor's own loop."""
        for process in self._state.roster.by_name.values():
            process.last_message_ns = min(now_ns, process.last_message_ns + stood_ns)
        self._begun_ns = min(now_ns, self._begun_ns + stood_ns)
        self._progress_ns = min(now_ns, self._progress_ns + stood_ns)
        if stood_ns >= REPORTED_NS:
            self._doubt_ns = now_ns + DOUBT_NS
            self._state.log("warning", standstill_text(stood_ns))

    def doubts(self, process: Process, now_ns: int) -> bool:
        """Whether a closed connection may be due to the supervisor's own standstill: then its process is lost only when
        it stays silent. A connection that closes a second time, or whose successor is here, is beyond doubt.
        """
        process.in_doubt = now_ns < self._doubt_ns and not process.in_doubt
        return process.in_doubt

    def released(self, tick: int, now_ns: int) -> None:
        self._released[tick] = now_ns - self._busy_ns
        before = (tick - 1, tick - 2)
        if not any(earlier in self._released and earlier + 1 not in self._committed for earlier in before):
            self._progress_ns = now_ns  # nothing was waited for until now

    def delivered(self, tick: int, now_ns: int) -> None:
        self._delivered[tick] = now_ns - self._busy_ns

    def on_heartbeat(self, heartbeat: Heartbeat) -> None:
        """The vHub reports which process its closing waited for: the deliveries of the next tick are late by it."""
        names = _names(heartbeat.waiting_for)
        if names:
            self._late_by[heartbeat.tick + 1] = names[0]
            self._late_by.pop(heartbeat.tick + 1 - limits.KEPT_TICKS, None)

    def part(self, tick: int, node: str, now_ns: int) -> None:
        """A node's part of the frame after `tick` has come."""
        self._parts.setdefault(tick, {})[node] = now_ns - self._busy_ns

    def committed(self, frame_tick: int, lag_ns: int, due_ns: int, now_ns: int) -> str:
        """A frame is committed, of a tick whose release was due at `due_ns`; return the lines to log."""
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
        if lag_ns < self._state.deployment.tick_ns:
            return ""
        self._late_ticks += 1
        if now_ns - self._late_logged_ns < LATE_EVERY_NS:
            return ""
        self._late_logged_ns, count, self._late_ticks = now_ns, self._late_ticks, 0
        return f"tick {frame_tick}: lag {lag_ns / 1e6:.1f} ms, waited for {self.late} ({count} late ticks)"

    def _waited_for(self, tick: int, due_ns: int, now_ns: int) -> str:
        """Return the process with the longest share of the time from the commit of frame `tick` to the next one."""
        before, busy_before_ns = self._committed.get(tick, (self._begun_ns - self._busy_ns, self._busy_ns))
        begun = max(before, due_ns - busy_before_ns)
        released = max(begun, self._released.get(tick, begun))
        delivered = max(begun, self._delivered.get(tick, begun))
        spans = {SUPERVISOR: self._busy_ns - busy_before_ns + released - begun}
        hub = self._late_by.get(tick, VHUB)
        spans[hub] = spans.get(hub, 0) + delivered - begun
        for node, came in self._parts.get(tick, {}).items():
            spans[node] = spans.get(node, 0) + came - max(released, delivered)
        return max(sorted(spans), key=lambda name: spans[name])

    # --- the process that the run waits for --------------------------------------------------------------------------

    def waiting_for(self) -> list[str]:
        """Return the processes and lockstep clients that are waited for, in name order."""
        state = self._state
        if not state.is_open:
            missing = state.roster.missing()
            clients = self._hub_waits_for() if missing == [VHUB] else []
            return clients or missing
        tick = state.frame.tick
        if tick >= state.released:
            return []
        if tick not in self._delivered:
            return self._hub_waits_for() or [VHUB]
        return state.missing_nodes

    def _hub_waits_for(self) -> list[str]:
        """Return the clients or nodes that the vHub reports to wait for."""
        hub = self._state.roster.by_name.get(VHUB)
        return [] if hub is None or hub.heartbeat is None else _names(hub.heartbeat.waiting_for)

    def _has_sensed(self, name: str) -> bool:
        """Whether a node that the vHub waits for has sent the samples: its heartbeat is at that tick, or further.

        Then the vHub perhaps does not hear it, which shows when its connection closes.
        """
        by_name = self._state.roster.by_name
        node, hub = by_name.get(name), by_name.get(VHUB)
        if node is None or node.role != "node" or node.heartbeat is None or hub is None or hub.heartbeat is None:
            return False
        return hub.heartbeat.waiting_for.startswith(SAMPLES_OF) and node.heartbeat.tick >= hub.heartbeat.tick

    def lost(self, now_ns: int) -> dict[str, str]:
        """Return the processes that are lost, and why."""
        self.now_ns = now_ns
        state, deployment = self._state, self._state.deployment
        deadlines = deployment.deadlines
        if state.epoch == 0:
            return self._late_to_start(now_ns)
        tick = state.frame.tick
        heartbeat_ns = state.wait_ns(deadlines.heartbeat_ns)
        silent = state.roster.silent(now_ns, heartbeat_ns)
        if silent:
            return dict.fromkeys(silent, f"no heartbeat for {heartbeat_ns / 1e9:g} s")
        if state.is_resuming:
            return {}  # no process is waited for yet
        if state.is_vhub_away:
            self._progress_ns = now_ns  # the run waits for it, and no other process is overdue
            return {}
        names = [name for name in self.waiting_for() if name in state.members or name not in deployment.nodes]
        if all(name in deployment.players or name in deployment.clients for name in names):
            self._progress_ns = max(self._progress_ns, now_ns - deadlines.tick_named_ns)  # the vHub has their deadline
            return {}
        waited = ", ".join(names)
        overdue_ns = now_ns - self._progress_ns
        lost_ns = state.wait_ns(deadlines.tick_lost_ns)
        if names and all(map(self._has_sensed, names)):
            lost_ns = max(lost_ns, CUT_SEEN_NS)
        if self._waits_for_capture(names):
            lost_ns = max(lost_ns, deadlines.close_ns)
        if overdue_ns > lost_ns:
            return dict.fromkeys(names, f"tick {tick} is overdue by {overdue_ns / 1e9:.1f} s")
        if overdue_ns > deadlines.tick_named_ns and waited != self._named:
            self._named = waited
            state.log("warning", f"tick {tick} waits for {waited} since {overdue_ns / 1e9:.1f} s")
        return {}

    def _waits_for_capture(self, names: list[str]) -> bool:
        """Whether only the vHub is waited for, and reports to wait for its disk."""
        hub = self._state.roster.by_name.get(VHUB)
        beat = None if hub is None else hub.heartbeat
        return names == [VHUB] and beat is not None and beat.waiting_for == CAPTURE

    def _late_to_start(self, now_ns: int) -> dict[str, str]:
        """Return the local processes and players that did not start in time; one started by hand has no limit."""
        deployment = self._state.deployment
        local = {name for name, node in deployment.nodes.items() if node.launch == "local"}
        local |= {VHUB, *deployment.players}
        missing = [name for name in self.waiting_for() if name in local]
        if not missing or now_ns - self._begun_ns <= deployment.deadlines.start_ns:
            return {}
        return dict.fromkeys(missing, f"not ready within {deployment.deadlines.start_ns / 1e9:g} s")


class ClosingMonitor:
    """Waits until the vHub of a run that has ended has closed the capture, for as long as it makes progress.

    The account of the capture in its heartbeats shows progress. A vHub without any for `deadlines.close`, or that ends
    meanwhile, leaves a capture that is cut off: an error, though the run itself may have been in order. A vHub has
    ended when its connection has closed and nothing was heard of it for `deadlines.heartbeat` since. The shell reads
    the file before it reports that: a capture that has its end was closed, whatever was heard of its vHub.
    """

    def __init__(self, state: RunState) -> None:
        self._state = state
        self._account: Any = None
        self._progress_ns = self._ended_ns = 0

    def ended(self, now_ns: int) -> None:
        """The run has ended."""
        self._ended_ns = now_ns

    def on_standstill(self, stood_ns: int, now_ns: int) -> None:
        """Extend the deadline by a standstill of the supervisor, which received no progress meanwhile."""
        self._progress_ns = min(now_ns, self._progress_ns + stood_ns)
        self._ended_ns = min(now_ns, self._ended_ns + stood_ns)

    def is_over(self, now_ns: int) -> bool:
        """Whether nothing is waited for any more."""
        hub, deadlines = self._state.roster.by_name.get(VHUB), self._state.deployment.deadlines
        if hub is None or hub.farewell:
            return True
        account = hub.report.get("recording"), hub.report.get("disk_progress")
        if account != self._account:
            self._account, self._progress_ns = account, now_ns
        silent_ns = now_ns - max(hub.closed_ns, hub.last_message_ns)
        if hub.closed_ns and silent_ns > deadlines.heartbeat_ns and not hub.in_doubt:
            self._cut_off(hub, "its vHub ended before it was closed")
            return True
        if now_ns > max(self._progress_ns, self._ended_ns) + deadlines.close_ns:
            wait_s = deadlines.close_ns / 1e9
            self._cut_off(hub, f"its vHub has made no progress in closing it for {wait_s:g} s (deadlines.close)")
            return True
        return False

    def _cut_off(self, hub: Process, why: str) -> None:
        if hub.report.get("capture"):
            self._state.cut_off = f"the capture is cut off: {why}"


def losses(lost: Mapping[str, str]) -> str:
    """Return the lost processes and why as a reason to end."""
    return "lost " + "; ".join(f"{name}: {why}" for name, why in lost.items())


def _names(waiting_for: str) -> list[str]:
    """Return the names in the `waiting_for` of a heartbeat of the vHub."""
    for what in (DONE_OF, SAMPLES_OF, JOIN_OF):
        if waiting_for.startswith(what):
            return [name for name in waiting_for.removeprefix(what).split(", ") if name]
    return []

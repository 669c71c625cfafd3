"""Who is waited for, who is late, who is lost.

Who is waited for is who has all its inputs and has not answered (node: order and deliveries; vHub: commit, samples and
Dones; lockstep client: Go). Only that one can be late or overdue. Neighbours: `core` tells it what came when.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from foosim.protocol import limits
from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.protocol.deployment import Deployment
from foosim.supervisor.roster import Roster

if TYPE_CHECKING:
    from foosim.supervisor.core import SupervisorCore

DONE_OF = "Done of "


class Watch:
    """When each input of the last ticks came, as wall times of the supervisor."""

    def __init__(self, deployment: Deployment, roster: Roster, now_ns: int) -> None:
        self.deployment = deployment
        self.roster = roster
        self.now_ns = now_ns
        self.ended_ns = 0
        self.late = ""
        """The process that the last late tick waited for."""
        self.late_tick = -1
        self._begun_ns = now_ns
        self._progress_ns = now_ns
        self._named = ""
        self._released: dict[int, int] = {}
        self._delivered: dict[int, int] = {0: now_ns}
        self._committed: dict[int, int] = {0: now_ns}
        self._parts: dict[int, dict[str, int]] = {}

    def begun(self, now_ns: int) -> None:
        """An epoch begins."""
        self._begun_ns = self._progress_ns = now_ns

    def released(self, tick: int, now_ns: int) -> None:
        self._released[tick] = now_ns
        if tick not in self._parts:
            self._parts[tick] = {}
        if not self._waits_before(tick):
            self._progress_ns = now_ns

    def _waits_before(self, tick: int) -> bool:
        return any(earlier in self._released and earlier + 1 not in self._committed for earlier in (tick - 1, tick - 2))

    def delivered(self, tick: int, now_ns: int) -> None:
        self._delivered[tick] = now_ns

    def part(self, tick: int, node: str, now_ns: int) -> None:
        """A node's part of the frame after `tick` has come."""
        self._parts.setdefault(tick, {})[node] = now_ns

    def committed(self, frame_tick: int, lag_ns: int, now_ns: int) -> None:
        """A frame is committed; name who was waited for when it is late."""
        self._committed[frame_tick] = self._progress_ns = now_ns
        self._named = ""
        if lag_ns > 0:
            self.late = self._waited_for(frame_tick - 1)
            self.late_tick = frame_tick
        for known in (self._released, self._delivered, self._committed, self._parts):
            known.pop(frame_tick - limits.KEPT_TICKS, None)

    def _waited_for(self, tick: int) -> str:
        """Return who took the longest of those on the way to the frame after `tick`."""
        begun = self._begun_ns
        released = self._released.get(tick, begun)
        delivered = self._delivered.get(tick, begun)
        before = self._committed.get(tick, begun)
        spans = {SUPERVISOR: released - before}
        spans[self._hub_or_client()] = delivered - self._committed.get(tick - 1, begun)
        for node, came in self._parts.get(tick, {}).items():
            spans[node] = came - max(released, delivered, before)
        return max(sorted(spans), key=lambda name: spans[name])

    def _hub_or_client(self) -> str:
        """Return the vHub, or the lockstep client that it waited for."""
        hub = self.roster.by_name.get(VHUB)
        waiting = hub.heartbeat.waiting_for if hub is not None and hub.heartbeat is not None else ""
        return waiting.removeprefix(DONE_OF).partition(",")[0] if waiting.startswith(DONE_OF) else VHUB

    def waiting_for(self, core: SupervisorCore) -> str:
        """Return who is being waited for, for people: a name, or several, or an empty string."""
        if core.epoch == 0:
            return ", ".join(self.roster.missing(core.frame.layout.digest))
        tick = core.frame.tick
        if tick >= core.released:
            return ""
        if tick not in self._delivered:
            return self._hub_or_client()
        return ", ".join(node for node in core.members if node not in self._parts.get(tick, {}))

    def lost(self, core: SupervisorCore, now_ns: int) -> str:
        """Return who is lost and why, or an empty string."""
        self.now_ns = now_ns
        deadlines = self.deployment.deadlines
        if core.epoch == 0:
            return self._late_to_start(core, now_ns)
        silent = self.roster.silent(now_ns, deadlines.heartbeat_ns)
        if silent:
            return f"{silent[0]}: no heartbeat for {deadlines.heartbeat_ns / 1e9:g} s"
        waited = self.waiting_for(core)
        if not waited or waited in self.deployment.players or waited in self.deployment.clients:
            self._progress_ns = max(self._progress_ns, now_ns - deadlines.tick_named_ns)
            return ""
        overdue_ns = now_ns - self._progress_ns
        if overdue_ns > deadlines.tick_lost_ns:
            return f"{waited}: tick {core.frame.tick} is overdue by {overdue_ns / 1e9:.1f} s"
        if overdue_ns > deadlines.tick_named_ns and waited != self._named:
            self._named = waited
            core.say("warning", f"tick {core.frame.tick} waits for {waited} since {overdue_ns / 1e9:.1f} s")
        return ""

    def _late_to_start(self, core: SupervisorCore, now_ns: int) -> str:
        """Give local processes their time to start; those started by hand are waited for."""
        local = [name for name, node in self.deployment.nodes.items() if node.launch == "local"]
        missing = [name for name in self.roster.missing(core.frame.layout.digest) if name in local]
        if not missing or now_ns - self._begun_ns <= self.deployment.deadlines.start_ns:
            return ""
        return f"{', '.join(missing)}: not ready within {self.deployment.deadlines.start_ns / 1e9:g} s"

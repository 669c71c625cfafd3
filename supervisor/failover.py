"""Failover: a supervisor that was started again goes on with a run whose nodes and vHub live; and the rollback.

The state is restored from the journal. The other processes find the supervisor by the address that it had before, are
recalled, and repeat hello and ready. The vHub reports its resume position with its last commit, which is the later one
when the supervisor's machine was lost. Then a new epoch begins at the last commit, without the nodes that have not come
in time, and the same ticks are computed again from the same inputs.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from foosim.protocol import channels
from foosim.protocol.codec import decode
from foosim.protocol.hub_messages import ResumeState
from foosim.protocol.messages import Commit
from foosim.supervisor.node_loss import NodeLoss
from foosim.supervisor.progress import ClosingMonitor, ProgressMonitor
from foosim.supervisor.records import History, Recovered, close_outages, reopen_outages
from foosim.supervisor.state import RunState

REJOIN_NS: Final = 1_000_000_000
"""How long, beside the deadline of heartbeats, nodes have to find the supervisor again."""


class Rollback:
    """Rollback of a run whose vHub has lost the end of its journal with its machine.

    Nobody can give the vHub the inputs of the ticks after its last closed one. So the run goes on from there, and
    everything after it is void: commits, inputs, orders. The run is a new branch; its number is that of the first epoch
    in it. Deliveries and messages of and to clients name the branch, so that void ones that are in flight do not count.
    Requests keep their ids, ticks and answers, and their edits are ordered again at their ticks.
    """

    def __init__(self, state: RunState, progress: ProgressMonitor) -> None:
        self._state = state
        self._progress = progress

    def is_behind(self, standing: ResumeState) -> bool:
        """Whether somebody knows more, or may, than a vHub that goes on from a journal."""
        state = self._state
        if not standing.waits or not standing.commit:
            return False
        return standing.lost_machine or max(state.frame.tick - 1, state.inputs.delivered) > standing.final

    def is_due(self, standing: ResumeState) -> bool:
        """Whether this start of the vHub needs a rollback, and did not have it yet."""
        return standing.boot != self._state.granted_boot and self.is_behind(standing)

    @property
    def is_pending(self) -> bool:
        """Whether the branch has begun and no epoch is in it yet: no other process knows of it."""
        return self._state.branch > self._state.epoch

    def enter(self, epoch: int) -> None:
        """Name the branch that has begun after the first epoch in it."""
        self._state.branch = self._state.inputs.branch = epoch

    def begin(self, standing: ResumeState, now_ns: int) -> None:
        """Roll back to the vHub's last closed tick; the branch begins with the epoch that is opened next.

        That is one record of the journal, with the entry in the account. A supervisor or vHub that ends before that
        epoch reports or is asked again: the branch that has begun at the vHub's position is that one.
        """
        state, frame = self._state, self._state.frame_of(standing)
        if self.is_pending and standing.branch < state.branch and frame.tick == state.branch_tick:
            return
        tick, before = frame.tick, state.frame.tick
        state.epoch = max(state.epoch, standing.epoch)
        reason = f"branch from tick {tick}: " + (
            f"{before - tick} ticks are lost" if before > tick else "its machine was lost, and what was on its way"
        )
        unknown = state.edit_log.forgotten
        if unknown >= tick:
            reason += f", and what requests changed up to tick {unknown}"
        reopen_outages(state.recovered, tick)
        state.recovered.append(Recovered("vhub", channels.VHUB, reason, tick, state.epoch + 1))
        state.pacer.roll_back(max(0, before - tick), tick, now_ns)
        self._progress.roll_back(tick, now_ns)
        state.branch, state.branch_tick = state.epoch + 1, tick
        state.roll_back(frame, standing.chain, standing.commit)
        state.log("warning", f"goes on as {reason}")


class Failover:
    """The time between the start of such a supervisor and its first epoch."""

    def __init__(
        self,
        state: RunState,
        closing: ClosingMonitor,
        node_loss: NodeLoss,
        rollback: Rollback,
        finish: Callable[[str], None],
        publish_commit: Callable[[int], None],
    ) -> None:
        """`finish` ends the run as failed, `publish_commit` publishes its last commit again."""
        self._state = state
        self._closing = closing
        self._node_loss = node_loss
        self._rollback = rollback
        self._finish = finish
        self._publish_commit = publish_commit
        self._standing: ResumeState | None = None
        """The resume position of the vHub, once it is known."""
        self._living_ns = self._start_ns = self._hub_ns = 0
        self._roster: list[str] = []
        self._owners: dict[str, str] = {}
        """The owners by the last request, also if no epoch has begun with them."""

    def begin(self, history: History, now_ns: int) -> None:
        """Restore the state from a journal. Times of another clock are moved to that of `now_ns`."""
        state, deadlines = self._state, self._state.deployment.deadlines
        state.is_resuming = True
        self._living_ns = now_ns + deadlines.heartbeat_ns + REJOIN_NS
        self._start_ns = now_ns + deadlines.start_ns
        self._hub_ns = now_ns + max(deadlines.orphan_ns, deadlines.start_ns)
        self._roster = [] if history.epoch is None else list(history.epoch.roster)
        self._owners = history.owners
        if history.run.clock != state.clock:
            history.started_ns += now_ns - history.committed_ns
            history.committed_ns = now_ns
        state.restore(history)
        state.resumed()
        state.log("warning", f"started again: the journal ends at tick {state.frame.tick}, epoch {state.epoch}")

    def on_standing(self, standing: ResumeState, now_ns: int) -> bool:
        """The vHub reports its resume position: go on from its last commit when the journal has lost that, or when the
        vHub has lost what came after it. False for a repeat."""
        state = self._state
        if self._standing is not None and self._standing.boot == standing.boot:
            return False
        if state.end is not None:
            self._standing = standing
            self._closing.ended(now_ns)
            state.grant(standing)
            return True
        if self._rollback.is_behind(standing):
            self._rollback.begin(standing, now_ns)
        elif self._is_ahead(standing):
            self._catch_up(standing)
        state.epoch = max(state.epoch, standing.epoch)
        state.prepare(state.frame.layout)
        self._standing = standing
        state.resumed()
        return True

    def on_standstill(self, stood_ns: int) -> None:
        """The supervisor stood still for so long: no process could come back to it."""
        self._living_ns += stood_ns
        self._start_ns += stood_ns
        self._hub_ns += stood_ns

    def waits_for_hub(self, now_ns: int) -> bool:
        """Whether a run that has ended, perhaps before this start, waits for the vHub to close its capture."""
        return self._state.is_resuming and self._standing is None and now_ns <= self._hub_ns

    def lose_hub(self) -> None:
        """The vHub is lost again: the next one reports its resume position."""
        self._standing = None

    def wake(self, now_ns: int) -> None:
        """Begin the epoch when all processes are here, or when those that are not have had their time."""
        state, deadlines = self._state, self._state.deployment.deadlines
        if not state.is_resuming or state.end is not None or state.finished:
            return
        if self._standing is None:
            if now_ns > self._hub_ns:
                wait_s = max(deadlines.orphan_ns, deadlines.start_ns) / 1e9
                self._finish(f"lost {channels.VHUB}: it has not come to the supervisor within {wait_s:g} s")
            return
        layout, known = state.frame.layout.digest, state.roster.by_name
        expected = [name for name in self._roster if name not in state.roster.stopped]
        here = [name for name in expected if name in known and layout in known[name].ready and not known[name].lost]
        waits_until_ns = self._living_ns if state.found_living else self._start_ns
        if len(here) == len(expected) or now_ns >= waits_until_ns:
            self._open(self._standing, here, [name for name in expected if name not in here], now_ns)

    def _is_ahead(self, standing: ResumeState) -> bool:
        """Whether the vHub knows of commits, or of a branch, that are not in the supervisor's journal."""
        newer = bool(standing.commit) and decode(Commit, standing.commit).tick > self._state.frame.tick
        return newer or standing.branch > self._state.branch

    def _catch_up(self, standing: ResumeState) -> None:
        """Go on from the vHub's last commit. Raises Malformed for one that does not fit its frame."""
        state, frame = self._state, self._state.frame_of(standing)
        if standing.branch > state.branch:
            state.branch, state.branch_tick = standing.branch, standing.branch_tick
        # A commit that the journal lost has reported the open outages, with their length: they are not reported again.
        close_outages(state.recovered, state.committed_ns, state.committed_ns, frame.tick)
        state.roll_back(frame, standing.chain, standing.commit)
        state.log("warning", f"goes on from the vHub's commit {state.frame.tick}, the journal lost what led to it")

    def _open(self, standing: ResumeState, here: list[str], missing: list[str], now_ns: int) -> None:
        state = self._state
        state.is_resuming = False
        state.is_open = True
        beats = [process.heartbeat for process in state.roster.by_name.values()]
        is_branch = self._rollback.is_pending
        state.epoch = max(
            [state.epoch, *(beat.epoch for beat in beats if beat is not None)]
        )  # both journals may lack it
        if is_branch:
            self._rollback.enter(state.epoch + 1)
        state.pacer.start(now_ns, state.frame.tick)
        state.publish_tempo()
        state.note_recovery(channels.SUPERVISOR, channels.SUPERVISOR, "started again")
        state.account.moves += sum(state.owners[robot] != owner for robot, owner in self._owners.items())
        state.owners = dict(self._owners)
        state.members = tuple(here)
        self._node_loss.begin(here, missing, now_ns)
        if state.finished:
            return
        self._publish_commit(now_ns)
        state.grant(standing)
        state.log("info", f"goes on from tick {state.frame.tick} with {', '.join(here) or 'no node yet'}")

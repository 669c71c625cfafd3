"""The core of the supervisor: takes messages and the time, releases orders, assembles and commits frames.

It computes nothing of the world. An epoch assigns robots to nodes, an order has the edits of a tick, and a frame is
assembled from the parts of the nodes. Each record is journalled before its message is published, and a committed tick
never changes. The core dispatches messages to its helpers; all share one `RunState`, and no helper refers to the core.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from mypy_extensions import mypyc_attr

from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.protocol import channels
from foosim.protocol.actions import Journal, Publish
from foosim.protocol.barrier import BadParts, Barrier, Slots, input_digest_of
from foosim.protocol.channels import Channel
from foosim.protocol.codec import decode, encode
from foosim.protocol.hub_messages import ResumeState
from foosim.protocol.messages import (
    Commit,
    Deliveries,
    End,
    FailedComponent,
    Farewell,
    Fetch,
    Heartbeat,
    Hello,
    Inquiry,
    Order,
    Part,
    Ready,
    Request,
    Want,
)
from foosim.protocol.rejects import Refusals
from foosim.protocol.retry import RetryTimer
from foosim.runtime.roles.standstill import closed
from foosim.supervisor.failover import Failover, lacks_inputs, why_it_ends
from foosim.supervisor.handshake import Handshake
from foosim.supervisor.load_balancing import Balancer
from foosim.supervisor.node_loss import NodeLoss
from foosim.supervisor.progress import ClosingMonitor, ProgressMonitor, losses
from foosim.supervisor.records import CommitRecord, History, Recovered, Solved, close_outages, solved_by
from foosim.supervisor.requests import Requests
from foosim.supervisor.settings import RunSettings
from foosim.supervisor.state import RunState
from foosim.supervisor.status import result, status
from foosim.supervisor.vhub_loss import PlayerLosses, VhubLoss
from foosim.supervisor.viewing import Viewing
from foosim.world.assembly.presence import Presence
from foosim.world.components.command_watch import CommandWatch
from foosim.world.edits import Edit
from foosim.world.frame import Frame, chain_next


@mypyc_attr(allow_interpreted_subclasses=True)
class SupervisorCore:
    """The supervisor's state machine. The shell performs its `actions` next."""

    def __init__(
        self,
        settings: RunSettings,
        fingerprint: bytes,
        now_ns: int,
        boot: str = "first",
        clock: str = "",
        history: History | None = None,
    ) -> None:
        """`boot` names this start of the supervisor, `clock` the clock of `now_ns`; `history` resumes a run."""
        state = self.state = RunState(settings, fingerprint, boot, clock)
        self.actions = state.actions
        self.refusals = Refusals(state.actions.append, lambda: state.deployment)
        self.progress, self.closing = ProgressMonitor(state, now_ns), ClosingMonitor(state)
        self.viewing = Viewing(state)
        self.handshake = Handshake(state, self.connection_closed)
        self.vhub_loss, self.player_losses = VhubLoss(state, self.progress), PlayerLosses(state)
        self.node_loss = NodeLoss(state, self.open_epoch, self.fail)
        ends = self.fail, self.publish_last_commit
        self.failover = Failover(state, self.closing, self.node_loss, *ends)
        self.balancer = Balancer(state.deployment.owners()) if settings.balance else None
        does = self.status, self.open_epoch, self.stop, self.fail
        self.requests = Requests(state, self.viewing, self.node_loss, *does)
        self._commands = CommandWatch(state.deployment, lambda text: state.log("warning", text))
        self.on_commit: Callable[[Frame], None] | None = None
        """Gets every committed frame, for a rehearsal."""
        self._slots = Slots(state.frame.layout, state.owners)
        self._presence = Presence(state.frame.layout)
        self._retry = RetryTimer(now_ns)
        self.refused = 0
        self._readers: dict[type[Any], Callable[[Any, bytes, int], None]] = {
            Hello: self.handshake.on_hello,
            Fetch: self.handshake.on_fetch,
            Ready: self._on_ready,
            ResumeState: self._on_standing,
            Heartbeat: self._on_heartbeat,
            Part: self._on_part,
            Deliveries: self._on_deliveries,
            Want: self._on_want,
            Request: self.requests.on_request,
            Inquiry: self.requests.on_inquiry,
            Farewell: self.handshake.on_farewell,
        }
        if history is not None and history.kept.epoch:
            self.failover.begin(history, now_ns)
        self.actions.append(Journal(encode(state.run_record) if history is None else state.checkpoint()))

    # --- calls of the shell ----------------------------------------------------------------------------------------

    def receive(self, channel: Channel, name: str, payload: bytes, now_ns: int) -> None:
        """Take one message as received; an invalid one is counted and dropped."""
        try:
            message = self.refusals.read(channel, name, payload, now_ns)
            reader = self._readers.get(type(message))
            if reader is None:
                raise Malformed(f"the supervisor does not read the channel {channel.name}")
            reader(message, payload, now_ns)
        except Malformed as error:
            self.refused += 1
            self.refusals.refuse(channel, name, payload, error, now_ns)

    def advance(self, now_ns: int) -> None:
        """Commit and release as far as parts, pace and clock allow."""
        state = self.state
        if not state.is_open or state.end is not None:
            return
        self._release(now_ns)
        while self._commit_next(now_ns):
            self._release(now_ns)
        if state.stop_at and state.frame.tick >= state.stop_at:
            self.finish("done" if state.stop_at == state.settings.last_tick else "stopped", failed=False)

    def wake(self, now_ns: int) -> None:
        """Check deadlines: of processes that are silent or overdue, and of the end of a run."""
        state = self.state
        self.viewing.wake(now_ns)
        overdue = "" if state.end is not None else self.vhub_loss.timeout(now_ns)
        if overdue:
            self.fail(overdue)
        if state.end is None and not overdue:
            self._wake_run(now_ns)
        elif not (state.finished or self.failover.waits_for_hub(now_ns)):
            state.finished = self.closing.is_over(now_ns)

    def _wake_run(self, now_ns: int) -> None:
        """Handle losses, and repeat requests for missing messages."""
        state = self.state
        lost = self.progress.lost(now_ns)
        if lost and state.epoch == 0:
            self.fail(losses(lost))
        elif lost:
            self._lose(lost, now_ns)
        self.failover.wake(now_ns)
        self._balance(now_ns)
        if state.lacks_inputs and self._retry.is_over(now_ns):
            self._request_missing(now_ns)

    @property
    def lacking(self) -> tuple[Channel, int]:
        """The channel, and how many messages of it, without which there is nothing to commit.

        Commits wait for each other as long as nodes can continue without them, less a tick for the time of a commit.
        """
        state = self.state
        inputs, tick = state.inputs, state.frame.tick
        reach = min(state.released, inputs.delivered + 1)
        ticks = range(tick + 1, max(tick + 2, reach))
        missing = sum(len(state.members) - len(inputs.parts.get(ahead, ())) for ahead in ticks)
        return (channels.PART, missing) if missing > 0 else (channels.DELIVERIES, 1)

    def deadline_ns(self, now_ns: int) -> int:
        """The latest time of the shell's next call."""
        state = self.state
        deadline = now_ns + limits.HEARTBEAT_NS
        if state.lacks_inputs:
            deadline = min(deadline, self._retry.at_ns)
        if state.is_open and state.end is None and state.released <= state.frame.tick + limits.RELEASE_AHEAD:
            release_ns = state.pacer.release_ns(state.released)
            if release_ns is not None and (not state.stop_at or state.released < state.stop_at):
                deadline = min(deadline, release_ns)
        return deadline

    def connection_closed(self, name: str, now_ns: int) -> None:
        """The connection of a process has closed."""
        state = self.state
        process = state.roster.by_name.get(name)
        if process is None:
            return
        process.closed_ns = now_ns
        is_certain = not self.progress.doubts(process, now_ns)
        if is_certain and not process.farewell and not process.lost and state.end is None:
            self._lose({name: closed(now_ns - process.last_message_ns)}, now_ns)

    def on_standstill(self, stood_ns: int, now_ns: int) -> None:
        """Extend the deadlines of other processes by a standstill of the supervisor's own loop."""
        self.progress.on_standstill(stood_ns, now_ns)
        self.vhub_loss.on_standstill(stood_ns)
        self.closing.on_standstill(stood_ns, now_ns)
        self.failover.on_standstill(stood_ns)

    def finish(
        self, reason: str, failed: bool, tick: int | None = None, component: FailedComponent | None = None
    ) -> None:
        """End the run in order, once: at the last committed tick, or at an earlier one that is the last in the capture.

        A run that was only resumed is abandoned.
        """
        state = self.state
        if state.end is not None or state.finished:
            return
        if failed and state.abandons(reason):
            state.finished = True
            state.log("error", f"the run does not continue from tick {state.frame.tick}: {reason}")
            return
        state.end = End(state.frame.tick if tick is None else tick, reason, failed, component)
        self.closing.ended(self.progress.now_ns)
        state.log("error" if failed else "info", f"run ends at tick {state.frame.tick}: {reason}")
        state.journal(state.end)
        state.publish_end()

    def fail(self, reason: str, tick: int | None = None) -> None:
        """End the run as failed, by default at the last committed tick."""
        self.finish(reason, failed=True, tick=tick)

    def stop(self) -> int:
        """End the run in order and return its last tick: the released one, or one more when that is committed.

        The last commit is marked as the last, so that the vHub does not close its tick: no other may be.
        """
        state, pacer = self.state, self.state.pacer
        if not state.is_open or state.end is not None:
            self.finish("stopped", failed=False)
            return state.frame.tick
        last = max(state.released, state.frame.tick + 1)
        state.stop_at = min(state.stop_at or last, last)
        if pacer.paused and state.released < state.stop_at:
            pacer.step(state.released, state.stop_at - state.released)
        state.journal(state.control())
        return state.stop_at

    def status(self, now_ns: int) -> dict[str, Any]:
        """Return the state of the run for people and scripts."""
        vhub_lost = self.vhub_loss.as_json(now_ns) if self.state.roster.is_hub_away else None
        return status(self.state, self.progress, vhub_lost, self.refusals.by_sender())

    def result(self) -> dict[str, Any]:
        """Return the result of the run, or of the run so far."""
        return result(self.state)

    # --- release and commit ------------------------------------------------------------------------------------------

    def _release(self, now_ns: int) -> None:
        """Release the orders that pace and clock allow.

        What is released together and has no edits goes in one message; in fast, two ticks at a time.
        """
        state, pacer = self.state, self.state.pacer
        first, committed = state.released, state.frame.tick
        last = state.stop_at or limits.COUNTER_MAX
        alone = first + 1 < last and not pacer.may_release(first + 1, committed, now_ns)
        if pacer.is_fast and alone and committed < first:
            return
        while state.released < last and pacer.may_release(state.released, committed, now_ns):
            tick = state.released
            state.released += 1
            edits = state.coming_edits.pop(tick, [])
            if edits and tick > first:
                self._publish_orders(first, tick)
                first = tick
            state.orders[tick] = edits
            state.orders.pop(tick - limits.KEPT_TICKS, None)
            if tick == committed:
                self._retry.progress(state.deployment.tick_ns, now_ns)
            if tick == state.first_tick:
                state.started_ns = now_ns
            self.progress.released(tick, now_ns)
        self._publish_orders(first, state.released)

    def _publish_orders(self, first: int, end: int) -> None:
        """Publish the orders of `first` to `end` - 1, of which only the first has edits."""
        if first < end:
            order = Order(self.state.epoch, first, self.state.orders[first], end - 1 - first)
            self.actions.append(Publish(channels.ORDER, channels.SUPERVISOR, encode(order)))

    def _commit_next(self, now_ns: int) -> bool:
        """Assemble and commit the next frame when all its parts are there; False when something is missing."""
        state = self.state
        inputs, tick = state.inputs, state.frame.tick
        parts = inputs.parts.get(tick + 1)
        deliveries = inputs.deliveries.get(tick)
        if parts is None or deliveries is None or len(parts) < len(state.members) or tick not in state.orders:
            return False
        assert state.members, "parts without members"
        edits = state.orders[tick]
        barrier = Barrier(tick + 1, state.members, self._slots)
        digest = input_digest_of(state.frame.digest, edits, deliveries)
        diverged = [part.node for part in parts if part.input_digest != digest]
        if diverged:
            why = f"has diverged: its part {tick + 1} has another input digest"
            if len(diverged) == len(parts):
                self.fail("; ".join(f"node {node} {why}" for node in diverged))
            else:
                self._lose(dict.fromkeys(diverged, why), now_ns)
            return False
        try:
            barrier.add_all(parts)
            frame = barrier.assemble()
        except BadParts as bad:
            self.refused += len(bad.nodes)
            state.log("error", f"{bad}: requested again")
            inputs.drop(tick + 1, bad.nodes)
            return False
        inputs.committed(tick)
        self._commands.committed(state.frame, frame, lambda: decode(Deliveries, deliveries).packets)
        solved = solved_by(barrier, frame.layout, self._presence.absent(frame.values))
        self._take_frame(frame, edits, solved, now_ns)
        return True

    def _take_frame(self, frame: Frame, edits: list[Edit], solved: Solved, now_ns: int) -> None:
        state, pacer = self.state, self.state.pacer
        state.frame = frame
        state.account.count(*solved)
        state.chain = chain_next(state.chain, frame.digest)
        over = close_outages(state.recovered, state.committed_ns, now_ns)
        self.player_losses.committed(state.committed_ns, now_ns)
        self.vhub_loss.committed(state.committed_ns, now_ns)
        state.committed_ns = now_ns
        self._retry.progress(state.deployment.tick_ns, now_ns)
        due_ns = pacer.release_ns(frame.tick - 1) or 0
        moved_ns = pacer.committed(frame.tick, now_ns)
        self._publish_commit(edits, solved, now_ns, over)
        if self.on_commit is not None:
            self.on_commit(frame)
        late = self.progress.committed(frame.tick, pacer.last_lag_ns, due_ns, now_ns)
        if moved_ns:
            state.log("warning", f"tick {frame.tick}: lag {moved_ns / 1e6:.1f} ms, waited for {self.progress.late}")
        elif late:
            state.log("info", late)

    def _publish_commit(self, edits: list[Edit], solved: Solved, now_ns: int, over: Iterable[Recovered] = ()) -> None:
        """Journal a frame, its solvers and the outages that end with it, then publish it to the vHub."""
        state, frame = self.state, self.state.frame
        last = state.stop_at > 0 and frame.tick >= state.stop_at
        content = frame.digest, frame.values.tobytes(), frame.outbox_items, edits
        commit = Commit(state.epoch, frame.tick, *content, last, [entry.message() for entry in over])
        payload = encode(commit)
        state.commits[frame.tick] = payload
        state.commits.pop(frame.tick - limits.KEPT_TICKS, None)
        lag_ns = state.pacer.last_lag_ns if state.pacer.counts_lags else -1
        self.actions.append(Journal(encode(CommitRecord(payload, *solved, now_ns, lag_ns))))
        self.actions.append(Publish(channels.COMMIT, channels.VHUB, payload))
        if self.viewing.is_shown:
            self.viewing.committed(payload, edits, now_ns)

    def publish_last_commit(self, now_ns: int) -> None:
        """Publish the last commit again: a supervisor that ended may have written and not published it."""
        payload = self.state.commits.get(self.state.frame.tick)
        if payload is None:
            self._publish_commit([], ([], {}), now_ns)
        else:
            self.actions.append(Publish(channels.COMMIT, channels.VHUB, payload))

    def _request_missing(self, now_ns: int) -> None:
        """Request the messages that the next commit lacks; the wait doubles."""
        state, tick = self.state, self.state.frame.tick
        wants: list[Want] = []
        if tick not in state.inputs.deliveries:
            wants.append(Want(channels.SUPERVISOR, channels.DELIVERIES.name, tick, state.epoch, []))
        if missing := state.missing_nodes:
            wants.append(Want(channels.SUPERVISOR, channels.PART.name, tick + 1, state.epoch, missing))
        for want in wants:
            state.publish(channels.WANT, channels.SUPERVISOR, want)
        self._retry.requested(now_ns)

    # --- epochs ------------------------------------------------------------------------------------------------------

    def open_epoch(self, owners: dict[str, str], now_ns: int, members: Iterable[str] | None = None) -> None:
        """Begin a new epoch at the last commit, and publish the orders from there again.

        `members` are the nodes that take part from now on; without them they stay.
        """
        state = self.state
        state.begin_epoch(owners, members)
        self._slots = Slots(state.frame.layout, owners)
        for tick in range(state.frame.tick, state.released):
            self._publish_orders(tick, tick + 1)
        self.progress.begun(now_ns)
        self._retry.progress(state.deployment.tick_ns, now_ns)

    def _start_if_ready(self, now_ns: int) -> None:
        """Open the first epoch when every declared process has built the world."""
        state = self.state
        if state.is_open or state.end is not None or state.roster.missing():
            return
        state.pacer.start(now_ns, state.frame.tick)
        state.publish_tempo()
        self.open_epoch(state.owners, now_ns, state.deployment.nodes)
        state.committed_ns = now_ns
        self._publish_commit([], ([], {}), now_ns)

    def _lose(self, lost: Mapping[str, str], now_ns: int) -> None:
        """Continue without lost nodes, wait for a lost vHub; the loss of another process ends the run."""
        state = self.state
        others = {name: why for name, why in lost.items() if name not in state.deployment.nodes}
        if channels.VHUB in others:
            self.failover.lose_hub()
            self.vhub_loss.lose(others.pop(channels.VHUB), now_ns)
        if others:
            self.fail(losses(others))
        for name in sorted(lost.keys() & state.deployment.nodes.keys()):
            if state.end is None:
                self.node_loss.lose(name, lost[name], now_ns)

    def _balance(self, now_ns: int) -> None:
        """Move a robot from a busy node to an idle one, where the run balances loads."""
        state = self.state
        shift = None if self.balancer is None else self.balancer.wake(state, now_ns)
        if shift is not None:
            state.account.moves += 1
            self.open_epoch({**state.owners, shift.robot: shift.target}, now_ns)
            state.log("info", f"{shift} at tick {state.frame.tick}")

    # --- messages ----------------------------------------------------------------------------------------------------

    def _on_ready(self, ready: Ready, payload: bytes, now_ns: int) -> None:
        """A process has built the world: the run may begin, a node may join."""
        state, process = self.state, self.handshake.on_ready(ready, now_ns)
        if process is None:
            return
        is_hub = process.name == channels.VHUB
        if is_hub:
            self.viewing.hub_ready()
        if state.is_resuming:
            self.failover.wake(now_ns)
        elif not state.is_open:
            self._start_if_ready(now_ns)
        elif is_hub:
            self.vhub_loss.on_ready(now_ns)
        elif process.name in state.members:
            state.publish_epoch()
        else:
            self.node_loss.join(process, now_ns)

    def _on_heartbeat(self, heartbeat: Heartbeat, payload: bytes, now_ns: int) -> None:
        """A process lives: a lost one may be back; send it the missed messages again."""
        state, process = self.state, self.handshake.on_heartbeat(heartbeat, now_ns)
        if process is None:
            return
        is_hub = process.name == channels.VHUB
        if process.lost and not is_hub:
            self.node_loss.on_heartbeat(process, now_ns)
        if not heartbeat.report:
            self.progress.on_heartbeat(heartbeat)
            return
        self.handshake.keep_report(process, heartbeat)
        self.player_losses.on_report(process)
        if process.lost and is_hub:
            self.vhub_loss.on_heartbeat(process, now_ns)
        if state.end is not None:
            state.publish_end()
        elif state.is_open and heartbeat.epoch < state.epoch:
            state.publish_epoch()
            if is_hub:
                state.publish_tempo()
        if heartbeat.lost and state.end is None and (is_hub or self._is_of_now(heartbeat)):
            self._fail_by(heartbeat)

    def _fail_by(self, heartbeat: Heartbeat) -> None:
        """A process has reported why the run cannot continue; the traceback of a component is logged here, too."""
        component = heartbeat.failed
        if component is not None:
            self.state.log("error", f"{heartbeat.lost}\n{component.traceback}")
        self.finish(heartbeat.lost, failed=True, component=component)

    def _is_of_now(self, heartbeat: Heartbeat) -> bool:
        """Whether a node's heartbeat is of the present epoch, at a tick that a node can have reached."""
        state = self.state
        ahead = heartbeat.tick - state.frame.tick
        return heartbeat.epoch == state.epoch and (state.epoch == 0 or 0 <= ahead <= limits.KEPT_TICKS)

    def _on_part(self, part: Part, payload: bytes, now_ns: int) -> None:
        state = self.state
        if part.epoch == state.epoch and state.inputs.take_part(part, state.frame.tick, state.members):
            self.progress.part(part.tick - 1, part.node, now_ns)
        else:
            state.repeated += 1

    def _on_deliveries(self, deliveries: Deliveries, payload: bytes, now_ns: int) -> None:
        state = self.state
        if not state.inputs.take_deliveries(deliveries, payload, state.frame.tick):
            state.repeated += 1
            return
        for tick in range(deliveries.tick, deliveries.last + 1):
            self.progress.delivered(tick, now_ns)

    def _on_standing(self, standing: ResumeState, payload: bytes, now_ns: int) -> None:
        """The vHub reports its resume position."""
        self.state.repeated += not self._resume_hub(standing, now_ns)

    def _resume_hub(self, standing: ResumeState, now_ns: int) -> bool:
        """Grant the vHub's resume, or end the run where it lacks inputs; False for repeats and for another boot."""
        state, process = self.state, self.state.roster.by_name.get(channels.VHUB)
        if process is None or process.boot != standing.boot or standing.supervisor != state.boot:
            return False
        if state.is_resuming:
            return self.failover.on_standing(standing, now_ns)
        if standing.boot != state.granted_boot and lacks_inputs(state, standing):
            if state.end is not None:
                return False
            if state.is_vhub_away:
                self.vhub_loss.note()
            self.fail(*why_it_ends(state, standing))
        else:
            state.grant(standing)
        return True

    def _on_want(self, want: Want, payload: bytes, now_ns: int) -> None:
        state = self.state
        if want.kind == channels.ORDER.name and want.tick in state.orders and want.epoch == state.epoch:
            self._publish_orders(want.tick, want.tick + 1)
        elif want.kind == channels.COMMIT.name and want.tick in state.commits:
            self.actions.append(Publish(channels.COMMIT, want.sender, state.commits[want.tick]))

"""The core of the supervisor: takes messages and the time, releases orders, assembles and commits frames.

It computes nothing of the world: it knows who computes what (epochs), what changes the world (orders), and puts the
nodes' parts together. It journals, then speaks. A committed tick never changes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final

from mypy_extensions import mypyc_attr

from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.protocol import channels
from foosim.protocol.actions import Action, Journal, Publish, Say
from foosim.protocol.barrier import BadParts, Barrier, Slots, basis_of
from foosim.protocol.channels import Channel
from foosim.protocol.codec import encode
from foosim.protocol.hub_messages import Standing
from foosim.protocol.messages import (
    Commit,
    Deliveries,
    End,
    Epoch,
    Farewell,
    Fetch,
    Heartbeat,
    Hello,
    Inquiry,
    Order,
    Part,
    Prepare,
    Ready,
    Request,
    Tempo,
    Want,
)
from foosim.protocol.rejects import Refusals
from foosim.protocol.retry import Patience
from foosim.runtime.closed import closed
from foosim.supervisor.account import Account, Recovered
from foosim.supervisor.arrivals import Arrivals
from foosim.supervisor.beginning import Beginning
from foosim.supervisor.branches import Branches
from foosim.supervisor.closing import Closing
from foosim.supervisor.failover import TakeOver
from foosim.supervisor.handshake import Handshake
from foosim.supervisor.load_balancing import Balancer
from foosim.supervisor.node_loss import Recovery
from foosim.supervisor.pacing import Pacer
from foosim.supervisor.progress import Watch, losses
from foosim.supervisor.records import CommitRecord, Control, History, RunRecord, Solved, solved_by
from foosim.supervisor.requests import Requests
from foosim.supervisor.roster import Roster
from foosim.supervisor.settings import RunSettings
from foosim.supervisor.state import control_of, head_of
from foosim.supervisor.status import SupervisorStatistics
from foosim.supervisor.vhub_loss import Absence
from foosim.supervisor.viewing import Viewing
from foosim.world.edits import Edit, layout_after
from foosim.world.frame import Frame, chain_next
from foosim.world.initial_state import AddedEntity, added_to, first_chain, first_frame
from foosim.world.layout import Layout

PREPARE_NS: Final = 200_000_000
"""How often a layout that nodes have not built yet is asked for again."""


@mypyc_attr(allow_interpreted_subclasses=True)
class SupervisorCore:
    """The supervisor's state machine. `actions` is what the shell performs next."""

    def __init__(
        self,
        settings: RunSettings,
        fingerprint: bytes,
        now_ns: int,
        boot: str = "first",
        clock: str = "",
        history: History | None = None,
    ) -> None:
        """`boot` names this start of the supervisor, `clock` the clock of `now_ns`; with a history it goes on."""
        self.settings = settings
        self.boot = boot
        self.clock = clock
        self.actions: list[Action] = []
        self.refusals = Refusals(self.actions.append, lambda: self.deployment)
        self.deployment = settings.load_deployment()
        self.roster = Roster(self.deployment, fingerprint)
        self.pacer = Pacer(self.deployment.tick_ns, settings.pace)
        self.watch = Watch(self.deployment, self.roster, now_ns)
        self.recovery, self.absence, self.branches = Recovery(self), Absence(self), Branches(self)
        self.balancer = Balancer(self.deployment.owners()) if settings.balance else None
        self.viewing = Viewing(self)
        self.requests, self.handshake, self.closing = Requests(self), Handshake(self), Closing(self)
        self.frame, self.chain = first_frame(self.deployment, settings.start), first_chain(settings.origin)
        self.first_tick = self.frame.tick
        self.beginning = Beginning(self.deployment, self.first_tick)
        self.epoch, self.is_open = 0, False
        """Whether an epoch of this supervisor has begun."""
        self.owners = self.deployment.owners()
        self.members: tuple[str, ...] = ()
        self.released = self.first_tick
        """The first tick whose order is not released."""
        self.stop_at = settings.last_tick
        self.end: End | None = None
        self.finished = False
        self.busy = 0.0
        self.account = Account(dict.fromkeys(sorted(self.deployment.nodes), 0))
        self.started_ns = self.committed_ns = 0
        self.on_commit: Callable[[Frame], None] | None = None
        """Told of every committed frame: a rehearsal's window on the run."""
        self.arrivals = Arrivals()
        self.epoch_payload = b""
        self.orders: dict[int, list[Edit]] = {}
        self.commits: dict[int, bytes] = {}
        """The last ones, as they were published."""
        self._slots = Slots(self.frame.layout, self.owners)
        self._prepare_ns = now_ns
        self._patience = Patience(now_ns)
        self._refused = self._repeated = self._diverged = 0
        self._readers: dict[type[Any], Callable[[Any, bytes, int], None]] = {
            Hello: self.handshake.hello,
            Fetch: self.handshake.fetch,
            Ready: self.handshake.ready,
            Standing: self._on_standing,
            Heartbeat: self.handshake.heartbeat,
            Part: self._on_part,
            Deliveries: self._on_deliveries,
            Want: self._on_want,
            Request: self.requests.take,
            Inquiry: self.requests.inquire,
            Farewell: self.handshake.farewell,
        }
        text = settings.deployment_name, settings.deployment_text
        self.run_record = RunRecord(settings.run, *text, str(settings.pace), settings.ticks, clock, settings.start)
        self.take_over = TakeOver(self, history, now_ns) if history is not None and history.epoch is not None else None
        self.actions.append(Journal(encode(self.run_record) if history is None else self.head()))

    # --- what the shell calls --------------------------------------------------------------------------------------

    def receive(self, channel: Channel, name: str, payload: bytes, now_ns: int) -> None:
        """Take one message as it came; what does not fit is counted and dropped."""
        try:
            message = self.refusals.read(channel, name, payload, now_ns)
            reader = self._readers.get(type(message))
            if reader is None:
                raise Malformed(f"the supervisor does not read the channel {channel.name}")
            reader(message, payload, now_ns)
        except Malformed as error:
            self._refused += 1
            self.refusals.refuse(channel, name, payload, error, now_ns)

    def advance(self, now_ns: int) -> None:
        """Commit and release as far as parts, pace and clock allow."""
        if not self.is_open or self.end is not None:
            return
        self._release(now_ns)
        while self._commit_next(now_ns):
            self._release(now_ns)
        if self.stop_at and self.frame.tick >= self.stop_at:
            self.finish("done" if self.stop_at == self.settings.last_tick else "stopped", failed=False)

    def wake(self, now_ns: int) -> None:
        """Look for who is silent or overdue, and for the end of an ended run."""
        self.viewing.wake(now_ns)
        if self.end is None and not self.absence.is_over(now_ns):
            lost = self.watch.lost(self, now_ns)
            if lost and self.epoch == 0:
                self.finish(losses(lost), failed=True)
            elif lost:
                self._lose(lost, now_ns)
            if self.take_over is not None:
                self.take_over.wake(now_ns)
            if self.balancer is not None:
                self.balancer.wake(self, now_ns)
            if self._lacks and self._patience.is_over(now_ns):
                self._ask_again(now_ns)
            if now_ns >= self._prepare_ns:
                self.requests.prepare()
                self._prepare_ns = now_ns + PREPARE_NS
        elif not (self.finished or (self.take_over is not None and self.take_over.waits_for_hub(now_ns))):
            self.finished = self.closing.is_over(now_ns)

    @property
    def lacking(self) -> tuple[Channel, int]:
        """The channel, and how many messages of it, without which there is nothing to commit.

        Commits wait for each other as long as nodes can go on without them, less a tick for what a commit takes.
        """
        tick = self.frame.tick
        reach = min(self.released, self.arrivals.delivered + 1)
        ticks = range(tick + 1, max(tick + 2, reach))
        missing = sum(len(self.members) - len(self.arrivals.parts.get(ahead, ())) for ahead in ticks)
        return (channels.PART, missing) if missing > 0 else (channels.DELIVERIES, 1)

    def deadline_ns(self, now_ns: int) -> int:
        """When the shell has to call again at the latest."""
        deadline = now_ns + limits.HEARTBEAT_NS
        if self._lacks:
            deadline = min(deadline, self._patience.at_ns)
        if self.is_open and self.end is None and self.released <= self.frame.tick + limits.RELEASE_AHEAD:
            release_ns = self.pacer.release_ns(self.released)
            if release_ns is not None and (not self.stop_at or self.released < self.stop_at):
                deadline = min(deadline, release_ns)
        return deadline

    def process_gone(self, name: str, now_ns: int) -> None:
        """A process's presence has ended."""
        process = self.roster.by_name.get(name)
        if process is None:
            return
        process.gone_ns = now_ns
        is_certain = not self.watch.doubts(process, now_ns)
        if is_certain and not process.farewell and not process.lost and self.end is None:
            self._lose({name: closed(now_ns - process.heard_ns)}, now_ns)

    def _lose(self, lost: Mapping[str, str], now_ns: int) -> None:
        """Go on without the nodes among those who are lost, wait for the vHub; without any other the run ends."""
        others = {name: why for name, why in lost.items() if name not in self.deployment.nodes}
        if channels.VHUB in others:
            self.absence.lose(others.pop(channels.VHUB), now_ns)
        if others:
            self.finish(losses(others), failed=True)
        for name in sorted(lost.keys() & self.deployment.nodes.keys()):
            if self.end is None:
                self.recovery.lose(name, lost[name], now_ns)

    def hold(self) -> None:
        """No node is left: nothing is computed until one joins."""
        self.members = ()
        self.arrivals.parts.clear()

    def finish(self, reason: str, failed: bool) -> None:
        """End the run in order at the last committed tick; say it once. One that was only resumed is abandoned."""
        if self.end is not None or self.finished:
            return
        if failed and self.beginning.abandons(self.frame.tick, reason):
            self.finished = True
            self.say("error", f"the run does not go on from tick {self.frame.tick}: {reason}")
            return
        self.end = End(self.frame.tick, reason, failed)
        self.watch.ended_ns = self.watch.now_ns
        self.actions.append(Say("error" if failed else "info", f"run ends at tick {self.frame.tick}: {reason}"))
        end = encode(self.end)
        self.actions += [Journal(end), Publish(channels.END, channels.SUPERVISOR, end)]
        self.requests.end()

    def stop(self) -> int:
        """End the run in order and return after which tick: what is released, or one more when all of it is committed.

        The last commit says that it is the last, so that the vHub does not close its tick: no other may be.
        """
        if not self.is_open or self.end is not None:
            self.finish("stopped", failed=False)
            return self.frame.tick
        last = max(self.released, self.frame.tick + 1)
        self.stop_at = min(self.stop_at or last, last)
        if self.pacer.paused and self.released < self.stop_at:
            self.pacer.step(self.released, self.stop_at - self.released)
        self.actions.append(Journal(encode(self.control())))
        return self.stop_at

    def statistics(self) -> SupervisorStatistics:
        account, refusals = self.account, (self._refused, self._repeated, self._diverged)
        return SupervisorStatistics(self.frame.tick, self.epoch, account.moves, account.handovers, *refusals)

    def say(self, level: str, text: str) -> None:
        """Log a line for people."""
        self.actions.append(Say(level, text))

    def ordered_edits(self) -> list[Edit]:
        """Return the edits of released ticks that are not committed yet, and of those still to be released."""
        released = [edit for tick in range(self.frame.tick, self.released) for edit in self.orders[tick]]
        return released + self.requests.coming_edits()

    def added_to(self, layout: Layout) -> list[AddedEntity]:
        """Return the entities of a layout beside the deployment's."""
        return added_to(self.deployment, layout)

    @property
    def missing_nodes(self) -> list[str]:
        """Return the nodes without whose parts the next frame cannot be put together."""
        return self.arrivals.missing(self.frame.tick + 1, self.members)

    def unready_nodes(self, layout: bytes) -> list[str]:
        """Return the nodes that have no engine for a layout yet."""
        return [name for name in self.members if layout not in self.roster.by_name[name].ready]

    def head(self) -> bytes:
        """Return the record with which a further journal file starts: what those before say and is still needed."""
        return head_of(self)

    def control(self) -> Control:
        """Return what people have set, for the journal."""
        return control_of(self)

    def say_last_commit(self, now_ns: int) -> None:
        """Say the last commit again: it may have been written and not said."""
        payload = self.commits.get(self.frame.tick)
        if payload is None:
            self._say_commit([], ([], ""), now_ns)
        else:
            self.actions.append(Publish(channels.COMMIT, channels.VHUB, payload))

    # --- release and commit ------------------------------------------------------------------------------------------

    def _release(self, now_ns: int) -> None:
        """Release the orders that pace and clock allow.

        What is released together and has no edits goes in one message; in fast, two ticks at a time.
        """
        first = self.released
        last = self.stop_at or limits.COUNTER_MAX
        alone = first + 1 < last and not self.pacer.may_release(first + 1, self.frame.tick, now_ns)
        if self.pacer.is_fast and alone and self.frame.tick < first:
            return
        while self.released < last and self.pacer.may_release(self.released, self.frame.tick, now_ns):
            tick = self.released
            self.released += 1
            edits = self.requests.edits_for(tick)
            if edits and tick > first:
                self._say_orders(first, tick)
                first = tick
            self.orders[tick] = edits
            self.orders.pop(tick - limits.KEPT_TICKS, None)
            if tick == self.frame.tick:
                self._patience.progress(self.deployment.tick_ns, now_ns)
            if tick == self.first_tick:
                self.started_ns = now_ns
            self.watch.released(tick, now_ns)
        self._say_orders(first, self.released)

    def _say_orders(self, first: int, end: int) -> None:
        """Publish the orders of `first` to `end` - 1, of which only the first has edits."""
        if first < end:
            order = Order(self.epoch, first, self.orders[first], end - 1 - first)
            self.actions.append(Publish(channels.ORDER, channels.SUPERVISOR, encode(order)))

    def _commit_next(self, now_ns: int) -> bool:
        """Assemble and commit the next frame when all its parts are there; False when something is missing."""
        tick = self.frame.tick
        parts = self.arrivals.parts.get(tick + 1)
        deliveries = self.arrivals.deliveries.get(tick)
        if parts is None or deliveries is None or len(parts) < len(self.members) or tick not in self.orders:
            return False
        assert self.members, "parts of nobody"
        edits = self.orders[tick]
        layout = layout_after(self.frame.layout, edits)
        slots = self._slots if layout is self.frame.layout else Slots(layout, self.owners)
        barrier = Barrier(tick + 1, self.members, slots)
        basis = basis_of(self.frame.digest, edits, deliveries)
        diverged = [part.node for part in parts if part.basis != basis]
        if diverged:
            self._diverged += len(diverged)
            why = f"has diverged: its part {tick + 1} has another basis"
            if len(diverged) == len(parts):
                self.finish("; ".join(f"node {node} {why}" for node in diverged), failed=True)
            else:
                self._lose(dict.fromkeys(diverged, why), now_ns)
            return False
        try:
            barrier.add_all(parts)
            frame = barrier.assemble()
        except BadParts as bad:
            self._refused += len(bad.nodes)
            self.say("error", f"{bad}: asked for again")
            self.arrivals.drop(tick + 1, bad.nodes)
            return False
        self._slots = slots
        self.arrivals.committed(tick)
        self._take_frame(frame, edits, solved_by(barrier, frame), now_ns)
        return True

    def _take_frame(self, frame: Frame, edits: list[Edit], solved: Solved, now_ns: int) -> None:
        self.frame = frame
        self.account.count(*solved)
        self.chain = chain_next(self.chain, frame.digest)
        recovered = self.recovery.committed(self.committed_ns, now_ns, frame.tick)
        self.absence.committed(self.committed_ns, now_ns)
        self.committed_ns = now_ns
        self._patience.progress(self.deployment.tick_ns, now_ns)
        due_ns = self.pacer.release_ns(frame.tick - 1) or 0
        moved_ns = self.pacer.committed(frame.tick, now_ns)
        self._say_commit(edits, solved, now_ns, recovered)
        if self.on_commit is not None:
            self.on_commit(frame)
        late = self.watch.committed(frame.tick, self.pacer.last_lag_ns, due_ns, now_ns)
        if moved_ns:
            self.say("warning", f"tick {frame.tick}: lag {moved_ns / 1e6:.1f} ms, waited for {self.watch.late}")
        elif late:
            self.say("info", late)

    def _say_commit(self, edits: list[Edit], solved: Solved, now_ns: int, recovered: Iterable[Recovered] = ()) -> None:
        """Journal a frame, who solved it and what is over by it, then publish it to the vHub."""
        frame = self.frame
        last = self.stop_at > 0 and frame.tick >= self.stop_at
        content = frame.digest, frame.values.tobytes(), frame.outbox_items, edits
        commit = Commit(self.epoch, frame.tick, *content, last, [entry.message() for entry in recovered])
        payload = encode(commit)
        self.commits[frame.tick] = payload
        self.commits.pop(frame.tick - limits.KEPT_TICKS, None)
        lag_ns = self.pacer.last_lag_ns if self.pacer.counts_lags else -1
        self.actions.append(Journal(encode(CommitRecord(payload, *solved, now_ns, lag_ns))))
        self.actions.append(Publish(channels.COMMIT, channels.VHUB, payload))
        if self.viewing.is_shown:
            self.viewing.committed(payload, edits, now_ns)

    @property
    def _lacks(self) -> bool:
        """Whether a released tick waits for parts or deliveries."""
        return self.is_open and self.end is None and self.frame.tick < self.released

    def _ask_again(self, now_ns: int) -> None:
        """Ask for what the next commit lacks, the wait doubling."""
        tick = self.frame.tick
        wants: list[Want] = []
        if tick not in self.arrivals.deliveries:
            wants.append(Want(channels.SUPERVISOR, channels.DELIVERIES.name, tick, self.epoch, []))
        if missing := self.missing_nodes:
            wants.append(Want(channels.SUPERVISOR, channels.PART.name, tick + 1, self.epoch, missing))
        self.actions += [Publish(channels.WANT, channels.SUPERVISOR, encode(want)) for want in wants]
        self._patience.asked(now_ns)

    # --- epochs ------------------------------------------------------------------------------------------------------

    def open_epoch(self, owners: dict[str, str], now_ns: int, members: Iterable[str] | None = None) -> None:
        """Begin a new epoch at the last commit: journal it, say it, issue the orders from there again.

        `members` are the nodes that take part from now on; without them they stay.
        """
        self.epoch += 1
        self.is_open = True
        self.owners = owners
        self.members = self.members if members is None else tuple(sorted(members))
        self.arrivals.parts.clear()
        self._slots = Slots(self.frame.layout, owners)
        frame, added = self.frame, self.added_to(self.frame.layout)
        who = list(self.members), sorted(owners.items()), added, self.roster.arithmetic
        epoch = Epoch(self.epoch, frame.tick, frame.digest, *who, self.branches.number, self.branches.tick)
        payload = encode(epoch)
        self.actions.append(Journal(payload))
        self.actions.append(Publish(channels.EPOCH, channels.SUPERVISOR, payload))
        self.epoch_payload = payload
        for tick in range(self.frame.tick, self.released):
            self._say_orders(tick, tick + 1)
        self.watch.begun(now_ns)
        self._patience.progress(self.deployment.tick_ns, now_ns)

    def start_if_ready(self, now_ns: int) -> None:
        """Open the first epoch when every declared process has built the world."""
        if self.is_open or self.end is not None or self.roster.missing(self.frame.layout.digest):
            return
        self.pacer.start(now_ns, self.frame.tick)
        self.actions.append(Publish(channels.TEMPO, channels.SUPERVISOR, self.tempo()))
        self.open_epoch(self.owners, now_ns, self.deployment.nodes)
        self.committed_ns = now_ns
        self._say_commit([], ([], ""), now_ns)

    def say_epoch(self) -> None:
        """Say the present epoch again."""
        self.actions.append(Publish(channels.EPOCH, channels.SUPERVISOR, self.epoch_payload))

    def count_repeat(self) -> None:
        """A message came twice, or for somebody who is not here any more."""
        self._repeated += 1

    def tempo(self) -> bytes:
        """Return the message that tells the vHub the pace."""
        return encode(Tempo(str(self.pacer.pace), self.pacer.paused))

    def prepare(self, layout: Layout) -> None:
        """Have every node build an engine for a layout."""
        self.actions.append(Publish(channels.PREPARE, channels.SUPERVISOR, encode(Prepare(self.added_to(layout)))))

    # --- messages ----------------------------------------------------------------------------------------------------

    def _on_part(self, part: Part, payload: bytes, now_ns: int) -> None:
        if part.epoch == self.epoch and self.arrivals.take_part(part, self.frame.tick, self.members):
            self.watch.part(part.tick - 1, part.node, now_ns)
        else:
            self._repeated += 1

    def _on_deliveries(self, deliveries: Deliveries, payload: bytes, now_ns: int) -> None:
        if not self.arrivals.take_deliveries(deliveries, payload, self.frame.tick):
            self._repeated += 1
            return
        for tick in range(deliveries.tick, deliveries.last + 1):
            self.watch.delivered(tick, now_ns)

    def _on_standing(self, standing: Standing, payload: bytes, now_ns: int) -> None:
        self._repeated += not self.branches.take(standing, now_ns)

    def _on_want(self, want: Want, payload: bytes, now_ns: int) -> None:
        if want.kind == channels.ORDER.name and want.tick in self.orders and want.epoch == self.epoch:
            self._say_orders(want.tick, want.tick + 1)
        elif want.kind == channels.COMMIT.name and want.tick in self.commits:
            self.actions.append(Publish(channels.COMMIT, want.sender, self.commits[want.tick]))

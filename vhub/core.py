"""The core of the vHub: takes messages and the time, and closes ticks in two phases.

It sees committed frames only. Closing tick k waits for Commit(k) and the samples of every robot (world phase), then for
the Dones of the lockstep clients that are due (clients phase); the record is written before the deliveries are spoken.
`Go` alone may be spoken before: it is a function of what is already written, commit and samples.
Neighbours: `state` (what a closing does), `door` and `sessions` (clients), `records` (journal), `resume` (what a vHub
that is started again goes on from), `protocol.member` (handshake).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from foosim.protocol import channels, limits
from foosim.protocol.actions import Action, Journal, Publish, Say
from foosim.protocol.channels import Channel
from foosim.protocol.codec import encode
from foosim.protocol.deployment import Deployment
from foosim.protocol.errors import Malformed, Refused
from foosim.protocol.frame import Frame
from foosim.protocol.hub_messages import Proceed
from foosim.protocol.member import Member
from foosim.protocol.messages import (
    DONE_OF,
    JOIN_OF,
    SAMPLES_OF,
    Build,
    ClientHello,
    Commit,
    Deliveries,
    Done,
    Down,
    End,
    Epoch,
    Failure,
    Farewell,
    Heartbeat,
    Join,
    Piece,
    Recall,
    Samples,
    Tempo,
    Up,
    Want,
    Watched,
)
from foosim.protocol.orphan import Orphan
from foosim.protocol.patience import Patience
from foosim.protocol.refusals import Refusals
from foosim.protocol.start import first_chain
from foosim.vhub.commits import Commits
from foosim.vhub.door import Door
from foosim.vhub.footing import Footing
from foosim.vhub.head import head_of
from foosim.vhub.keeping import Keep, KeepEpoch, Keeping, last_closings
from foosim.vhub.packet import Flight, received
from foosim.vhub.records import Closing, closing_of, missing_robots, tick_record, world_packets
from foosim.vhub.release import Releases
from foosim.vhub.report import HubStatistics, LinksTold, report, statistics
from foosim.vhub.resume import Past
from foosim.vhub.sessions import Sessions
from foosim.vhub.state import HubState
from foosim.vhub.waits import Waits
from foosim.vhub.watching import Watching

HubAction = Action | Keep | KeepEpoch


@dataclass(slots=True)
class _World:
    """The tick that is being closed, after its world phase."""

    frame: Frame
    closing: Closing
    commit: bytes
    free: dict[str, list[Flight]]


class HubCore:
    """The vHub's state machine. `actions` is what the shell performs next."""

    def __init__(self, boot: str, fingerprint: bytes, now_ns: int, world: str = "", machine: str = "") -> None:
        """`machine` names the present start of the machine, where that has a name."""
        self.actions: list[HubAction] = []
        self.refusals = Refusals(self.actions.append, lambda: self.deployment)
        self.member = Member("vhub", channels.VHUB, boot, fingerprint, world, self.actions, now_ns)  # type: ignore[arg-type]
        self.sessions = Sessions(boot, self.actions)  # type: ignore[arg-type]
        self.door, self.footing, self.orphan = Door(self), Footing(self, machine), Orphan()
        self.deployment: Deployment | None = None
        self.state: HubState | None = None
        self.releases: Releases | None = None
        self.ended: End | None = None
        self.finished = False
        self.lost = self.failure = self.capture = self.capture_file = self.radio_address = ""
        self.recording: dict[str, Any] = {}
        self.links_told, self.watching = LinksTold(), Watching()
        self.speak: Callable[[int], int] = lambda now_ns: now_ns
        """Called amid a closing: what is to be said by then may be performed; returns the time."""
        self.busy = 0.0
        self.epoch = self._epoch_tick = self._end_ns = self._malformed = self.repeated = self.disk_progress = 0
        self.epoch_payload = b""
        self._owners: dict[str, str] = {}
        self.waits = Waits()
        self._keeping = Keeping()
        self.commits = Commits()
        self._samples: dict[int, list[tuple[bytes, Samples]]] = {}
        self._sent: dict[int, bytes] = {}
        self._world: _World | None = None
        self.waited: list[str] = []
        """Clients whose Dones that tick lacks."""
        self._patience = Patience(now_ns)
        self._readers: dict[type[Any], Callable[[Any, bytes, int], None]] = {
            Commit: self._on_commit,
            Samples: self._on_samples,
            Epoch: self._on_epoch,
            Want: self._on_want,
            Recall: self._on_recall,
            Build: self._on_build,
            Piece: self._on_build,
            Tempo: self.door.tempo,
            Watched: self.watching.take,
            End: self._on_end,
            Proceed: self.footing.proceed,
            ClientHello: self.door.hello,
            Join: self.door.join,
            Up: self.door.up,
            Done: self.door.done,
            Failure: self.door.failure,
        }

    # --- what the shell calls --------------------------------------------------------------------------------------

    def receive(self, channel: Channel, name: str, payload: bytes, now_ns: int) -> None:
        """Take one message as it came; what does not fit is counted and dropped."""
        try:
            if channel is channels.REFUSAL:
                self.repeated += not self.member.refuse(self.refusals.read(channel, name, payload, now_ns))
                return
            message = self.refusals.read(channel, name, payload, now_ns)
            reader = self._readers.get(type(message))
            if reader is None:
                raise Malformed(f"the vHub does not read the channel {channel.name}")
            reader(message, payload, now_ns)
        except Refused as error:
            self._malformed += 1
            if channel.plane is channels.Plane.RADIO and self.state is not None:
                self.state.refuse_at_door("malformed")
            self.refusals.refuse(channel, name, payload, error, now_ns)

    def advance(self, now_ns: int) -> None:
        """Close ticks as far as the inputs allow."""
        while self.state is not None and self.epoch > 0 and not self.finished:
            if self.ended is not None and self.state.closed + 1 >= self.ended.tick:
                self._finish(now_ns)
                return
            if self.footing.waits or (self._world is None and not self._close_world(now_ns)):
                return
            if not self._close_clients(now_ns):
                return

    def wake(self, now_ns: int) -> None:
        """Do what is due by time: hello, heartbeat, asking again, releases, deadlines, the end."""
        self.member.wake(now_ns, self.heartbeat)
        self.door.wake(now_ns)
        if self.state is not None and self.epoch > 0:
            self.sessions.acknowledge(self.state, now_ns)
        if self._patience.is_over(now_ns) and self.epoch > 0 and not self.finished:
            self._ask_again(now_ns)
        self._release(now_ns)
        if self.ended is not None and not self.finished and now_ns >= self._end_ns:
            self._finish(now_ns)

    def deadline_ns(self) -> int:
        """When `wake` has something to do next."""
        deadline = self.member.deadline_ns
        if self.epoch > 0 and not self.finished:
            deadline = min(deadline, self._patience.at_ns, limits.COUNTER_MAX if self.ended is None else self._end_ns)
        if self.releases is not None and self.releases.deadline_ns is not None:
            deadline = min(deadline, self.releases.deadline_ns)
        if self.waited:
            deadline = min(deadline, self.sessions.again_ns(self.waited))
        late_ns = self.sessions.late_ns
        return deadline if late_ns is None else min(deadline, late_ns)

    def client_gone(self, name: str, now_ns: int) -> None:
        """A client's presence has ended."""
        self.door.gone(name, now_ns)

    def statistics(self) -> HubStatistics:
        return statistics(self.state, self._malformed, self.repeated)

    @property
    def lacking(self) -> tuple[Channel, int]:
        """The channel, and how many messages of it, without which no tick is closed; free-running clients wake nobody.
        Where deliveries are final nobody waits for a closing: those ticks are closed together."""
        if self.state is None:
            return channels.COMMIT, 1
        if self.epoch == 0 or self.waited:
            return channels.UP, max(1, len(self.waited))
        if self._world is None and self.state.closed + 1 in self.commits:
            return channels.SAMPLES, 1
        return channels.COMMIT, max(1, self.state.final - self.commits.next_tick)

    @property
    def waiting_for(self) -> str:
        """What the closing of the current tick lacks, for people and for the supervisor."""
        if self.state is None:
            return "start"
        if self.footing.waits:
            return "to proceed"
        if self.epoch == 0:
            missing = self.sessions.missing(self.state.deployment, self.state)
            return JOIN_OF + ", ".join(missing) if missing else "epoch"
        if self._world is not None:
            return DONE_OF + ", ".join(self.waited) if self.waited else ""
        tick = self.state.closed + 1
        committed = self.commits.get(tick)
        if committed is None:
            return "commit"
        _, commit, frame = committed
        robots = missing_robots((s for _, s in self._samples.get(tick, ())), commit.digest, frame)
        return "end" if commit.last else SAMPLES_OF + ", ".join(sorted({self._owners[robot] for robot in robots}))

    @property
    def is_between_ticks(self) -> bool:
        return self._world is None

    def waits_for(self, client: str) -> bool:
        """Whether a tick waits for this client's Done."""
        return client in self.waited

    # --- closing a tick ----------------------------------------------------------------------------------------------

    def _close_world(self, now_ns: int) -> bool:
        """Phase one, when commit and all samples are there: judge what robots sent, say Go."""
        state = self.state
        assert state is not None
        tick = state.closed + 1
        if (committed := self.commits.get(tick)) is None:
            return False
        raw, commit, frame = committed
        self.waits.begin(now_ns)
        packets = world_packets((s for _, s in self._samples.get(tick, ())), commit.digest, frame, state.sampling)
        if packets is None or commit.last:
            return False
        self.waits.close_world(now_ns)
        joins, leaves = self.door.come_and_go(tick)
        for name in leaves:
            state.leave(name)
        for joining in joins:
            state.join(joining, tick)
        closing = closing_of(frame, commit, self.commits.chain_at(tick), state, joins, leaves, now_ns)
        released = state.close_world(frame, packets, closing.fates, commit.edits)
        if self.watching.readings:
            self.watching.sensed(tick, packets)
        due = state.due_members(tick)
        for name in due:
            self.door.go(name, tick, released.pop(name, []), now_ns)
        self._world = _World(frame, closing, raw, released)
        self.waited = [name for name in due if name in self.sessions.by_name]
        return True

    def _close_clients(self, now_ns: int) -> bool:
        """Phase two, when all Dones are there: judge what clients sent, write, speak; what robots get comes first."""
        if self.waited:
            return False
        world, state, releases = self._world, self.state, self.releases
        assert world is not None and state is not None and releases is not None
        tick = world.frame.tick
        self._tell_of_waits(now_ns)
        self.door.leave_owing(state, world.closing)
        admitted = self.sessions.take_sent() if state.hears_clients else {}
        samples = self._samples.pop(tick, [])
        deliveries = state.close_robots(world.frame, admitted)
        payload = encode(deliveries)
        for name in world.free:
            state.members[name].downlink += 1
        record = tick_record(world.closing, world.commit, samples, admitted, state, payload)
        self.actions.append(Journal(record))
        self.door.say_owed(world.closing, now_ns)
        self.door.tell()
        self._sent.pop(tick + 1 - limits.KEPT_TICKS, None)
        if not state.was_final:
            self._sent[tick + 1] = payload
            for following in range(tick + 2, state.final + 1):
                self._sent[following] = encode(Deliveries(following, [], branch=state.branch))
            self.actions.append(Publish(channels.DELIVERIES, channels.VHUB, payload))
        now_ns = self.speak(now_ns)
        for name, flights in world.free.items():
            releases.add(name, state.members[name].downlink, tick, flights, now_ns)
        self._release(now_ns)
        self.speak(now_ns)
        world.closing.fates += state.close_rest()
        if state.fabric.faults:
            self.lose("the network", state.fabric.faults[0])
        for flight in world.closing.fates:
            if not flight.cause and flight.destination not in state.members:
                flight.released_wall_ns = now_ns
        if self.watching.links:
            self.watching.judged(world.closing.fates)
        world.closing.ages = state.aged
        self._keeping.add(world.closing)
        self.actions += self._keeping.take(releases.waiting_tick)
        self._world = None
        if (tick + 1) % limits.CHECKPOINT_TICKS == 0:
            self.actions.append(Journal(self.head()))
        self.commits.forget(tick - limits.KEPT_TICKS)
        self._patience.progress(state.tick_ns, now_ns)
        return True

    def _tell_of_waits(self, now_ns: int) -> None:
        """Before late deliveries, tell the supervisor whom they waited for."""
        assert self.releases is not None and self.state is not None
        factor = self.releases.factor
        text = self.waits.close(now_ns, int(self.state.tick_ns / factor / 2) if factor else limits.COUNTER_MAX)
        if text:
            told = Heartbeat(channels.VHUB, self.state.closed + 1, self.epoch, text, self.lost, self.busy, b"")
            self.actions.append(Publish(channels.HEARTBEAT, channels.VHUB, encode(told)))

    def head(self) -> bytes:
        """Return the record with which a journal file starts: the state after the last closed tick."""
        return head_of(self)

    def _release(self, now_ns: int) -> None:
        """Say what is released to free-running clients by now; closings of which nothing waits go to the capture."""
        if self.releases is None or self.state is None:
            return
        for release in self.releases.take(now_ns, everything=self.finished):
            for flight in release.flights:
                flight.released_wall_ns = now_ns
            member = self.state.members[release.client]
            packets, branch = received(release.flights), self.state.branch
            down = Down(release.number, release.tick, member.sequence, packets, False, branch)
            self.sessions.say_down(release.client, down, now_ns)
        self.actions += self._keeping.take(self.releases.waiting_tick)

    # --- messages ----------------------------------------------------------------------------------------------------

    def _on_build(self, build: Build | Piece, payload: bytes, now_ns: int) -> None:
        if not self.member.take_build(build):
            self.repeated += not self.member.is_fetching
            return
        self.deployment = self.member.deployment
        if self.state is not None:  # of a supervisor that has recalled us
            self.member.is_ready = False
            self.ready_if_complete()

    def begin(self, past: Past | None, now_ns: int) -> None:
        """Take part, once there is a build: from the start, or from where the vHub before ended, as its journal says.

        The shell calls it, since only the shell can read the journal.
        """
        deployment, build = self.deployment, self.member.build
        assert deployment is not None and build is not None and self.state is None, "begin once, after the build"
        self.releases = Releases(deployment.tick_ns)
        self.sessions.downlinks.kept_ns = deployment.deadlines.client_back_ns
        self.member.standing = self.footing.standing
        if past is None:
            self.state = HubState(deployment, self.member.first_tick)
            self.commits.start(self.member.layout, self.member.first_tick, first_chain(build.origin))
        else:
            self._go_on(past, now_ns)
        self.actions.append(Journal(self.head()))
        self.ready_if_complete()

    def _go_on(self, past: Past, now_ns: int) -> None:
        """Be the vHub that was there before: say its last deliveries again, and ask for what comes after."""
        assert self.deployment is not None
        state = self.state = past.state
        self.commits.start(past.layout, state.closed + 1, past.chain, past.committed)
        self._sent = past.sent
        self.sessions.downlinks.restore(past.downlinks, now_ns)
        self.door.go_on(past.inputs, past.absences, now_ns)
        self.actions += past.words()
        if past.epoch is not None:
            self._take_epoch(past.epoch)
            self.footing.stand(past.machine, past.published, past.owing)
        self._patience.progress(self.deployment.tick_ns, now_ns)

    def _on_recall(self, recall: Recall, payload: bytes, now_ns: int) -> None:
        self.repeated += not self.member.recall(recall)

    def ready_if_complete(self) -> None:
        """The hub is ready when all declared lockstep clients have joined, or had joined the one before it."""
        layout = self.commits.layout
        if layout is None or self.deployment is None or self.state is None or self.member.is_ready:
            return
        if self.epoch > 0 or not self.sessions.missing(self.deployment, self.state):
            self.member.ready(layout)

    def _take_epoch(self, epoch: Epoch) -> None:
        self.epoch, self._epoch_tick = epoch.epoch, epoch.tick
        self.epoch_payload = encode(epoch)
        self._owners = dict(epoch.owners)

    def _on_epoch(self, epoch: Epoch, payload: bytes, now_ns: int) -> None:
        if self.state is None:
            return
        if epoch.epoch <= self.epoch:
            self.repeated += 1
            self.member.repeated(epoch.epoch == self.epoch and not self.footing.waits)
            return
        self.member.check_epoch(epoch)
        first = self.epoch == 0
        if first and epoch.tick > self.state.closed + 1:
            self.failure = f"the run is at tick {epoch.tick}: the journal of the vHub that brought it there is not here"
            return
        branches = self.state.turn_to(epoch)
        self._take_epoch(epoch)
        self.actions += [Journal(self.epoch_payload), KeepEpoch(epoch)]
        if branches:
            self.footing.branch_off(self._sent)
        self.footing.entered()
        if first:
            tick = self.state.closed + 1
            self._sent[tick] = encode(Deliveries(tick, [], branch=epoch.branch))
            self.actions.append(Publish(channels.DELIVERIES, channels.VHUB, self._sent[tick]))
            self._patience.progress(self.state.tick_ns, now_ns)

    def _on_commit(self, commit: Commit, payload: bytes, now_ns: int) -> None:
        taken = [] if self.footing.fences(commit, self._epoch_tick) else self.commits.take(commit, payload)
        self.repeated += not taken
        if self.releases is not None:
            for tick in taken:
                self.releases.committed(tick, now_ns)

    def _on_samples(self, samples: Samples, payload: bytes, now_ns: int) -> None:
        if self.state is None or not self.state.closed < samples.tick <= self.state.closed + limits.KEPT_TICKS:
            self.repeated += 1
            return
        kept = self._samples.setdefault(samples.tick, [])
        if any(raw == payload for raw, _ in kept):
            self.repeated += 1
        elif len(kept) < limits.NODES_MAX * 4:
            kept.append((payload, samples))
            self.waits.node = samples.node

    def _on_want(self, want: Want, payload: bytes, now_ns: int) -> None:
        if want.kind == channels.DELIVERIES.name and want.tick in self._sent and not self.footing.waits:
            self.actions.append(Publish(channels.DELIVERIES, channels.VHUB, self._sent[want.tick]))

    # --- time --------------------------------------------------------------------------------------------------------

    def _ask_again(self, now_ns: int) -> None:
        assert self.state is not None
        tick, kind = self.state.closed + 1, channels.SAMPLES.name
        if self.commits.next_tick <= (tick if self.ended is None else self.ended.tick):
            tick, kind = self.commits.next_tick, channels.COMMIT.name
        if (self._world is None or kind == channels.COMMIT.name) and not self.footing.waits:
            want = Want(channels.VHUB, kind, tick, self.epoch, [])
            self.actions.append(Publish(channels.WANT, channels.VHUB, encode(want)))
        self._patience.asked(now_ns)

    def lose(self, name: str, why: str) -> None:
        """What the run cannot do without is lost: a client, the capture, room for the journal."""
        self.give_up(f"lost {name}: {why}")

    def give_up(self, reason: str) -> None:
        """The run cannot go on: the supervisor ends it for the first reason that it hears."""
        if not self.lost:
            self.lost = reason
            self.actions.append(Say("error", reason))
            self.say_heartbeat()

    def say_heartbeat(self) -> None:
        """Say at once what the next heartbeat would."""
        self.actions.append(Publish(channels.HEARTBEAT, channels.VHUB, encode(self.heartbeat())))

    def heartbeat(self) -> Heartbeat:
        """Return what it says of itself."""
        tick = 0 if self.state is None else self.state.closed + 1
        return Heartbeat(channels.VHUB, tick, self.epoch, self.waiting_for, self.lost, self.busy, report(self))

    # --- the end -----------------------------------------------------------------------------------------------------

    def _on_end(self, end: End, payload: bytes, now_ns: int) -> None:
        if self.ended is None:
            self.ended = end
            self._end_ns = now_ns + limits.DOWNLINK_KEPT_NS

    def _finish(self, now_ns: int) -> None:
        """Record what is committed and not closed, and what is in flight; tell the clients. The shell says farewell."""
        assert self.state is not None and self.ended is not None
        lacks = self.ended.tick not in self.commits
        if lacks and self.state.closed + 1 >= self.ended.tick and now_ns < self._end_ns:
            return
        self.finished = True
        self._release(now_ns)
        half = None if self._world is None else self._world.closing  # a tick that is half closed has fates
        self.actions += map(Keep, last_closings(self.state, self.commits, self.ended.tick, half, now_ns))
        for name in self.sessions.by_name:
            member = self.state.members.get(name)
            number = 1 if member is None else member.downlink + 1
            self.sessions.say_down(name, Down(number, self.ended.tick, 0, [], True, self.state.branch), now_ns)

    def farewell(self) -> Publish:
        """Return the hub's last message, once the shell has closed the capture."""
        return Publish(channels.FAREWELL, channels.VHUB, encode(Farewell(channels.VHUB, report(self, is_last=True))))

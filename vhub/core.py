"""The core of the vHub: takes messages and the time, and closes ticks.

It reads committed frames only. The closing of tick k waits for Commit(k) and the samples of every robot (world phase),
then for the Dones of the lockstep clients that are due (clients phase). The tick's record is written before its
deliveries are sent. Only `Go` messages may be sent before: they are a function of the commit and the samples, which
other processes have.

What nodes wait for leaves first, so a closing has steps: between them the shell performs the actions
(`HubCore.step`).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any

from foosim.common import limits
from foosim.common.errors import Malformed, Refused
from foosim.common.json_text import encode_json
from foosim.deployment.schema import Deployment
from foosim.protocol import channels
from foosim.protocol.actions import Action, Journal, Log, Publish
from foosim.protocol.channels import Channel
from foosim.protocol.codec import encode
from foosim.protocol.handshake import Member, NotValidHere, failed_component, sendable
from foosim.protocol.hub_messages import ResumeGrant, ResumeState
from foosim.protocol.messages import (
    CAPTURE,
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
    FailedComponent,
    Failure,
    Farewell,
    Fetch,
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
from foosim.protocol.rejects import Refusals
from foosim.protocol.retry import RetryTimer
from foosim.runtime.roles.standstill import REPORTED_NS, standstill_text
from foosim.runtime.supervisor_timeout import SupervisorTimeout
from foosim.vhub.clients import Clients, lost
from foosim.vhub.network.packet import Flight, received
from foosim.vhub.paced_release import Releases
from foosim.vhub.sessions import Sessions
from foosim.vhub.state.commits import Commits
from foosim.vhub.state.hub_state import HubState
from foosim.vhub.state.records import (
    Closing,
    HeadRecord,
    closing_of,
    last_closings,
    missing_robots,
    tick_record,
    world_packets,
)
from foosim.vhub.state.resume import Past
from foosim.vhub.status import LinkLines, ShellStatus, report
from foosim.vhub.wait_times import WaitTimes
from foosim.vhub.watching import WatchList
from foosim.world.assembly.initial_state import first_chain
from foosim.world.components.view import ComponentError
from foosim.world.frame import Frame

HubAction = Action | Closing | Epoch
"""The shell records a closing, or an epoch that begins, in the capture."""


class _Step(Enum):
    """How far the closing of a tick is after its world phase."""

    OPEN = 0
    """It waits for Dones."""
    WRITTEN = 1
    """The tick's record and its deliveries are among the actions."""
    RELEASED = 2
    """Also what is released to free-running clients."""


@dataclass(slots=True)
class _World:
    """The tick that is being closed, after its world phase."""

    frame: Frame
    closing: Closing
    commit: bytes
    free: dict[str, list[Flight]]
    """What is released to clients outside of lockstep."""
    step: _Step = _Step.OPEN
    sent_ns: int = 0
    """When its deliveries had left."""


class ResumeHandshake:
    """Whether a vHub that resumes from a journal has the supervisor's grant, and what it sends once it has.

    The journal's end may be lost with the machine. So the vHub reports its resume position; until the grant it closes
    no tick, takes no commit and admits no client. `machine` is the present boot of its machine, empty for an unnamed
    one.
    """

    def __init__(self, machine: str) -> None:
        self.waits = False
        self.lost_machine = False
        """Whether the journal was written before the last boot of the machine."""
        self.published: list[bytes] = []
        """The last deliveries of the vHub before, which may have been written and not sent."""
        self.owing: list[str] = []
        """Clients that left at its last tick without their Done: the packets of their Go may not have been sent."""
        self.granted_from = limits.COUNTER_MAX
        """The first epoch of the grant."""
        self._machine = self._written_on = machine

    @property
    def machine(self) -> str:
        """The machine's boot that the journal names: the one before, until its end is known to be complete."""
        return self._written_on if self.waits else self._machine

    def begin(self, machine: str, published: bytes, owing: list[str]) -> None:
        """Wait for the grant: the journal names this boot of a machine, and these deliveries as the last."""
        self.waits, self._written_on, self.owing = True, machine, owing
        self.published = [published] if published else []
        self.lost_machine = "" != machine != self._machine != ""


class HubCore:
    """The vHub's state machine. `actions` is what the shell performs next."""

    def __init__(self, boot: str, fingerprint: bytes, now_ns: int, world: str = "", machine: str = "") -> None:
        """`machine` names the present boot of the machine, where that has a name."""
        self.actions: list[HubAction] = []
        self.refusals = Refusals(self.actions.append, lambda: self.deployment)
        self.member = Member("vhub", channels.VHUB, boot, fingerprint, world, self.actions, now_ns)  # type: ignore[arg-type]
        self.sessions = Sessions(boot, self.actions)  # type: ignore[arg-type]
        self.waits = WaitTimes()
        hooks = self.send_heartbeat, self.give_up
        self.clients = Clients(self.sessions, self.actions, self.waits, *hooks)  # type: ignore[arg-type]
        self.handshake, self.orphan = ResumeHandshake(machine), SupervisorTimeout()
        self.deployment: Deployment | None = None
        self.state: HubState | None = None
        self.releases: Releases | None = None
        self.ended: End | None = None
        self.finished = False
        self.is_closing = False
        """Whether the run has ended and the capture accepts no more records: only heartbeats follow, with its state."""
        self.lost = self.failure = self.capture_file = ""
        self.shell = ShellStatus()
        self.link_lines, self.watching = LinkLines(), WatchList()
        self.busy = 0.0
        self.epoch = self._epoch_tick = self._end_ns = self.malformed = self._repeated = 0
        self.epoch_payload = b""
        self._owners: dict[str, str] = {}
        self._unrecorded: deque[Closing] = deque()
        """Closings with packets that clients have not been sent yet, and all later ones, oldest first."""
        self.commits = Commits()
        self._samples: dict[int, list[tuple[bytes, Samples]]] = {}
        self._sent: dict[int, bytes] = {}
        self._world: _World | None = None
        self._failed: FailedComponent | None = None
        self._retry = RetryTimer(now_ns)
        clients = self.clients
        self._readers: dict[type[Any], Callable[[Any, bytes, int], None]] = {
            Commit: self._on_commit,
            Samples: self._on_samples,
            Epoch: self._on_epoch,
            Want: self._on_want,
            Recall: self._on_recall,
            Build: self._on_build,
            Piece: self._on_build,
            Tempo: clients.on_tempo,
            Watched: self.watching.take,
            End: self._on_end,
            ResumeGrant: self._on_proceed,
            ClientHello: self._on_hello,
            Fetch: clients.on_fetch,
            Join: self._on_join,
            Up: clients.on_up,
            Done: clients.on_done,
            Failure: clients.on_failure,
        }

    # --- what the shell calls --------------------------------------------------------------------------------------

    def receive(self, channel: Channel, name: str, payload: bytes, now_ns: int) -> None:
        """Take one message; a malformed or misplaced one is counted and dropped.

        Any one is dropped once the capture is being closed.
        """
        if self.is_closing:
            return
        try:
            if channel is channels.REFUSAL:
                self._repeated += not self.member.refuse(self.refusals.read(channel, name, payload, now_ns))
                return
            message = self.refusals.read(channel, name, payload, now_ns)
            reader = self._readers.get(type(message))
            if reader is None:
                raise Malformed(f"the vHub does not read the channel {channel.name}")
            reader(message, payload, now_ns)
        except NotValidHere as error:
            self.lost = self.lost or error.what
        except Refused as error:
            self.malformed += 1
            if channel.plane is channels.Plane.RADIO and self.state is not None:
                self.state.reject_on_receipt("malformed")
            self.refusals.refuse(channel, name, payload, error, now_ns)

    def advance(self, now_ns: int) -> None:
        """Close ticks as far as the inputs allow."""
        while self.step(now_ns, now_ns):
            pass

    def step(self, now_ns: int, sent_ns: int) -> bool:
        """Close ticks up to the next point at which something has to leave before the rest is computed.

        Return True there: the shell performs `actions` and steps again; `sent_ns` is the time when they had left.
        Return False when the inputs allow no more. `now_ns` is the time of the messages that were received last.
        """
        try:
            return self._step(now_ns, sent_ns)
        except ComponentError as error:  # such as a body that cannot be made here
            self.fail(error)
            return False

    def _step(self, now_ns: int, sent_ns: int) -> bool:
        while self.state is not None and self.epoch > 0 and not self.finished:
            world = self._world
            if self._failed is not None:
                if self.ended is not None:
                    self._finish(now_ns)
                return False
            if world is not None and world.step is _Step.WRITTEN:
                self._release_closed(world, sent_ns)
                return True
            if world is not None and world.step is _Step.RELEASED:
                self._close_rest(world)
                continue
            if self.ended is not None and self.state.closed + 1 >= self.ended.tick:
                self._finish(now_ns)
                return False
            if self.handshake.waits or (world is None and not self._close_world(now_ns)):
                return False
            return self._close_clients(now_ns)
        return False

    def wake(self, now_ns: int) -> None:
        """Do what is due by time: hello, heartbeat, repeated requests, releases, deadlines, the end."""
        self.member.wake(now_ns, self.heartbeat)
        if self.is_closing:
            return
        self.clients.wake(now_ns, holds=self.orphan.is_alone or self.handshake.waits)
        if self.state is not None and self.epoch > 0:
            self.sessions.acknowledge(self.state, now_ns)
        if self._retry.is_over(now_ns) and self.epoch > 0 and not self.finished:
            self._request_again(now_ns)
        self._release(now_ns)
        if self.ended is not None and not self.finished and now_ns >= self._end_ns:
            self._finish(now_ns)

    def deadline_ns(self) -> int:
        """When `wake` has something to do next."""
        deadline = self.member.deadline_ns
        if self.is_closing:
            return deadline
        if self.epoch > 0 and not self.finished:
            deadline = min(deadline, self._retry.at_ns, limits.COUNTER_MAX if self.ended is None else self._end_ns)
        if self.releases is not None and self.releases.deadline_ns is not None:
            deadline = min(deadline, self.releases.deadline_ns)
        if self.clients.waited:
            deadline = min(deadline, self.sessions.again_ns(self.clients.waited))
        late_ns = self.sessions.late_ns
        return deadline if late_ns is None else min(deadline, late_ns)

    def rest(self, stood_ns: int, now_ns: int) -> None:
        """The vHub's own loop was blocked for `stood_ns`: that counts neither against clients nor the supervisor."""
        self.orphan.rest(stood_ns, now_ns)
        if stood_ns >= REPORTED_NS:
            self.actions.append(Log("warning", standstill_text(stood_ns)))
        self.clients.rest(stood_ns, now_ns)

    def client_gone(self, name: str, now_ns: int) -> None:
        """A client has disconnected."""
        if self.ended is None:
            self.clients.on_gone(name, now_ns)

    @property
    def repeated(self) -> int:
        """Messages that came twice or too late."""
        return self._repeated + self.clients.repeated

    @property
    def lacking(self) -> tuple[Channel, int]:
        """The channel, and how many messages of it, without which no tick is closed; messages of free-running
        clients are not among them. Ticks whose deliveries are final already are closed together."""
        if self.state is None:
            return channels.COMMIT, 1
        if self.epoch == 0 or self.clients.waited:
            return channels.UP, max(1, len(self.clients.waited))
        if self._world is None and self.state.closed + 1 in self.commits:
            return channels.SAMPLES, 1
        return channels.COMMIT, max(1, self.state.final - self.commits.next_tick)

    @property
    def waiting_for(self) -> str:
        """What the closing of the current tick waits for, for people and for the supervisor."""
        if self.is_closing:
            return CAPTURE
        if self.state is None:
            return "start"
        if self.handshake.waits:
            return "to proceed"
        if self.epoch == 0:
            missing = self.sessions.missing(self.state.deployment, self.state)
            return JOIN_OF + ", ".join(missing) if missing else "epoch"
        if self._world is not None:
            return DONE_OF + ", ".join(self.clients.waited) if self.clients.waited else ""
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

    # --- closing a tick ----------------------------------------------------------------------------------------------

    def _close_world(self, now_ns: int) -> bool:
        """Phase one, when commit and all samples have come: judge what robots sent, send Go."""
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
        joins, leaves = self.clients.come_and_go(tick)
        for name in leaves:
            state.leave(name)
        for joining in joins:
            state.join(joining, tick)
        closing = closing_of(frame, commit, self.commits.chain_at(tick), state, joins, leaves, now_ns)
        closing.sensed = packets
        released = state.close_world(frame, packets, closing.fates, commit.edits)
        if self.watching.readings:
            self.watching.sensed(tick, packets)
        due = state.due_members(tick)
        for name in due:
            self.clients.go(name, tick, released.pop(name, []), now_ns)
        self._world = _World(frame, closing, raw, released)
        self.clients.waited = [name for name in due if name in self.sessions.by_name]
        return True

    def _close_clients(self, now_ns: int) -> bool:
        """Phase two, when all Dones are there: judge what clients sent to robots; write, then send the deliveries."""
        if self.clients.waited:
            return False
        world, state = self._world, self.state
        assert world is not None and state is not None
        tick = world.frame.tick
        self._report_waits(now_ns)
        self.clients.leave_owing(state, world.closing)
        admitted, reports = self.sessions.take_sent() if state.hears_clients else ({}, {})
        samples = self._samples.pop(tick, [])
        deliveries = state.close_robots(world.frame, admitted, reports)
        payload = encode(deliveries)
        for name in world.free:
            state.members[name].downlink += 1
        record = tick_record(world.closing, world.commit, samples, admitted, state, payload, reports)
        self.actions.append(Journal(record))
        self.clients.send_owed(world.closing, now_ns)
        self.clients.report()
        self._sent.pop(tick + 1 - limits.KEPT_TICKS, None)
        if not state.was_final:
            self._sent[tick + 1] = payload
            for following in range(tick + 2, state.final + 1):
                self._sent[following] = encode(Deliveries(following, []))
            self.actions.append(Publish(channels.DELIVERIES, channels.VHUB, payload))
        world.step = _Step.WRITTEN
        return True

    def _release_closed(self, world: _World, sent_ns: int) -> None:
        """After the deliveries, release to free-running clients the packets due by now."""
        state, releases = self.state, self.releases
        assert state is not None and releases is not None
        for name, flights in world.free.items():
            member = state.members[name]
            what = name, member.downlink, world.frame.tick, flights, sent_ns
            releases.add(*what, member.since, member.absent)
        self._release(sent_ns)
        world.step, world.sent_ns = _Step.RELEASED, sent_ns

    def _close_rest(self, world: _World) -> None:
        """Judge the packets between clients, which no process waits for, and hand the closing to the capture."""
        state, releases, tick = self.state, self.releases, world.frame.tick
        assert state is not None and releases is not None
        world.closing.fates += state.close_rest()
        if state.fabric.faults:
            self.lose("the network", state.fabric.faults[0])
        for flight in world.closing.fates:
            if not flight.cause and flight.destination not in state.members:
                flight.released_wall_ns = world.sent_ns
        if self.watching.links:
            self.watching.judged(world.closing.fates)
        world.closing.ages, world.closing.metrics = state.aged, state.measured
        self._unrecorded.append(world.closing)
        self._record(releases)
        self._world = None
        if (tick + 1) % limits.CHECKPOINT_TICKS == 0:
            self.actions.append(Journal(self.head()))
        self.commits.forget(tick - limits.KEPT_TICKS)
        self._retry.progress(state.tick_ns, world.sent_ns)

    def _report_waits(self, now_ns: int) -> None:
        """Before late deliveries, report to the supervisor what they waited for."""
        assert self.releases is not None and self.state is not None
        factor = self.releases.factor
        text = self.waits.close(now_ns, int(self.state.tick_ns / factor / 2) if factor else limits.COUNTER_MAX)
        if text:
            late = Heartbeat(channels.VHUB, self.state.closed + 1, self.epoch, text, self.lost, self.busy, b"")
            self.actions.append(Publish(channels.HEARTBEAT, channels.VHUB, encode(late)))

    def head(self) -> bytes:
        """Return the record with which a journal file starts: the state after the last closed tick."""
        assert self.state is not None and self.member.build is not None
        closed = self.state.closed
        commit, _, _ = self.commits.get(closed) or (b"", None, None)
        return encode(
            HeadRecord(
                self.member.build.run,
                self.state.snapshot(),
                commit,
                self.epoch_payload,
                self.capture_file,
                self.commits.chain_at(closed),
                self.handshake.machine,
                self.clients.absences.record(),
            )
        )

    def _release(self, now_ns: int) -> None:
        """Send packets to free-running clients that are due by now; closings without dependants go to the capture."""
        if self.releases is None or self.state is None:
            return
        for release in self.releases.take(now_ns, everything=self.finished):
            for flight in release.flights:
                flight.released_wall_ns = now_ns
            member = self.state.members[release.client]
            what = release.number, release.tick, member.sequence, received(release.flights)
            down = Down(*what, False, release.since, [*release.absent])
            self.sessions.send_down(release.client, down, now_ns)
        self._record(self.releases)

    def _record(self, releases: Releases) -> None:
        """Have the closings recorded, in the order of their ticks, whose packets have their times of release."""
        waiting, closings = releases.waiting_tick, self._unrecorded
        while closings and (waiting is None or closings[0].frame.tick < waiting):
            self.actions.append(closings.popleft())

    # --- messages ----------------------------------------------------------------------------------------------------

    def _on_build(self, build: Build | Piece, payload: bytes, now_ns: int) -> None:
        if not self.member.take_build(build):
            self._repeated += not self.member.is_fetching
            return
        self.deployment = self.member.deployment
        if self.state is not None:  # of a supervisor that has recalled us
            self.member.is_ready = False
            self.ready_if_complete()

    def begin(self, past: Past | None, now_ns: int) -> None:
        """Take part, once there is a build: from the start, or from the end of the journal of the vHub before.

        The shell calls it, since only the shell can read the journal.
        """
        deployment, build = self.deployment, self.member.build
        assert deployment is not None and build is not None and self.state is None, "begin once, after the build"
        self.releases = Releases(deployment.tick_ns)
        self.sessions.downlinks.kept_ns = deployment.deadlines.client_back_ns
        self.member.standing = self._resume_state
        if past is None:
            self.state = HubState(deployment, self.member.first_tick)
            self.clients.begin(self.state, self.releases)
            self.commits.start(self.member.layout, self.member.first_tick, first_chain(build.origin))
        else:
            self._resume(past, now_ns)
        self.actions.append(Journal(self.head()))
        self.ready_if_complete()

    def _resume(self, past: Past, now_ns: int) -> None:
        """Resume as the vHub before: restore its state, and wait for the supervisor's grant."""
        assert self.deployment is not None and self.releases is not None
        fold = past.fold
        state = self.state = fold.state
        self.clients.begin(state, self.releases)
        self.commits.start(fold.layout, state.closed + 1, fold.chain, past.committed)
        self._sent = past.sent
        self.sessions.downlinks.restore(past.downlinks, now_ns)
        self.clients.resume(fold.inputs, fold.absences, now_ns)
        self.actions += past.actions()
        if past.epoch is not None:
            self._take_epoch(past.epoch)
            self.handshake.begin(fold.machine, past.published, past.owing)
        self._retry.progress(self.deployment.tick_ns, now_ns)

    def _on_recall(self, recall: Recall, payload: bytes, now_ns: int) -> None:
        self._repeated += not self.member.recall(recall)

    def ready_if_complete(self) -> None:
        """The hub is ready when all declared lockstep clients have joined, or had joined the one before it."""
        if self.commits.layout is None or self.deployment is None or self.state is None or self.member.is_ready:
            return
        if self.epoch > 0 or not self.sessions.missing(self.deployment, self.state):
            self.member.ready()

    def _take_epoch(self, epoch: Epoch) -> None:
        self.epoch, self._epoch_tick = epoch.epoch, epoch.tick
        self.clients.has_begun = True
        self.epoch_payload = encode(epoch)
        self._owners = dict(epoch.owners)

    def _on_epoch(self, epoch: Epoch, payload: bytes, now_ns: int) -> None:
        if self.state is None:
            return
        if epoch.epoch <= self.epoch:
            self._repeated += 1
            self.member.repeated(epoch.epoch == self.epoch and not self.handshake.waits)
            return
        self.member.check_epoch(epoch)
        first = self.epoch == 0
        if first and epoch.tick > self.state.closed + 1:
            self.failure = f"the run is at tick {epoch.tick}: the journal of the vHub that brought it there is not here"
            return
        self._take_epoch(epoch)
        self.actions += [Journal(self.epoch_payload), epoch]
        self._enter()
        if first:
            tick = self.state.closed + 1
            self._sent[tick] = encode(Deliveries(tick, []))
            self.actions.append(Publish(channels.DELIVERIES, channels.VHUB, self._sent[tick]))
            self._retry.progress(self.state.tick_ns, now_ns)

    def _on_commit(self, commit: Commit, payload: bytes, now_ns: int) -> None:
        taken = [] if self._fences(commit) else self.commits.take(commit, payload)
        self._repeated += not taken
        if self.releases is not None:
            for tick in taken:
                self.releases.committed(tick, now_ns)

    def _on_samples(self, samples: Samples, payload: bytes, now_ns: int) -> None:
        if self.state is None or not self.state.closed < samples.tick <= self.state.closed + limits.KEPT_TICKS:
            self._repeated += 1
            return
        kept = self._samples.setdefault(samples.tick, [])
        if any(raw == payload for raw, _ in kept):
            self._repeated += 1
        elif len(kept) < limits.NODES_MAX * 4:
            kept.append((payload, samples))
            self.waits.node = samples.node

    def _on_want(self, want: Want, payload: bytes, now_ns: int) -> None:
        if want.kind == channels.DELIVERIES.name and want.tick in self._sent and not self.handshake.waits:
            self.actions.append(Publish(channels.DELIVERIES, channels.VHUB, self._sent[want.tick]))

    def _on_hello(self, hello: ClientHello, payload: bytes, now_ns: int) -> None:
        """Admit a client, but not before the grant: it would learn a position from which the run may not resume."""
        if not self.handshake.waits and self.member.build is not None:
            self.clients.on_hello(hello, self.member.build)

    def _on_join(self, join: Join, payload: bytes, now_ns: int) -> None:
        if self.clients.on_join(join, now_ns):
            self.ready_if_complete()

    # --- resuming ----------------------------------------------------------------------------------------------------

    def _resume_state(self) -> Publish:
        """Return the report of the resume position, which is sent before each ready."""
        state, build = self.state, self.member.build
        assert state is not None and build is not None
        standing = ResumeState(
            channels.VHUB,
            self.member.boot,
            build.supervisor,
            self.epoch,
            *self.commits.last(),
            state.final,
            self.handshake.waits,
            self.handshake.lost_machine,
            self.capture_file,
        )
        return Publish(channels.RESUME_STATE, channels.VHUB, encode(standing))

    def _on_proceed(self, proceed: ResumeGrant, payload: bytes, now_ns: int) -> None:
        """Take the supervisor's grant: it knows this vHub's resume position."""
        if proceed.boot != self.member.boot or not self.handshake.waits:
            self._repeated += 1
            return
        self.handshake.granted_from = proceed.epoch
        self._enter()

    def _enter(self) -> None:
        """An epoch has begun, or a grant has come: once both are there, send the last deliveries and request the next
        commits and samples."""
        handshake, state = self.handshake, self.state
        if handshake.waits and self.epoch < handshake.granted_from:
            return
        self.member.entered()
        if not handshake.waits or state is None:
            return
        handshake.waits = False
        if handshake.lost_machine:
            self.actions.append(Journal(self.head()))
        for payload in handshake.published:
            self.actions.append(Publish(channels.DELIVERIES, channels.VHUB, payload))
        for name in handshake.owing:
            self.sessions.resend(name, state.members[name].downlink)
        for tick in range(state.closed + 1, state.final + 2):
            for kind in (channels.COMMIT, channels.SAMPLES):
                want = encode(Want(channels.VHUB, kind.name, tick, self.epoch, []))
                self.actions.append(Publish(channels.WANT, channels.VHUB, want))

    def _fences(self, commit: Commit) -> bool:
        """Whether a commit does not count: it is of an epoch before the present one.

        Up to the epoch's first tick it counts under its old epoch: committed frames never change.
        """
        is_old = commit.epoch < self.epoch and commit.tick > self._epoch_tick
        return is_old or self.handshake.waits

    # --- time --------------------------------------------------------------------------------------------------------

    def _request_again(self, now_ns: int) -> None:
        assert self.state is not None
        tick, kind = self.state.closed + 1, channels.SAMPLES.name
        if self.commits.next_tick <= (tick if self.ended is None else self.ended.tick):
            tick, kind = self.commits.next_tick, channels.COMMIT.name
        if (self._world is None or kind == channels.COMMIT.name) and not self.handshake.waits:
            want = Want(channels.VHUB, kind, tick, self.epoch, [])
            self.actions.append(Publish(channels.WANT, channels.VHUB, encode(want)))
        self._retry.requested(now_ns)

    def lose(self, name: str, why: str) -> None:
        """End the run, since it has lost what it cannot do without: a client, the capture, space for the journal."""
        self.give_up(lost(name, why))

    def fail(self, error: ComponentError) -> None:
        """A component has raised: close no more ticks, and have the run end."""
        _, self._failed = failed_component(error)
        self.give_up(sendable(str(error))[: limits.TEXT_LENGTH_MAX])

    def give_up(self, reason: str) -> None:
        """Ask the supervisor to end the run; the first reason counts."""
        if not self.lost:
            self.lost = reason
            self.actions.append(Log("error", reason))
            self.send_heartbeat()

    def send_heartbeat(self) -> None:
        """Send a heartbeat at once."""
        self.actions.append(Publish(channels.HEARTBEAT, channels.VHUB, encode(self.heartbeat())))

    def heartbeat(self) -> Heartbeat:
        """Return the heartbeat of now."""
        tick = 0 if self.state is None else self.state.closed + 1
        report = self._report()
        return Heartbeat(
            channels.VHUB, tick, self.epoch, self.waiting_for, self.lost, self.busy, report, failed=self._failed
        )

    def _report(self, *, is_last: bool = False) -> bytes:
        refused, absences = self.refusals.by_sender(), {"boot": self.member.boot, **self.clients.absences.report()}
        if self.state is None or self.releases is None:
            return encode_json({"refused": refused})
        lines = self.link_lines.lines(self.state, self.watching.links, anew=is_last)
        parts = lines, self.watching.report(self.state), absences, self.releases.lateness, self.shell
        return report(self.state, refused, *parts)

    # --- the end -----------------------------------------------------------------------------------------------------

    def _on_end(self, end: End, payload: bytes, now_ns: int) -> None:
        if self.ended is None:
            self.ended = end
            self._end_ns = now_ns + limits.DOWNLINK_KEPT_NS

    def _finish(self, now_ns: int) -> None:
        """Record what is committed and not closed, and what is in flight; notify the clients."""
        assert self.state is not None and self.ended is not None
        lacks = self.ended.tick not in self.commits
        if lacks and self.state.closed + 1 >= self.ended.tick and now_ns < self._end_ns:
            return
        self.finished = True
        self._release(now_ns)
        half = None if self._world is None else self._world.closing  # a tick that is half closed has fates
        self.actions += last_closings(self.state, self.commits, self.ended.tick, half, now_ns)
        for name in self.sessions.by_name:
            member = self.state.members.get(name)
            number = 1 if member is None else member.downlink + 1
            self.sessions.send_down(name, Down(number, self.ended.tick, 0, [], True), now_ns)

    def farewell(self) -> Publish:
        """Return the hub's last message, once the shell has closed the capture."""
        return Publish(channels.FAREWELL, channels.VHUB, encode(Farewell(channels.VHUB, self._report(is_last=True))))

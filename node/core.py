"""The core of a node: takes messages and the time, and computes ticks of the world in step with its peers.

A tick reads: sense, edit, assign, solve, part, collect (design, section 4). The core owns no engine: it hands out
`work`, the shell solves it and calls `solved`. It runs ahead of commit, by at most what deliveries allow; everything
else in the system sees committed frames only.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from mypy_extensions import mypyc_attr

from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.common.json_text import encode_json
from foosim.deployment.schema import Deployment
from foosim.node.inputs import Inputs, PendingEpochMessages, check_near
from foosim.node.tick import Stepper, Term, Work
from foosim.protocol import channels
from foosim.protocol.actions import Action, Log, Publish
from foosim.protocol.barrier import BadParts, Barrier, committed_frame, input_digest_of
from foosim.protocol.channels import Channel
from foosim.protocol.codec import encode
from foosim.protocol.handshake import Member, NotValidHere, failed_component, sendable
from foosim.protocol.messages import (
    Build,
    Commit,
    Deliveries,
    End,
    Epoch,
    FailedComponent,
    Heartbeat,
    Order,
    Part,
    Piece,
    Recall,
    Samples,
    Want,
)
from foosim.protocol.rejects import Refusals
from foosim.protocol.retry import RetryTimer
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.components.view import ComponentError
from foosim.world.frame import Frame
from foosim.world.layout import Entity, Layout
from foosim.world.robot_packets import Outbox


@mypyc_attr(allow_interpreted_subclasses=True)
class NodeCore:
    """One node's state machine. `actions` are performed next by the shell, `work` is solved next."""

    def __init__(self, name: str, boot: str, fingerprint: bytes, now_ns: int, world: str = "") -> None:
        self.name = name
        self.actions: list[Action] = []
        self.refusals = Refusals(self.actions.append, lambda: self.deployment)
        self.work: Work | None = None
        self.failure = ""
        """The error that ends the run here: a component has raised."""
        self._failed: FailedComponent | None = None
        self.member = Member("node", name, boot, fingerprint, world, self.actions, now_ns)
        self.busy = 0.0
        self.is_guarded = False
        """Whether a component that writes to the frame without its view is an error: a check sets this."""
        self.deployment: Deployment | None = None
        self.frame: Frame | None = None
        self.epoch = 0
        self.roster: tuple[str, ...] = ()
        self.owners: dict[str, str] = {}
        self.ended: End | None = None
        self._stepper: Stepper | None = None
        self._term: Term | None = None
        self._history: dict[int, Frame] = {}
        self._awaited_epoch: Epoch | None = None
        self._inputs = Inputs()
        self._parts: dict[int, list[Part]] = {}
        self._sent_parts: dict[int, bytes] = {}
        self._unsampled: set[int] = set()
        """Ticks of frames whose samples are requested and whose frame is missing here."""
        self._pending = PendingEpochMessages()
        self._remembered: dict[int, float] = {}
        """The new slots of this node's sensors at the present frame: numbers of the next one, by place."""
        self._last_samples: tuple[bytes, list[str], bytes] = b"", [], b""
        """The last published samples: the digest of their frame, their robots, and the payload.

        A request that is repeated while a sensor takes long is answered with them: the sensor measures once.
        """
        self._barrier: Barrier | None = None
        self._input_digest = b""
        self._sensed = False
        self._retry = RetryTimer(now_ns)
        self._not_finite: set[str] = set()
        """Readings that were logged as not finite."""
        self._solved_ticks = self.refused = self.repeated = 0
        self._readers: dict[str, Callable[[Any, bytes, int], None]] = {
            channels.ORDER.name: self._on_order,
            channels.DELIVERIES.name: self._on_deliveries,
            channels.PART.name: self._on_part,
            channels.EPOCH.name: self._on_epoch,
            channels.COMMIT.name: self._on_commit,
            channels.WANT.name: self._on_want,
            channels.RECALL.name: self._on_recall,
            channels.BUILD.name: self._on_build,
            channels.PIECE.name: self._on_build,
            channels.END.name: self._on_end,
        }

    # --- calls of the shell ---------------------------------------------------------------------------------------

    def receive(self, channel: Channel, name: str, payload: bytes, now_ns: int) -> None:
        """Take one message as it came; an invalid one is counted and dropped."""
        try:
            if channel is channels.REFUSAL:
                self.repeated += not self.member.refuse(self.refusals.read(channel, name, payload, now_ns))
                return
            if channel.name not in self._readers:
                raise Malformed(f"a node does not read the channel {channel.name}")
            self._readers[channel.name](self.refusals.read(channel, name, payload, now_ns), payload, now_ns)
        except ComponentError as error:
            self.fail(error)
        except NotValidHere as error:
            self.failure = error.what
        except Malformed as error:
            self.refused += 1
            self.refusals.refuse(channel, name, payload, error, now_ns)

    def advance(self, now_ns: int) -> None:
        """Advance as far as the inputs allow; `work` is set when the engine has to solve."""
        try:
            while self.frame is not None and self._term is not None and self.work is None and self._computes:
                if not self._sensed:
                    self._sense()
                if self._barrier is None:
                    if not self._begin():
                        return
                elif not self._collect(now_ns):
                    return
        except ComponentError as error:
            self.fail(error)

    @property
    def _computes(self) -> bool:
        return self.ended is None and not self.failure

    def fail(self, error: ComponentError) -> None:
        """A component has raised: compute no more, and end the run, since the next owner would meet it, too."""
        self.failure = sendable(str(error))[: limits.TEXT_LENGTH_MAX]
        self.work = None
        trace, self._failed = failed_component(error)
        self.actions.append(Log("error", f"{error}\n{trace}"))
        self.actions.append(Publish(channels.HEARTBEAT, self.name, encode(self._heartbeat())))

    def solved(self, work: Work) -> None:
        """Accept the solved work, and publish this node's part of the next frame."""
        assert work is self.work
        assert self.frame is not None and self._term is not None and self._barrier is not None
        self.work = None
        if work.islands:
            self._solved_ticks += 1
        quarantined = self._term.stepper.quarantined
        while quarantined:
            self.actions.append(Log("warning", quarantined.pop(0)))
        for place, number in self._remembered.items():
            work.numbers[place] = number
        values = np.frombuffer(array("d", work.numbers))  # takes a third of what np.array does
        slots = self._barrier.slots
        part = Part(
            epoch=self.epoch,
            tick=work.tick + 1,
            node=self.name,
            input_digest=self._input_digest,
            solved=list(work.solved),
            solver_values=values[slots.solver(work.solved)].tobytes(),
            owner_values=values[slots.owner(self.name)].tobytes(),
            outboxes=[Outbox(index, packets) for index, packets in work.outboxes.items()],
        )
        payload = encode(part)
        self._sent_parts[part.tick] = payload
        self.actions.append(Publish(channels.PART, self.name, payload))
        self._barrier.add(part)

    def engine_ready(self, fingerprint: bytes) -> None:
        """The shell has built the engine; `fingerprint` is the digest of its fixed small run."""
        self.member.simulation = fingerprint
        self.member.ready()

    def wake(self, now_ns: int) -> None:
        """Send the messages that are due by time: hello, heartbeat, repeated requests."""
        self.member.wake(now_ns, self._heartbeat)
        if self._is_in and self._retry.is_over(now_ns) and self.work is None:
            self._request_missing(now_ns)

    def deadline_ns(self) -> int:
        """The time of the next work of `wake`."""
        return min(self.member.deadline_ns, self._retry.at_ns) if self._is_in else self.member.deadline_ns

    @property
    def _is_in(self) -> bool:
        """Whether this node is a member of the current epoch."""
        return self.ended is None and (self.frame is not None or self._awaited_epoch is not None)

    @property
    def layout(self) -> Layout | None:
        """The layout of the world; None before the build."""
        return self.member.layout

    @property
    def stepper(self) -> Stepper:
        """The pure step, built once."""
        if self._stepper is None:
            assert self.deployment is not None and self.member.layout is not None
            self._stepper = Stepper(self.deployment, self.member.layout, is_guarded=self.is_guarded)
        return self._stepper

    def make_anew(self) -> None:
        """Replace all objects that compute ticks by new ones: they keep no state."""
        self._stepper = None
        if self._term is not None:
            self._term = self._make_term()

    @property
    def lacking(self) -> tuple[Channel, int] | None:
        """The channel, and the number of its messages, that the tick waits for; None without a tick."""
        if self.frame is None or self.ended is not None or self._awaited_epoch is not None:
            return None
        if self._barrier is not None:
            return channels.PART, len(self._barrier.missing)
        missing = self._inputs.missing(self.frame.tick)
        return missing[0] if missing else channels.ORDER, 1

    @property
    def waiting_for(self) -> str:
        """The missing inputs of the current tick, in words, for logs and the supervisor."""
        if self.frame is None:
            return "epoch" if self.member.is_ready else "start"
        if self._barrier is not None:
            return "" if self.work is not None else f"part of {', '.join(self._barrier.missing)}"
        return " and ".join(channel.name for channel in self._inputs.missing(self.frame.tick))

    # --- one tick ----------------------------------------------------------------------------------------------------

    def _sense(self) -> None:
        """Step 1: publish the samples of this node's robots at this frame, also empty ones, except at a silent tick."""
        frame, term = self.frame, self._term
        assert frame is not None and term is not None
        self._sensed = True
        if term.stepper.sampling.is_silent(frame):
            self._remembered = {}
            return
        self._remembered = self._publish_samples(frame, term.mine)

    def _publish_samples(self, frame: Frame, robots: Sequence[Entity]) -> dict[int, float]:
        """Publish the samples of these robots at a frame; return their sensors' new slots."""
        stepper = self.stepper
        packets, sensed = stepper.sense(frame, robots)
        for name in stepper.not_finite.keys() - self._not_finite:
            self._not_finite.add(name)
            self.actions.append(Log("warning", f"tick {frame.tick}: a reading of {name} is not finite and not sent"))
        names = [robot.name for robot in robots]
        payload = encode(Samples(frame.tick, frame.digest, self.name, names, packets))
        self._last_samples = frame.digest, names, payload
        self.actions.append(Publish(channels.SAMPLES, self.name, payload))
        return sensed

    def _begin(self) -> bool:
        """Steps 2 to 4: with order and deliveries, edit the frame and hand this node's share to the engine."""
        frame = self.frame
        assert frame is not None and self._term is not None
        edits = self._inputs.edits(frame.tick)
        delivered = self._inputs.deliveries(frame.tick)
        if edits is None or delivered is None:
            return False
        raw, deliveries = delivered
        term = self._term
        self.work, self._remembered = term.work(frame, edits, deliveries.packets, self._remembered)
        self._input_digest = input_digest_of(frame.digest, edits, raw)
        self._barrier = Barrier(frame.tick + 1, self.roster, term.slots)
        return True

    def _collect(self, now_ns: int) -> bool:
        """Step 6: take the parts of all nodes; with all of them, the next frame is there."""
        barrier = self._barrier
        assert barrier is not None
        waiting = self._parts.pop(barrier.tick, None)
        if waiting is not None:
            for part in waiting:
                self._take_part(barrier, part)
        if barrier.missing:
            return False
        try:
            frame = barrier.assemble()
        except BadParts as bad:
            self.refused += 1
            self.actions.append(Log("error", f"{bad}: requested again"))
            barrier.drop(node for node in bad.nodes if node != self.name)
            return False
        self._enter(frame, now_ns)
        return True

    def _take_part(self, barrier: Barrier, part: Part) -> None:
        if part.input_digest != self._input_digest:
            self.actions.append(Log("error", f"part {part.tick} of {part.node} has another input digest: kept"))
            return
        try:
            barrier.add(part)
        except Malformed as error:
            self.refused += 1
            self.actions.append(Log("error", str(error)))

    def _enter(self, frame: Frame, now_ns: int) -> None:
        """Enter `frame`, and drop data that is older than any request."""
        self.frame = frame
        self._barrier = None
        self._sensed = False
        assert self.deployment is not None
        self._retry.progress(self.deployment.tick_ns, now_ns)
        self._history[frame.tick], old = frame, frame.tick - limits.KEPT_TICKS
        self._history.pop(old, None)
        self._inputs.forget(old)
        self._sent_parts.pop(old, None)

    # --- messages of the tick ----------------------------------------------------------------------------------------

    def _fenced(self, channel: Channel, message: Order | Part | Commit, payload: bytes) -> bool:
        """Whether a message is of another epoch: an older one is dropped, a newer one held until its epoch comes."""
        if message.epoch == self.epoch and self._awaited_epoch is None:
            return False
        if message.epoch >= self.epoch:
            self._pending.add(channel, message.node if isinstance(message, Part) else channels.SUPERVISOR, payload)
        else:
            self.repeated += 1
        return True

    def _on_order(self, order: Order, payload: bytes, now_ns: int) -> None:
        if self._fenced(channels.ORDER, order, payload):
            return
        if self.frame is None or not self._inputs.take_order(order, self.frame.tick):
            self.repeated += 1

    def _on_deliveries(self, deliveries: Deliveries, payload: bytes, now_ns: int) -> None:
        own_tick = self.member.first_tick if self.frame is None else self.frame.tick
        if not self._inputs.take_deliveries(deliveries, payload, own_tick):
            self.repeated += 1

    def _on_part(self, part: Part, payload: bytes, now_ns: int) -> None:
        if self._fenced(channels.PART, part, payload):
            return
        if self.frame is None or part.tick <= self.frame.tick:
            self.repeated += 1
            return
        check_near(part.tick, self.frame.tick)
        if part.node not in self.roster or part.node == self.name:
            raise Malformed(f"a part of {part.node} to {self.name}, the roster is {', '.join(self.roster)}")
        waiting = self._parts.setdefault(part.tick, [])
        if len(waiting) >= limits.NODES_MAX * 4:
            raise Malformed(f"{len(waiting)} parts of tick {part.tick} wait already")
        waiting.append(part)

    def _on_want(self, want: Want, payload: bytes, now_ns: int) -> None:
        if want.of and self.name not in want.of:
            return
        if want.kind == channels.PART.name and want.epoch == self.epoch:
            sent = self._sent_parts.get(want.tick)
            if sent is not None:
                self.actions.append(Publish(channels.PART, self.name, sent))
        elif want.kind == channels.SAMPLES.name:
            self._sample_again(want.tick)

    def _sample_again(self, tick: int) -> None:
        """Publish the samples of this node's present robots at a frame; request a missing frame."""
        frame = self._history.get(tick)
        if frame is not None:
            mine = [robot for robot in frame.layout.robots if self.owners.get(robot.name) == self.name]
            digest, names, payload = self._last_samples
            if digest == frame.digest and names == [robot.name for robot in mine]:
                self.actions.append(Publish(channels.SAMPLES, self.name, payload))
            else:
                self._publish_samples(frame, mine)
        elif self.frame is not None and self.frame.tick - limits.KEPT_TICKS <= tick < self.frame.tick:
            self._unsampled = {kept for kept in self._unsampled if kept >= self.frame.tick - limits.KEPT_TICKS} | {tick}
            message = encode(Want(self.name, channels.COMMIT.name, tick, self.epoch, []))
            self.actions.append(Publish(channels.WANT, self.name, message))

    def _request_missing(self, now_ns: int) -> None:
        """Request the missing inputs of the current tick, the wait doubling."""
        tick = 0 if self.frame is None else self.frame.tick
        if self._awaited_epoch is not None:
            wants = [Want(self.name, channels.COMMIT.name, self._awaited_epoch.tick, self.epoch, [])]
        elif self._barrier is not None:
            wants = [Want(self.name, channels.PART.name, tick + 1, self.epoch, self._barrier.missing)]
        else:
            wants = [Want(self.name, channel.name, tick, self.epoch, []) for channel in self._inputs.missing(tick)]
        self.actions += [Publish(channels.WANT, self.name, encode(want)) for want in wants]
        self._retry.requested(now_ns)

    # --- epochs, start and end ---------------------------------------------------------------------------------------

    def _on_build(self, build: Build | Piece, payload: bytes, now_ns: int) -> None:
        if not self.member.take_build(build):
            self.repeated += not self.member.is_fetching
            return
        self.deployment = self.member.deployment
        if self.member.simulation:
            self.member.ready()

    def _on_recall(self, recall: Recall, payload: bytes, now_ns: int) -> None:
        self.repeated += not self.member.recall(recall)

    def _on_epoch(self, epoch: Epoch, payload: bytes, now_ns: int) -> None:
        if epoch.epoch <= self.epoch or self.deployment is None:
            self.repeated += 1
            self.member.repeated(epoch.epoch == self.epoch and self.name in epoch.roster)
            return
        self.member.check_epoch(epoch)
        if self.name not in epoch.roster:
            self._begin_anew(epoch)
            return
        self.epoch = epoch.epoch
        self.roster = tuple(sorted(epoch.roster))
        self.owners = dict(epoch.owners)
        self.member.entered()
        self._inputs.begin(epoch)
        self._parts.clear()
        self._sent_parts.clear()
        self.work = None
        self._barrier = None
        self._awaited_epoch = epoch
        if epoch.tick == 0:
            self._history.setdefault(0, initial_frame(self.deployment))
        own = self._history.get(epoch.tick)
        if own is not None and own.digest == epoch.digest:
            self._resume(own, now_ns)
        else:
            message = encode(Want(self.name, channels.COMMIT.name, epoch.tick, epoch.epoch, []))
            self.actions.append(Publish(channels.WANT, self.name, message))
            self._retry.progress(self.deployment.tick_ns, now_ns)

    def _begin_anew(self, epoch: Epoch) -> None:
        """The other nodes continue without this one: its results are void, so it joins again."""
        if self.epoch == 0:
            return  # it was never a member
        self.actions.append(Log("warning", f"epoch {epoch.epoch} is without this node: it sends its hello again"))
        self.epoch = epoch.epoch
        self.frame = self._term = self._awaited_epoch = self.work = self._barrier = None
        self._inputs.begin(epoch)
        self._pending.take()
        for kept in (self._history, self._parts, self._sent_parts):
            kept.clear()
        self.member.begin_anew()

    def _on_commit(self, commit: Commit, payload: bytes, now_ns: int) -> None:
        """The frame that the epoch starts from, where this node has none or another one; or one to sample."""
        if commit.tick in self._unsampled:
            self._take_old_frame(commit)
            return
        epoch = self._awaited_epoch
        if epoch is None or commit.tick != epoch.tick or commit.digest != epoch.digest:
            self.repeated += 1
            return
        assert self.member.layout is not None
        self._resume(committed_frame(commit, self.member.layout), now_ns)

    def _take_old_frame(self, commit: Commit) -> None:
        """Take a frame to sample."""
        assert self.member.layout is not None
        self._history[commit.tick] = committed_frame(commit, self.member.layout)
        self._unsampled.discard(commit.tick)
        self._sample_again(commit.tick)

    def _resume(self, frame: Frame, now_ns: int) -> None:
        """Continue from the epoch's frame, with its roster and owners and its pending messages."""
        self._awaited_epoch = None
        self._history = {tick: kept for tick, kept in self._history.items() if tick < frame.tick}
        self._enter(frame, now_ns)
        self._term = self._make_term()
        for channel, name, payload in self._pending.take():
            self.receive(channel, name, payload, now_ns)

    def _make_term(self) -> Term:
        return Term(self.stepper, self.name, self.roster, self.owners)

    def _on_end(self, end: End, payload: bytes, now_ns: int) -> None:
        self.ended = end
        self.work = None

    def _heartbeat(self) -> Heartbeat:
        tick = self.frame.tick if self.frame is not None else 0
        not_finite = {} if self._stepper is None else self._stepper.not_finite
        counts = {"solved_ticks": self._solved_ticks, "refused": self.refusals.by_sender(), "not_finite": not_finite}
        report = encode_json(counts)
        lacks, lost = self.waiting_for, self.failure
        return Heartbeat(self.name, tick, self.epoch, lacks, lost, self.busy, report, self._failed)

"""The vHub's journal: one record per closed tick, with the inputs of the closing and its result.

A fold of the records through the same state gives frames, fates, packets in flight and the next deliveries again, byte
for byte. The first record of a file is a checkpoint of the whole state, so that older files can be removed; checkpoints
are also between ticks now and then, so that a fold need not begin far back. Further records are the epochs, the joins
and leaves of a tick (its Go is sent before its record is written), and which players are away.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple

import msgspec

from foosim.common.errors import Malformed
from foosim.deployment.schema import Deployment
from foosim.protocol.codec import decode, decode_any, encode
from foosim.protocol.messages import Build, Commit, Epoch, Recovered, Samples, Sent
from foosim.vhub.network.memory import Age, Joining
from foosim.vhub.network.packet import IN_FLIGHT, Flight, flight_of, state_of
from foosim.vhub.state.commits import Commits, Committed
from foosim.vhub.state.hub_state import HubState
from foosim.vhub.state.metrics import Metric, Reports
from foosim.world.assembly.initial_state import first_chain
from foosim.world.edits import Edit
from foosim.world.frame import CHAIN_START, Frame, chain_next, frame_from_bytes
from foosim.world.layout import build_layout
from foosim.world.robot_packets import Delivered, RobotPacket
from foosim.world.sampling import Sampling


class AbsencesRecord(msgspec.Struct, frozen=True, array_like=True, tag="absences", forbid_unknown_fields=True):
    """The players that are away and the absences that have ended, for the run's recoveries: no closing depends on it.

    `away` has name, process, reason and tick, `over` what, name, reason and tick, as in `absences`.
    """

    away: list[tuple[str, str, str, int]]
    over: list[tuple[str, str, str, int]]


NONE_AWAY: Final = AbsencesRecord([], [])


class HeadRecord(msgspec.Struct, frozen=True, array_like=True, tag="head", forbid_unknown_fields=True):
    """The first record of a journal file: the run, the state after the last closed tick.

    Commit and epoch are the last ones as they came, empty before the first.
    """

    run: str
    state: bytes
    commit: bytes = b""
    epoch: bytes = b""
    capture: str = ""
    """The capture's path; empty when there is none."""
    chain: bytes = CHAIN_START
    """Over the frames up to that of the last closed tick."""
    machine: str = ""
    """The boot of the machine that wrote it: the last records of an earlier boot may not have reached the disk."""
    absences: AbsencesRecord = NONE_AWAY


def first_head(build: Build, deployment: Deployment, capture: str) -> bytes:
    """Return the head of a vHub before its first closing, which is about to create `capture`."""
    tick = 0 if build.origin is None else build.origin.tick
    state = HubState(deployment, tick).snapshot()
    return encode(HeadRecord(build.run, state, b"", b"", capture, first_chain(build.origin)))


class InputsRecord(msgspec.Struct, frozen=True, array_like=True, tag="inputs", forbid_unknown_fields=True):
    """The joins and leaves of `tick`, journalled before its Go is sent: any vHub closes the tick with them."""

    tick: int
    joins: list[Joining]
    leaves: list[str]


class TickRecord(msgspec.Struct, frozen=True, array_like=True, tag="tick", forbid_unknown_fields=True):
    """One closed tick: commit and samples as received, admitted packets, joins and leaves, and the result.

    `refused` counts by cause what was refused at the door since the tick before. `owing` left while the tick waited for
    their Dones: they were sent its Go, and have left when the packets of clients are judged. `reports` are values of
    metrics, by client.
    """

    tick: int
    commit: bytes
    samples: list[bytes]
    admitted: list[tuple[str, list[Sent]]]
    joins: list[Joining]
    leaves: list[str]
    refused: list[tuple[str, int]]
    deliveries: bytes
    owing: list[str] = []
    reports: dict[str, dict[str, float]] = {}


HubRecord = HeadRecord | TickRecord | InputsRecord | AbsencesRecord | Epoch


@dataclass(slots=True)
class Closing:
    """The results of closing one tick, for the capture. The last one of a run has a frame and no fates."""

    frame: Frame
    digest: bytes
    edits: Sequence[Edit]
    delivered: Sequence[Delivered]
    """Deliveries to robots at the tick that led to this frame."""
    joins: list[Joining] = field(default_factory=list)
    leaves: list[str] = field(default_factory=list)
    fates: list[Flight] = field(default_factory=list)
    wall_ns: int = 0
    recovered: Sequence[Recovered] = ()
    """Losses and returns that ended with this frame."""
    chain: bytes = b""
    """Over the frames up to this one, without the one that the run began with."""
    owing: list[str] = field(default_factory=list)
    """Clients that left while the tick waited for their Dones."""
    sensed: Sequence[RobotPacket] = ()
    """What the robots sent at this frame, in (robot, index) order."""
    ages: Sequence[Age] = ()
    """Ages at use since the last rows of them, where this closing has rows."""
    metrics: Sequence[Metric] = ()
    """Changes of what clients reported, and of the network's figures where this closing has rows of them."""


def closing_of(
    frame: Frame,
    commit: Commit,
    chain: bytes,
    state: HubState,
    joins: list[Joining],
    leaves: list[str],
    wall_ns: int = 0,
) -> Closing:
    """Return the closing of a committed frame's tick, without its fates; `state` is that before it."""
    delivered = state.deliveries.get(frame.tick - 1, [])
    what = wall_ns, commit.recovered, chain
    return Closing(frame, commit.digest, commit.edits, delivered, joins, leaves, [], *what)


def last_closings(
    state: HubState, commits: Commits, end_tick: int, half_closed: Closing | None, now_ns: int
) -> list[Closing]:
    """Return the last closings of a run: the tick that is half closed, with its fates, and all committed frames after
    it, up to `end_tick`; the last one has the packets in flight.

    Nodes run ahead of closings as far as deliveries allow, so there may be many. Open ticks have no fates.
    """
    closings = [] if half_closed is None else [half_closed]
    for tick in range(state.closed + len(closings) + 1, end_tick + 1):
        committed = commits.get(tick)
        if committed is None:
            break
        closings.append(_unjudged(state, commits, committed, now_ns))
    closed = commits.get(state.closed)
    if not closings and closed is not None:
        closings.append(_unjudged(state, commits, closed, now_ns))
    for closing in closings[-1:]:
        closing.ages, closing.metrics = state.ages.unreported(state.closed), state.metrics.unreported(state.closed)
        for flight in state.in_flight():
            left = flight_of(state_of(flight))
            left.cause = IN_FLIGHT
            closing.fates.append(left)
    return closings


def _unjudged(state: HubState, commits: Commits, committed: Committed, now_ns: int) -> Closing:
    _, commit, frame = committed
    return closing_of(frame, commit, commits.chain_at(frame.tick), state, [], [], now_ns)


def tick_record(
    closing: Closing,
    commit: bytes,
    samples: Iterable[tuple[bytes, Samples]],
    admitted: Mapping[str, list[Sent]],
    state: HubState,
    deliveries: bytes,
    reports: Reports,
) -> bytes:
    """Return the record of a closing, which is journalled before its deliveries are sent."""
    sampled = [raw for raw, message in samples if message.digest == closing.digest]
    clients = sorted(admitted.items()), closing.joins, closing.leaves
    given = state.counted_rejections, deliveries, closing.owing
    return encode(TickRecord(closing.frame.tick, commit, sampled, *clients, *given, reports))


def world_packets(
    samples: Iterable[Samples], digest: bytes, frame: Frame, sampling: Sampling
) -> list[RobotPacket] | None:
    """Return what the robots sent at a frame in (robot, index) order, or None while a robot's samples are missing."""
    if sampling.is_silent(frame):
        return []
    by_robot: dict[str, list[RobotPacket]] = {}
    for message in samples:
        if message.digest != digest:
            continue
        fresh = {robot for robot in message.robots if robot not in by_robot}
        by_robot.update({robot: [] for robot in fresh})
        for packet in message.packets:
            if packet.robot in fresh:
                by_robot[packet.robot].append(packet)
    robots = frame.layout.robots
    if any(robot.name not in by_robot for robot in robots):
        return None
    return [packet for robot in robots for packet in by_robot[robot.name]]


def missing_robots(samples: Iterable[Samples], digest: bytes, frame: Frame) -> list[str]:
    """Return the robots whose samples at a frame are missing."""
    covered = {robot for message in samples if message.digest == digest for robot in message.robots}
    return [robot.name for robot in frame.layout.robots if robot.name not in covered]


class Folded(NamedTuple):
    """One closing that a fold computed again: its record, and the packets released to each client."""

    closing: Closing
    record: TickRecord
    released: dict[str, list[Flight]]


class Fold:
    """Computes the closings of a journal again from its records, the first of which is a head.

    Iterating gives each closing; `state`, `layout`, `commit`, `epoch`, `inputs` and `absences` are then the ones after
    it. Raises Malformed unless the records are of one run of this version.
    """

    def __init__(self, deployment: Deployment, records: Iterable[bytes]) -> None:
        self._records = iter(records)
        head = decode_any(HubRecord, next(self._records, b""))
        if not isinstance(head, HeadRecord):
            raise Malformed("a journal of the vHub that does not start with its head")
        self.run = head.run
        self.state = HubState.restore(deployment, head.state)
        self.layout = build_layout(deployment)
        self.commit = head.commit
        self.epoch = head.epoch
        self.chain = head.chain
        self.machine, self.absences = head.machine, head.absences
        self.inputs: InputsRecord | None = None
        """The joins and leaves of the tick after the last closed one, where they are journalled."""

    def __iter__(self) -> Iterator[Folded]:
        for raw in self._records:
            record = decode_any(HubRecord, raw)
            if isinstance(record, TickRecord):
                yield self._close(record)
            elif isinstance(record, InputsRecord):
                self.inputs = record
            elif isinstance(record, Epoch):
                self.epoch = raw
            elif isinstance(record, AbsencesRecord):
                self.absences = record
            else:
                self.machine, self.absences = record.machine, record.absences

    def _close(self, record: TickRecord) -> Folded:
        state = self.state
        commit = decode(Commit, record.commit)
        frame = frame_from_bytes(commit.tick, self.layout, commit.values, commit.outboxes)
        samples = [decode(Samples, raw) for raw in record.samples]
        packets = world_packets(samples, commit.digest, frame, state.sampling)
        if packets is None or frame.tick != state.closed + 1 or record.tick != frame.tick:
            raise Malformed(f"record {record.tick} of the vHub's journal does not follow on tick {state.closed}")
        if self.commit:  # the frame that a run begins with is not in its chain, or is already
            self.chain = chain_next(self.chain, commit.digest)
        closing = closing_of(frame, commit, self.chain, state, record.joins, record.leaves)
        closing.sensed = packets
        for name in record.leaves:
            state.leave(name)
        for joining in record.joins:
            state.join(joining, record.tick)
        released = state.close_world(frame, packets, closing.fates, commit.edits)
        count_downlinks(state, frame.tick, released)
        state.rejected_on_receipt = dict(record.refused)
        closing.owing += record.owing
        for name in record.owing:
            state.leave(name)
        deliveries = state.close_clients(frame, dict(record.admitted), closing.fates, record.reports)
        closing.ages, closing.metrics = state.aged, state.measured
        if encode(deliveries) != record.deliveries:
            raise Malformed(f"record {record.tick} of the vHub's journal: its inputs give other deliveries")
        self.commit, self.inputs = record.commit, None
        return Folded(closing, record, released)


def count_downlinks(state: HubState, tick: int, released: dict[str, list[Flight]]) -> None:
    """Number the messages to clients of one tick: a Go for each that is due, a Down for other releases."""
    for name in sorted({*state.due_members(tick), *released}):
        state.members[name].downlink += 1

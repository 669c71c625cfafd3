"""The pure parts of one tick: sense, edit, command, check. `core` puts them in order, the shell's engine solves.

`step` knows neither node, owner nor epoch: it is given the entities to compute.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite
from typing import Final, NamedTuple, TypeAlias, cast

import msgspec
import numpy as np
from numpy.typing import NDArray

from foosim.common import limits
from foosim.deployment.schema import Deployment
from foosim.node.due_sensors import DueSensors, Turn
from foosim.node.edited_frame import edit, kept
from foosim.node.physics.interface import AnyEngine, Engine, Island, IslandEngine, Weld
from foosim.node.physics.touch_log import clear_touches
from foosim.protocol.barrier import Slots
from foosim.world.assembly.body_limits import BodyLimits
from foosim.world.assembly.grippers import Gripper, grippers_of, release
from foosim.world.assembly.islands import Assignment, Share, reach_of
from foosim.world.assembly.rest import Rest, stop, wake_edited
from foosim.world.assembly.standing import UnmovedBodies
from foosim.world.assembly.world import World
from foosim.world.component_types.descriptions import INACTIVE
from foosim.world.components.fitted import sensors_of
from foosim.world.components.sensing import Sensing
from foosim.world.components.view import SensingView, View, WritableView
from foosim.world.components.watching import ReadOnly
from foosim.world.edits import Edit
from foosim.world.frame import Frame
from foosim.world.layout import Entity, Layout, switches_of
from foosim.world.robot_packets import Delivered, OutboxPacket, RobotPacket
from foosim.world.sampling import Sampling
from foosim.world.setting.scheduled import Schedule

ECHO = "echo"
RETRIES: Final = 3
"""The count of times that a body in quarantine is solved again, each after `RETRY_NS`; then it stays out until it is
put elsewhere or removed."""
RETRY_NS: Final = 1_000_000_000
ATTEMPTS: Final = 8
"""The field `quarantined` is this times the ticks that are left, plus the count of times in quarantine; minus that
count of a body that is solved again; 0 of one that never was there."""

_outbox_decoder = msgspec.msgpack.Decoder(list[OutboxPacket])
_outbox_encoder = msgspec.msgpack.Encoder()


Groups: TypeAlias = tuple[tuple[Entity, ...], ...]
"""Entities that a node solves together, or that are in their way."""


@dataclass
class Work:
    """The work of an engine for one tick. `numbers` is the edited frame and is written by `solve`.

    `start` is the edited frame before packets were delivered, the same in all nodes; empty where none were. `values`
    are the same as an array, where nothing was edited. `movers` are those in the way of each island, for engines that
    solve one island after the other.
    """

    tick: int
    layout: Layout
    islands: Groups
    solved: tuple[int, ...]
    numbers: list[float]
    outboxes: dict[int, bytes]
    start: list[float] = field(default_factory=list)
    movers: Groups = ()
    values: NDArray[np.float64] | None = None


class _RigidIsland(NamedTuple):
    """The rigid bodies of an island, the movers in its way, whether a body has actuators, and the grippers of all."""

    bodies: tuple[Entity, ...]
    movers: tuple[Entity, ...]
    is_driven: bool
    grippers: tuple[Gripper, ...]


class Stepper:
    """The pure step of one deployment and layout: all of a tick except the engine."""

    def __init__(self, deployment: Deployment, layout: Layout, *, is_guarded: bool = False) -> None:
        """`is_guarded`: a component that writes to the frame without its view is an error."""
        self.deployment = deployment
        self.layout = layout
        self.world = World(deployment, layout, is_guarded=is_guarded)
        self._is_guarded = is_guarded
        self.substeps = deployment.substeps
        self.events = Schedule(deployment)
        self.rest = Rest(deployment, layout)
        self._limits = BodyLimits(deployment, layout)
        self._by_island = layout.couples
        self._unmoved = UnmovedBodies(layout, self.world.actuators, self.world.ruled | self.world.having_jobs)
        self._alone: frozenset[int] = frozenset()
        """Bodies that are islands by themselves, of the last solved islands."""
        self._grippers: dict[int, list[Gripper]] = {}
        """By the indices of their robots."""
        for one in grippers_of(deployment, layout):
            self._grippers.setdefault(one.robot, []).append(one)
        self._divided: tuple[Groups, list[_RigidIsland]] = (), []
        """The islands of the last tick, and their solved entities."""
        self._rigid = frozenset(entity.index for entity in layout.entities if entity.is_rigid)
        self._islands: Groups | None = None
        self._bodies: list[Entity] = []
        self._quarantined: list[int] = []
        """Of the last solved islands: their entities, and the places of the fields `quarantined`."""
        self._all_rigid = all(entity.is_rigid for entity in layout.entities if entity.is_solved)
        self._sensors = {robot.name: sensors_of(deployment, layout, robot) for robot in layout.robots}
        self._switches = {robot.name: switches_of(deployment.robots[robot.name]) for robot in layout.robots}
        self._due = DueSensors((), self._sensors, self._switches)
        self._sensing = Sensing()
        self._waiting = [
            (layout.entities[index], one)
            for index, actuators in sorted(self.world.actuators.items())
            for one in actuators
            if one.has_waiting
        ]
        """Robots and those of their actuators whose commands may wait for their tick."""
        self.sampling = Sampling(deployment)
        self.not_finite: Counter[str] = Counter()
        """Robot and channel of unsent readings with a non-finite number."""
        self.quarantined: list[str] = []
        """The entities that came into quarantine, with the reasons, in words; the reader empties it."""

    def sense(self, frame: Frame, robots: Sequence[Entity]) -> tuple[list[RobotPacket], dict[int, float]]:
        """Return the packets of these robots at the frame's tick, and their sensors' new slots.

        The latter are numbers of the next frame, by place. Raises ComponentError.
        """
        tick, numbers = frame.tick, frame.numbers
        if self._due.robots is not robots and self._due.robots != robots:
            self._due = DueSensors(robots, self._sensors, self._switches)
        turn = self._due.at(tick, numbers, frame.values)
        view = SensingView(tick, ReadOnly(numbers) if self._is_guarded else numbers, frame.values)
        payloads = self._sensing.sample(turn.sensors, view, turn.whole, turn.rows)
        for at in turn.counters:
            view.written[at] = numbers[at] + 1.0
        self.not_finite.update(f"{one.robot} {one.channel}" for one in view.not_finite)
        if frame.outboxes or None in payloads:
            return list(_packets(turn, payloads, frame.outboxes)), view.written
        sent = cast("list[bytes]", payloads)
        packets = [
            RobotPacket(robot, number, "", channel, payload)
            for (robot, number, channel), payload in zip(turn.heads, sent, strict=True)
        ]
        return packets, view.written

    def edited(
        self, frame: Frame, edits: Sequence[Edit], sensed: dict[int, float]
    ) -> tuple[list[float], dict[int, float]]:
        """Return the numbers of the frame after the edits of order and events, and the rules of the world; and the
        new slots of sensors that are still present, by place."""
        if frame.tick in self.events.by_tick:
            edits = [*edits, *self.events.edits(frame.tick, frame, edits)]
        numbers, moved = edit(frame, edits, self.deployment)
        self.world.apply_rules(numbers, frame.tick)
        if edits or self.world.has_rules:
            wake_edited(frame, numbers, edits)
            self._unmoved.wake_edited(frame, numbers)
        return numbers, kept(sensed, moved) if moved else sensed

    @property
    def waits(self) -> bool:
        """Whether commands may wait in actuators for their tick."""
        return bool(self._waiting)

    def deliver(
        self,
        packets: Sequence[Delivered],
        solved: Sequence[int],
        numbers: list[float],
        tick: int,
        start: Sequence[float] | None = None,
    ) -> dict[int, bytes]:
        """Apply the packets that reached these robots, in order; return the filled outboxes.

        `start` is a copy of the numbers before; None: it is built here.
        """
        if not packets and not self._waiting:
            return {}
        outboxes: dict[int, list[OutboxPacket]] = {}
        view = WritableView(tick, numbers, numbers.copy() if start is None else start)
        for entity, one in self._waiting:
            if entity.index in solved and numbers[entity.offsets["down"]] == 0.0:
                numbers[entity.offsets["refused"]] += one.take_due(view)
        for packet in packets:
            if packet.destination not in self.layout:
                continue
            entity = self.layout[packet.destination]
            if entity.index not in solved or not entity.is_robot or entity.is_absent(numbers):
                continue
            if not self._take(packet, entity, view, outboxes):
                numbers[entity.offsets["refused"]] += 1.0
        return {index: _outbox_encoder.encode(waiting) for index, waiting in sorted(outboxes.items())}

    def _take(
        self, packet: Delivered, entity: Entity, view: WritableView, outboxes: dict[int, list[OutboxPacket]]
    ) -> bool:
        if view.numbers[entity.offsets["down"]] != 0.0:
            return False
        if packet.channel == ECHO:
            waiting = outboxes.get(entity.index, [])
            waiting = [*waiting, OutboxPacket(packet.source, ECHO, packet.payload)]
            if len(waiting) > limits.OUTBOX_PACKETS_MAX:
                return False
            if len(_outbox_encoder.encode(waiting)) > limits.OUTBOX_BYTES_MAX:
                return False
            outboxes[entity.index] = waiting
            return True
        for one in self.world.actuators.get(entity.index, ()):
            if one.channel == packet.channel:
                off = int(view.numbers[entity.offsets[INACTIVE]])
                return not off & self._switches[entity.name][one.channel] and one.accept(
                    packet.payload, view, packet.source
                )
        return False

    def solve(self, engine: AnyEngine, work: Work) -> None:
        """Load, command, step, read: write the next state of every body of `work` into its numbers."""
        numbers = work.numbers
        bodies, is_partial = self._awake(work)
        if not bodies:
            return
        world, before = self.world, numbers.copy()
        start = work.start or before
        rigid = bodies if self._all_rigid else [entity for entity in bodies if entity.index in self._rigid]
        changed = bodies
        if rigid and self._by_island:
            awake = self._solve_islands(cast("IslandEngine", engine), work, start, is_partial=is_partial)
            changed = [*awake, *[entity for entity in bodies if entity.index not in self._rigid]]
        elif rigid:
            self._solve_together(cast("Engine", engine), rigid, work, start)
        world.derive(rigid, numbers, work.tick)
        if len(rigid) < len(bodies):
            world.move(bodies, start, numbers, work.tick, work.values if work.start else None)
        world.apply_entity_rules(bodies, start, numbers, work.tick)
        world.judge_jobs(bodies, start, numbers, work.tick)
        if not self._by_island:
            self._unmoved.note(bodies, numbers, before)
        if not (isfinite(sum(numbers)) and self._can_all_be(changed, before, work)):
            self._quarantine(work, before)

    def _can_all_be(self, entities: Sequence[Entity], before: Sequence[float], work: Work) -> bool:
        """Whether the new, finite states of these entities are valid."""
        numbers = work.numbers
        if not self.world.are_plausible(entities, numbers, before, work.tick):
            return not any(self._problem(entity, before, work) for entity in entities)
        return not self._limits or not any(self._limits.problem(entity, numbers, before) for entity in entities)

    def _awake(self, work: Work) -> tuple[Sequence[Entity], bool]:
        """Return the entities to solve, without unmoved and quarantined ones, and whether some are in quarantine."""
        numbers = work.numbers
        if work.islands is not self._islands:
            self._islands = work.islands
            self._bodies = [entity for island in work.islands for entity in island]
            self._quarantined = [entity.offsets["quarantined"] for entity in self._bodies]
            self._alone = frozenset([island[0].index for island in work.islands if len(island) == 1])
        bodies: Sequence[Entity] = self._bodies
        is_partial = any(map(numbers.__getitem__, self._quarantined))
        if is_partial:
            for entity in bodies:
                if numbers[entity.offsets["quarantined"]] > 0.0:
                    _clear_results(entity, numbers)
                    _wait(entity, numbers)
            bodies = [entity for entity in bodies if numbers[entity.offsets["quarantined"]] <= 0.0]
        if not self._by_island:
            bodies = self._unmoved.awake(bodies, self._alone, numbers, work.start or numbers)
        return bodies, is_partial

    def _solve_together(self, engine: Engine, bodies: Sequence[Entity], work: Work, start: Sequence[float]) -> None:
        """Solve bodies whose joints do not couple: all in one go."""
        numbers, world = work.numbers, self.world
        view = View(work.tick, numbers, start=start)
        driven = [entity for entity in bodies if entity.index in world.actuators]
        engine.load(bodies, numbers)
        commands = world.motors(driven, view)
        try:
            engine.command(driven, commands)
            engine.step(self.substeps)
        except Exception:
            world.check_motors(driven, commands, work.tick)
            raise
        engine.read(bodies, numbers)

    def _solve_islands(
        self, engine: IslandEngine, work: Work, start: Sequence[float], *, is_partial: bool
    ) -> list[Entity]:
        """Solve the rigid bodies of one island after the other; bodies at rest are kept.

        `is_partial`: some are in quarantine. Returns the solved bodies.
        """
        numbers, world, rest = work.numbers, self.world, self.rest
        view = View(work.tick, numbers, start=start)
        solved: list[Entity] = []
        if self._divided[0] is not work.islands:
            self._divided = work.islands, self._rigid_islands(work)
        for members, in_the_way, is_driven, grippers in self._divided[1]:
            bodies = members
            if is_partial and any(numbers[entity.offsets["quarantined"]] > 0.0 for entity in members):
                bodies = tuple([entity for entity in members if numbers[entity.offsets["quarantined"]] <= 0.0])
                if not bodies:
                    continue
            if grippers and any(numbers[one.held] != start[one.held] for one in grippers):
                rest.wake(bodies, numbers)
            may_rest = rest.may_rest(bodies, in_the_way, numbers, start)
            drives = world.drives(bodies, view) if is_driven or not may_rest else ()
            if may_rest and not any(drive.is_moving for drive in drives):
                rest.keep(bodies, numbers)
                continue
            welds = _welds(grippers, bodies, numbers) if grippers else ()
            engine.solve(Island(bodies, in_the_way, drives, welds), numbers, start)
            rest.count(bodies, drives, numbers)
            solved += bodies
        return solved

    def _rigid_islands(self, work: Work) -> list[_RigidIsland]:
        """Return the islands that have rigid bodies, with these alone."""
        found = []
        movers = work.movers or ((),) * len(work.islands)
        for members, in_the_way in zip(work.islands, movers, strict=True):
            bodies = tuple([entity for entity in members if entity.index in self._rigid])
            if bodies:
                is_driven = any(entity.index in self.world.actuators for entity in bodies)
                grippers = tuple([one for entity in bodies for one in self._grippers.get(entity.index, ())])
                found.append(_RigidIsland(bodies, in_the_way, is_driven, grippers))
        return found

    def _quarantine(self, work: Work, before: list[float]) -> None:
        """Let an island with an invalid result keep its edited state; the bad entities stop, and are marked.

        An entity in quarantine was copied before: its state, maybe still invalid, has no effect on the others. A body
        is solved again after `RETRY_NS`, at most `RETRIES` times.
        """
        numbers = work.numbers
        for island in work.islands:
            bad = [
                (entity, why)
                for entity in island
                if before[entity.offsets["quarantined"]] <= 0.0
                and (why := _not_finite(entity, numbers) or self._problem(entity, before, work))
            ]
            if not bad:
                continue
            for entity in island:
                numbers[entity.start : entity.split] = before[entity.start : entity.split]
                _clear_results(entity, numbers)
            grippers = [one for entity in island for one in self._grippers.get(entity.index, ())]
            for entity, why in bad:
                for index in release(grippers, numbers, entity):
                    self.rest.wake([work.layout.entities[index]], numbers)
                until = self._hold(entity, numbers)
                self.quarantined.append(f"tick {work.tick}: {entity.name} is in quarantine {until}: {why}")

    def _hold(self, entity: Entity, numbers: list[float]) -> str:
        """Mark an entity, and return in words until when it is not solved. Where joints do not couple, a rule of
        the world decides."""
        at = entity.offsets["quarantined"]
        if entity.index not in self._limits:
            numbers[at] = 1.0
            return "until a rule or an order ends it"
        stop(entity, numbers)
        attempt = 1 - numbers[at]
        if attempt > RETRIES:
            numbers[at] = attempt
            return "until it is put elsewhere or removed"
        numbers[at] = attempt - ATTEMPTS * (-RETRY_NS // self.deployment.tick_ns)
        return f"for 1 s, then it is solved again ({attempt:.0f} of {RETRIES})"

    def _problem(self, entity: Entity, before: Sequence[float], work: Work) -> str:
        """Return in words why an entity's new, finite state is invalid; empty for a valid one."""
        numbers = work.numbers
        return self._limits.problem(entity, numbers, before) or self.world.problem(entity, numbers, before, work.tick)


class Term:
    """The part of one node in each tick, with the roster and the owners of an epoch."""

    def __init__(self, stepper: Stepper, node: str, roster: Sequence[str], owners: Mapping[str, str]) -> None:
        """`roster` has the nodes in name order, `owners` the node of each robot."""
        layout = stepper.layout
        self.stepper = stepper
        self.node = node
        self.slots = Slots(layout, owners)
        self.mine = tuple(robot for robot in layout.robots if owners.get(robot.name) == node)
        self.assignment = Assignment(layout, reach_of(stepper.deployment, layout), roster, owners)
        self._share: Share | None = None
        self._members: tuple[Groups, Groups] = ((), ())

    def work(
        self, frame: Frame, edits: Sequence[Edit], packets: Sequence[Delivered], sensed: dict[int, float]
    ) -> tuple[Work, dict[int, float]]:
        """Edit the frame, deliver the packets, return the node's share of the tick, and the new slots of sensors that
        are still present, by place."""
        stepper = self.stepper
        numbers, sensed = stepper.edited(frame, edits, sensed)
        is_edited = edits or frame.tick in stepper.events.by_tick or stepper.world.has_rules
        values = None if is_edited else frame.values
        share = self.assignment.shares(numbers, values)[self.node]
        start = numbers.copy()
        outboxes = stepper.deliver(packets, share.solved, numbers, frame.tick, start)
        islands, movers = self._groups(share)
        work = Work(frame.tick, frame.layout, islands, share.solved, numbers, outboxes, start, movers, values)
        return work, sensed

    def _groups(self, share: Share) -> tuple[Groups, Groups]:
        """Return the entities of a share's islands, and those in the way of each; a share is often the last one."""
        if share is not self._share:
            entities = self.stepper.layout.entities
            islands, movers = (
                tuple([tuple([entities[index] for index in group]) for group in groups])
                for groups in (share.islands, share.movers)
            )
            self._share, self._members = share, (islands, movers)
        return self._members


def _welds(grippers: Sequence[Gripper], bodies: Sequence[Entity], numbers: Sequence[float]) -> tuple[Weld, ...]:
    """Return the welds between these bodies: holders and held."""
    holding = [one for one in grippers if numbers[one.held] >= 0.0]
    if not holding:
        return ()
    places = {entity.index: place for place, entity in enumerate(bodies)}
    return tuple(
        [
            Weld(places[one.robot], one.link, places[held], one.grasp)
            for one in holding
            if (held := int(numbers[one.held])) in places and one.robot in places
        ]
    )


def _not_finite(entity: Entity, numbers: Sequence[float]) -> str:
    """Return in words the first field of an entity's state with a non-finite number; empty without one."""
    for field_name, at in entity.offsets.items():
        values = numbers[at : at + entity.counts[field_name]]
        if at < entity.split and not all(map(isfinite, values)):
            return f"its new {field_name} is {', '.join(map(str, values))}"
    return ""


def _wait(entity: Entity, numbers: list[float]) -> None:
    """Let a tick of a body's time in quarantine pass; at its end it is solved again."""
    at = entity.offsets["quarantined"]
    if numbers[at] > ATTEMPTS:
        left = numbers[at] - ATTEMPTS
        numbers[at] = left if left > ATTEMPTS else -left


def _clear_results(entity: Entity, numbers: list[float]) -> None:
    """Empty the contact logs and the efforts of an unsolved body: they are those of one tick."""
    start = entity.offsets.get("contacts")
    if start is not None:
        numbers[start : start + 3] = (0.0, 0.0, -1.0)
    if "touches" in entity.offsets:
        clear_touches(entity, numbers)
    start = entity.offsets.get("joint_efforts")
    if start is not None:
        count = entity.counts["joint_efforts"]
        numbers[start : start + count] = [0.0] * count


def _packets(turn: Turn, payloads: Iterable[bytes | None], outboxes: Mapping[int, bytes]) -> Iterator[RobotPacket]:
    """Yield the packets of robots: their readings except dropped ones, and the packets of their outboxes."""
    readings = iter(payloads)
    for robot, sensors in turn.robots:
        found = [(one.channel, "", payload) for one in sensors if (payload := next(readings)) is not None]
        waiting = outboxes.get(robot.index)
        if waiting:
            found += [
                (packet.channel, packet.destination, packet.payload) for packet in _outbox_decoder.decode(waiting)
            ]
            found.sort(key=lambda send: send[0])
        for number, (channel, destination, payload) in enumerate(found):
            yield RobotPacket(robot.name, number, destination, channel, payload)

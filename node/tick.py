"""The pure parts of one tick: sense, edit, command, check. `core` puts them in order, the shell's engine solves.

`step` knows neither node, owner nor epoch: it is given the entities to compute.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import isfinite

import msgspec

from foosim.common import limits
from foosim.deployment.schema import Deployment
from foosim.node.edited_frame import edit
from foosim.node.engines.interface import Engine
from foosim.world.edits import Edit
from foosim.world.frame import Frame
from foosim.world.layout import Entity, Layout
from foosim.world.robot_packets import Delivered, OutboxPacket, RobotPacket
from foosim.world.sampling import Sampling
from foosim.world.scenes.worlds import world_of
from foosim.world.sensors import Sensor, make_sensor, sample_all
from foosim.world.spec import Sensor as SensorSpec

ECHO = "echo"

_outbox_decoder = msgspec.msgpack.Decoder(list[OutboxPacket])
_outbox_encoder = msgspec.msgpack.Encoder()


@dataclass
class Work:
    """What the engine has to do for one tick. `numbers` is the edited frame and is written by `solve`."""

    tick: int
    layout: Layout
    islands: tuple[tuple[Entity, ...], ...]
    solved: tuple[int, ...]
    numbers: list[float]
    outboxes: dict[int, bytes]


class Stepper:
    """The pure step of one deployment and layout: everything a tick needs but the engine."""

    def __init__(self, deployment: Deployment, layout: Layout) -> None:
        self.deployment = deployment
        self.layout = layout
        self.world = world_of(deployment, layout)
        self.substeps = deployment.substeps
        self._sensors: dict[str, list[tuple[str, tuple[int, int], int, Sensor]]] = {}
        for robot in layout.robots:
            self._sensors[robot.name] = [
                (
                    channel,
                    deployment.turns(settings),
                    robot.offsets[f"sampled.{channel}"],
                    make_sensor(settings, deployment, layout, robot, channel),
                )
                for channel, settings in _sensors_of(deployment, robot.name)
            ]
        self.sampling = Sampling(deployment)

    def sense(self, frame: Frame, robots: Iterable[Entity]) -> tuple[list[RobotPacket], list[int]]:
        """Return what these robots send at the frame's tick, and the counters of the sensors that sampled."""
        packets: list[RobotPacket] = []
        counters: list[int] = []
        tick, outboxes = frame.tick, frame.outboxes
        awake = [robot for robot in robots if frame.numbers[robot.offsets["down"]] == 0.0]
        due = {
            robot.name: [sensor for sensor in self._sensors[robot.name] if tick % sensor[1][0] == sensor[1][1]]
            for robot in awake
        }
        payloads = iter(sample_all([sensor[3] for sensors in due.values() for sensor in sensors], frame.numbers, tick))
        for robot in awake:
            sends: list[tuple[str, str, bytes]] = []
            for channel, _, slot, _ in due[robot.name]:
                sends.append((channel, "", next(payloads)))
                counters.append(slot)
            waiting = outboxes.get(robot.index)
            if waiting:
                sends += [
                    (packet.channel, packet.destination, packet.payload) for packet in _outbox_decoder.decode(waiting)
                ]
                sends.sort(key=lambda send: send[0])
            packets += [
                RobotPacket(robot.name, index, destination, channel, payload)
                for index, (channel, destination, payload) in enumerate(sends)
            ]
        return packets, counters

    def edited(self, frame: Frame, edits: Sequence[Edit]) -> tuple[Layout, list[float]]:
        """Return layout and numbers of the frame after the order's edits and the world's rules."""
        layout, numbers = edit(frame, edits, self.deployment)
        self.world.apply_rules(numbers, layout)
        return layout, numbers

    def deliver(self, packets: Sequence[Delivered], solved: Sequence[int], numbers: list[float]) -> dict[int, bytes]:
        """Apply what reached these robots, in order; return the outboxes that it filled."""
        outboxes: dict[int, list[OutboxPacket]] = {}
        for packet in packets:
            if packet.destination not in self.layout:
                continue
            entity = self.layout[packet.destination]
            if entity.index not in solved or not entity.is_robot:
                continue
            if not self._take(packet, entity, numbers, outboxes):
                numbers[entity.offsets["refused"]] += 1.0
        return {index: _outbox_encoder.encode(waiting) for index, waiting in sorted(outboxes.items())}

    def _take(
        self, packet: Delivered, entity: Entity, numbers: list[float], outboxes: dict[int, list[OutboxPacket]]
    ) -> bool:
        if numbers[entity.offsets["down"]] != 0.0:
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
        actuator = self.world.actuators.get(entity.index)
        return actuator is not None and packet.channel == actuator.channel and actuator.accept(packet.payload, numbers)

    def solve(self, engine: Engine, work: Work) -> None:
        """Load, command, step, read: write the next state of every body of `work` into its numbers."""
        numbers = work.numbers
        bodies = [entity for island in work.islands for entity in island]
        if any(numbers[entity.offsets["quarantined"]] != 0.0 for entity in bodies):
            for entity in bodies:
                if numbers[entity.offsets["quarantined"]] != 0.0:
                    _clear_log(entity, numbers)
            bodies = [entity for entity in bodies if numbers[entity.offsets["quarantined"]] == 0.0]
        if not bodies:
            return
        actuators = self.world.actuators
        driven = [entity for entity in bodies if entity.index in actuators]
        engine.load(bodies, numbers)
        engine.command(driven, [actuators[entity.index].command(numbers) for entity in driven])
        engine.step(self.substeps)
        before = numbers.copy()
        engine.read(bodies, numbers)
        if not (isfinite(sum(numbers)) and all(self.world.plausible(entity, numbers, before) for entity in bodies)):
            self._quarantine(work, before)

    def _quarantine(self, work: Work, before: list[float]) -> None:
        """An island with a result that cannot be keeps its edited state; the bad entities are marked.

        Who was in quarantine before was copied: its state, which may be as bad as ever, says nothing of the others.
        """
        numbers = work.numbers
        for island in work.islands:
            bad = [
                entity
                for entity in island
                if before[entity.offsets["quarantined"]] == 0.0
                and not (
                    all(map(isfinite, numbers[entity.start : entity.split]))
                    and self.world.plausible(entity, numbers, before)
                )
            ]
            if not bad:
                continue
            for entity in island:
                numbers[entity.start : entity.split] = before[entity.start : entity.split]
                _clear_log(entity, numbers)
            for entity in bad:
                numbers[entity.offsets["quarantined"]] = 1.0


def _clear_log(entity: Entity, numbers: list[float]) -> None:
    """Empty the contact log of a body that was not solved: a contact happens once."""
    start = entity.offsets.get("contacts")
    if start is not None:
        numbers[start : start + 3] = (0.0, 0.0, -1.0)


def _sensors_of(deployment: Deployment, robot: str) -> list[tuple[str, SensorSpec]]:
    """Return (channel, settings) of a robot's sensors, in channel order."""
    return sorted(deployment.robots[robot].sensors.items(), key=lambda item: item[0])


def moved_counters(counters: list[int], old: Layout, new: Layout) -> list[int]:
    """Return the positions of the same counters in another layout."""
    moved = []
    for entity in old.robots:
        for field, slot in entity.offsets.items():
            if slot in counters and slot >= entity.split and entity.name in new:
                moved.append(new[entity.name].offsets[field])
    return moved

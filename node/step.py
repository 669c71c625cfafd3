"""The pure parts of one tick: sense, edit, command, check. `core` puts them in order, the shell's engine solves.

`step` knows neither node, owner nor epoch: it is given the entities to compute. Neighbours: `edits`, `rules`,
`sensors`, `actuators`, `engines`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import isfinite

import msgspec

from foosim.node.actuators.position import CHANNEL as POSITION
from foosim.node.actuators.position import PositionActuator
from foosim.node.edits import edit
from foosim.node.engines.interface import Engine
from foosim.node.rules import TableRules
from foosim.node.sensors import Sensor, make_sensor
from foosim.protocol import limits
from foosim.protocol.deployment import BallSensor, Deployment, RodRobot, RodSensor, period_ticks
from foosim.protocol.frame import Frame
from foosim.protocol.layout import Entity, Layout
from foosim.protocol.messages import Delivered, Edit, OutboxPacket, RobotPacket
from foosim.protocol.sampling import Sampling

ECHO = "echo"
ROD_SPEED_FACTOR = 1.5
"""A rod's declared speed limit is this many times its drive's: a ball may push it faster than its motor does."""

STOP_DEPTH_M = 0.01
"""How far a rod may be beyond its stroke: joint stops give way a little."""

_outbox_decoder = msgspec.msgpack.Decoder(list[OutboxPacket])
_outbox_encoder = msgspec.msgpack.Encoder()


@dataclass(slots=True)
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
        self.rules = TableRules.of(deployment)
        self.substeps = deployment.substeps
        self._actuators = {entity.index: PositionActuator(deployment, entity) for entity in layout.rods}
        self._sensors: dict[str, list[tuple[str, int, int, Sensor]]] = {}
        for robot in layout.robots:
            self._sensors[robot.name] = [
                (
                    channel,
                    period_ticks(settings.rate_hz, deployment.tick_ns),
                    robot.offsets[f"sampled.{channel}"],
                    make_sensor(settings, layout, robot, channel, deployment.seed),
                )
                for channel, settings in _sensors_of(deployment, robot.name)
            ]
        self.sampling = Sampling(deployment)
        drive = deployment.table.drive
        self._slide_speed_max = drive.slide.speed * ROD_SPEED_FACTOR
        self._spin_speed_max = drive.spin.speed * ROD_SPEED_FACTOR
        self._ball_speed_max = deployment.table.ball.speed_limit
        table = deployment.table
        margin = table.rules.out_margin
        self._x_max = table.field.length / 2 + margin
        self._y_max = table.field.width / 2 + margin
        self._z_min, self._z_max = -margin, table.walls.height + margin
        tick_s = deployment.tick_ns / 1e9
        self._slide_reach_m, self._spin_reach_rad = self._slide_speed_max * tick_s, self._spin_speed_max * tick_s
        self._rods: dict[int, tuple[int, int, float]] = {}
        for entity in layout.rods:
            spec = deployment.robots[entity.name]
            assert isinstance(spec, RodRobot)
            self._rods[entity.index] = (
                entity.offsets["joint_positions"],
                entity.offsets["joint_velocities"],
                table.lines[spec.line].half_stroke + STOP_DEPTH_M,
            )
        self._ball_reach_m = self._ball_speed_max * tick_s

    def sense(self, frame: Frame, robots: Iterable[Entity]) -> tuple[list[RobotPacket], list[int]]:
        """Return what these robots send at the frame's tick, and the counters of the sensors that sampled."""
        packets: list[RobotPacket] = []
        counters: list[int] = []
        tick, outboxes = frame.tick, frame.outboxes
        for robot in robots:
            if frame.numbers[robot.offsets["down"]] != 0.0:
                continue
            sends: list[tuple[str, str, bytes]] = []
            for channel, period, slot, sensor in self._sensors[robot.name]:
                if tick % period == 0:
                    sends.append((channel, "", sensor.sample(frame.numbers, tick)))
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
        self.rules.apply(numbers, layout)
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
        if packet.channel == POSITION and entity.index in self._actuators:
            return self._actuators[entity.index].accept(packet.payload, numbers)
        return False

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
        rods = [entity for entity in bodies if entity.model == "rod"]
        engine.load(bodies, numbers)
        engine.command(rods, [self._actuators[entity.index].command(numbers) for entity in rods])
        engine.step(self.substeps)
        before = numbers.copy()
        engine.read(bodies, numbers)
        if not (isfinite(sum(numbers)) and all(self._plausible(entity, numbers, before) for entity in bodies)):
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
                    and self._plausible(entity, numbers, before)
                )
            ]
            if not bad:
                continue
            for entity in island:
                numbers[entity.start : entity.split] = before[entity.start : entity.split]
                _clear_log(entity, numbers)
            for entity in bad:
                numbers[entity.offsets["quarantined"]] = 1.0

    def _plausible(self, entity: Entity, numbers: list[float], before: list[float]) -> bool:
        """Whether an entity's new, finite state is in the world, within its speed limit and its reach."""
        rod = self._rods.get(entity.index)
        if rod is not None:
            slide, speed, slide_max = rod
            return (
                -slide_max <= numbers[slide] <= slide_max
                and abs(numbers[slide] - before[slide]) <= self._slide_reach_m
                and abs(numbers[slide + 1] - before[slide + 1]) <= self._spin_reach_rad
                and -self._slide_speed_max <= numbers[speed] <= self._slide_speed_max
                and -self._spin_speed_max <= numbers[speed + 1] <= self._spin_speed_max
            )
        start = entity.offsets["position"]
        velocity = entity.offsets["linear_velocity"]
        x, y, z = numbers[start : start + 3]
        vx, vy, vz = numbers[velocity : velocity + 3]
        dx, dy, dz = x - before[start], y - before[start + 1], z - before[start + 2]
        return (
            abs(x) <= self._x_max
            and abs(y) <= self._y_max
            and self._z_min <= z <= self._z_max
            and vx * vx + vy * vy + vz * vz <= self._ball_speed_max * self._ball_speed_max
            and dx * dx + dy * dy + dz * dz <= self._ball_reach_m * self._ball_reach_m
        )


def _clear_log(entity: Entity, numbers: list[float]) -> None:
    """Empty the contact log of a body that was not solved: a contact happens once."""
    start = entity.offsets["contacts"]
    numbers[start : start + 3] = (0.0, 0.0, -1.0)


def _sensors_of(deployment: Deployment, robot: str) -> list[tuple[str, RodSensor | BallSensor]]:
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

"""What a run begins with: the world at tick 0, or a frame of another run; and the state of an entity that is added.

Tick 0 and additions are pure functions of the deployment. A run that begins with a frame of another one keeps that
frame's tick and the chain up to it, so that equal inputs give equal digests.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from foosim.common.errors import BadValue, Malformed
from foosim.world.frame import CHAIN_START, Frame, frame_from_bytes
from foosim.world.layout import Entity, Layout, build_layout
from foosim.world.robots.rover import RoverRobot
from foosim.world.scene import turn
from foosim.world.spec import WorldSpec
from foosim.world.start import AddedEntity, Origin, Start


def place_ball(
    numbers: list[float],
    entity: Entity,
    position: tuple[float, float, float],
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> None:
    """Set a ball to `position` (m) and `velocity` (m/s) without spin, its rules' memory and quarantine cleared."""
    numbers[entity.start : entity.split] = [0.0] * (entity.split - entity.start)
    start = entity.offsets["position"]
    numbers[start : start + 3] = position
    numbers[entity.offsets["orientation"] + 3] = 1.0
    start = entity.offsets["linear_velocity"]
    numbers[start : start + 3] = velocity
    numbers[entity.offsets["contacts"] + 2] = -1.0


def place_rover(numbers: list[float], entity: Entity, spec: WorldSpec) -> None:
    """Set a rover to its start, at rest, with the deployment's charge."""
    robot = spec.robots[entity.name]
    assert isinstance(robot, RoverRobot)
    numbers[entity.start : entity.split] = [0.0] * (entity.split - entity.start)
    start, turned = entity.offsets["position"], entity.offsets["orientation"]
    numbers[start : start + 2] = robot.x, robot.y
    numbers[turned : turned + 4] = turn((0.0, 0.0, 1.0), robot.heading)
    numbers[entity.offsets["heading"]] = robot.heading
    numbers[entity.offsets["charge"]] = robot.charge * spec.hall.rover.battery.capacity


def kickoff_ticks(spec: WorldSpec) -> int:
    """Return how many ticks a ball rests at the kick-off spot."""
    return max(1, spec.table.rules.kickoff_delay_ns // spec.tick_ns)


def kickoff_spot(spec: WorldSpec) -> tuple[float, float, float]:
    return 0.0, 0.0, spec.table.ball.radius


def initial_numbers(spec: WorldSpec, layout: Layout) -> list[float]:
    """Return the numbers of a world at rest: rods centred, figures down, the ball at the kick-off spot; or rovers
    where the deployment says."""
    numbers = [0.0] * layout.size
    for entity in layout.rovers:
        place_rover(numbers, entity, spec)
    for entity in layout.rods:
        numbers[entity.offsets["contacts"] + 2] = -1.0
    for entity in layout.balls:
        place_ball(numbers, entity, kickoff_spot(spec))
        numbers[entity.offsets["wait_ticks"]] = float(kickoff_ticks(spec))
    return numbers


def initial_frame(spec: WorldSpec) -> Frame:
    """Return frame 0."""
    layout = build_layout(spec)
    return Frame(0, layout, np.array(initial_numbers(spec, layout)))


def start_with(frame: Frame, source: str, chain: bytes, added: Iterable[AddedEntity]) -> Start:
    """Return the start with a frame of `source`; `chain` is over all frames up to it."""
    origin = Origin(frame.tick, source, frame.digest, chain)
    return Start(origin, frame.values.tobytes(), frame.outbox_items, list(added))


def first_frame(spec: WorldSpec, start: Start | None) -> Frame:
    """Return the frame that a run begins with.

    Raises BadValue for a start whose frame does not fit the deployment.
    """
    if start is None:
        return initial_frame(spec)
    try:
        layout = build_layout(spec, [(entity.name, entity.model) for entity in start.added])
        frame = frame_from_bytes(start.origin.tick, layout, start.values, start.outboxes)
    except Malformed as error:
        raise BadValue(f"the frame to begin with does not fit the deployment: {error}", start.origin.source) from None
    if frame.digest != start.origin.digest:
        raise BadValue("the frame to begin with has another digest in this deployment's layout", start.origin.source)
    return frame


def added_to(spec: WorldSpec, layout: Layout) -> list[AddedEntity]:
    """Return the entities of a layout beside the deployment's."""
    base = build_layout(spec)
    return [AddedEntity(entity.name, entity.model) for entity in layout.entities if entity.name not in base]


def first_chain(origin: Origin | None) -> bytes:
    """Return the chain over the frames up to the one that a run begins with."""
    return CHAIN_START if origin is None else origin.chain

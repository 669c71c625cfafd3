"""The world at tick 0 and the state of an entity that is added: pure functions of the deployment.

Neighbours: `layout` has the slots; the rules of the table (`node.rules`) take it from there.
"""

from __future__ import annotations

import numpy as np

from foosim.protocol.deployment import Deployment
from foosim.protocol.frame import Frame
from foosim.protocol.layout import Entity, Layout, build_layout


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


def kickoff_ticks(deployment: Deployment) -> int:
    """Return how many ticks a ball rests at the kick-off spot."""
    return max(1, deployment.table.rules.kickoff_delay_ns // deployment.tick_ns)


def kickoff_spot(deployment: Deployment) -> tuple[float, float, float]:
    return 0.0, 0.0, deployment.table.ball.radius


def initial_numbers(deployment: Deployment, layout: Layout) -> list[float]:
    """Return the numbers of a world at rest: rods centred, figures down, the ball at the kick-off spot."""
    numbers = [0.0] * layout.size
    for entity in layout.rods:
        numbers[entity.offsets["contacts"] + 2] = -1.0
    for entity in layout.balls:
        place_ball(numbers, entity, kickoff_spot(deployment))
        numbers[entity.offsets["wait_ticks"]] = float(kickoff_ticks(deployment))
    return numbers


def initial_frame(deployment: Deployment) -> Frame:
    """Return frame 0."""
    layout = build_layout(deployment)
    return Frame(0, layout, np.array(initial_numbers(deployment, layout)))

"""Sets free bodies of a frame to places, as tests need them."""

from __future__ import annotations

from foosim.world.component_types.descriptions import NO_ENTITY, References
from foosim.world.edits import Add
from foosim.world.layout import Entity, Layout


def place_ball(
    numbers: list[float],
    entity: Entity,
    position: tuple[float, float, float],
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> None:
    """Set a ball to `position` (m) and `velocity` (m/s) without spin, its rules' memory and quarantine cleared."""
    numbers[entity.start : entity.split] = [0.0] * (entity.split - entity.start)
    for field, count in entity.counts.items():
        if isinstance(count, References):
            numbers[entity.offsets[field] : entity.offsets[field] + count] = [NO_ENTITY] * count
    start = entity.offsets["position"]
    numbers[start : start + 3] = position
    numbers[entity.offsets["orientation"] + 3] = 1.0
    start = entity.offsets["linear_velocity"]
    numbers[start : start + 3] = velocity
    numbers[entity.offsets["contacts"] + 2] = -1.0


def added_ball(
    layout: Layout,
    name: str,
    position: tuple[float, float, float],
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Add:
    """Return the edit that adds a spare ball of a layout at `position` (m) with `velocity` (m/s)."""
    entity, numbers = layout[name], [0.0] * layout.size
    place_ball(numbers, entity, position, velocity)
    return Add(name, numbers[entity.start : entity.stop])

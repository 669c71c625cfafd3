"""Sets free bodies of a frame to places, as tests need them."""

from __future__ import annotations

from foosim.world.forms.forms import NO_ENTITY, References
from foosim.world.layout import Entity


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

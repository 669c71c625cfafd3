"""Two driven wheels, as motions and actuators ask for them: a model that has such says so by its method `wheels()`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from foosim.common.errors import BadValue
from foosim.common.keyed_random import draw_key, draw_words, unit_interval
from foosim.world.layout import Entity, Layout
from foosim.world.moving.upright import made_model
from foosim.world.spec import WorldSpec


@dataclass(frozen=True, slots=True)
class Wheels:
    """Two wheels, `track` apart (m): greatest speed (m/s) and acceleration (m/s2) of their rims.

    `turn_rate` (rad/s) is how fast they may turn their robot. On the ground the left and the right wheel roll less far
    than they turn, by these shares.
    """

    track: float
    speed: float
    acceleration: float
    turn_rate: float
    slips: tuple[float, float] = (0.0, 0.0)


def wheels_of(spec: WorldSpec, layout: Layout, entity: Entity) -> Wheels:
    """Return the wheels of an entity. Raises BadValue where its model does not say what they are."""
    model: Any = made_model(spec, layout, entity)
    if not hasattr(model, "wheels"):
        raise BadValue("a model with wheel_speeds, and without a method wheels that says what they are", entity.model)
    found: Wheels = model.wheels()
    return found


def slips_of(spec: WorldSpec, name: str, slip: float) -> tuple[float, float]:
    """Return by which shares the wheels of a robot slip: each between none and `slip`, drawn by the robot's name."""
    words = draw_words(draw_key(spec.seed, "slip", name), 0)
    return slip * unit_interval(words[0]), slip * unit_interval(words[1])

"""Bodies that move upright, as they meet obstacles: cylinders on their places.

A model of robots that move by kinematics may define its cylinder by a method `upright()`; of any other it is the
one around its body.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Any

from foosim.world.component_types.descriptions import overrides
from foosim.world.component_types.settings import EntitySettings
from foosim.world.scene import Body, Capsule, Cylinder, Sphere, shape_box


@dataclass(frozen=True, slots=True)
class Upright:
    """A cylinder with a vertical axis through the place of an entity: its radius, from `low` to `high` above it (m)."""

    radius: float
    low: float
    high: float


def stands_upright(settings: EntitySettings) -> bool:
    """Whether robots with these settings move by kinematics, define their cylinder, and belong to no kit."""
    model = settings.component_type
    return (
        model.motion is not None
        and not model.kit
        and overrides(model.factory, "upright")
        and "position" in (model.declared or ())
    )


def is_upright(model: Any) -> bool:
    """Whether a moving model is a cylinder to obstacles; with `is_upright` False its shapes count."""
    return bool(model.is_upright)


def upright_of(model: Any) -> Upright:
    """Return the cylinder of a model of an entity that has a body."""
    found: Upright | None = model.upright()
    if found is not None:
        return found
    body = model.body()
    assert body is not None, "an entity without a body has no cylinder"
    return around(body)


def around(body: Body) -> Upright:
    """Return the cylinder around the first link of a body that stands upright."""
    radii, lows, highs = [], [], []
    for shape in body.links[0].shapes:
        low, high = shape_box(shape)
        lows.append(low[2])
        highs.append(high[2])
        x, y, _ = shape.position
        geometry = shape.geometry
        is_upright = shape.orientation[0] == 0.0 and shape.orientation[1] == 0.0
        if isinstance(geometry, Sphere) or (is_upright and isinstance(geometry, Cylinder | Capsule)):
            radii.append(sqrt(x * x + y * y) + geometry.radius)
        else:
            reach_x, reach_y = max(abs(low[0]), abs(high[0])), max(abs(low[1]), abs(high[1]))
            radii.append(sqrt(reach_x * reach_x + reach_y * reach_y))
    return Upright(max(radii), min(lows), max(highs))

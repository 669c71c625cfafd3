"""A fire: a place with a radius that grows. It is no body: rays, radio waves and robots pass it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from math import pi
from typing import Annotated, Final, Self

from pydantic import model_validator

from foosim.common import units
from foosim.common.errors import BadValue
from foosim.common.exact_math import cos, sin
from foosim.common.spec_base import default
from foosim.common.units import Quantity, custom_error
from foosim.library.mobile.vehicles import UprightAt
from foosim.world.component_types.registry import model
from foosim.world.component_types.settings import EntitySettings
from foosim.world.components.base import Model, Motion
from foosim.world.components.entities import MotionMounting, Motors
from foosim.world.components.fires import FIRE
from foosim.world.components.view import WritableView
from foosim.world.layout import Entity
from foosim.world.matter.materials import OPEN
from foosim.world.matter.mesh import Mesh
from foosim.world.placing import ORIGIN_OF_WORLD
from foosim.world.scene import ORIGIN, UPRIGHT, Body, Colour, Hull, Link, Shape

FLAME: Final[Colour] = (0.95, 0.40, 0.05, 0.6)
SIDES: Final = 16
RADIUS: Final = Quantity(units.LENGTH, "0 m", "100 m")
Radius = Annotated[float, RADIUS]
Greatest = Annotated[float, Quantity(units.LENGTH, "1 cm", "100 m")]
Growth = Annotated[float, Quantity(units.SPEED, "0 m/s", "10 m/s")]


class FireObject(EntitySettings):
    """A fire at a place: its `radius` grows by `growth` up to `radius_max`. One whose radius is 0 is out."""

    at: UprightAt = ORIGIN_OF_WORLD
    radius: Radius = default("50 cm")
    growth: Growth = default("0 m/s")
    radius_max: Greatest = default("2 m")

    @model_validator(mode="after")
    def _is_no_greater(self) -> Self:
        if self.radius > self.radius_max:
            raise custom_error(BadValue(f"the radius is above the greatest one, {self.radius_max:g} m"))
        return self


@lru_cache(maxsize=64)
def _cone(radius: float) -> Mesh:
    """Return a cone that is as high as its radius (m)."""
    import numpy as np  # only where bodies are built

    from foosim.world.bodies.hull import convex_hull

    turns = [2.0 * pi * side / SIDES for side in range(SIDES)]
    rim = [(radius * cos(turn), radius * sin(turn), 0.0) for turn in turns]
    return convex_hull(np.array([*rim, (0.0, 0.0, radius)]))


STATE: Final = ("radius", "joint_positions")
"""The fields that this motion reads and writes."""


class Growing(Motion):
    """The radius grows with time, up to the greatest one. What is out stays out."""

    def __init__(self, at: MotionMounting) -> None:
        self._tick_s = at.spec.tick_ns / 1e9
        self._slots = {its.index: tuple(at.slot(its, field) for field in STATE) for its in at.entities}
        self._settings = at.settings(FireObject)

    def move(self, entities: Sequence[Entity], motors: Sequence[Motors], view: WritableView) -> None:
        """Advance these fires by a tick; they have no motors."""
        for entity in entities:
            radius_slot, sunk = self._slots[entity.index]
            its, (radius,) = self._settings[entity.index], view.read(radius_slot)
            if radius > 0.0:
                radius = min(radius + its.growth * self._tick_s, its.radius_max)
            view.write(radius_slot, radius)
            view.write(sunk, radius - its.radius_max)


@model(
    "fire",
    FireObject,
    slots={"position": 3, "orientation": 4, "radius": 1, "joint_positions": 1},
    is_robot=False,
    motion=Growing,
    tags=(FIRE,),
    units={"radius": ("m",), "joint_positions": ("m",)},
    settable={"radius": RADIUS},
)
class Fire(Model):
    """A fire; `radius` can be set, at most to the greatest one: 0 puts it out.

    It is drawn as a cone of the greatest radius that is sunk into the ground: the part above has the fire's own radius.
    """

    def body(self) -> Body:
        """Return the cone, on a joint that sinks it (`joint_positions`: radius less the greatest one, m)."""
        name, greatest = self.at.robot.name, self.settings.radius_max
        shape = Shape(Hull(_cone(greatest)), "", FLAME, radio=OPEN)
        place = Link(name, "free", (), 0.0, ORIGIN)
        flame = Link(
            f"{name}/flame", "prismatic", (shape,), 0.0, ORIGIN, axis=(0.0, 0.0, 1.0), limits=(-greatest, 0.0), parent=0
        )
        return Body(name, "fire", ORIGIN, (place, flame), is_solid=False)

    def place(self, view: WritableView) -> None:
        """Light it at the place of its settings."""
        its = self.settings
        view.write(self.at.slot("position"), *its.at.position)
        view.write(self.at.slot("orientation"), *UPRIGHT)
        for slot, numbers in self.set("radius", its.radius).items():
            view.write(self.at.slot(slot), *numbers)

    def set(self, field: str, value: float) -> Mapping[str, Sequence[float]]:
        """Return the radius, no greater than it can be, and how deep that sinks the cone."""
        greatest = self.settings.radius_max
        return {field: [min(value, greatest)], "joint_positions": [min(value, greatest) - greatest]}

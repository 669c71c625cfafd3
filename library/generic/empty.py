"""A floor, and nothing on it."""

from __future__ import annotations

from typing import Annotated, Final

from foosim.common import units
from foosim.common.spec_base import default
from foosim.common.units import Quantity
from foosim.world.component_types.registry import scene
from foosim.world.component_types.settings import SceneSettings
from foosim.world.matter.materials import CONCRETE
from foosim.world.scene import Box, Colour, Shape

GREY: Final[Colour] = (0.62, 0.62, 0.60, 1.0)
THICKNESS_M: Final = 0.2

Side = Annotated[float, Quantity(units.LENGTH, "1 m", "10 km")]


class EmptySettings(SceneSettings):
    """A floor at z = 0 around the origin: `length` along x and `width` along y, 100 m each by default.

    `surface` is what rigid bodies feel of it, '' nothing.
    """

    length: Side = default("100 m")
    width: Side = default("100 m")
    surface: str = "floor"


@scene("empty", EmptySettings)
def floor(settings: EmptySettings) -> tuple[Shape, ...]:
    """A floor, whose upper side is at z = 0."""
    half = (settings.length / 2, settings.width / 2, THICKNESS_M / 2)
    return (Shape(Box(half), settings.surface, GREY, (0.0, 0.0, -THICKNESS_M / 2), radio=CONCRETE, name="floor"),)

"""A floor with fixed boxes."""

from __future__ import annotations

from typing import Annotated, Final

from pydantic import Field

from foosim.common import units
from foosim.common.spec_base import Name, SpecBase
from foosim.common.units import Quantity
from foosim.library.generic.empty import EmptySettings, floor
from foosim.world.component_types.registry import scene
from foosim.world.matter.materials import UNKNOWN, Radio
from foosim.world.placing import ORIGIN_OF_WORLD, At
from foosim.world.scene import Box, Shape, rotate
from foosim.world.scenery import Material

BOXES_MAX: Final = 4096

Side = Annotated[float, Quantity(units.LENGTH, "1 mm", "1 km")]


class SceneBox(SpecBase):
    """A box of `length` along its x, `width` along y and `height` along z: `at` is the middle of its underside.

    `surface` is what rigid bodies feel of it, '' nothing; `material` how it looks; `radio` what waves that cross it
    lose: 5 dB by default.
    """

    at: At = ORIGIN_OF_WORLD
    length: Side
    width: Side
    height: Side
    surface: str = "walls"
    material: Material = Field(default_factory=Material)
    radio: Radio | None = None


class BoxesSettings(EmptySettings):
    """A floor, and boxes by name."""

    boxes: dict[Name, SceneBox] = Field(default={}, max_length=BOXES_MAX)


@scene("boxes", BoxesSettings)
def boxes(settings: BoxesSettings) -> tuple[Shape, ...]:
    """A floor with boxes on it, in name order."""
    return (*floor(settings), *(_box(name, box) for name, box in sorted(settings.boxes.items())))


def _box(name: str, its: SceneBox) -> Shape:
    half = (its.length / 2, its.width / 2, its.height / 2)
    turned, (x, y, z) = its.at.orientation, its.at.position
    dx, dy, dz = rotate(turned, (0.0, 0.0, its.height / 2))
    middle = (x + dx, y + dy, z + dz)
    return Shape(Box(half), its.surface, its.material.colour, middle, turned, its.radio or UNKNOWN, name)

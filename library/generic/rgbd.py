"""A camera of colour and depth."""

from __future__ import annotations

from typing import ClassVar

from foosim.world.component_types.registry import sensor
from foosim.world.components.cameras import ColourSettings, PictureSensor
from foosim.world.components.sight import PICTURES, Sight


class RgbdSettings(ColourSettings):
    """A colour picture and distances, `sample.value.image()` and `.depth()`, drawn where they are looked at."""

    pictures: ClassVar = ("image", "depth")
    bytes_per_pixel: ClassVar = 1.35


@sensor("rgbd", RgbdSettings, Sight, drawn_by=PICTURES)
class Rgbd(PictureSensor):
    """A colour picture and distances of what is in view."""

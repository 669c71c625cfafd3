"""A camera: colour pictures."""

from __future__ import annotations

from typing import ClassVar

from foosim.world.component_types.registry import sensor
from foosim.world.components.cameras import ColourSettings, PictureSensor
from foosim.world.components.sight import PICTURES, Sight


class CameraSettings(ColourSettings):
    """A colour picture, `sample.value.image()`, drawn where it is looked at."""

    pictures: ClassVar = ("image",)
    bytes_per_pixel: ClassVar = 0.35


@sensor("camera", CameraSettings, Sight, drawn_by=PICTURES)
class Camera(PictureSensor):
    """A colour picture of what is in view."""

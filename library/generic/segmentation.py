"""A segmentation camera: pictures of which thing is in each pixel."""

from __future__ import annotations

from typing import ClassVar

from foosim.world.component_types.registry import sensor
from foosim.world.components.cameras import PictureSensor, PictureSettings
from foosim.world.components.sight import PICTURES, Sight


class SegmentationSettings(PictureSettings):
    """The thing in each pixel, `sample.value.segmentation()`, drawn where it is looked at."""

    pictures: ClassVar = ("segmentation",)
    bytes_per_pixel: ClassVar = 0.05


@sensor("segmentation", SegmentationSettings, Sight, drawn_by=PICTURES)
class Segmentation(PictureSensor):
    """Which things are in view, pixel by pixel."""

"""A depth camera: pictures of distances."""

from __future__ import annotations

from typing import ClassVar

from foosim.world.component_types.registry import sensor
from foosim.world.components.cameras import PictureSensor, PictureSettings
from foosim.world.components.sight import PICTURES, Sight


class DepthCameraSettings(PictureSettings):
    """Distances along the axis of the camera, `sample.value.depth()` in m, drawn where they are looked at."""

    pictures: ClassVar = ("depth",)
    bytes_per_pixel: ClassVar = 1.0


@sensor("depth_camera", DepthCameraSettings, Sight, drawn_by=PICTURES)
class DepthCamera(PictureSensor):
    """Distances of what is in view."""

"""Where a rover is, as a localisation of the hall gives it."""

from __future__ import annotations

from typing import ClassVar

from msgspec import Struct

from foosim.world.component_types.quantities import Metres, Radians
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.base import need
from foosim.world.components.rows import SlotSensor
from foosim.world.components.view import Mounting


class PoseSettings(SensorSettings):
    """Where a rover is, and its heading."""


class Pose(Struct, frozen=True):
    """Where a rover is: `x` and `y` in the world frame, `heading` from +x towards +y."""

    x: Metres
    y: Metres
    heading: Radians

    groups: ClassVar = {"position": ("x", "y")}


@sensor("pose", PoseSettings, Pose, shown_as="foxglove.PoseInFrame")
class PoseTracker(SlotSensor):
    """Place and heading in the world frame."""

    position, heading = need(), need()
    reading: ClassVar = Pose

    def __init__(self, settings: PoseSettings, at: Mounting) -> None:
        self.places = (*self.position.places[:2], self.heading.at)

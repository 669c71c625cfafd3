"""Where a rover is, as a localisation of the hall gives it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from msgspec import Struct

from foosim.world.component_types.quantities import Metres, Radians
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.base import Sensor, need
from foosim.world.components.view import SlotReadings, View


class PoseSettings(SensorSettings):
    """Where a rover is, and its heading."""


class Pose(Struct, frozen=True):
    """Where a rover is: `x` and `y` in the world frame, `heading` from +x towards +y."""

    x: Metres
    y: Metres
    heading: Radians

    groups: ClassVar = {"position": ("x", "y")}


@sensor("pose", PoseSettings, Pose, shown_as="foxglove.PoseInFrame")
class PoseTracker(Sensor):
    """Place and heading in the world frame."""

    position, heading = need(), need()

    def sample(self, view: View) -> Pose:
        x, y, _ = view.read(self.position)
        return Pose(x, y, view.numbers[self.heading.at])

    @staticmethod
    def together(sensors: Sequence[PoseTracker]) -> SlotReadings:
        """Return these as one."""
        return SlotReadings([(one.position.at, one.position.at + 1, one.heading.at) for one in sensors])

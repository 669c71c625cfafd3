"""Where a rover is, as a localisation of the hall gives it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from msgspec import Struct

from foosim.world.component_types.quantities import Metres, Radians
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.base import Sensor
from foosim.world.components.view import Mounting, SlotReadings, View


class PoseSettings(SensorSettings):
    """Where a rover is, and its heading."""


class Pose(Struct, frozen=True):
    """Where a rover is: `x` and `y` in the world frame, `heading` from +x towards +y."""

    x: Metres
    y: Metres
    heading: Radians

    groups: ClassVar = {"position": ("x", "y")}


@sensor("pose", PoseSettings, Pose, needs=("position", "heading"), shown_as="foxglove.PoseInFrame")
class PoseTracker(Sensor):
    """Place and heading in the world frame."""

    def __init__(self, settings: PoseSettings, at: Mounting) -> None:
        self._position, self._heading = at.slot("position"), at.slot("heading")

    def sample(self, view: View) -> Pose:
        x, y, _ = view.read(self._position)
        return Pose(x, y, view.numbers[self._heading.at])

    @staticmethod
    def together(sensors: Sequence[PoseTracker]) -> SlotReadings:
        """Return these as one."""
        return SlotReadings([(one._position.at, one._position.at + 1, one._heading.at) for one in sensors])

"""Position of the ball as an overhead camera's tracker gives it."""

from __future__ import annotations

from typing import ClassVar

from msgspec import Struct

from foosim.world.components.base import Sensor
from foosim.world.components.view import Mounting, View
from foosim.world.forms.quantities import Metres
from foosim.world.forms.registry import sensor
from foosim.world.forms.settings import SensorSettings


class BallSettings(SensorSettings):
    """Reads the ball's position."""


class BallPosition(Struct, frozen=True):
    """Where the ball is: `x`, `y`, `z` in the world frame (origin on the floor in the middle, z up)."""

    x: Metres
    y: Metres
    z: Metres

    groups: ClassVar = {"position": ("x", "y", "z")}


@sensor("ball", BallSettings, BallPosition, kit="table")
class BallTracker(Sensor):
    """The ball's position in the world frame."""

    def __init__(self, settings: BallSettings, at: Mounting) -> None:
        self._start = at.layout["ball"].offsets["position"]

    def sample(self, view: View) -> BallPosition:
        return BallPosition(*view.numbers[self._start : self._start + 3])

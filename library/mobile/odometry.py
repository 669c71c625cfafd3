"""How far a rover's wheels have turned.

It includes the slip of the wheels, and their turning while the rover was blocked and did not move.
"""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from foosim.world.component_types.quantities import Metres
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.base import Sensor
from foosim.world.components.view import Mounting, SlotReadings, View


class OdometrySettings(SensorSettings):
    """How far the left and the right wheel have turned, at the rim."""


class WheelTravel(Struct, frozen=True):
    """How far a rover's wheels have turned since the start, at the rim."""

    left: Metres
    right: Metres


@sensor("odometry", OdometrySettings, WheelTravel, needs=("wheel_travel",))
class Odometry(Sensor):
    """Travel of the left and the right wheel's rim since the start."""

    def __init__(self, settings: OdometrySettings, at: Mounting) -> None:
        self.travel = at.slot("wheel_travel")

    def sample(self, view: View) -> WheelTravel:
        return WheelTravel(*view.read(self.travel))

    @staticmethod
    def together(sensors: Sequence[Odometry]) -> SlotReadings:
        """Return these as one."""
        return SlotReadings([one.travel.places for one in sensors])

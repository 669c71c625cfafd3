"""How far a rover's wheels have turned.

It includes the slip of the wheels, and their turning while the rover was blocked and did not move.
"""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from foosim.world.component_types.quantities import Metres
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.base import Sensor, need
from foosim.world.components.view import SlotReadings, View


class OdometrySettings(SensorSettings):
    """How far the left and the right wheel have turned, at the rim."""


class WheelTravel(Struct, frozen=True):
    """How far a rover's wheels have turned since the start, at the rim."""

    left: Metres
    right: Metres


@sensor("odometry", OdometrySettings, WheelTravel)
class Odometry(Sensor):
    """Travel of the left and the right wheel's rim since the start."""

    wheel_travel = need()

    def sample(self, view: View) -> WheelTravel:
        return WheelTravel(*view.read(self.wheel_travel))

    @staticmethod
    def together(sensors: Sequence[Odometry]) -> SlotReadings:
        """Return these as one."""
        return SlotReadings([one.wheel_travel.places for one in sensors])

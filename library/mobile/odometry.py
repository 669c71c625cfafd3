"""How far a rover's wheels have turned.

It includes the slip of the wheels, and their turning while the rover was blocked and did not move.
"""

from __future__ import annotations

from typing import ClassVar

from msgspec import Struct

from foosim.world.component_types.quantities import Metres
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.base import need
from foosim.world.components.rows import SlotSensor


class OdometrySettings(SensorSettings):
    """How far the left and the right wheel have turned, at the rim."""


class WheelTravel(Struct, frozen=True):
    """How far a rover's wheels have turned since the start, at the rim."""

    left: Metres
    right: Metres


@sensor("odometry", OdometrySettings, WheelTravel)
class Odometry(SlotSensor):
    """Travel of the left and the right wheel's rim since the start."""

    wheel_travel = need()
    reading: ClassVar = WheelTravel

"""Position and angle of a rod."""

from __future__ import annotations

from typing import ClassVar

from msgspec import Struct

from foosim.world.component_types.quantities import Metres, Radians
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.base import need
from foosim.world.components.rows import SlotSensor


class EncoderSettings(SensorSettings):
    """Reads a rod's slide and spin."""


class RodPosition(Struct, frozen=True):
    """Where a rod is: `slide` along world +y from its middle, `spin` about +y, 0 with the feet down."""

    slide: Metres
    spin: Radians


@sensor("encoder", EncoderSettings, RodPosition)
class Encoder(SlotSensor):
    """Slide and spin of a rod."""

    joint_positions = need()
    reading: ClassVar = RodPosition

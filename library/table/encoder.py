"""Position and angle of a rod."""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from foosim.world.component_types.quantities import Metres, Radians
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.base import Sensor, need
from foosim.world.components.view import SlotReadings, View


class EncoderSettings(SensorSettings):
    """Reads a rod's slide and spin."""


class RodPosition(Struct, frozen=True):
    """Where a rod is: `slide` along world +y from its middle, `spin` about +y, 0 with the feet down."""

    slide: Metres
    spin: Radians


@sensor("encoder", EncoderSettings, RodPosition)
class Encoder(Sensor):
    """Slide and spin of a rod."""

    joint_positions = need()

    def sample(self, view: View) -> RodPosition:
        return RodPosition(*view.read(self.joint_positions))

    @staticmethod
    def together(sensors: Sequence[Encoder]) -> SlotReadings:
        """Return these as one."""
        return SlotReadings([one.joint_positions.places for one in sensors])

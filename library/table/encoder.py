"""Position and angle of a rod."""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from foosim.world.component_types.quantities import Metres, Radians
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.base import Sensor
from foosim.world.components.view import Mounting, SlotReadings, View


class EncoderSettings(SensorSettings):
    """Reads a rod's slide and spin."""


class RodPosition(Struct, frozen=True):
    """Where a rod is: `slide` along world +y from its middle, `spin` about +y, 0 with the feet down."""

    slide: Metres
    spin: Radians


@sensor("encoder", EncoderSettings, RodPosition, needs=("joint_positions",))
class Encoder(Sensor):
    """Slide and spin of a rod."""

    def __init__(self, settings: EncoderSettings, at: Mounting) -> None:
        self.joints = at.slot("joint_positions")

    def sample(self, view: View) -> RodPosition:
        return RodPosition(*view.read(self.joints))

    @staticmethod
    def together(sensors: Sequence[Encoder]) -> SlotReadings:
        """Return these as one."""
        return SlotReadings([one.joints.places for one in sensors])

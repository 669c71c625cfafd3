"""The temperature at a place on a robot, by how far it is from fires.

A place at the distance d from the middle of a sphere of radius r that radiates evenly gets the share (r / d)^2 of what
it would get at the sphere (the configuration factor of a small surface that faces a sphere: Howell, Menguec, Siegel,
*Thermal Radiation Heat Transfer*, appendix C). A small body that loses heat in proportion to how much warmer it is than
the air becomes warmer than that by as much, times a gain. The gains of several fires add up. Walls shade nothing.
"""

from __future__ import annotations

from typing import Annotated

from msgspec import Struct

from foosim.common import units
from foosim.common.spec_base import default
from foosim.common.units import Quantity
from foosim.world.component_types.quantities import DegreesCelsius
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.fires import Fires
from foosim.world.components.mounted import MountedSensor
from foosim.world.components.view import Mounting, View
from foosim.world.placing import FIRST_LINK, MountedAt

Ambient = Annotated[float, Quantity(units.TEMPERATURE, "-100 degC", "100 degC")]
Gain = Annotated[float, Quantity(units.TEMPERATURE, "0 degC", "2000 degC")]


class ThermometerSettings(SensorSettings):
    """The temperature at a place on a robot: `ambient` far from all fires, and by `gain` more at the edge of one.

    It is ambient + the sum over all fires of gain x (r / max(d, r))^2, with a fire's radius r, and d from its middle.
    """

    at: MountedAt = FIRST_LINK
    ambient: Ambient = default("25 degC")
    gain: Gain = default("200 degC")


class Temperature(Struct, frozen=True):
    """How warm it is."""

    temperature: DegreesCelsius


@sensor("thermometer", ThermometerSettings, Temperature)
class Thermometer(MountedSensor):
    """The temperature at the mount, by the distance from all fires that burn."""

    def __init__(self, settings: ThermometerSettings, at: Mounting) -> None:
        super().__init__(settings, at)
        self._fires = Fires(at.spec, at.layout)
        self._ambient, self._gain = settings.ambient, settings.gain

    def sample(self, view: View) -> Temperature:
        place, _ = self.mount.pose(view.numbers)
        temperature = self._ambient
        for radius, square in self._fires.near(place, view.start):
            least = radius * radius
            temperature += self._gain * (least / max(square, least))
        return Temperature(temperature)

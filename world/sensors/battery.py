"""A rover's battery: its charge and its voltage."""

from __future__ import annotations

from msgspec import Struct

from foosim.world.components.view import Mounting, View
from foosim.world.forms.quantities import Share, Volts
from foosim.world.forms.registry import sensor
from foosim.world.forms.settings import SensorSettings
from foosim.world.parameters.hall import hall_of


class BatterySettings(SensorSettings):
    """The charge as a share of the capacity, and the voltage."""


class Battery(Struct, frozen=True):
    """A rover's battery: `share` of its capacity, `voltage` in V."""

    share: Share
    voltage: Volts


@sensor("battery", BatterySettings, Battery, needs=("charge",), kit="hall")
class BatteryGauge:
    """Charge of a battery as a share of its capacity, and its voltage, which falls evenly with the charge."""

    def __init__(self, settings: BatterySettings, at: Mounting) -> None:
        battery = hall_of(at.spec).rover.battery
        self._charge = at.slot("charge")
        self._capacity_j = battery.capacity
        self._empty_v, self._span_v = battery.empty, battery.full - battery.empty

    def sample(self, view: View) -> Battery:
        share = view.numbers[self._charge.at] / self._capacity_j
        return Battery(share, self._empty_v + share * self._span_v)

"""A robot's battery: its charge and its voltage."""

from __future__ import annotations

from msgspec import Struct

from foosim.world.components.base import Sensor
from foosim.world.components.view import IncompatibleComponent, Mounting, View
from foosim.world.energy.battery import batteries_of, cell_of, is_rover
from foosim.world.forms.quantities import Share, Volts
from foosim.world.forms.registry import sensor
from foosim.world.forms.settings import SensorSettings


class BatterySettings(SensorSettings):
    """The charge as a share of the capacity, and the voltage, of a robot with the rule `battery`."""


class Battery(Struct, frozen=True):
    """A robot's battery: `share` of its capacity, `voltage` in V."""

    share: Share
    voltage: Volts


@sensor("battery", BatterySettings, Battery)
class BatteryGauge(Sensor):
    """Charge of a battery as a share of its capacity, and its voltage, which falls evenly with the charge."""

    def __init__(self, settings: BatterySettings, at: Mounting) -> None:
        label, battery = next(iter(batteries_of(at.spec, at.robot).items()), ("", None))
        cell, own = cell_of(battery, at), f"{label}.charge"
        self._charge = at.robot.offsets[own if own in at.robot.offsets else "charge"]
        self._capacity_j = cell.capacity
        self._empty_v, self._span_v = cell.empty, cell.full - cell.empty

    @staticmethod
    def check(settings: BatterySettings, at: Mounting) -> None:
        """Raise IncompatibleComponent on a robot without a battery."""
        if not (is_rover(at.spec, at.robot) or batteries_of(at.spec, at.robot)):
            raise IncompatibleComponent(
                ("kind",), f"on a robot without a battery: {at.robot.name} has no rule battery", settings.kind
            )

    def sample(self, view: View) -> Battery:
        share = view.numbers[self._charge] / self._capacity_j
        return Battery(share, self._empty_v + share * self._span_v)

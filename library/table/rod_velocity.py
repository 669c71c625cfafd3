"""The rod's velocity actuator: its motors pursue speeds, with no more than the drive's force."""

from __future__ import annotations

from msgspec import Struct

from foosim.library.table.rod_drives import RodLimits, RodSetPoint
from foosim.world.component_types.quantities import MetresPerSecond, RadiansPerSecond
from foosim.world.component_types.registry import actuator
from foosim.world.component_types.settings import ActuatorSettings
from foosim.world.components.entities import Motors
from foosim.world.components.view import Mounting, View


class RodVelocitySettings(ActuatorSettings):
    """Moves a rod at speeds; the limits are the table's."""


class RodVelocity(Struct, frozen=True):
    """The speeds of a rod: `slide` along world +y, `spin` about +y."""

    slide: MetresPerSecond
    spin: RadiansPerSecond


@actuator("rod_velocity", RodVelocitySettings, RodVelocity, kit="table")
class VelocityActuator(RodSetPoint):
    """Motors with speed controllers, as ideal ones: the speed is there as soon as the greatest force can bring it."""

    def __init__(self, settings: RodVelocitySettings, at: Mounting) -> None:
        limits = RodLimits(at)
        self._bounds, self._forces = limits.speeds, limits.forces

    def command(self, view: View) -> Motors:
        """Return (target speed, greatest force) of slide and spin, in SI units."""
        slide, spin = view.read(self._set_point)
        force, torque = self._forces
        return (slide, force), (spin, torque)

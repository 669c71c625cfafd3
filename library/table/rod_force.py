"""The rod's force actuator: a force along the rod and a torque about it, as of motors with current controllers."""

from __future__ import annotations

from math import copysign
from typing import ClassVar

from msgspec import Struct

from foosim.library.table.rod_drives import RodLimits, RodSetPoint
from foosim.world.component_types.quantities import NewtonMetres, Newtons
from foosim.world.component_types.registry import actuator
from foosim.world.component_types.settings import ActuatorSettings
from foosim.world.components.entities import Motors
from foosim.world.components.view import Mounting, View


class RodForceSettings(ActuatorSettings):
    """Pushes and turns a rod; the limits are the table's."""


class RodForce(Struct, frozen=True):
    """What moves a rod: the force `slide` along world +y, the torque `spin` about +y."""

    slide: Newtons
    spin: NewtonMetres


@actuator("rod_force", RodForceSettings, RodForce, kit="table")
class ForceActuator(RodSetPoint):
    """Motors that apply the force and the torque of the last command, up to their greatest speeds."""

    excites: ClassVar = (0.1, 0.1)

    def __init__(self, settings: RodForceSettings, at: Mounting) -> None:
        limits = RodLimits(at)
        self._speeds, self._forces = limits.speeds, limits.forces
        self._bounds = limits.forces

    def command(self, view: View) -> Motors:
        """Return the greatest speed in the direction of each effort, and the effort, of slide and spin, in SI units."""
        slide, spin = view.read(self._set_point)
        speed, turning = self._speeds
        return (copysign(speed, slide), abs(slide)), (copysign(turning, spin), abs(spin))

    def unpowered(self) -> Motors:
        """Return that nothing pushes."""
        return (0.0, 0.0), (0.0, 0.0)

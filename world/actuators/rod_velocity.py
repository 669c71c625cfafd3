"""The rod's velocity actuator: its motors pursue speeds, with no more than the drive's force."""

from __future__ import annotations

from typing import ClassVar

from msgspec import Struct

from foosim.world.components.entities import Motors
from foosim.world.components.view import Mounting, View, WritableView
from foosim.world.forms.quantities import MetresPerSecond, RadiansPerSecond
from foosim.world.forms.registry import actuator
from foosim.world.forms.settings import ActuatorSettings
from foosim.world.parameters.rod_drives import RodLimits


class RodVelocitySettings(ActuatorSettings):
    """Moves a rod at speeds; the limits are the table's."""


class RodVelocity(Struct, frozen=True):
    """The speeds of a rod: `slide` along world +y, `spin` about +y."""

    slide: MetresPerSecond
    spin: RadiansPerSecond


@actuator(
    "rod_velocity", RodVelocitySettings, RodVelocity, slots={"set_point": 2}, needs=("joint_positions",), kit="table"
)
class VelocityActuator:
    """Motors with speed controllers, as ideal ones: the speed is there as soon as the greatest force can bring it."""

    steady: ClassVar = True
    """What it asks follows from the state of its rod alone."""

    def __init__(self, settings: RodVelocitySettings, at: Mounting) -> None:
        limits = RodLimits(at)
        self._set_point = at.slot("set_point")
        self._speeds, self._forces = limits.speeds, limits.forces

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return the least and greatest speeds that are accepted (m/s, rad/s)."""
        slide, spin = self._speeds
        return {"slide": (-slide, slide), "spin": (-spin, spin)}

    def accept(self, command: RodVelocity, view: WritableView) -> bool:
        """Take speeds; those that are out of their limits are refused."""
        slide, spin = self._speeds
        if abs(command.slide) > slide or abs(command.spin) > spin:
            return False
        view.write(self._set_point, command.slide, command.spin)
        return True

    def hold(self, view: WritableView) -> None:
        """Stop."""
        view.write(self._set_point, 0.0, 0.0)

    def stir(self, view: WritableView) -> None:
        """Slide and turn, for the small run that tells engines apart."""
        slide, spin = self._speeds
        view.write(self._set_point, 0.1 * slide, 0.5 * spin)

    def command(self, view: View) -> Motors:
        """Return (target speed, greatest force) of slide and spin, in SI units."""
        slide, spin = view.read(self._set_point)
        force, torque = self._forces
        return (slide, force), (spin, torque)

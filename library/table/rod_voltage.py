"""The rod's voltage actuator: electrical machines with back-EMF, a limit of the current and rotors.

At each substep of the physics the force is F = k_t i with i = (u - k_e v) / R, at most the greatest current, as the
mean over the substep: an unloaded rod follows the exponential of the closed form at any resistance. So what a real
table's computer sends to its amplifiers can be sent here.
"""

from __future__ import annotations

from msgspec import Struct

from foosim.library.table.rod_drives import RodLimits, RodSetPoint, RodVoltageSettings
from foosim.world.component_types.quantities import Volts
from foosim.world.component_types.registry import actuator
from foosim.world.components.entities import Motors
from foosim.world.components.view import IncompatibleComponent, Mounting, View


class RodVoltages(Struct, frozen=True):
    """The voltages of a rod's motors: positive ones move it along world +y, and turn it about +y."""

    slide: Volts
    spin: Volts


@actuator("rod_voltage", RodVoltageSettings, RodVoltages, kit="table")
class VoltageActuator(RodSetPoint):
    """Motors at the voltages of the last command; a dead time is the modifier `delay`."""

    def __init__(self, settings: RodVoltageSettings, at: Mounting) -> None:
        slide, spin = settings.slide, settings.spin
        self._bounds = slide.voltage, spin.voltage
        self._emf = slide.back_emf, spin.back_emf
        along, around = settings.constants
        self._forces = along * slide.current, around * spin.current
        self._slopes = along * slide.back_emf / slide.resistance, around * spin.back_emf / spin.resistance

    @staticmethod
    def check(settings: RodVoltageSettings, at: Mounting) -> None:
        """Raise IncompatibleComponent for a motor that turns faster without a load than the table's rods do."""
        slide, spin = settings.slide, settings.spin
        motors = ("slide", slide.voltage, slide.back_emf, "m/s"), ("spin", spin.voltage, spin.back_emf, "rad/s")
        for (axis, voltage, emf, unit), most in zip(motors, RodLimits(at).speeds, strict=True):
            if voltage / emf > most:
                what = f"{voltage / emf:g} {unit} without a load, more than table.drive.{axis}.speed, {most:g} {unit}"
                raise IncompatibleComponent((axis, "voltage"), what, f"{voltage:g} V")

    def command(self, view: View) -> Motors:
        """Return of slide and spin, in SI units: the speed without a load, the force of the greatest current, and by
        how much the force falls with the speed."""
        slide, spin = view.read(self._set_point)
        along, around = self._emf
        force, torque = self._forces
        of_slide, of_spin = self._slopes
        return (slide / along, force, of_slide), (spin / around, torque, of_spin)

    def unpowered(self) -> Motors:
        """Return that no current flows."""
        return (0.0, 0.0), (0.0, 0.0)

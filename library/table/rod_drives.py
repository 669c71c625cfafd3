"""What drives a rod: the limits of its motors, and motors as electrical machines.

A direct-current machine with a winding of the resistance R takes the current i = (u - k_e v) / R from the voltage u, at
most what its amplifier gives, and pushes with F = k_t i (Lynch and Park, Modern Robotics, 2017, section 8.9.1, for a
torque; of a linear machine likewise). In SI units k_t and k_e of an ideal machine are one number. Its force falls with
the speed by b = k_t k_e / R, to 0 at u / k_e.
"""

from __future__ import annotations

from math import inf
from typing import Annotated, ClassVar

from foosim.common import units
from foosim.common.spec_base import SpecBase, default
from foosim.common.units import Quantity
from foosim.library.table.settings import table_of
from foosim.world.component_types.settings import ActuatorSettings
from foosim.world.components.base import SetPointActuator, need, slot
from foosim.world.components.entities import made_model
from foosim.world.components.view import Mounting, WritableView
from foosim.world.scene import load_of

SLIDE, SPIN = 0, 1
"""The joints of a rod, and its links."""

Voltage = Annotated[float, Quantity(units.VOLTAGE, "1 mV", "1 kV")]
Resistance = Annotated[float, Quantity(units.RESISTANCE, "1 mOhm", "1000 Ohm")]
Current = Annotated[float, Quantity(units.CURRENT, "1 mA", "1000 A")]
ForceConstant = Annotated[float, Quantity(units.FORCE_CONSTANT, "0.01 N/A", "10000 N/A")]
TorqueConstant = Annotated[float, Quantity(units.TORQUE_CONSTANT, "0.01 mN m/A", "1000 N m/A")]
SpeedConstant = Annotated[float, Quantity(units.SPEED_CONSTANT, "0.01 V s/m", "10000 V s/m")]
SpinConstant = Annotated[float, Quantity(units.SPIN_CONSTANT, "0.01 mV s/rad", "1000 V s/rad")]
RotorMass = Annotated[float, Quantity(units.MASS, "0 kg", "100 kg")]
RotorInertia = Annotated[float, Quantity(units.INERTIA, "0 kg m2", "1 kg m2")]


class SlideMotor(SpecBase):
    """The motor along a rod: the greatest `voltage` and `current` of its amplifier, its `resistance`, its
    `force_constant` (k_t) and its `back_emf` (k_e), and its `rotor` as a mass that slides with the rod, J / r2 of one
    with the inertia J on a belt wheel of the radius r."""

    voltage: Voltage = default("48 V")
    current: Current = default("6.5 A")
    resistance: Resistance = default("2 Ohm")
    force_constant: ForceConstant = default("14 N/A")
    back_emf: SpeedConstant = default("14 V s/m")
    rotor: RotorMass = default("100 g")


class SpinMotor(SpecBase):
    """The motor around a rod: as that along it, with a `torque_constant` (k_t), and its `rotor` as a moment of inertia
    about the rod, n2 J of one behind a gear that turns n times as fast."""

    voltage: Voltage = default("48 V")
    current: Current = default("6.25 A")
    resistance: Resistance = default("2 Ohm")
    torque_constant: TorqueConstant = default("0.32 N m/A")
    back_emf: SpinConstant = default("0.32 V s/rad")
    rotor: RotorInertia = default("1e-5 kg m2")


class RodVoltageSettings(ActuatorSettings):
    """Applies voltages to a rod's motors, which are electrical machines.

    Their speed without a load, voltage / back_emf, is at most the table's `drive.slide.speed` and `drive.spin.speed`.
    """

    slide: SlideMotor = SlideMotor()
    spin: SpinMotor = SpinMotor()

    @property
    def constants(self) -> tuple[float, float]:
        """Newtons and newton metres per ampere."""
        return self.slide.force_constant, self.spin.torque_constant


class RodLimits:
    """What the table's drives give a rod, of slide and spin: the greatest speeds (m/s, rad/s) and forces (N, N m).

    A limit of the acceleration is one of the force: no more than accelerates the rod by so much without a load.
    """

    def __init__(self, at: Mounting) -> None:
        table, body = table_of(at.spec), made_model(at.spec, at.layout, at.robot).body()
        drive = table.drive
        self.loads = load_of(body, SLIDE), load_of(body, SPIN)
        """The mass (kg) and the moment of inertia (kg m2) that the motors accelerate."""
        self.half_stroke = body.links[SLIDE].limits[1]
        self.speeds = drive.slide.speed, drive.spin.speed
        most = tuple(inf if one is None else one for one in (drive.slide.acceleration, drive.spin.acceleration))
        self.forces = (
            min(drive.slide.force, self.loads[SLIDE] * most[SLIDE]),
            min(drive.spin.torque, self.loads[SPIN] * most[SPIN]),
        )


class RodSetPoint(SetPointActuator):
    """The last command to a rod's motors, in the slot `set_point`: two numbers, each within its bounds.

    All are 0 when it holds: a speed of 0, no force, or shorted motors, which brake.
    """

    steady: ClassVar = True
    """Its set-points follow from the state of its rod alone."""
    excites: ClassVar = (0.1, 0.5)
    """Shares of the bounds that `excite` sets."""
    _set_point, joint_positions = slot(2), need()
    _bounds: tuple[float, float]
    """The greatest numbers of slide and spin in either direction, in the units of the command."""

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return the least and the greatest numbers."""
        slide, spin = self._bounds
        return {"slide": (-slide, slide), "spin": (-spin, spin)}

    def excite(self, view: WritableView) -> None:
        """Slide and turn, for the run that compares engines."""
        view.write(self._set_point, *[share * most for share, most in zip(self.excites, self._bounds, strict=True)])

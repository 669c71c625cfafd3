"""The settings of a quadrotor."""

from __future__ import annotations

from collections.abc import Mapping
from math import sqrt
from typing import Annotated

from pydantic import Field

from foosim.common import units
from foosim.common.finding import Location
from foosim.common.spec_base import Name, default
from foosim.common.units import Quantity
from foosim.world.component_types.settings import RobotSettings
from foosim.world.matter.physics import DEFAULT
from foosim.world.placing import At

RotorSpeed = Annotated[float, Quantity(units.SPIN, "1 rad/s", "20000 rad/s")]
Mass = Annotated[float, Quantity(units.MASS, "1 g", "1000 kg")]
Extent = Annotated[float, Quantity(units.LENGTH, "1 mm", "100 m")]
SpeedLimit = Annotated[float, Quantity(units.SPEED, "0.1 m/s", "1000 m/s")]


class QuadrotorRobot(RobotSettings):
    """A quadrotor of four rotors in a cross that stands between its axes, and where it is at tick 0 (its middle).

    `arm` is from the middle to a rotor; `thrust_factor` (N s2) and `drag_factor` (N m s2) are those of each rotor,
    whose speed is at most `rotor_speed`. Defaults are of an airframe of 1.5 kg that hovers at half of its greatest
    thrust. `speed_limit` is how fast any part of it usually is.
    """

    at: At = Field(default_factory=lambda: At.model_validate({}))
    mass: Mass = default("1.5 kg")
    arm: Extent = default("25 cm")
    height: Extent = default("10 cm")
    rotor_radius: Extent = default("12 cm")
    rotor_speed: RotorSpeed = default("900 rad/s")
    thrust_factor: Annotated[float, Field(ge=1e-9, le=1)] = 9.0e-6
    drag_factor: Annotated[float, Field(ge=0, le=1)] = 1.5e-7
    surface: Name = DEFAULT
    speed_limit: SpeedLimit = default("30 m/s")

    @property
    def felt_surfaces(self) -> Mapping[Location, str]:
        """The surface of all its shapes."""
        return {("surface",): self.surface}

    @property
    def side(self) -> float:
        """The length of the middle, a square seen from above (m)."""
        return 0.6 * self.arm

    @property
    def moments(self) -> tuple[float, float, float]:
        """The principal moments of inertia (kg m2), about x, y and z.

        The mass is half in the middle, a solid box, and half in the four rotors, which count as points: I_x = I_y =
        m_c (b^2 + h^2) / 12 + m_r a^2 / 2, I_z = m_c 2 b^2 / 12 + m_r a^2, with b the middle's side and a the arm.
        """
        side, height = self.side, self.height
        core = rotors = self.mass / 2.0
        arm = self.arm * self.arm
        level = core * (side * side + height * height) / 12.0 + rotors * arm / 2.0
        return level, level, core * side * side / 6.0 + rotors * arm

    def rotor_places(self) -> tuple[tuple[float, float, float], ...]:
        """Return x and y of each rotor (m) and its sense (1: counter-clockwise from above): front left, rear left, rear
        right, front right."""
        side = self.arm / sqrt(2.0)
        return (side, side, -1.0), (-side, side, 1.0), (-side, -side, -1.0), (side, -side, 1.0)

"""Wind: the velocity of the air around rigid bodies. It does not act on bodies that move by kinematics.

The engine `mujoco` computes its force on a body by MuJoCo's inertia box model of a passive medium (MuJoCo's
documentation, Computation, section "Fluid forces"): the force along each axis of the box that has the body's mass and
moments of inertia is -density / 2 x A |v| v - 3 pi x viscosity x D v, with v of the body relative to the air, A the
box's area across that axis and D the mean of its sides; likewise it damps how the body turns. No body
shelters another one. The speed of the air is in the frame, so it can be set during a run.
"""

from __future__ import annotations

from typing import Annotated, Final, NamedTuple

from foosim.common import units
from foosim.common.spec_base import default
from foosim.common.units import Quantity
from foosim.world.components.base import Rule
from foosim.world.components.entities import RuleMounting
from foosim.world.components.view import WritableView
from foosim.world.forms.registry import rule
from foosim.world.forms.settings import RuleSettings
from foosim.world.layout import WORLD, Layout
from foosim.world.spec import WorldSpec

AIR_SPEED: Final = Quantity(units.SPEED, "-100 m/s", "100 m/s")
AXES: Final = ("x", "y", "z")
AirSpeed = Annotated[float, AIR_SPEED]
Density = Annotated[float, Quantity(units.DENSITY, "0 kg/m3", "2000 kg/m3")]
Viscosity = Annotated[float, Quantity(units.VISCOSITY, "0 Pa s", "10 Pa s")]


class WindSettings(RuleSettings):
    """The velocity of the air in the world's frame, its density and its dynamic viscosity, by default those of air.

    These are the values that MuJoCo's documentation names for air. `x`, `y` and `z` can be set during a run.
    """

    x: AirSpeed = default("0 m/s")
    y: AirSpeed = default("0 m/s")
    z: AirSpeed = default("0 m/s")
    density: Density = default("1.2 kg/m3")
    viscosity: Viscosity = default("0.00002 Pa s")


class Air(NamedTuple):
    """What the rigid bodies of a world are in: density (kg/m3), viscosity (Pa s), where a frame has its velocity."""

    density: float
    viscosity: float
    velocity: tuple[int, ...]


def air_of(spec: WorldSpec, layout: Layout) -> Air | None:
    """Return the air of a world with wind."""
    for label, settings in spec.world_rules.items():
        if isinstance(settings, WindSettings):
            offsets = layout[WORLD].offsets
            return Air(settings.density, settings.viscosity, tuple(offsets[f"{label}.{axis}"] for axis in AXES))
    return None


@rule("wind", WindSettings, slots=dict.fromkeys(AXES, 1), settable=dict.fromkeys(AXES, AIR_SPEED))
class Wind(Rule):
    """The velocity of the air (m/s), the same everywhere."""

    def __init__(self, settings: WindSettings, at: RuleMounting) -> None:
        self._start = {axis: getattr(settings, axis) for axis in AXES}
        self._at = at

    def place(self, view: WritableView) -> None:
        """Set it to its value at tick 0."""
        for axis, speed in self._start.items():
            view.write(self._at.slot(axis), speed)

    def apply(self, view: WritableView) -> None:
        """It stays as it is."""

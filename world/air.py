"""The air that rigid bodies are in: its density and viscosity, and the place of its velocity in the frame."""

from __future__ import annotations

from typing import Annotated, Final, NamedTuple

from foosim.common import units
from foosim.common.spec_base import default
from foosim.common.units import Quantity
from foosim.world.component_types.settings import RuleSettings
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

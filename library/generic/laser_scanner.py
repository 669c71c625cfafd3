"""A laser scanner: the distances to the first thing on each beam in a plane."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi
from typing import Annotated, Final

from msgspec import Meta, Struct
from pydantic import Field

from foosim.common import units
from foosim.common.exact_math import cos, sin
from foosim.common.spec_base import default
from foosim.common.units import Quantity
from foosim.world.component_types.quantities import Metres
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.beams import Beams, BeamSensor
from foosim.world.components.view import Mounting
from foosim.world.placing import FIRST_LINK, MountedAt
from foosim.world.scene import Vector

RAYS_MAX: Final = 1081
"""Those of a scanner that sees 270 degrees in steps of a quarter of one."""
FULL_TURN: Final = 2.0 * pi * (1.0 - 1e-9)
Angle = Annotated[float, Quantity(units.ANGLE, "0 deg", "360 deg")]
Least = Annotated[float, Quantity(units.LENGTH, "0 m", "100 m")]
Range = Annotated[float, Quantity(units.LENGTH, "1 cm", "1 km")]


class LaserScannerSettings(SensorSettings):
    """The distance from `at` to the first thing on each of `rays` beams, from `least` to `range`.

    They are in the plane of x and y of the mount, over `angle` in equal steps: the first is farthest to the right of x,
    the last farthest to the left. Of a full turn the first is behind, and none is there twice; a single one is ahead.
    """

    rays: Annotated[int, Field(ge=1, le=RAYS_MAX)]
    range: Range
    angle: Angle = default("270 deg")
    least: Least = default("0 m")
    at: MountedAt = FIRST_LINK

    @property
    def bearings(self) -> tuple[float, float]:
        """Those of the first and the last beam (rad), from x towards y of the mount."""
        if self.rays == 1:
            return 0.0, 0.0
        first = -self.angle / 2.0
        return first, first + (self.rays - 1) * step_of(self.rays, self.angle)


class Scan(Struct, frozen=True):
    """A distance for each beam, from right to left; the sensor's range where nothing is met."""

    distances: Annotated[tuple[Metres, ...], Meta(min_length=1, max_length=RAYS_MAX)]


@sensor("laser_scanner", LaserScannerSettings, Scan, array_length="rays", shown_as="foxglove.LaserScan")
class LaserScanner(BeamSensor):
    """The distance to the first thing on each beam other than the robot's own body; the range for none."""

    def __init__(self, settings: LaserScannerSettings, at: Mounting) -> None:
        self.least_m, self.range_m = settings.least, settings.range
        self.beams = Beams(at, settings.at, list(directions(settings.rays, settings.angle)), settings.range)

    def reading(self, distances: list[float]) -> Scan:
        return Scan(tuple(distances))


def step_of(rays: int, angle: float) -> float:
    """Return the angle (rad) between two neighbours of `rays` beams over an angle (rad)."""
    return angle / rays if angle >= FULL_TURN else angle / max(rays - 1, 1)


def directions(rays: int, angle: float) -> Iterator[Vector]:
    """Yield unit vectors in the plane of x and y, over an angle (rad) about x, from right to left."""
    step = step_of(rays, angle)
    for ray in range(rays):
        turned = ray * step - angle / 2.0 if rays > 1 else 0.0
        yield cos(turned), sin(turned), 0.0

"""Distances around a robot along rays, measured from its own hull.

The hull is the first shape of the robot's first link. Rays begin at its middle, in the plane of x and y of the link,
and pass the robot's own body. A distance counts from where a ray leaves the last shape of that link.
"""

from __future__ import annotations

from math import pi
from typing import Annotated, Final

from msgspec import Meta, Struct
from pydantic import Field

from foosim.common import units
from foosim.common.exact_math import cos, sin
from foosim.common.units import Quantity
from foosim.world.component_types.quantities import Metres
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.beams import Beams, BeamSensor, hull_middle, mounted_at, way_out
from foosim.world.components.mounted import body_at
from foosim.world.components.view import Mounting

Range = Annotated[float, Quantity(units.LENGTH, "1 cm", "100 m")]
RAYS_MAX: Final = 128


class ProximitySettings(SensorSettings):
    """The distance from a robot's hull to the first thing on each of `rays` rays, at most `range`.

    The first ray is ahead, the others evenly around to the left, at half of the hull's height.
    """

    rays: Annotated[int, Field(ge=1, le=RAYS_MAX)]
    range: Range


class Ranges(Struct, frozen=True):
    """The free space around a robot: a distance from its hull for each ray, the first ahead, then to the left."""

    ways: Annotated[tuple[Metres, ...], Meta(min_length=1, max_length=RAYS_MAX)]


@sensor("proximity", ProximitySettings, Ranges, array_length="rays")
class Proximity(BeamSensor):
    """The free way from the hull along each ray; the sensor's range where nothing is hit."""

    field = "ways"

    def __init__(self, settings: ProximitySettings, at: Mounting) -> None:
        link = body_at(at).links[0]
        middle = hull_middle(link)
        turns = [2.0 * pi * ray / settings.rays for ray in range(settings.rays)]
        directions = [(cos(turn), sin(turn), 0.0) for turn in turns]
        self.hull_m = [way_out(link, middle, direction) for direction in directions]
        self.range_m = settings.range
        self.beams = Beams(at, mounted_at(middle), directions, settings.range + max(self.hull_m))

    def reading(self, distances: list[float]) -> Ranges:
        return Ranges(tuple(distances))

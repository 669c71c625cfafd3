"""Distances around a robot along rays, measured from its own hull.

The hull is the first shape of the robot's first link. Rays begin at its middle, in the plane of x and y of the link,
and pass the robot's own body. A distance counts from where a ray leaves the last shape of that link.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import Annotated, Final

import numpy as np
from msgspec import Meta, Struct
from pydantic import Field

from foosim.common import units
from foosim.common.exact_math import cos, sin
from foosim.common.units import Quantity
from foosim.world.component_types.quantities import Metres
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.base import Sensor
from foosim.world.components.beams import Beams, BeamsTogether, body_of, hull_middle, mounted_at, way_out
from foosim.world.components.rows import Rows
from foosim.world.components.view import Mounting, View
from foosim.world.rays.boxes import Floats

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
class Proximity(Sensor):
    """The free way from the hull along each ray; the sensor's range where nothing is hit."""

    def __init__(self, settings: ProximitySettings, at: Mounting) -> None:
        link = body_of(at).links[0]
        middle = hull_middle(link)
        turns = [2.0 * pi * ray / settings.rays for ray in range(settings.rays)]
        directions = [(cos(turn), sin(turn), 0.0) for turn in turns]
        self.hull_m = [way_out(link, middle, direction) for direction in directions]
        """How far it is from the middle to the hull, along each ray."""
        self.range_m = settings.range
        self.beams = Beams(at, mounted_at(middle), directions, settings.range + max(self.hull_m))

    def limits(self) -> dict[str, tuple[float, float]]:
        """Return the least and the greatest way (m); a ray that meets nothing has the greatest."""
        return {"ways": (0.0, self.range_m)}

    def sample(self, view: View) -> Ranges:
        return Ranges(tuple(ProximityBatch([self]).sample(view)[0].tolist()))

    @staticmethod
    def together(sensors: Sequence[Proximity]) -> ProximityBatch:
        """Return these as one; all have as many rays."""
        return ProximityBatch(sensors)

    @staticmethod
    def rays(sensors: Sequence[Proximity], numbers: Sequence[float]) -> Floats:
        """Return both ends of each ray: from a robot's hull to the first thing, or as far as the sensor reaches.

        All have as many rays.
        """
        hulls = np.array([one.hull_m for one in sensors])
        farthest = hulls + np.array([[one.range_m] for one in sensors])
        return BeamsTogether([one.beams for one in sensors]).ends(numbers, hulls, farthest)


class ProximityBatch(Rows):
    """Several of them, with as many rays."""

    def __init__(self, sensors: Sequence[Proximity]) -> None:
        self._beams = BeamsTogether([one.beams for one in sensors])
        self._hulls = np.array([one.hull_m for one in sensors])
        self._ranges = np.array([[one.range_m] for one in sensors])

    def sample(self, view: View) -> Floats:
        """Return the free ways (m), of shape (sensors, rays)."""
        found: Floats = np.minimum(np.maximum(self._beams.distances(view) - self._hulls, 0.0), self._ranges)
        return found

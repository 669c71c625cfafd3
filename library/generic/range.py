"""A range finder, as of ultrasound or infrared: the distance to the nearest thing in a cone."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import pi
from typing import Annotated, Final

import numpy as np
from msgspec import Struct

from foosim.common import units
from foosim.common.exact_math import cos, sin
from foosim.common.spec_base import default
from foosim.common.units import Quantity
from foosim.world.component_types.quantities import Metres
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings
from foosim.world.components.beams import Beams, BeamSensor, BeamsTogether
from foosim.world.components.view import Mounting, View
from foosim.world.placing import FIRST_LINK, MountedAt
from foosim.world.rays.boxes import Floats
from foosim.world.scene import Vector

CIRCLES: Final = ((0.5, 4), (1.0, 8))
"""Shares of half of the cone's angle, and the beams at that angle from its axis."""
Cone = Annotated[float, Quantity(units.ANGLE, "0 deg", "120 deg")]
Least = Annotated[float, Quantity(units.LENGTH, "0 m", "100 m")]
Range = Annotated[float, Quantity(units.LENGTH, "1 cm", "1 km")]


class RangeSettings(SensorSettings):
    """The distance from `at`, along the x axis of the mount, to the nearest thing, from `least` to `range`.

    With a `cone`, whose angle is that from side to side, it is the nearest that 13 beams meet: one along the axis, four
    half-way to the cone's surface and eight on it. Without one it is a single beam.
    """

    range: Range
    least: Least = default("0 m")
    cone: Cone = default("0 deg")
    at: MountedAt = FIRST_LINK


class Distance(Struct, frozen=True):
    """A distance; the sensor's range where nothing is met."""

    distance: Metres


@sensor("range", RangeSettings, Distance)
class RangeFinder(BeamSensor):
    """The distance to the nearest that one beam, or a cone of 13, meets, the robot's own body aside."""

    field = "distance"

    def __init__(self, settings: RangeSettings, at: Mounting) -> None:
        self.least_m, self.range_m = settings.least, settings.range
        self.beams = Beams(at, settings.at, list(directions(settings.cone)), settings.range)

    def reading(self, distances: list[float]) -> Distance:
        return Distance(*distances)

    @staticmethod
    def together(sensors: Sequence[RangeFinder]) -> RangeFinders:
        """Return these as one."""
        return RangeFinders(sensors)


class RangeFinders:
    """Several of them: those with a cone are computed together, and those with a single beam."""

    def __init__(self, sensors: Sequence[RangeFinder]) -> None:
        self._sensors = tuple(sensors)
        counts = [len(one.beams.directions) for one in sensors]
        places = [[place for place, its in enumerate(counts) if its == count] for count in sorted(set(counts))]
        self._groups = [(chosen, BeamsTogether([sensors[place].beams for place in chosen])) for chosen in places]
        self._least = np.array([[one.least_m] for one in sensors])
        self._ranges = np.array([[one.range_m] for one in sensors])

    def sample(self, view: View) -> Floats:
        """Return the distances (m), of shape (sensors, 1)."""
        nearest = np.empty((len(self._sensors), 1))
        for chosen, beams in self._groups:
            nearest[chosen, 0] = beams.distances(view).min(axis=1)
        found: Floats = np.minimum(np.maximum(nearest, self._least), self._ranges)
        return found


def directions(cone: float, circles: Sequence[tuple[float, int]] = CIRCLES) -> Iterator[Vector]:
    """Yield unit vectors: the x axis, and those of a cone about it of this angle (rad) from side to side.

    `circles` are shares of half of the angle, and the number of directions at that angle from the axis.
    """
    yield 1.0, 0.0, 0.0
    for share, beams in circles if cone > 0.0 else ():
        aside, along = sin(share * cone / 2.0), cos(share * cone / 2.0)
        for beam in range(beams):
            around = 2.0 * pi * beam / beams
            yield along, aside * cos(around), aside * sin(around)

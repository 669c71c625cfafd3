"""What is near a rover: rays from its middle against all obstacles and the other rovers, measured from its hull.

All rays of the rovers that sample at a tick are one batch of element-wise numpy: a sample has the same bits wherever it
is computed, and beside whichever others.
A ray enters a rectangle where it has crossed both pairs of its sides (slabs: Kay and Kajiya, "Ray Tracing Complex
Scenes", SIGGRAPH 1986), a circle at the smaller root of its quadratic equation.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, pi, sin
from typing import Annotated, Final, TypeAlias

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray
from pydantic import Field

from foosim.common import units
from foosim.common.units import Quantity
from foosim.world.clearance.footprints import Circle, Rectangle
from foosim.world.clearance.hall_obstacles import obstacles_of
from foosim.world.components.view import Mounting, View
from foosim.world.forms.quantities import Metres
from foosim.world.forms.registry import sensor
from foosim.world.forms.settings import SensorSettings
from foosim.world.parameters.hall import hall_of

Numbers: TypeAlias = NDArray[np.float64]
Range = Annotated[float, Quantity(units.LENGTH, "1 cm", "100 m")]
RAYS_MAX: Final = 128
TINY: Final = 1e-300
"""Replaces 0 in a ray's direction, so that a quotient is never 0 / 0."""


class ProximitySettings(SensorSettings):
    """How far it is from a rover's hull to what stands in the way of each of `rays` rays, at most `range`.

    The first ray is ahead, the others evenly around to the left.
    """

    rays: Annotated[int, Field(ge=1, le=RAYS_MAX)]
    range: Range


class Ranges(Struct, frozen=True):
    """The free space around a rover: a distance from its hull for each ray, the first ahead, then to the left."""

    ways: Annotated[tuple[Metres, ...], Meta(min_length=1, max_length=RAYS_MAX)]


@sensor("proximity", ProximitySettings, Ranges, needs=("position", "heading"), kit="hall", several="rays")
class Proximity:
    """The free way from the hull along each ray; the sensor's range where nothing is hit."""

    def __init__(self, settings: ProximitySettings, at: Mounting) -> None:
        rover = hall_of(at.spec).rover
        self._height_m = rover.height / 2
        obstacles = obstacles_of(at.spec)
        self._position = at.robot.offsets["position"]
        self._heading = at.robot.offsets["heading"]
        rovers = at.layout.of("rover")
        self._rovers = [rover.offsets["position"] for rover in rovers]
        self._own = next((place for place, rover in enumerate(rovers) if rover.name == at.robot.name), None)
        """Which of the rovers it is itself on: that is nowhere in its way."""
        self.radius_m, self.range_m = rover.radius, settings.range
        angles = [2.0 * pi * ray / settings.rays for ray in range(settings.rays)]
        self._cos = np.array([[cos(angle)] for angle in angles])
        self._sin = np.array([[sin(angle)] for angle in angles])
        self._rays = settings.rays
        self._rectangles = np.array(
            [(r.x, r.y, r.along_x, r.along_y, r.half_along, r.half_across) for r in obstacles if type(r) is Rectangle]
        ).T.copy()
        self._circles = np.array([(c.x, c.y, c.radius) for c in obstacles if type(c) is Circle]).reshape(-1, 3).T.copy()

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
    def rays(sensors: Sequence[Proximity], numbers: Sequence[float]) -> Numbers:
        """Return both ends of each ray: from a rover's hull to what it meets, or as far as the sensor reaches.

        All have as many rays.
        """
        ways, found = ways_of(sensors, numbers), []
        turns = 2.0 * np.pi * np.arange(sensors[0]._rays) / sensors[0]._rays
        for row, one in enumerate(sensors):
            x, y, z = numbers[one._position : one._position + 3]
            angles, radius = numbers[one._heading] + turns, one.radius_m
            ends = np.clip(ways[row], radius, radius + one.range_m)
            east, north, height = np.cos(angles), np.sin(angles), np.full(len(turns), z + one._height_m)
            lines = [x + radius * east, y + radius * north, height, x + ends * east, y + ends * north, height]
            found.append(np.stack(lines, axis=1))
        return np.concatenate(found)


class ProximityBatch:
    """Several of them, with as many rays."""

    def __init__(self, sensors: Sequence[Proximity]) -> None:
        self._sensors = sensors
        self._radii = np.array([[one.radius_m] for one in sensors])
        self._ranges = np.array([[one.range_m] for one in sensors])

    def sample(self, view: View) -> Numbers:
        """Return the free ways (m), of shape (sensors, rays)."""
        ways = ways_of(self._sensors, view.numbers)
        free: Numbers = np.minimum(np.maximum(ways - self._radii, 0.0), self._ranges)
        return free


def ways_of(sensors: Sequence[Proximity], numbers: Sequence[float]) -> Numbers:
    """Return how far it is from each rover's middle to what each of its rays hits first (m): shape (sensors, rays).

    What is out of a sensor's range may be missing: inf where nothing else is hit. All have as many rays.
    """
    first = sensors[0]
    at = [one._position for one in sensors]
    x, y = (np.array([numbers[place + axis] for place in at]).reshape(-1, 1, 1) for axis in (0, 1))
    headings = [numbers[one._heading] for one in sensors]
    c, s = (np.array([turn(heading) for heading in headings]).reshape(-1, 1, 1) for turn in (cos, sin))
    dx, dy = c * first._cos - s * first._sin, s * first._cos + c * first._sin
    ways: Numbers = np.minimum.reduce(_to_rectangles(x, y, dx, dy, first._rectangles), axis=2)  # four walls at least
    rovers = np.array([numbers[place : place + 2] for place in first._rovers]).reshape(-1, 2).T
    middles_x = np.concatenate((first._circles[0], rovers[0])) - x
    middles_y = np.concatenate((first._circles[1], rovers[1])) - y
    radii = np.concatenate((first._circles[2], np.full(rovers.shape[1], first.radius_m)))
    reach = np.array([one.range_m for one in sensors]).reshape(-1, 1, 1) + first.radius_m + radii
    near = (np.abs(middles_x) <= reach) & (np.abs(middles_y) <= reach)
    for row, one in enumerate(sensors):
        if one._own is not None:
            near[row, 0, len(first._circles[0]) + one._own] = False
    met = np.flatnonzero(near.any(axis=(0, 1)))
    if len(met):
        to_circles = _to_circles(dx, dy, middles_x[:, :, met], middles_y[:, :, met], radii[met])
        ways = np.minimum(ways, np.minimum.reduce(np.where(near[:, :, met], to_circles, np.inf), axis=2))
    return ways


def _to_rectangles(x: Numbers, y: Numbers, dx: Numbers, dy: Numbers, rectangles: Numbers) -> Numbers:
    """Return the way of each sensor's rays to each rectangle, shape (sensors, rays, rectangles); inf where one misses.

    `x` and `y` have the shape (sensors, 1, 1), `dx` and `dy` (sensors, rays, 1).
    """
    middle_x, middle_y, along_x, along_y, half_along, half_across = rectangles
    east, north = x - middle_x, y - middle_y
    along, across = east * along_x + north * along_y, north * along_x - east * along_y
    to_along, to_across = dx * along_x + dy * along_y, dy * along_x - dx * along_y
    to_along, to_across = np.where(to_along == 0.0, TINY, to_along), np.where(to_across == 0.0, TINY, to_across)
    with np.errstate(over="ignore"):
        low_along, high_along = (-half_along - along) / to_along, (half_along - along) / to_along
        low_across, high_across = (-half_across - across) / to_across, (half_across - across) / to_across
    enters = np.maximum(np.minimum(low_along, high_along), np.minimum(low_across, high_across))
    leaves = np.minimum(np.maximum(low_along, high_along), np.maximum(low_across, high_across))
    return np.where((leaves >= enters) & (leaves >= 0.0), np.maximum(enters, 0.0), np.inf)


def _to_circles(dx: Numbers, dy: Numbers, middle_x: Numbers, middle_y: Numbers, radii: Numbers) -> Numbers:
    """Return the way of each sensor's rays to each circle, shape (sensors, rays, circles); inf where one misses.

    Middles are relative to the rays' start, of shape (sensors, 1, circles).
    """
    along = dx * middle_x + dy * middle_y
    across = dx * middle_y - dy * middle_x
    inside = radii * radii - across * across
    ways = along - np.sqrt(np.maximum(inside, 0.0))
    return np.where((inside >= 0.0) & (along >= 0.0), np.maximum(ways, 0.0), np.inf)

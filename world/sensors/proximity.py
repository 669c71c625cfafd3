"""What is near a rover: rays from its middle against all obstacles and the other rovers, measured from its hull.

All rays of the rovers that sample at a tick are one batch of element-wise numpy: a sample has the same bits wherever it
is computed, and beside whichever others.
A ray enters a rectangle where it has crossed both pairs of its sides (slabs: Kay and Kajiya, "Ray Tracing Complex
Scenes", SIGGRAPH 1986), a circle at the smaller root of its quadratic equation.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, pi, sin
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foosim.common.keyed_random import draw_words, gaussian
from foosim.world.robots.rover import ProximitySensor
from foosim.world.scenes.obstacles import Circle, Rectangle, obstacles_of
from foosim.world.sensors.fitting import Fitting

Numbers: TypeAlias = NDArray[np.float64]
TINY: Final = 1e-300
"""Replaces 0 in a ray's direction, so that a quotient is never 0 / 0."""
WORDS: Final = 8
"""Words of one draw."""


class Proximity:
    """Payload: a little-endian float64 a ray, in m: the free way from the hull, `range` where nothing is hit."""

    def __init__(self, settings: ProximitySensor, at: Fitting) -> None:
        rover = at.spec.hall.rover
        obstacles = obstacles_of(at.spec)
        self._position = at.robot.offsets["position"]
        self._heading = at.robot.offsets["heading"]
        self._rovers = [rover.offsets["position"] for rover in at.layout.rovers]
        self._radius_m, self._range_m, self._noise_m = rover.radius, settings.range, settings.noise
        self._key = at.key
        angles = [2.0 * pi * ray / settings.rays for ray in range(settings.rays)]
        self._cos = np.array([[cos(angle)] for angle in angles])
        self._sin = np.array([[sin(angle)] for angle in angles])
        self._rays = settings.rays
        self._rectangles = np.array(
            [(r.x, r.y, r.along_x, r.along_y, r.half_along, r.half_across) for r in obstacles if type(r) is Rectangle]
        ).T.copy()
        self._circles = np.array([(c.x, c.y, c.radius) for c in obstacles if type(c) is Circle]).reshape(-1, 3).T.copy()

    def sample(self, numbers: Sequence[float], tick: int) -> bytes:
        return self.sample_together([self], numbers, tick)[0]

    @classmethod
    def sample_together(cls, sensors: Sequence[Proximity], numbers: Sequence[float], tick: int) -> list[bytes]:
        """Return the payload of each of these sensors at `tick`: of those with as many rays in one batch."""
        payloads: dict[int, bytes] = {}
        for rays in sorted({sensor._rays for sensor in sensors}):
            alike = [place for place, sensor in enumerate(sensors) if sensor._rays == rays]
            ways = ways_of([sensors[place] for place in alike], numbers)
            payloads |= {place: sensors[place]._payload(ways[row], tick) for row, place in enumerate(alike)}
        return [payloads[place] for place in range(len(sensors))]

    def _payload(self, ways: Numbers, tick: int) -> bytes:
        free = np.minimum(np.maximum(ways - self._radius_m, 0.0), self._range_m)
        hit = free < self._range_m
        if self._noise_m > 0.0 and hit.any():
            noise = np.array(self._noise(tick, len(free)))
            free = np.where(hit, np.minimum(np.maximum(free + noise, 0.0), self._range_m), free)
        return free.tobytes()

    def _noise(self, tick: int, count: int) -> list[float]:
        words = [word for copy in range(-(-count // WORDS)) for word in draw_words(self._key, tick, copy)]
        return [self._noise_m * gaussian(word) for word in words[:count]]


def ways_of(sensors: Sequence[Proximity], numbers: Sequence[float]) -> Numbers:
    """Return how far it is from each rover's middle to what each of its rays hits first (m): shape (sensors, rays).

    What is out of a sensor's range may be missing: inf where nothing else is hit. All have as many rays.
    """
    first = sensors[0]
    at = [sensor._position for sensor in sensors]
    x, y = (np.array([numbers[place + axis] for place in at]).reshape(-1, 1, 1) for axis in (0, 1))
    headings = [numbers[sensor._heading] for sensor in sensors]
    c, s = (np.array([turn(heading) for heading in headings]).reshape(-1, 1, 1) for turn in (cos, sin))
    dx, dy = c * first._cos - s * first._sin, s * first._cos + c * first._sin
    ways: Numbers = np.minimum.reduce(_to_rectangles(x, y, dx, dy, first._rectangles), axis=2)  # four walls at least
    rovers = np.array([numbers[place : place + 2] for place in first._rovers]).reshape(-1, 2).T
    middles_x = np.concatenate((first._circles[0], rovers[0])) - x
    middles_y = np.concatenate((first._circles[1], rovers[1])) - y
    radii = np.concatenate((first._circles[2], np.full(rovers.shape[1], first._radius_m)))
    reach = np.array([sensor._range_m for sensor in sensors]).reshape(-1, 1, 1) + first._radius_m + radii
    near = (np.abs(middles_x) <= reach) & (np.abs(middles_y) <= reach)
    for row, sensor in enumerate(sensors):
        near[row, 0, len(first._circles[0]) + first._rovers.index(sensor._position)] = False
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

"""What is near a rover: rays from its middle against all obstacles and the other rovers, measured from its hull.

All rays of a sample are one batch of element-wise numpy, so that a sample has the same bits wherever it is computed.
A ray enters a rectangle where it has crossed both pairs of its sides (slabs: Kay and Kajiya, "Ray Tracing Complex
Scenes", SIGGRAPH 1986), a circle at the smaller root of its quadratic equation. Neighbours: `protocol.obstacles`.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, pi, sin
from typing import Final

import numpy as np
from numpy.typing import NDArray

from foosim.node.sensors.fitting import Fitting
from foosim.protocol.draws import draw_words, gaussian
from foosim.protocol.obstacles import Circle, Rectangle, obstacles_of
from foosim.protocol.rovers import ProximitySensor

Numbers = NDArray[np.float64]
TINY: Final = 1e-300
"""Stands for 0 in a ray's direction, so that a quotient is never 0 / 0."""
WORDS: Final = 8
"""Words of one draw."""


class Proximity:
    """Payload: a little-endian float64 a ray, in m: the free way from the hull, `range` where nothing is hit."""

    def __init__(self, settings: ProximitySensor, at: Fitting) -> None:
        rover = at.deployment.hall.rover
        obstacles = obstacles_of(at.deployment)
        self._position = at.robot.offsets["position"]
        self._heading = at.robot.offsets["heading"]
        self._others = [e.offsets["position"] for e in at.layout.rovers if e.name != at.robot.name]
        self._radius_m, self._range_m, self._noise_m = rover.radius, settings.range, settings.noise
        self._key = at.key
        angles = [2.0 * pi * ray / settings.rays for ray in range(settings.rays)]
        self._cos = np.array([[cos(angle)] for angle in angles])
        self._sin = np.array([[sin(angle)] for angle in angles])
        self._rectangles = np.array(
            [(r.x, r.y, r.along_x, r.along_y, r.half_along, r.half_across) for r in obstacles if type(r) is Rectangle]
        ).T.copy()
        self._circles = np.array([(c.x, c.y, c.radius) for c in obstacles if type(c) is Circle]).reshape(-1, 3).T.copy()

    def sample(self, numbers: Sequence[float], tick: int) -> bytes:
        ways = self.ways(numbers)
        free = np.minimum(np.maximum(ways - self._radius_m, 0.0), self._range_m)
        hit = free < self._range_m
        if self._noise_m > 0.0 and hit.any():
            noise = np.array(self._noise(tick, len(free)))
            free = np.where(hit, np.minimum(np.maximum(free + noise, 0.0), self._range_m), free)
        return free.tobytes()

    def _noise(self, tick: int, count: int) -> list[float]:
        words = [word for copy in range(-(-count // WORDS)) for word in draw_words(self._key, tick, copy)]
        return [self._noise_m * gaussian(word) for word in words[:count]]

    def ways(self, numbers: Sequence[float]) -> Numbers:
        """Return how far it is from the rover's middle to what each ray hits first (m); inf where it hits nothing."""
        x, y, heading = numbers[self._position], numbers[self._position + 1], numbers[self._heading]
        c, s = cos(heading), sin(heading)
        dx, dy = c * self._cos - s * self._sin, s * self._cos + c * self._sin
        others = np.array([numbers[at : at + 2] for at in self._others]).reshape(-1, 2).T
        middles_x = np.concatenate((self._circles[0], others[0])) - x
        middles_y = np.concatenate((self._circles[1], others[1])) - y
        radii = np.concatenate((self._circles[2], np.full(others.shape[1], self._radius_m)))
        reach = self._range_m + self._radius_m + radii
        near = (np.abs(middles_x) <= reach) & (np.abs(middles_y) <= reach)
        to_rectangles = _to_rectangles(x, y, dx, dy, self._rectangles)
        ways: Numbers = np.minimum.reduce(to_rectangles, axis=1)  # there are four walls at least
        if near.any():
            to_circles = _to_circles(dx, dy, middles_x[near], middles_y[near], radii[near])
            ways = np.minimum(ways, np.minimum.reduce(to_circles, axis=1))
        return ways


def _to_rectangles(x: float, y: float, dx: Numbers, dy: Numbers, rectangles: Numbers) -> Numbers:
    """Return the way of each ray (rows) to each rectangle (columns); inf where it misses it."""
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
    """Return the way of each ray (rows) to each circle (columns, relative to the rays' start); inf where it misses."""
    along = dx * middle_x + dy * middle_y
    across = dx * middle_y - dy * middle_x
    inside = radii * radii - across * across
    ways = along - np.sqrt(np.maximum(inside, 0.0))
    return np.where((inside >= 0.0) & (along >= 0.0), np.maximum(ways, 0.0), np.inf)

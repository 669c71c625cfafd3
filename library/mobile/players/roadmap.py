"""Where a rover may drive, by the deployment's hall and scenery: spots on a grid and straight ways between them."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection
from functools import lru_cache
from math import ceil, hypot
from typing import Final

from foosim.deployment.schema import Deployment
from foosim.library.mobile.hall_obstacles import obstacles_of
from foosim.library.mobile.hall_settings import hall_of
from foosim.world.rays.outlines import Outline

MARGIN_M: Final = 0.2
"""What stays free between a rover and everything along its way."""
STEP_M: Final = 0.15
"""How far apart a way is looked at."""


class Roadmap:
    """Spots (x, y in m), by their number, and the spots that a straight, free way of one cell leads to from each."""

    def __init__(self, spots: tuple[tuple[float, float], ...], neighbours: tuple[tuple[int, ...], ...]) -> None:
        self.spots: Final = spots
        self.neighbours: Final = neighbours

    def nearest(self, x: float, y: float) -> int:
        """Return the spot that is nearest to a place."""
        return min(range(len(self.spots)), key=lambda spot: self.distance(spot, x, y))

    def distance(self, spot: int, x: float, y: float) -> float:
        """Return how far it is from a place to a spot, in m."""
        there_x, there_y = self.spots[spot]
        return hypot(there_x - x, there_y - y)

    def around(self, x: float, y: float, radius: float) -> frozenset[int]:
        """Return the spots within a radius of a place."""
        return frozenset(spot for spot in range(len(self.spots)) if self.distance(spot, x, y) <= radius)

    def step_towards(self, start: int, goals: Collection[int], avoided: Collection[int]) -> int | None:
        """Return the next spot on a shortest way to one of the goals, round those to avoid; None without a way."""
        first: dict[int, int] = {start: start}
        waiting = deque([start])
        while waiting:
            spot = waiting.popleft()
            if spot in goals:
                return first[spot]
            for other in self.neighbours[spot]:
                if other not in first and other not in avoided:
                    first[other] = other if spot == start else first[spot]
                    waiting.append(other)
        return None


def roadmap_of(deployment: Deployment, cell_m: float) -> Roadmap:
    """Return the roadmap of a deployment's hall with spots `cell_m` apart."""
    hall = hall_of(deployment)
    return _roadmap(obstacles_of(deployment), hall.length, hall.width, hall.rover.radius + MARGIN_M, cell_m)


@lru_cache(maxsize=4)
def _roadmap(obstacles: tuple[Outline, ...], length: float, width: float, room: float, cell: float) -> Roadmap:
    def is_free(x: float, y: float) -> bool:
        return all(obstacle.is_clear(x, y, room) for obstacle in obstacles)

    columns, rows = int(length / cell), int(width / cell)
    places = {
        (column, row): ((column - (columns - 1) / 2) * cell, (row - (rows - 1) / 2) * cell)
        for row in range(rows)
        for column in range(columns)
    }
    free = [place for place, (x, y) in places.items() if is_free(x, y)]
    numbers = {place: number for number, place in enumerate(free)}
    steps = ceil(cell / STEP_M)
    ways: list[list[int]] = [[] for _ in free]
    for (column, row), number in numbers.items():
        for other in ((column + 1, row), (column, row + 1)):
            if other not in numbers:
                continue
            (x, y), (to_x, to_y) = places[column, row], places[other]
            shares = [step / steps for step in range(1, steps)]
            if all(is_free(x + (to_x - x) * share, y + (to_y - y) * share) for share in shares):
                ways[number].append(numbers[other])
                ways[numbers[other]].append(number)
    return Roadmap(tuple(places[place] for place in free), tuple(tuple(sorted(way)) for way in ways))

"""The fires of a world, as components see them: the place and the radius of each burning one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from foosim.world.components.surroundings import Surroundings
from foosim.world.layout import Layout
from foosim.world.spec import WorldSpec

FIRE: Final = "fire"
"""The tag of fires. A fire of another package needs it, too, and the fields `position` and `radius`."""


class Fires:
    """The fires of one layout."""

    def __init__(self, spec: WorldSpec, layout: Layout) -> None:
        self._fires = [
            (entity.offsets["position"], entity.offsets["radius"])
            for entity in Surroundings(spec, layout).tagged(FIRE)
            if "position" in entity.offsets and "radius" in entity.offsets
        ]

    def near(self, place: Sequence[float], start: Sequence[float]) -> Iterator[tuple[float, float]]:
        """Yield of each fire that burns its radius (m) and the square of its distance from a place (m2), in name order.

        `start` are the numbers at the start of the tick. A fire that is out, or absent, has a radius of 0.
        """
        x, y, z = place
        for at, radius_at in self._fires:
            radius = start[radius_at]
            if radius > 0.0:
                dx, dy, dz = start[at] - x, start[at + 1] - y, start[at + 2] - z
                yield radius, dx * dx + dy * dy + dz * dz

"""Floors: wide upright boxes of scenery. To bodies above one, away from its edges, it is a plane: contacts with planes
cost a tenth of a solve less. A body below it at the start of a tick, or near its edges, meets the box."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final, TypeAlias

from foosim.world.assembly.volumes import radius_of
from foosim.world.layout import Entity
from foosim.world.scene import UPRIGHT, Body, Box, Shape, Vector, moved, swept_box

EDGE_M: Final = 1.0
"""The least distance of a body from a floor's edges (m). It is carried until the tick's end if it moves farther."""
THICKNESS_MIN_M: Final = 0.05
SUNK_M: Final = 0.001
"""The tolerance by which the middle of a thin body that lies on a floor may be below its surface (m)."""


@dataclass(frozen=True, slots=True)
class Plane:
    """The half-space below z = 0 in a shape's frame."""


Floor: TypeAlias = tuple[int, float, float, float, float, float]
"""Its place in the scenery, the middle and the half sides of its area for bodies, x and y, and its upper side."""


class Floors:
    """The floors among some scenery, and a test of bodies above them."""

    def __init__(self, scenery: Sequence[Shape], bodies: Iterable[tuple[Entity, Body]]) -> None:
        self._floors = [floor for number, shape in enumerate(scenery) for floor in _floors(number, shape)]
        self._free: dict[int, tuple[int, float]] = {}
        """Of each free body the place of its position in a frame, and its radius."""
        self._fixed: dict[int, tuple[Vector, float]] = {}
        for entity, body in bodies:
            if body.is_free:
                self._free[entity.index] = entity.offsets["position"], radius_of(body)
            else:
                (x, y, _), (to_x, to_y, _) = swept_box(body)
                self._fixed[entity.index] = ((x + to_x) / 2, (y + to_y) / 2, body.position[2]), max(to_x - x, to_y - y)

    def below(self, entities: Sequence[Entity], numbers: Sequence[float]) -> tuple[int, ...]:
        """Return the places in the scenery of the floors that all of these are above."""
        found = []
        for number, middle_x, middle_y, wide, deep, top in self._floors:
            for entity in entities:
                its = self._free.get(entity.index)
                if its is None:
                    (x, y, z), reach = self._fixed[entity.index]
                else:
                    at, reach = its
                    x, y, z = numbers[at : at + 3]
                if not (abs(x - middle_x) + reach < wide and abs(y - middle_y) + reach < deep and z > top - SUNK_M):
                    break
            else:
                found.append(number)
        return tuple(found)


def _floors(number: int, shape: Shape) -> list[Floor]:
    box, (x, y, z) = shape.geometry, shape.position
    if not isinstance(box, Box) or shape.orientation != UPRIGHT:
        return []
    if min(box.half[:2]) <= EDGE_M or box.half[2] < THICKNESS_MIN_M / 2:
        return []
    return [(number, x, y, box.half[0] - EDGE_M, box.half[1] - EDGE_M, z + box.half[2])]


def as_plane(floor: Shape) -> Shape:
    """Return the plane of a floor's upper side."""
    assert isinstance(floor.geometry, Box)
    top = moved(floor.position, (0.0, 0.0, 1.0), floor.geometry.half[2])
    return replace(floor, geometry=Plane(), position=top)  # type: ignore[arg-type]

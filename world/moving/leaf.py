"""Obstacles of a leaf, such as a door's: an upright box with a heading that slides among robots and objects.

A cylinder around a leaf would fill its doorway, so it is compared as a rectangle, seen from above, with its heights.
What moves by kinematics is a cylinder, grown by how far it may come within the tick, so that both never overlap. Rigid
bodies are the footprints of their shapes. All are where they were at the tick's start: so it is the same for all nodes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import sqrt
from typing import Final, NamedTuple

from foosim.world.components.entities import MotionMounting, made_model
from foosim.world.layout import WORLD, Entity
from foosim.world.moving.free_way import placed_shapes
from foosim.world.moving.solids import solid
from foosim.world.moving.upright import is_upright, upright_of
from foosim.world.scene import Body

ROUNDING_M: Final = 1e-9
"""Who is nearer than he was by less than this is as near."""


class Leaf(NamedTuple):
    """A rectangle seen from above (m): its middle, the unit vector along its length, half of its sides; its heights."""

    x: float
    y: float
    along_x: float
    along_y: float
    half_along: float
    half_across: float
    low: float
    high: float

    def gap(self, row: Sequence[float]) -> float:
        """Return how far it is from a row of `solids.Solids`; negative where they overlap, at corners maybe less."""
        x, y, ux, uy, half_u, half_v, radius = row[:7]
        east, north = x - self.x, y - self.y
        cos, sin = ux * self.along_x + uy * self.along_y, uy * self.along_x - ux * self.along_y
        c, s = abs(cos), abs(sin)
        along = abs(east * self.along_x + north * self.along_y) - self.half_along - (half_u * c + half_v * s)
        across = abs(north * self.along_x - east * self.along_y) - self.half_across - (half_u * s + half_v * c)
        if half_u == 0.0 and half_v == 0.0 and along > 0.0 and across > 0.0:
            return sqrt(along * along + across * across) - radius
        over_u = abs(east * ux + north * uy) - half_u - (self.half_along * c + self.half_across * s)
        over_v = abs(north * ux - east * uy) - half_v - (self.half_along * s + self.half_across * c)
        return max(along, across, *((over_u, over_v) if half_u or half_v else ())) - radius


class InTheWay:
    """The robots and objects of a layout, as they may be in the way of leaves."""

    def __init__(self, at: MotionMounting) -> None:
        tick_s = at.spec.tick_ns / 1e9
        self._upright: list[tuple[Entity, float, float, float]] = []
        self._rigid: list[tuple[Entity, Body]] = []
        for entity in at.layout.entities:
            model = None if entity.name == WORLD else made_model(at.spec, at.layout, entity)
            body = None if model is None else model.body()
            if body is None or not body.is_solid or not is_upright(model):
                continue
            if entity.is_rigid:
                self._rigid.append((entity, body))
            elif entity.kind.motion and "position" in entity.offsets:
                its = upright_of(model)
                self._upright.append((entity, its.radius + body.speed_limit * tick_s, its.low, its.high))

    def stops(self, before: Leaf, after: Leaf, start: Sequence[float]) -> bool:
        """Return whether a leaf is blocked on the way to another place: it would overlap something more than before.

        `start` are the numbers at the start of the tick.
        """
        for row in self._rows(start):
            if row[7] < after.high and row[8] > after.low:
                gap = after.gap(row)
                is_beside = row[7] < before.high and row[8] > before.low
                if gap < 0.0 and (not is_beside or gap < before.gap(row) - ROUNDING_M):
                    return True
        return False

    def _rows(self, start: Sequence[float]) -> Iterator[Sequence[float]]:
        """Yield all that is present as rows of `solids.Solids`."""
        for entity, radius, low, high in self._upright:
            if not entity.is_absent(start):
                at = entity.offsets["position"]
                x, y, z = start[at : at + 3]
                yield x, y, 1.0, 0.0, 0.0, 0.0, radius, z + low, z + high
        for entity, body in self._rigid:
            if not entity.is_absent(start):
                for shape in placed_shapes(body, entity, start):
                    yield solid(shape)

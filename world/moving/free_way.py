"""How far upright bodies may go: none enters scenery, a rigid body or another body that moves by kinematics.

A body that moves by kinematics is a vertical cylinder (`moving.upright`), an obstacle is a shape in its band of
heights, seen from above (`solids`). A blocked way is halved. Others that move so are where they were at
the tick's start, and each stays on its own side of the plane half-way between two (a buffered Voronoi cell: Zhou, Wang,
Bandyopadhyay, Schwager, IEEE RA-L 2(2), 2017): an upright plane, or a level one where two are one above the other. So
they never overlap, and the next state of each is a function of the frame alone, on any node.

An overlapping body, into which a rigid body was pushed, may only move so that the overlap shrinks.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foosim.world.components.entities import MotionMounting, made_model
from foosim.world.components.view import Slot, WritableView
from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import WORLD, Entity
from foosim.world.moving.solids import (
    Floats,
    Places,
    Solids,
    Standing,
    distance,
    joined,
    pairs_near,
    scenery_of,
    solid,
    solids,
)
from foosim.world.moving.upright import is_upright, upright_of
from foosim.world.scene import Body, Shape, place, swept_box

Flags: TypeAlias = NDArray[np.bool_]
HALVINGS: Final = 7
"""The shares of a blocked way that are tried: 1, 1/2, 1/4, ... of its length."""
SKIN_M: Final = 0.25
"""The pairs that may meet are looked up anew when a body has moved this far since, in x or y."""
GAP_M: Final = 1e-6
"""Half of the gap between two movers: far above rounding."""
ROUNDING: Final = 1.000001
"""A way is no longer than its speed allows, but for rounding."""


class _Rigid(NamedTuple):
    """A rigid body, a fixed one or a leaf: its place is that of the frame, or fixed; its parts are within a radius."""

    entity: Entity
    body: Body
    middle: tuple[float, float] | None
    radius: float


class FreeWay:
    """The obstacles of one layout, and all its bodies that move by kinematics."""

    def __init__(self, at: MotionMounting) -> None:
        self._tick_s = at.spec.tick_ns / 1e9
        standing: list[tuple[float, ...]] = [solid(shape) for shape in scenery_of(at.spec)]
        self._rigid: list[_Rigid] = []
        movers: list[tuple[Entity, tuple[float, ...]]] = []
        nothing = [0.0] * at.layout.size
        for entity in at.layout.entities:
            if entity.name == WORLD:
                continue
            model = made_model(at.spec, at.layout, entity)
            body: Body | None = model.body()
            if body is None or not body.is_solid:
                continue
            if entity.kind.motion and "position" in entity.offsets and is_upright(model):
                its = upright_of(model)
                movers.append((entity, (its.radius, its.low, its.high, body.speed_limit)))
            elif entity.is_rigid or body.is_free:
                self._rigid.append(_rigid(entity, body))
            else:
                standing += [solid(shape) for shape in placed_shapes(body, entity, nothing)]
        self._rows = {entity.index: row for row, (entity, _) in enumerate(movers)}
        about = np.array([numbers for _, numbers in movers])
        self._radius, self._low, self._high, speed = about.T.copy()
        self._way = speed * self._tick_s * ROUNDING
        self._places = np.array([_position(entity).places for entity, _ in movers])
        self._apart_m = 2.0 * float(np.max(self._radius + self._way)) + 4.0 * GAP_M
        self._standing = Standing(standing, float(np.max(self._radius + self._way)) + SKIN_M)
        self._rigid_radius = np.array([one.radius for one in self._rigid])

    def movers(self, entities: Sequence[Entity], *, is_level: bool = False) -> Movers:
        """Return the cylinders and ways of these bodies, for `near`; with `is_level` they keep their height."""
        rows = np.array([self._rows[entity.index] for entity in entities])
        way, radius = self._way[rows], self._radius[rows]
        assert (way > 0.0).all(), "a moving body has a greatest speed"
        return Movers(rows, radius, self._low[rows], self._high[rows], way, np.ceil(way / radius), is_level)

    def near(self, movers: Movers, view: WritableView) -> Near:
        """Return the obstacles and planes that these may meet within the tick."""
        bodies = view.values[self._places]
        candidates = movers.candidates
        if candidates is None or not candidates.hold(bodies, movers):
            candidates = movers.candidates = self._candidates(movers, bodies)
        places = bodies[movers.rows]
        planes = self._planes(movers, bodies, candidates)
        return Near(places, movers, planes, self._solids(movers, places, candidates, view.numbers))

    def _candidates(self, movers: Movers, bodies: Floats) -> _Candidates:
        """Return the pairs that may meet, as long as no body is farther from here than `SKIN_M`."""
        places = bodies[movers.rows]
        who, other = pairs_near(places, bodies, self._apart_m + 2.0 * SKIN_M)
        is_other = (movers.rows[who] != other).nonzero()[0]
        met, what = self._standing.near(places[:, 0], places[:, 1])
        if movers.is_level:
            found, z = self._standing.solids.at(what), places[met, 2]
            is_as_high = ((found.low < z + movers.high[met]) & (found.high > z + movers.low[met])).nonzero()[0]
            met, what = met[is_as_high], what[is_as_high]
        found = self._standing.solids.at(what)
        return _Candidates(bodies, places[:, 2], who[is_other], other[is_other], met, found)

    def _planes(self, movers: Movers, bodies: Floats, candidates: _Candidates) -> _Planes:
        """Return the planes half-way to other near bodies."""
        who, other = candidates.who, candidates.other
        if not len(who):
            return _NO_PLANES
        own = movers.rows[who]
        here, there = bodies[own], bodies[other]
        dx, dy = there[:, 0] - here[:, 0], there[:, 1] - here[:, 1]
        way = np.sqrt(dx * dx + dy * dy)
        beside = way - (self._radius[own] + self._radius[other])
        over = (there[:, 2] + self._low[other]) - (here[:, 2] + self._high[own])
        under = (here[:, 2] + self._low[own]) - (there[:, 2] + self._high[other])
        above = np.maximum(over, under)
        reach = self._way[own] + self._way[other] + 2.0 * GAP_M
        is_upright = beside >= above
        near = ((beside < reach) & (above < reach) & ((way > 0.0) | ~is_upright)).nonzero()[0]
        if not len(near):
            return _NO_PLANES
        who, own, other, here = who[near], own[near], other[near], here[near]
        is_upright, way = is_upright[near], np.where(way[near] > 0.0, way[near], 1.0)
        nx, ny = np.where(is_upright, dx[near] / way, 0.0), np.where(is_upright, dy[near] / way, 0.0)
        nz = np.where(is_upright, 0.0, np.where(over[near] >= under[near], 1.0, -1.0))
        half = (way + (self._radius[own] - self._radius[other])) / 2.0 - (self._radius[own] + GAP_M)
        room = np.where(is_upright, half, above[near] / 2.0 - GAP_M)
        return _Planes(who, nx, ny, nz, here[:, 0] * nx + here[:, 1] * ny + here[:, 2] * nz + room)

    def _solids(self, movers: Movers, places: Floats, candidates: _Candidates, numbers: Sequence[float]) -> _Met:
        """Return the near obstacles, and which of them the bodies overlap already."""
        who, found = candidates.met, candidates.what
        if self._rigid:
            moved, theirs = self._near_rigid(movers, places, numbers)
            who, found = np.concatenate((who, moved)), joined((found, theirs))
        if not len(who):
            return _NOTHING_MET
        x, y, z = places[who].T
        way, radius = movers.way[who], movers.radius[who] + found.radius
        bottom, top = z + movers.low[who], z + movers.high[who]
        depth = distance(*found.beside(x, y))
        near = ((depth < radius + way) & (found.low < top + way) & (found.high > bottom - way)).nonzero()[0]
        if not len(near):
            return _NOTHING_MET
        who, found, depth, radius = who[near], found.at(near), depth[near], radius[near]
        over = np.minimum(found.high, top[near]) - np.maximum(found.low, bottom[near])
        return _Met(who, found, radius, depth, over, (depth < radius) & (over > 0.0))

    def _near_rigid(self, movers: Movers, places: Floats, numbers: Sequence[float]) -> tuple[Places, Solids]:
        """Return the pairs of bodies and shapes of rigid bodies, as placed now, that may meet."""
        middles = np.array([_middle(one, numbers) for one in self._rigid])
        reach = self._apart_m + float(np.max(self._rigid_radius))
        who, other = pairs_near(places, middles, reach)
        dx, dy = middles[other, 0] - places[who, 0], middles[other, 1] - places[who, 1]
        least = self._rigid_radius[other] + movers.radius[who] + movers.way[who]
        near = np.flatnonzero(dx * dx + dy * dy <= least * least)
        who, other = who[near], other[near]
        rows_of: dict[int, list[tuple[float, ...]]] = {
            number: [
                solid(shape) for shape in placed_shapes(self._rigid[number].body, self._rigid[number].entity, numbers)
            ]
            for number in sorted(set(other.tolist()))
        }
        met = [
            (mover, row) for mover, number in zip(who.tolist(), other.tolist(), strict=True) for row in rows_of[number]
        ]
        return np.array([mover for mover, _ in met], np.int64), solids(row for _, row in met)


class _Candidates(NamedTuple):
    """The pairs that may meet: a choice that changes only the processor time.

    It holds near these places of all bodies, and these heights of the movers. `who` may meet the moving `other`, by
    their rows; `met` may meet the fixed `what`.
    """

    bodies: Floats
    heights: Floats
    who: Places
    other: Places
    met: Places
    what: Solids

    def hold(self, bodies: Floats, movers: Movers) -> bool:
        """Return whether each body is still near the place of the choice."""
        moved = np.abs(bodies[:, 0:2] - self.bodies[:, 0:2])
        if not moved.max() <= SKIN_M:
            return False
        return not movers.is_level or bool((bodies[movers.rows, 2] == self.heights).all())


@dataclass(slots=True)
class Movers:
    """Bodies that one node moves: their rows among all movers, cylinders and greatest ways."""

    rows: Places
    radius: Floats
    low: Floats
    high: Floats
    way: Floats
    """At most in a tick (m)."""
    pieces: Floats
    """The count of pieces in which a way is checked: none is longer than the radius."""
    is_level: bool
    """Whether they keep their heights."""
    candidates: _Candidates | None = None


_NOTHING: Final = np.zeros(0)


class _Planes(NamedTuple):
    """Planes that bound movers: the mover, the plane's unit normal, and the greatest place along it."""

    who: Places
    x: Floats
    y: Floats
    z: Floats
    most: Floats

    def along(self, places: Floats) -> Floats:
        """Return how far these places are along the normals."""
        here = places[self.who]
        found: Floats = here[:, 0] * self.x + here[:, 1] * self.y + here[:, 2] * self.z
        return found


_NO_PLANES: Final = _Planes(np.zeros(0, np.int64), _NOTHING, _NOTHING, _NOTHING, _NOTHING)


class _Met(NamedTuple):
    """Near obstacles: the mover, sum of radii, distance and common height at the start, and whether they overlap."""

    who: Places
    solids: Solids
    radius: Floats
    depth: Floats
    over: Floats
    is_in: Flags


_NOTHING_MET: Final = _Met(np.zeros(0, np.int64), solids([]), _NOTHING, _NOTHING, _NOTHING, np.zeros(0, np.bool_))


class Near:
    """The obstacles that some bodies may meet within one tick, in any direction."""

    def __init__(self, places: Floats, movers: Movers, planes: _Planes, met: _Met) -> None:
        self.places = places
        """Where they are at the start of the tick (m), of shape (n, 3)."""
        self._low, self._high = movers.low, movers.high
        self._pieces, self._planes, self._met = movers.pieces, planes, met

    def is_hit(self, start: Floats, ends: Floats) -> Flags:
        """Return which bodies are blocked at these ends, coming from a start; both are places of shape (n, 3)."""
        hit = np.zeros(len(ends), bool)
        planes, met = self._planes, self._met
        if len(planes.who):
            along = planes.along(ends)
            hit[planes.who[(along > planes.most) & (along > planes.along(start))]] = True
        if len(met.who):
            x, y, z = ends[met.who].T
            bottom, top = z + self._low[met.who], z + self._high[met.who]
            along, across = met.solids.beside(x, y)
            a, b = np.maximum(along, 0.0), np.maximum(across, 0.0)
            is_in = (a * a + b * b < met.radius * met.radius) & (met.solids.low < top) & (met.solids.high > bottom)
            if met.is_in.any():
                over = np.minimum(met.solids.high, top) - np.maximum(met.solids.low, bottom)
                is_in &= ~(met.is_in & ((distance(along, across) > met.depth) | (over < met.over)))
            hit[met.who[is_in]] = True
        return hit

    def free_way(self, start: Floats, ways: Floats) -> tuple[Floats, Floats, Flags]:
        """Return the reached places (m), the shares of the ways, and which bodies were stopped.

        `start` and `ways` have the shape (n, 3).
        """

        def after(shares: Floats) -> Floats:
            return start + ways * shares[:, None]

        shares, is_stopped = self.free_share(start, after, (ways != 0.0).any(axis=1))
        return after(shares), shares, is_stopped

    def free_share(self, start: Floats, after: Callable[[Floats], Floats], moves: Flags) -> tuple[Floats, Flags]:
        """Return the free shares of the ways, and which bodies were stopped.

        `after` returns the places after a share of each way, of shape (n, 3); `moves` flags the bodies with a way.
        Ways are checked in pieces of at most the radius.
        """
        count = len(start)
        shares, is_stopped = np.ones(count), np.zeros(count, bool)
        if not (len(self._planes.who) or len(self._met.who)):
            return shares, is_stopped
        shares[moves] = 0.0
        for piece in range(int(np.max(self._pieces))):
            tried = moves & ~is_stopped & (piece < self._pieces)
            if not tried.any():
                break
            share = (piece + 1.0) / self._pieces
            hit = tried & self.is_hit(start, after(share))
            shares = np.where(tried & ~hit, share, shares)
            is_stopped |= hit
            part = 1.0 / self._pieces
            for _ in range(HALVINGS - 1):
                if not hit.any():
                    break
                part = part / 2.0
                share = shares + part
                still = hit & self.is_hit(start, after(share))
                shares = np.where(hit & ~still, share, shares)
                hit = still
        return shares, is_stopped


def _position(entity: Entity) -> Slot:
    return Slot(entity.offsets["position"], 3, f"{entity.name} position", is_own=False)


def _rigid(entity: Entity, body: Body) -> _Rigid:
    low, high = swept_box(body)
    if body.is_free:
        corner = [max(abs(low[axis]), abs(high[axis])) + abs(body.links[0].centre_of_mass[axis]) for axis in range(3)]
        return _Rigid(entity, body, None, float(np.sqrt(sum(side * side for side in corner))))
    half_x, half_y = (high[0] - low[0]) / 2.0, (high[1] - low[1]) / 2.0
    middle = (low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0
    return _Rigid(entity, body, middle, float(np.sqrt(half_x * half_x + half_y * half_y)))


def _middle(one: _Rigid, numbers: Sequence[float]) -> tuple[float, float]:
    if one.middle is not None:
        return one.middle
    at = one.entity.offsets["position"]
    return numbers[at], numbers[at + 1]


def placed_shapes(body: Body, entity: Entity, numbers: Sequence[float]) -> list[Shape]:
    """Return the shapes of a body in the world."""
    shapes = []
    for link, (_, position, orientation) in zip(body.links, forward_kinematics(body, entity, numbers), strict=True):
        for shape in link.shapes:
            where, turned = place(shape, position, orientation)
            shapes.append(Shape(shape.geometry, shape.surface, shape.colour, where, turned))
    return shapes

"""Checks that rigid bodies start beside one another, beside scenery, and beside entities that move by kinematics.

Bodies that start in one another are pushed apart by the solver, as far as one tick and their speed limits let it: they
fly off or come into quarantine. Bodies that touch, as a stack does, are beside one another. Links of one body are not
compared, since they do not touch; nor two shapes that the solver never moves: a fixed base may stand in a floor.
A kit compares its own entities with its scenery. This takes geometry, so it is done when all single fields are valid.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Final, NamedTuple

import numpy as np

from foosim.common.finding import Finding
from foosim.world.assembly.sections import physics_of
from foosim.world.assembly.volumes import is_felt
from foosim.world.assembly.world import initial_numbers, models_of
from foosim.world.clearance.convex import Convex, convex_parts, overlap_of
from foosim.world.clearance.start import PLACED_BY
from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import Entity, Layout, build_layout
from foosim.world.matter.mesh import Mesh
from foosim.world.moving.solids import scenery_of
from foosim.world.rays.sorted_boxes import SortedBoxes
from foosim.world.scene import MOVING, Body, Quaternion, Shape, Vector, place, shape_box
from foosim.world.spec import WorldSpec

TOUCHING_M: Final = 0.001
"""The greatest overlap of touching bodies (m), as in Bullet itself."""
TOUCHING_SHARE: Final = 0.05
"""The greatest overlap of small touching bodies, as a share of the thinner one."""
FOUND_MAX: Final = 128
"""The search ends at this count of overlapping bodies, more than a report shows: a fleet in a heap is found soon."""


@dataclass(frozen=True, slots=True)
class _Piece:
    """A shape at its place in the world, and its owner: a number by the order in the file, -1 of scenery.

    `body_at` is the place of its body: the origin of the first link. `moves`: the solver moves it.
    `is_kits`: a kit brings it.
    """

    owner: int
    what: str
    body_at: Vector
    shape: Shape
    position: Vector
    orientation: Quaternion
    moves: bool
    is_kits: bool
    low: Vector
    high: Vector

    @property
    def thinnest(self) -> float:
        """The least side of the box around it in its own frame (m); infinite of a mesh."""
        if isinstance(self.shape.geometry, Mesh):
            return inf
        low, high = shape_box(Shape(self.shape.geometry, "", self.shape.colour))
        return min(high[axis] - low[axis] for axis in range(3))

    def convex(self, near: _Piece) -> Iterator[Convex]:
        """Yield it as convex bodies, of a mesh the triangles near another piece."""
        return convex_parts(self.shape, self.position, self.orientation, near.low, near.high)


class _Overlap(NamedTuple):
    """The depth of a body in another thing (m), the name of that, and the depth up to which both only touch."""

    depth: float
    what: str
    touching: float


def overlap_findings(spec: WorldSpec) -> Iterator[Finding]:
    """Yield the bodies that start in a thing, each once: the first thing of the file, and their depth in it.

    Of two bodies it is the later one of the file that starts in the other. Meshes count once their files are there.
    """
    layout = build_layout(spec)
    if not layout.couples:
        return
    order = {name: number for number, name in enumerate((*spec.robots, *spec.objects))}
    entities = sorted(layout.entities, key=lambda entity: order.get(entity.name, -1))  # entities of a kit come first
    pieces = _Pieces([*_scenery(spec), *_bodies(spec, layout, entities, initial_numbers(spec, layout))])
    found = 0
    for owner, entity in enumerate(entities):
        overlap = pieces.first_overlap(owner)
        if overlap is not None:
            yield _finding(spec, entity, overlap, pieces.place_of(owner))
            found += 1
        if found == FOUND_MAX:
            return


def overlapped(spec: WorldSpec, layout: Layout, numbers: Sequence[float], entity: Entity) -> str:
    """Return the thing that an entity overlaps at its place in a frame, and the depth; empty without an overlap.

    Entities of a kit are compared as well, since they come to other places than their kit's.
    """
    others = [one for one in layout.entities if one is not entity]
    bodies = [replace(piece, is_kits=False) for piece in _bodies(spec, layout, [*others, entity], numbers)]
    pieces = _Pieces([*_scenery(spec), *bodies])
    overlap = pieces.first_overlap(len(others))
    return "" if overlap is None else f"{overlap.what}, {overlap.depth * 1e3:.3g} mm deep"


def _finding(spec: WorldSpec, entity: Entity, overlap: _Overlap, place: Vector) -> Finding:
    section, settings = "robots" if entity.is_robot else "objects", spec.settings_of(entity.name)
    assert settings is not None, "entities of a kit are the first"
    key = next((key for key in PLACED_BY if key in type(settings).model_fields), "model")
    what, depth, touching = overlap.what, f"{overlap.depth * 1e3:.3g} mm", f"{overlap.touching * 1e3:.3g} mm"
    x, y, z = place
    problem = f"{entity.name} starts {depth} deep in {what} (up to {touching} is touching)"
    return Finding((section, entity.name, key), problem, f"{x:g} m, {y:g} m, {z:g} m")


class _Pieces:
    """All shapes of a world in the order of their owners, and the boxes around them."""

    def __init__(self, pieces: Sequence[_Piece]) -> None:
        self._all = pieces
        self._owners = np.array([piece.owner for piece in pieces], np.int64)
        self._moves = np.array([piece.moves for piece in pieces], np.bool_)
        self._is_kits = np.array([piece.is_kits for piece in pieces], np.bool_)
        self._is_others = self._is_kits | (self._owners < 0)
        self._low = np.array([piece.low for piece in pieces]).reshape(-1, 3).T.copy()
        self._high = np.array([piece.high for piece in pieces]).reshape(-1, 3).T.copy()
        self._boxes = SortedBoxes(self._low, self._high)

    def _range(self, owner: int) -> tuple[int, int]:
        first, last = np.searchsorted(self._owners, [owner, owner + 1]).tolist()
        return first, last

    def place_of(self, owner: int) -> Vector:
        """Return the place of an owner with pieces (m)."""
        return self._all[self._range(owner)[0]].body_at

    def first_overlap(self, owner: int) -> _Overlap | None:
        """Return the deepest overlap of an owner's pieces with the first of the earlier owners that they are in."""
        first, last = self._range(owner)
        queries, found = self._boxes.met(self._low[:, first:last], self._high[:, first:last])
        queries = queries + first
        is_met = (found < first) & (self._moves[queries] | self._moves[found])
        is_met &= ~(self._is_kits[queries] & self._is_others[found])
        queries, found = queries[is_met], found[is_met]
        for whose in np.unique(self._owners[found]).tolist():
            chosen = self._owners[found] == whose
            pairs = zip(queries[chosen].tolist(), found[chosen].tolist(), strict=True)
            deepest = _deepest((self._all[mine], self._all[its]) for mine, its in pairs)
            if deepest is not None:
                return deepest
        return None


def _deepest(pairs: Iterable[tuple[_Piece, _Piece]]) -> _Overlap | None:
    """Return the greatest overlap of pairs, if there is any."""
    found: _Overlap | None = None
    for one, other in pairs:
        if isinstance(one.shape.geometry, Mesh) and isinstance(other.shape.geometry, Mesh):
            continue  # triangles have no inside
        touching = min(TOUCHING_M, TOUCHING_SHARE * min(one.thinnest, other.thinnest))
        for mine in one.convex(other):
            for its in other.convex(one):
                depth = overlap_of(mine, its, touching if found is None else max(touching, found.depth))
                if depth > 0.0:
                    found = _Overlap(depth, other.what, touching)
    return found


def _scenery(spec: WorldSpec) -> Iterator[_Piece]:
    """Yield the scenery with contacts."""
    sides = physics_of(spec).sides
    for shape in scenery_of(spec):
        if shape.surface in sides:
            what = f"the {shape.name or 'scenery'}"
            at = shape.position, shape.orientation
            yield _piece((-1, what, shape.position), shape, *at, moves=False, is_kits=False)


def _bodies(spec: WorldSpec, layout: Layout, entities: Sequence[Entity], numbers: Sequence[float]) -> Iterator[_Piece]:
    """Yield the shapes of all bodies with contacts, in a frame. Owners are places in the list."""
    physics, models = physics_of(spec), models_of(spec, layout)
    for owner, entity in enumerate(entities):
        body: Body | None = models[entity.index].body() if entity.index in models else None
        if body is None or not entity.is_solved or not is_felt(body, physics):
            continue
        held: list[bool] = []
        poses = forward_kinematics(body, entity, numbers)
        whose = owner, entity.name, poses[0][1]
        for link, (_, position, orientation) in zip(body.links, poses, strict=True):
            on_held = link.parent < 0 or held[link.parent]
            held.append(not entity.is_rigid or (on_held and link.joint not in MOVING and link.joint != "free"))
            for shape in link.shapes:
                at = place(shape, position, orientation)
                moves, is_kits = not held[-1], bool(entity.kind.kit)
                yield _piece(whose, shape, *at, moves=moves, is_kits=is_kits)


def _piece(
    whose: tuple[int, str, Vector],
    shape: Shape,
    position: Vector,
    orientation: Quaternion,
    *,
    moves: bool,
    is_kits: bool,
) -> _Piece:
    low, high = shape_box(Shape(shape.geometry, "", shape.colour, position, orientation))
    return _Piece(*whose, shape, position, orientation, moves, is_kits, low, high)

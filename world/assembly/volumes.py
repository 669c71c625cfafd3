"""Bounding volumes of rigid bodies of any kind, and the islands that follow from them.

The volume of a body is the box around its shapes, grown by its declared speed limit x tick, or by twice its present
speed x tick where that is more; that of a body on a fixed base is the box around the reach of its joints. The volume of
a robot with a gripper includes the gripper's reach. Bodies whose volumes overlap are an island, and so are a holder and
the held entity. Movers (bodies that a motion moves) are in no island: each island has the movers near it. Everything
follows from the frame; only + - x / sqrt and comparisons, element by element, so that all CPUs agree.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from copy import copy
from dataclasses import dataclass, replace
from hashlib import blake2b
from math import sqrt
from operator import itemgetter
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foosim.world.assembly.grippers import Gripper, grippers_of, reaching
from foosim.world.assembly.sections import physics_of
from foosim.world.assembly.world import build_scene
from foosim.world.layout import Entity, Layout
from foosim.world.matter.physics import Physics
from foosim.world.scene import ORIGIN, UPRIGHT, Body, Vector, conjugate, moved, rotate, swept_box
from foosim.world.spec import WorldSpec

Numbers: TypeAlias = NDArray[np.float64]

MARGIN_M: Final = 0.001
"""Added to each volume: contacts are found up to Bullet's breaking threshold of 1 mm."""
PRESENT_SPEED: Final = 2.0
"""Within a tick a body moves at most at its declared speed limit, or at this multiple of its present speed."""
FEW: Final = 16
"""The count of boxes that are always swept along x: to look for a better axis would cost more."""
SKIN_M: Final = 0.05
"""Which boxes may overlap is looked up anew when a side of one is this far from where it was then."""
X, Y, Z, W = range(4)
ROTATION: Final = np.array(
    [
        [Y, X, X, X, X, Y, X, Y, X],
        [Y, Y, Z, Y, X, Z, Z, Z, X],
        [Z, Z, Y, Z, Z, X, Y, X, Y],
        [Z, W, W, W, Z, W, W, W, Y],
    ]
)
"""Of each element of a rotation matrix the parts of the quaternion in its two products: x y - z w, and so on."""
SIGNS: Final = np.array([1.0, -1.0, 1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 1.0])
TWICE: Final = np.array([-2.0, 2.0, 2.0, 2.0, -2.0, 2.0, 2.0, 2.0, -2.0])
UNIT: Final = np.array([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True)
class BodyIsland:
    """Bodies that could touch one another within the tick, the movers that could touch them, and the robot whose owner
    solves them (its name; empty without one). Indices of entities, ascending."""

    entities: tuple[int, ...]
    movers: tuple[int, ...]
    nearest: str


class _Near(NamedTuple):
    """The pairs of boxes that may overlap while no side of any is farther than `SKIN_M` from where it is in `boxes`:
    of each the lower row, and the other one, in order."""

    boxes: Numbers
    ones: NDArray[np.intp]
    others: NDArray[np.intp]


def _near(boxes: Numbers) -> _Near:
    grown = boxes.copy()
    grown[:, 0] -= SKIN_M + MARGIN_M  # the margin is far above rounding
    grown[:, 1] += SKIN_M + MARGIN_M
    pairs = np.array(overlapping(grown), np.intp).reshape(-1, 2)
    return _Near(boxes, pairs[:, 0], pairs[:, 1])


class _Felt(NamedTuple):
    """A rigid body or a mover: of a free one the middle of the box around it, half of its sides, and its radius; of any
    other the box around all that it reaches."""

    entity: Entity
    body: Body
    middle: Vector
    half: Vector
    radius: float
    box: tuple[Vector, Vector]


def _felt_of(entity: Entity, body: Body) -> _Felt:
    if body.is_free:
        return _Felt(entity, body, *_own_box(body), radius_of(body), (ORIGIN, ORIGIN))
    (x, y, z), (u, v, w) = swept_box(body)
    box = (x - MARGIN_M, y - MARGIN_M, z - MARGIN_M), (u + MARGIN_M, v + MARGIN_M, w + MARGIN_M)
    return _Felt(entity, body, ORIGIN, ORIGIN, 0.0, box)


def is_felt(body: Body, physics: Physics) -> bool:
    """Whether a body has contacts: it has a shape, and all of its shapes have known surfaces."""
    surfaces = [shape.surface for link in body.links for shape in link.shapes]
    return bool(surfaces) and all(surface in physics.sides for surface in surfaces)


class Volumes:
    """The volumes of the rigid bodies and movers of one layout."""

    def __init__(self, spec: WorldSpec, layout: Layout) -> None:
        physics, tick_s = physics_of(spec), spec.tick_ns / 1e9
        bodies = build_scene(spec, layout).bodies
        felt = [
            (entity, bodies[entity.name])
            for entity in layout.entities
            if entity.is_solved and entity.name in bodies and is_felt(bodies[entity.name], physics)
        ]
        self._layout, self._tick_s = layout, tick_s
        grippers: dict[int, list[Gripper]] = {}
        for one in grippers_of(spec, layout):
            grippers.setdefault(one.robot, []).append(one)
        self._grippers = [(index, one.held) for index, its in grippers.items() for one in its]
        """Of each gripper its robot, and the place of the reference to the held entity."""
        self._all = [_felt_of(entity, reaching(body, grippers.get(entity.index, ()))) for entity, body in felt]
        self._all_alone = [
            (entity.index, entity.name if entity.is_robot else "")
            for entity in layout.entities
            if entity.is_solved and not entity.is_rigid
        ]
        """Movers and other entities without contacts: each is solved by itself."""
        self._take(self._all, self._all_alone)

    def without(self, absent: Collection[int]) -> Volumes:
        """Return the volumes of all but some entities, by their indices."""
        found = copy(self)
        found._take(
            [one for one in self._all if one.entity.index not in absent],
            [one for one in self._all_alone if one[0] not in absent],
        )
        return found

    def _take(self, felt: Sequence[_Felt], alone: list[tuple[int, str]]) -> None:
        """Set the entities of the volumes."""
        self._entities = [one.entity for one in felt]
        self.rows = {entity.index: row for row, entity in enumerate(self._entities)}
        """The row of each entity in `boxes_at`."""
        self._is_mover = [not entity.is_rigid for entity in self._entities]
        free = [one for one in felt if one.body.is_free]
        self._free = np.array([row for row, one in enumerate(felt) if one.body.is_free], np.intp)
        self._poses = _getter(free, "position", "orientation")
        """Returns the position and the quaternion's parts of each free body, from a frame's numbers."""
        self._position_of = {one.entity.index: one.entity.offsets["position"] for one in free}
        self._middles = np.array([one.middle for one in free]).reshape(-1, 1, 3)
        self._halves = np.array([one.half for one in free]).reshape(-1, 1, 3)
        self._moves = _getter(free, "linear_velocity", "angular_velocity")
        """Returns the velocity and the spin of each free body."""
        self._radii = np.array([one.radius for one in free])
        self._limits = np.array([one.body.speed_limit for one in free])
        self._boxes = np.array([one.box for one in felt]).reshape(-1, 2, 3)
        self._fixed = {one.entity.index: one.body.position for one in felt if not one.body.is_free}
        robots = [entity.is_robot for entity in self._entities if entity.is_rigid]
        self._has_choice = sum(robots) > 1 and not all(robots)
        """Whether an island may have several robots and an object: then its solver depends on where they are."""
        self._alone = alone
        self._found: tuple[list[tuple[int, int]], list[BodyIsland]] | None = None
        """The pairs and the islands that were found last."""
        self._near: _Near | None = None

    def islands(self, numbers: Sequence[float]) -> list[BodyIsland]:
        """Return the islands of an edited frame, and entities that move alone, in the order of their first entities.

        It is the same list as the last one where it is equal to that.
        """
        boxes = self.boxes_at(numbers)
        if self._near is None or not (np.abs(boxes - self._near.boxes) <= SKIN_M).all():
            self._near = _near(boxes)
        ones, others = self._near.ones, self._near.others
        meet = ((boxes[others, 0] <= boxes[ones, 1]) & (boxes[others, 1] >= boxes[ones, 0])).all(axis=1)
        pairs = list(zip(ones[meet].tolist(), others[meet].tolist(), strict=True))
        if self._grippers:
            pairs += self._held(numbers)
        if self._found is None or pairs != self._found[0]:
            self._found = pairs, self._islands_of(pairs)
        found = [self._with_nearest(island, numbers) for island in self._found[1]] if self._has_choice else None
        if found is not None and found != self._found[1]:
            self._found = pairs, found
        return self._found[1]

    def _held(self, numbers: Sequence[float]) -> list[tuple[int, int]]:
        """Return the rows of holders and of held entities, whether their volumes overlap or not."""
        rows, found = self.rows, []
        for robot, at in self._grippers:
            held = int(numbers[at])
            if held in rows and robot in rows:
                found.append((rows[robot], rows[held]))
        return found

    def _with_nearest(self, island: BodyIsland, numbers: Sequence[float]) -> BodyIsland:
        if len(island.entities) <= 2:  # two robots or more, and an object, leave a choice
            return island
        nearest = self._nearest([self._layout.entities[index] for index in island.entities], numbers)
        return island if nearest == island.nearest else replace(island, nearest=nearest)

    def _islands_of(self, pairs: Sequence[tuple[int, int]]) -> list[BodyIsland]:
        """Return the islands that follow from the pairs of rows that could touch; the robot of each is its first."""
        group = list(range(len(self._entities)))
        movers: list[tuple[int, int]] = []
        for one, other in pairs:
            if self._is_mover[one] or self._is_mover[other]:
                if not (self._is_mover[one] and self._is_mover[other]):
                    movers.append((one, other) if self._is_mover[one] else (other, one))
                continue
            _join(group, one, other)
        members: dict[int, list[int]] = {}
        for row, is_mover in enumerate(self._is_mover):
            if not is_mover:
                members.setdefault(_root(group, row), []).append(row)
        in_the_way: dict[int, set[int]] = {}
        for mover, row in movers:
            in_the_way.setdefault(_root(group, row), set()).add(self._entities[mover].index)
        found = []
        for root, rows in members.items():
            entities = [self._entities[row] for row in rows]
            near = tuple(sorted(in_the_way.get(root, ())))
            indices = tuple([entity.index for entity in entities])
            first = next((entity.name for entity in entities if entity.is_robot), "")
            found.append(BodyIsland(indices, near, first))
        found += [BodyIsland((index,), (), name) for index, name in self._alone]
        return sorted(found, key=lambda island: island.entities)

    def boxes_at(self, numbers: Sequence[float]) -> Numbers:
        """Return the boxes of all bodies, shape (bodies, 2, 3): the least and the greatest coordinates."""
        boxes = self._boxes.copy()
        if self._poses is not None:
            poses = np.array(self._poses(numbers)).reshape(-1, 7)
            turned = _rotations(poses[:, 3:])
            along = turned * self._middles
            spread = np.abs(turned) * self._halves
            middle = poses[:, :3] + (along[:, :, 0] + along[:, :, 1] + along[:, :, 2])
            half = spread[:, :, 0] + spread[:, :, 1] + spread[:, :, 2] + self._grown(numbers)
            boxes[self._free, 0] = middle - half
            boxes[self._free, 1] = middle + half
        return boxes

    def _grown(self, numbers: Sequence[float]) -> Numbers:
        """Return by how much the volumes of free bodies grow (m), shape (bodies, 1)."""
        assert self._moves is not None
        moves = np.array(self._moves(numbers)).reshape(-1, 2, 3)
        square = moves * moves
        lengths = np.sqrt(square[:, :, 0] + square[:, :, 1] + square[:, :, 2])
        speeds = np.maximum(self._limits, PRESENT_SPEED * (lengths[:, 0] + lengths[:, 1] * self._radii))
        grown: Numbers = (speeds * self._tick_s + MARGIN_M)[:, None]
        return grown

    def _nearest(self, entities: Sequence[Entity], numbers: Sequence[float]) -> str:
        """Return the robot nearest to an object of an island, ties by name; the first robot without an object."""
        robots = [entity for entity in entities if entity.is_robot]
        objects = [entity for entity in entities if not entity.is_robot]
        if len(robots) <= 1 or not objects:
            return robots[0].name if robots else ""
        places = [self._place(entity, numbers) for entity in objects]
        distances = []
        for robot in robots:
            x, y, z = self._place(robot, numbers)
            squares = [(x - a) * (x - a) + (y - b) * (y - b) + (z - c) * (z - c) for a, b, c in places]
            distances.append((min(squares), robot.name))
        return min(distances)[1]

    def _place(self, entity: Entity, numbers: Sequence[float]) -> Vector:
        at = self._position_of.get(entity.index)
        return self._fixed[entity.index] if at is None else (numbers[at], numbers[at + 1], numbers[at + 2])


def solver_by_name(first: str, roster: tuple[str, ...]) -> str:
    """Return the node that solves an island without a robot: it follows from the name of its first entity, so that
    loose objects spread over the nodes."""
    return roster[int.from_bytes(blake2b(first.encode(), digest_size=8).digest(), "little") % len(roster)]


def overlapping(boxes: Numbers) -> list[tuple[int, int]]:
    """Return the pairs of boxes (n, 2, 3) that overlap, each with the lower row first, in order.

    Boxes are swept along the axis along which their least coordinates vary most, so that a row of boxes costs as
    little whichever way it goes. The pairs are the same along any.
    """
    count = len(boxes)
    if count < 2:
        return []
    axis = int(boxes[:, 0].var(axis=0).argmax()) if count > FEW else 0
    order = np.argsort(boxes[:, 0, axis], kind="stable")
    low, high = boxes[order, 0], boxes[order, 1]
    ends = np.searchsorted(low[:, axis], high[:, axis], side="right")
    counts = ends - np.arange(1, count + 1)  # how many of the later ones begin before a box ends
    if not counts.any():
        return []
    ones = np.repeat(np.arange(count), counts)
    others = np.arange(len(ones)) - np.repeat(np.cumsum(counts) - counts, counts) + ones + 1
    meet = ((low[others] <= high[ones]) & (high[others] >= low[ones])).all(axis=1)
    pairs = np.sort(np.stack((order[ones[meet]], order[others[meet]]), axis=1), axis=1)
    return sorted(map(tuple, pairs.tolist()))


def _getter(felt: Sequence[_Felt], *fields: str) -> Callable[[Sequence[float]], Any] | None:
    """Return what gets the numbers of fields of entities from a frame's, of at least one entity."""
    slots = [(one.entity.offsets[field], one.entity.counts[field]) for one in felt for field in fields]
    return itemgetter(*[at + step for at, count in slots for step in range(count)]) if felt else None


def reach_speed(speed_limit: float, present: float) -> float:
    """Return the greatest speed (m/s) of a body within a tick, from its promise and its present speed."""
    return max(speed_limit, PRESENT_SPEED * present)


def radius_of(body: Body) -> float:
    """Return the greatest distance of a part of a free body from its centre of mass (m)."""
    middle, half = _own_box(body)
    x, y, z = (abs(a) + b for a, b in zip(middle, half, strict=True))
    return sqrt(x * x + y * y + z * z)


def _own_box(body: Body) -> tuple[Vector, Vector]:
    """Return the middle of the box around a free body, from its centre of mass in its principal axes, and half of its
    sides. That of a body with joints is around all that these reach."""
    base = body.links[0]
    low, high = swept_box(body)
    back = conjugate(base.principal)
    half = (high[0] - low[0]) / 2, (high[1] - low[1]) / 2, (high[2] - low[2]) / 2
    middle = rotate(back, moved(moved(low, half, 1.0), base.centre_of_mass, -1.0))
    if base.principal == UPRIGHT:
        return middle, half
    sides = [rotate(back, side) for side in ((half[0], 0.0, 0.0), (0.0, half[1], 0.0), (0.0, 0.0, half[2]))]
    x, y, z = (sum(abs(side[axis]) for side in sides) for axis in range(3))
    return middle, (x, y, z)


def _rotations(quaternions: Numbers) -> Numbers:
    """Return the rotation matrices (n, 3, 3) of unit quaternions (n, 4): x, y, z, w."""
    squares = quaternions[:, :, None] * quaternions[:, None, :]
    first, second = squares[:, ROTATION[0], ROTATION[1]], squares[:, ROTATION[2], ROTATION[3]]
    parts: Numbers = (UNIT + (first + SIGNS * second) * TWICE).reshape(-1, 3, 3)
    return parts


def _root(group: list[int], row: int) -> int:
    while group[row] != row:
        group[row] = group[group[row]]
        row = group[row]
    return row


def _join(group: list[int], one: int, other: int) -> None:
    """Unite the groups of two rows; the root is the lowest row."""
    low, high = sorted((_root(group, one), _root(group, other)))
    group[high] = low

"""Line of sight: which things of the world a straight line between two antennas crosses, and how far inside of each.

The things are those of the scene: the scenery, prepared once, and the bodies, placed by the forward kinematics for the
first line near them in a frame. Crossings are computed from the lesser of the two ends, so both directions of a pair
have the same ones to the last bit. Boxes and pillars around things only select candidates; the crossings of each
candidate come from one routine on plain floats, so neither order nor other lines change them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import inf, sqrt
from operator import attrgetter
from typing import Final, NamedTuple

from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import Layout
from foosim.world.matter.materials import RadioMaterial
from foosim.world.rays.boxes import MARGIN_M, boxes_around, boxes_met_by
from foosim.world.rays.solids import Line, Meshes, Piece, Solid, chord_of, joined, ray_of, solid_of
from foosim.world.scene import (
    ORIGIN,
    Body,
    Link,
    Quaternion,
    Scene,
    Shape,
    Vector,
    enclosing,
    rotate,
    shape_box,
    swept_box,
)

_BY_DISTANCE: Final = attrgetter("entry_m", "name")
REACH_M: Final = 0.5
"""The scenery near a line is valid while neither end has moved further than this along an axis."""
UNKNOWN: Vector = (inf, inf, inf)
"""In place of a place: nothing is there."""


class Crossing(NamedTuple):
    """A thing that a line crosses: its name (of the scenery, or the entity's), its material, the way through it.

    `chord_m` is how far the line is inside of it, 0 for a wall without a thickness of its own. `entry_m` and `exit_m`
    are the distances from the lesser end at which it begins and ends.
    """

    name: str
    material: RadioMaterial
    chord_m: float
    entry_m: float = 0.0
    exit_m: float = 0.0


class _Groups:
    """Names and materials of which shapes that overlap count as one."""

    def __init__(self) -> None:
        self._known: dict[tuple[str, RadioMaterial], int] = {}
        self._named: list[tuple[str, RadioMaterial]] = []
        self._meshes = Meshes()

    def solids(self, shapes: Iterable[Shape], body: str | None = None) -> list[Solid]:
        """Return shapes of a body, or of the scenery, as solids."""
        return [solid_of(shape, self._number(shape, body), self._meshes) for shape in shapes]

    def _number(self, shape: Shape, body: str | None) -> int:
        key = shape.name if body is None else body, shape.radio
        number = self._known.setdefault(key, len(self._named))
        if number == len(self._named):
            self._named.append(key)
        return number

    def crossings(self, line: Line, solids: list[Solid]) -> list[Crossing]:
        """Return what a line crosses of some solids, in their order."""
        ray = ray_of(line)
        if not ray[2] > 0.0:
            return []
        found: dict[int, list[Piece]] = {}
        for solid in solids:
            pieces = solid.pieces(ray)
            if pieces:
                before = found.get(solid.group)
                if before is None:
                    found[solid.group] = pieces
                else:
                    before.extend(pieces)
        crossings: list[Crossing] = []
        for group, pieces in found.items():
            name, material = self._named[group]
            for piece in joined(pieces) if len(pieces) > 1 else pieces:
                enter, leave = piece[0][0], piece[-1][1]
                chord = leave - enter if len(piece) == 1 else chord_of(piece)
                crossings.append(Crossing(name, material, chord, enter, leave))
        return _in_order(crossings)


def _in_order(crossings: list[Crossing]) -> list[Crossing]:
    """Return crossings in the order of their distance from the lesser end, then of their names."""
    return sorted(crossings, key=_BY_DISTANCE) if len(crossings) > 1 else crossings


class Trace:
    """What is remembered of a line whose ends move: what of the scenery is near, and what of it the line crosses."""

    __slots__ = ("a", "b", "crossed", "line", "near", "still")

    def __init__(self) -> None:
        self.still: Still | None = None
        """The scenery that all of it is about."""
        self.a = self.b = UNKNOWN
        """Where the ends were when `near` was found."""
        self.near: list[Solid] = []
        self.line: Line = (UNKNOWN, UNKNOWN)
        self.crossed: tuple[Crossing, ...] = ()

    def covers(self, line: Line) -> bool:
        """Whether all of the scenery that a line may cross is in `near`."""
        ((ax, ay, az), (bx, by, bz)), (x, y, z), (u, v, w) = line, self.a, self.b
        return (
            abs(ax - x) <= REACH_M
            and abs(ay - y) <= REACH_M
            and abs(az - z) <= REACH_M
            and abs(bx - u) <= REACH_M
            and abs(by - v) <= REACH_M
            and abs(bz - w) <= REACH_M
        )


class Still:
    """The scenery."""

    def __init__(self, shapes: Sequence[Shape]) -> None:
        self.groups = _Groups()
        opaque = [shape for shape in shapes if not shape.radio.is_transparent]
        self.solids = self.groups.solids(opaque)
        boxes = [shape_box(shape) for shape in opaque]
        self._boxes = boxes_around([low for low, _ in boxes], [high for _, high in boxes], REACH_M + MARGIN_M)

    def crossed(self, line: Line, trace: Trace) -> tuple[Crossing, ...]:
        """Return what a line crosses of the scenery; `trace` is the cache of it, or of a similar line."""
        if trace.still is not self or trace.line != line:
            if trace.still is not self or not trace.covers(line):
                trace.still = self
                trace.a, trace.b = line
                trace.near = [self.solids[index] for index in boxes_met_by(self._boxes, line)]
            trace.crossed = tuple(self.groups.crossings(line, trace.near)) if trace.near else ()
            trace.line = line
        return trace.crossed


class _Limb:
    """A link as rays meet it: its solids, and the sphere around them in the link's frame."""

    __slots__ = ("middle", "radius", "solids")

    def __init__(self, body: str, link: Link, groups: _Groups) -> None:
        opaque = [shape for shape in link.shapes if not shape.radio.is_transparent]
        self.solids = groups.solids(opaque, body)
        low, high = enclosing([shape_box(shape) for shape in opaque] or [(ORIGIN, ORIGIN)])
        x, y, z = high[0] - low[0], high[1] - low[1], high[2] - low[2]
        self.middle = (low[0] + x / 2, low[1] + y / 2, low[2] + z / 2)
        self.radius = sqrt(x * x + y * y + z * z) / 2


def _reach(body: Body) -> float | Pillar:
    """Return how far a body reaches: about its own origin (m) when it is free to move, else in the world."""
    (lx, ly, lz), (hx, hy, hz) = swept_box(body)
    if body.links[0].joint != "free":
        x, y = hx - lx, hy - ly
        return pillar(body.name, lx + x / 2, ly + y / 2, sqrt(x * x + y * y) / 2, lz, hz)
    x, y, z = body.position
    x, y, z = max(abs(lx - x), abs(hx - x)), max(abs(ly - y), abs(hy - y)), max(abs(lz - z), abs(hz - z))
    return sqrt(x * x + y * y + z * z)


class Geometry:
    """A scene as rays meet it: fixed scenery, and the links of bodies, to be placed for each frame."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.still = Still(scene.scenery)
        self.groups = _Groups()
        self.limbs = {
            body.name: [_Limb(body.name, link, self.groups) for link in body.links] for body in scene.bodies.values()
        }
        self.reaches = {name: _reach(body) for name, body in sorted(scene.bodies.items())}


class _Placed:
    """A link at its pose in one frame."""

    __slots__ = ("_limb", "_middle", "_orientation", "_position", "_solids")

    def __init__(self, limb: _Limb, position: Vector, orientation: Quaternion) -> None:
        self._limb, self._position, self._orientation = limb, position, orientation
        x, y, z = rotate(orientation, limb.middle)
        self._middle = x + position[0], y + position[1], z + position[2]
        self._solids: list[Solid] | None = None

    def is_near(self, line: Line) -> bool:
        """Whether a line comes as near as the sphere around the link, or nearly so."""
        (x, y, z), ((ax, ay, az), (bx, by, bz)) = self._middle, line
        px, py, pz = x - ax, y - ay, z - az
        dx, dy, dz = bx - ax, by - ay, bz - az
        square = dx * dx + dy * dy + dz * dz
        along = px * dx + py * dy + pz * dz
        if along > 0.0:
            share = along / square if along < square else 1.0
            px, py, pz = px - share * dx, py - share * dy, pz - share * dz
        reach = self._limb.radius + MARGIN_M
        return px * px + py * py + pz * pz <= reach * reach

    def in_world(self) -> list[Solid]:
        if self._solids is None:
            self._solids = [solid.placed(self._position, self._orientation) for solid in self._limb.solids]
        return self._solids


class Sight:
    """Lines of sight in one frame: `numbers` are its values, `layout` has the scene's bodies."""

    def __init__(self, geometry: Geometry, layout: Layout, numbers: Sequence[float]) -> None:
        self._geometry, self._layout, self._numbers = geometry, layout, numbers
        self._placed: dict[str, list[_Placed]] = {}
        self._around: list[Pillar] | None = None
        """What is around bodies."""

    def crossings(self, line: Line, ignoring: frozenset[str], trace: Trace) -> tuple[Crossing, ...]:
        """Return what a line from its lesser end crosses, without the bodies `ignoring` (entities).

        In the order of their distance from the lesser end, then of their names: the same for both directions. Shapes
        of one body, or of scenery with one name, that overlap and are of the same material count as one. A closed mesh
        counts as one however often the line enters it: its chords add up. Of an open mesh each wall that the line
        passes counts. At an end inside a thing its chord begins or ends. Transparent things are left out. `trace` is
        what the caller remembers of the same line in earlier frames.
        """
        standing = self._geometry.still.crossed(line, trace)
        if self._around is None:
            self._around = self._pillars()
        near = pillars_met_by(self._around, line)
        moving: list[Solid] = []
        for name in near:
            if name not in ignoring:
                moving.extend(self._solids(name, line))
        if not moving:
            return standing
        crossed = self._geometry.groups.crossings(line, moving)
        if not standing or not crossed:
            return tuple(crossed) or standing
        return tuple(_in_order([*standing, *crossed]))

    def _pillars(self) -> list[Pillar]:
        """Return a pillar around each body: however a free one is turned, wherever another one's joints are."""
        pillars = []
        for name, reach in self._geometry.reaches.items():
            if isinstance(reach, float):
                start = self._layout[name].offsets["position"]
                x, y, z = self._numbers[start : start + 3]
                pillars.append(pillar(name, x, y, reach, z - reach, z + reach))
            else:
                pillars.append(reach)
        return pillars

    def _solids(self, name: str, line: Line) -> list[Solid]:
        """Return the solids of a body's links that a line comes near to."""
        placed = self._placed.get(name)
        if placed is None:
            placed = self._placed[name] = self._place(name)
        return [solid for link in placed if link.is_near(line) for solid in link.in_world()]

    def _place(self, name: str) -> list[_Placed]:
        """Place the links of a body that have shapes."""
        geometry = self._geometry
        poses = forward_kinematics(geometry.scene.bodies[name], self._layout[name], self._numbers)
        return [
            _Placed(limb, position, orientation)
            for limb, (_, position, orientation) in zip(geometry.limbs[name], poses, strict=True)
            if limb.solids
        ]


Pillar = tuple[str, float, float, float, float, float]
"""The name of a body, and an upright cylinder around it: x, y, the square of its radius, its least and greatest z (m).

A plain tuple, as every line of a frame is compared with each.
"""


def pillar(name: str, x: float, y: float, radius: float, low_z: float, high_z: float) -> Pillar:
    """Return a pillar that is a little larger than the given one."""
    radius += MARGIN_M
    return name, x, y, radius * radius, low_z - MARGIN_M, high_z + MARGIN_M


def pillars_met_by(pillars: list[Pillar], line: tuple[Vector, Vector]) -> list[str]:
    """Return the names whose pillars a line may pass, seen from above as if it had no ends: candidates of a hit."""
    (ax, ay, az), (bx, by, bz) = line
    way_x, way_y = bx - ax, by - ay
    square = way_x * way_x + way_y * way_y
    low_z, high_z = (az, bz) if az <= bz else (bz, az)
    met = []
    for name, x, y, reach, bottom, top in pillars:
        aside = (x - ax) * way_y - (y - ay) * way_x
        if aside * aside <= reach * square and top >= low_z and bottom <= high_z:
            met.append(name)
    return met

"""The map of a report: scenery and paths of bodies seen from above, and where packets were lost.

Places are x, y in m, in the world frame.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from math import cos, dist, hypot, pi, sin
from operator import itemgetter
from typing import Final

from foosim.capture.rows import PacketRow
from foosim.common.keyed_random import draw_key, draw_words
from foosim.console.shown.scene_json import standing_bounds
from foosim.deployment.network.rules import selects
from foosim.deployment.schema import Deployment
from foosim.painting.outlines import hull_of
from foosim.vhub.line_of_sight.placement import World
from foosim.world.assembly.world import build_scene
from foosim.world.frame import Frame
from foosim.world.kinematics import forward_kinematics
from foosim.world.layout import Entity, Layout
from foosim.world.scene import (
    ORIGIN,
    UPRIGHT,
    Body,
    Box,
    Capsule,
    Cylinder,
    Hull,
    Quaternion,
    Shape,
    Sphere,
    Vector,
    multiply,
    rotate,
)

FRAMES_KEPT: Final = 256
"""Captured frames whose places are remembered, for packets that are lost late."""
PATH_POINTS: Final = 200, 1000
"""Places of a body that are kept: in a world of many bodies, and of few."""
ALL_POINTS: Final = 50_000
FINE: Final = 0.0005
"""Ways are drawn to this share of the field."""
STEP_M: Final = 0.03
SPEED_FACTOR: Final = 2.0
"""A step of more than the first, and of more than the second times what the speeds before and after explain, is none:
the body was put there. A collision between two frames turns a body, and hardly ever hastens and stops it."""
LOSSES_KEPT: Final = 2000
VERTICES_MAX: Final = 20_000
ROUND: Final = 24
"""Corners of a circle."""

Place = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Outline:
    """A shape seen from above: its convex hull, and how high its top is."""

    name: str
    corners: tuple[Place, ...]
    top_m: float
    colour: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Track:
    """Where a body was, from the first captured frame that has it to the last, and what it looks like there."""

    name: str
    pieces: tuple[tuple[Place, ...], ...]
    """The ways between which it was put elsewhere, or was absent."""
    at: Place
    outlines: tuple[Outline, ...]
    """None of what is gone."""
    is_gone: bool
    """Whether it is absent at the end."""


@dataclass(frozen=True, slots=True)
class Loss:
    """Where a packet was lost: the middle between its ends, or the end of which the place is known."""

    at: Place
    cause: str
    source: str
    destination: str
    sent_ns: int


@dataclass(frozen=True, slots=True)
class Map:
    """What is drawn; `lost` counts what was dropped, `placeless` those of it whose ends have no place."""

    bounds: tuple[Place, Place]
    """The lowest and the highest corner of what stands: free bodies may be beyond it."""
    outlines: tuple[Outline, ...]
    """The scenery, the lowest first."""
    tracks: tuple[Track, ...]
    standing: dict[str, Place]
    """Endpoints without a body to which the deployment gives a place."""
    losses: tuple[Loss, ...]
    lost: int
    placeless: int
    links: tuple[tuple[str, str, str, int], ...]
    """Source, destination, cause and count, most first."""


class _Way:
    """The places of a body: every n-th one, with n such that there are few enough."""

    def __init__(self, most: int) -> None:
        self._most = most
        self.points: list[tuple[int, Place]] = []
        """Numbers of pieces, and places."""
        self.last: Place = (0.0, 0.0)
        self._last_ns = 0
        self._speed = 0.0
        self._piece = self._stride = 1
        self._seen = 0

    def cut(self) -> None:
        """What comes next is not joined to what was."""
        if not self._seen:
            return
        if self.points[-1] != (self._piece, self.last):
            self.points.append((self._piece, self.last))
        self._piece += 1
        self._seen = 0

    def add(self, at_ns: int, place: Place, velocity: Callable[[], Vector]) -> None:
        """Take the next place; `velocity` (m/s) is asked for where it matters."""
        if self._seen:
            way_m, passed_s = dist(self.last, place), (at_ns - self._last_ns) / 1e9
            if way_m > STEP_M:
                speed = hypot(*velocity())
                if way_m > STEP_M + SPEED_FACTOR * max(speed, self._speed) * passed_s:
                    self.cut()
                self._speed = speed
            else:
                self._speed = way_m / passed_s if passed_s else 0.0
        self.last, self._last_ns = place, at_ns
        if self._seen % self._stride == 0:
            self.points.append((self._piece, place))
        self._seen += 1
        if len(self.points) > self._most:
            del self.points[1::2]
            self._stride *= 2

    def pieces(self) -> tuple[tuple[Place, ...], ...]:
        """Return the ways between two cuts, each to its last place."""
        end = self._piece, self.last
        points = self.points if not self._seen or self.points[-1] == end else [*self.points, end]
        return tuple(tuple(place for _, place in piece) for _, piece in groupby(points, itemgetter(0)))


class MapMaker:
    """Takes frames and lost packets in the order of the file."""

    def __init__(self, deployment: Deployment, tick_ns: int) -> None:
        self._deployment, self._tick_ns = deployment, tick_ns
        self._world = World(deployment, deployment.network)
        self._endpoints = deployment.endpoints()
        self._frame: Frame | None = None
        self._bodies: Mapping[str, Body] = {}
        self._bounds: tuple[Place, Place] = ((-1.0, -1.0), (1.0, 1.0))
        self._placed: list[str] = []
        self._outlines: tuple[Outline, ...] = ()
        self._frames: deque[tuple[int, dict[str, Place]]] = deque(maxlen=FRAMES_KEPT)
        self._points = 0
        """Places that are kept of each body."""
        self._ways: dict[str, _Way] = {}
        """Of bodies that were there."""
        self._losses: list[Loss] = []
        self._lost = self._placeless = 0
        self._counts: Counter[tuple[str, str, str]] = Counter()
        self._key = draw_key(0, "report", "losses")

    def take_frame(self, frame: Frame) -> None:
        """Take the next captured frame."""
        if self._frame is None:
            self._begin(frame.layout)
        self._frame = frame
        self._world.turn_to(frame)
        at_ns = frame.tick * self._tick_ns
        absent = {entity.name for entity in frame.layout.entities if entity.is_absent(frame.numbers)}
        placed = [name for name in self._placed if self._world.body(name) not in absent]
        self._frames.append((at_ns, {name: self._world.antenna(name, ORIGIN)[:2] for name in placed}))
        for body in absent & self._ways.keys():
            self._ways[body].cut()
        for body in self._bodies.keys() - absent:
            if body not in self._ways:
                self._ways[body] = _Way(self._points)
            x, y, _ = self._world.antenna(body, ORIGIN)
            self._ways[body].add(at_ns, (x, y), partial(self._world.velocity, body))

    def _begin(self, layout: Layout) -> None:
        scene = build_scene(self._deployment, layout)
        self._bodies = scene.bodies
        self._outlines = tuple(sorted(map(outline, scene.scenery), key=lambda found: found.top_m))
        low, high = standing_bounds(scene)
        self._bounds = low[:2], high[:2]
        least, most = PATH_POINTS
        self._points = max(least, min(most, ALL_POINTS // max(1, len(scene.bodies))))
        written = list(self._deployment.network.places)
        self._placed = [
            name
            for name in self._endpoints
            if self._world.body(name) in self._bodies or any(selects([glob], name) for glob in written)
        ]

    def _look(self, body: Body, entity: Entity, numbers: Sequence[float]) -> tuple[Outline, ...]:
        """Return a body's shapes as they are in a frame of these numbers."""
        poses = forward_kinematics(body, entity, numbers)
        return tuple(
            outline(shape, position, orientation)
            for link, (_, position, orientation) in zip(body.links, poses, strict=True)
            for shape in link.shapes
        )

    def take_loss(self, row: PacketRow) -> None:
        """Take a packet that was dropped."""
        self._lost += 1
        self._counts[row.source, row.destination, row.cause] += 1
        places = self._places_at(row.sent_ns)
        ends = [places[end] for end in (row.source, row.destination) if end in places]
        if not ends:
            self._placeless += 1
            return
        at = sum(x for x, _ in ends) / len(ends), sum(y for _, y in ends) / len(ends)
        loss = Loss(at, row.cause, row.source, row.destination, row.sent_ns)
        count = self._lost - self._placeless
        if len(self._losses) < LOSSES_KEPT:
            self._losses.append(loss)
            return
        kept = draw_words(self._key, count)[0] * count >> 64  # algorithm R, as in `report_tallies`
        if kept < LOSSES_KEPT:
            self._losses[kept] = loss

    def _places_at(self, time_ns: int) -> Mapping[str, Place]:
        """Return places as of the last captured frame at or before a time, or the first that is remembered."""
        for at_ns, places in reversed(self._frames):
            if at_ns <= time_ns:
                return places
        return self._frames[0][1] if self._frames else {}

    def result(self, links_max: int) -> Map:
        standing = {}
        if self._frames:
            last = self._frames[-1][1]
            standing = {name: last[name] for name in self._placed if self._world.body(name) not in self._bodies}
        links = sorted(self._counts.items(), key=lambda entry: (-entry[1], entry[0]))[:links_max]
        return Map(
            self._bounds,
            self._outlines,
            tuple(self._track(name, way) for name, way in sorted(self._ways.items())),
            standing,
            tuple(self._losses),
            self._lost,
            self._placeless,
            tuple((*ends, count) for ends, count in links),
        )

    def _track(self, name: str, way: _Way) -> Track:
        assert self._frame is not None, "no way is known before it"
        entity, numbers = self._frame.layout[name], self._frame.numbers
        is_gone = entity.is_absent(numbers)
        look = () if is_gone else self._look(self._bodies[name], entity, numbers)
        within_m = FINE * dist(*self._bounds)
        return Track(name, tuple(simplified(piece, within_m) for piece in way.pieces()), way.last, look, is_gone)


def simplified(points: Sequence[Place], within_m: float) -> tuple[Place, ...]:
    """Return points whose line is nowhere further off. Source: Ramer (1972), Douglas and Peucker (1973)."""
    kept = {0, len(points) - 1}
    parts = [(0, len(points) - 1)]
    while parts:
        first, last = parts.pop()
        far = max(((_off(points[n], points[first], points[last]), n) for n in range(first + 1, last)), default=(0.0, 0))
        if far[0] > within_m:
            kept.add(far[1])
            parts += [(first, far[1]), (far[1], last)]
    return tuple(points[n] for n in sorted(kept))


def _off(point: Place, start: Place, end: Place) -> float:
    """Return the distance of a point from the line between two others."""
    (x, y), along_x, along_y = point, end[0] - start[0], end[1] - start[1]
    square = along_x * along_x + along_y * along_y
    share = ((x - start[0]) * along_x + (y - start[1]) * along_y) / square if square else 0.0
    share = min(1.0, max(0.0, share))
    return hypot(x - start[0] - share * along_x, y - start[1] - share * along_y)


def outline(shape: Shape, position: Vector = ORIGIN, orientation: Quaternion = UPRIGHT) -> Outline:
    """Return a shape as seen from above; its link is at that pose in the world, or it is scenery."""
    px, py, pz = rotate(orientation, shape.position)
    x0, y0, z0 = position[0] + px, position[1] + py, position[2] + pz
    turned = multiply(orientation, shape.orientation)
    corners = [(x + x0, y + y0, z + z0) for x, y, z in (rotate(turned, corner) for corner in _corners(shape))]
    red, green, blue, _ = shape.colour
    top = max(z for _, _, z in corners)
    return Outline(shape.name, tuple(hull_of([(x, y) for x, y, _ in corners])), top, (red, green, blue))


def _corners(shape: Shape) -> Iterable[Vector]:
    """Yield points in the shape's own frame whose hull is (close to) the shape's."""
    geometry = shape.geometry
    if isinstance(geometry, Box):
        a, b, c = geometry.half
        return [(x, y, z) for x in (-a, a) for y in (-b, b) for z in (-c, c)]
    turns = [2.0 * pi * n / ROUND for n in range(ROUND)]
    if isinstance(geometry, Cylinder):
        ends = -geometry.length / 2, geometry.length / 2
        return [(geometry.radius * cos(turn), geometry.radius * sin(turn), z) for turn in turns for z in ends]
    if isinstance(geometry, Sphere):
        r = geometry.radius
        rings = [r * sin(pi * n / 8) for n in range(-4, 5)]
        return [(cos(t) * (r * r - z * z) ** 0.5, sin(t) * (r * r - z * z) ** 0.5, z) for t in turns for z in rings]
    if isinstance(geometry, Capsule):
        r, half = geometry.radius, geometry.length / 2
        caps = [(r * cos(pi * n / 8), half + r * sin(pi * n / 8)) for n in range(5)]
        return [(wide * cos(t), wide * sin(t), side * z) for wide, z in caps for t in turns for side in (-1.0, 1.0)]
    vertices = (geometry.mesh if isinstance(geometry, Hull) else geometry).vertices
    step = -(-len(vertices) // VERTICES_MAX)
    return [(x, y, z) for x, y, z in vertices[::step].tolist()]

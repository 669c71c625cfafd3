"""The map of a report: scenery and paths of bodies seen from above, and where packets were lost.

Places are x, y in m, in the world frame. Neighbours: `report` feeds it with frames and lost packets.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import cos, pi, sin
from typing import Final

from foosim.protocol.deployment import Deployment
from foosim.protocol.draws import draw_key, draw_words
from foosim.protocol.frame import Frame
from foosim.protocol.layout import Layout
from foosim.protocol.network import selects
from foosim.protocol.scene import ORIGIN, Box, Cylinder, Shape, Sphere, Vector, rotate
from foosim.protocol.scenes import build_scene
from foosim.vhub.rows import PacketRow
from foosim.vhub.world import World

FRAMES_KEPT: Final = 256
"""Captured frames whose places are remembered, for packets that are lost late."""
PATH_POINTS: Final = 200
LOSSES_KEPT: Final = 2000
VERTICES_MAX: Final = 20_000
ROUND: Final = 24
"""Corners of a circle."""

Place = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Outline:
    """A thing that never moves, seen from above: its convex hull, and how high its top is."""

    name: str
    corners: tuple[Place, ...]
    top_m: float
    colour: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Track:
    """Where a body was, from the first captured frame to the last."""

    name: str
    points: tuple[Place, ...]


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

    outlines: tuple[Outline, ...]
    tracks: tuple[Track, ...]
    standing: dict[str, Place]
    """Endpoints without a body to which the deployment gives a place."""
    losses: tuple[Loss, ...]
    lost: int
    placeless: int
    links: tuple[tuple[str, str, str, int], ...]
    """Source, destination, cause and count, most first."""


class MapMaker:
    """Takes frames and lost packets in the order of the file."""

    def __init__(self, deployment: Deployment, tick_ns: int) -> None:
        self._deployment, self._tick_ns = deployment, tick_ns
        self._world = World(deployment, deployment.network)
        self._endpoints = deployment.endpoints()
        self._layout: Layout | None = None
        self._bodies: frozenset[str] = frozenset()
        self._placed: list[str] = []
        self._outlines: tuple[Outline, ...] = ()
        self._frames: deque[tuple[int, dict[str, Place]]] = deque(maxlen=FRAMES_KEPT)
        self._tracks: dict[str, list[Place]] = {}
        self._strides: dict[str, int] = {}
        self._seen: Counter[str] = Counter()
        self._losses: list[Loss] = []
        self._lost = self._placeless = 0
        self._counts: Counter[tuple[str, str, str]] = Counter()
        self._key = draw_key(0, "report", "losses")

    def take_frame(self, frame: Frame) -> None:
        """Take the next captured frame."""
        if frame.layout is not self._layout:
            self._take_layout(frame.layout)
        self._world.turn_to(frame)
        places = {name: self._world.antenna(name, ORIGIN)[:2] for name in self._placed}
        self._frames.append((frame.tick * self._tick_ns, places))
        for body in sorted(self._bodies):
            x, y, _ = self._world.antenna(body, ORIGIN)
            self._follow(body, (x, y))

    def _take_layout(self, layout: Layout) -> None:
        scene = build_scene(self._deployment, layout)
        if self._layout is None:
            self._outlines = tuple(sorted(map(outline, scene.scenery), key=lambda found: found.top_m))
        self._layout, self._bodies = layout, frozenset(scene.bodies)
        written = list(self._deployment.network.places)
        self._placed = [
            name
            for name in self._endpoints
            if self._world.body(name) in self._bodies or any(selects([glob], name) for glob in written)
        ]

    def _follow(self, body: str, place: Place) -> None:
        """Keep every n-th place of a body, with n such that there are few enough."""
        track = self._tracks.setdefault(body, [])
        stride = self._strides.setdefault(body, 1)
        if self._seen[body] % stride == 0:
            track.append(place)
        self._seen[body] += 1
        if len(track) > PATH_POINTS:
            del track[1::2]
            self._strides[body] = 2 * stride

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
            self._outlines,
            tuple(Track(name, tuple(points)) for name, points in sorted(self._tracks.items())),
            standing,
            tuple(self._losses),
            self._lost,
            self._placeless,
            tuple((*ends, count) for ends, count in links),
        )


def outline(shape: Shape) -> Outline:
    """Return a shape of the scenery as seen from above."""
    corners = [
        (x + shape.position[0], y + shape.position[1], z + shape.position[2])
        for x, y, z in (rotate(shape.orientation, corner) for corner in _corners(shape))
    ]
    red, green, blue, _ = shape.colour
    top = max(z for _, _, z in corners)
    return Outline(shape.name, hull((x, y) for x, y, _ in corners), top, (red, green, blue))


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
    step = -(-len(geometry.vertices) // VERTICES_MAX)
    return [(x, y, z) for x, y, z in geometry.vertices[::step].tolist()]


def hull(points: Iterable[Place]) -> tuple[Place, ...]:
    """Return the convex hull of points, counter-clockwise. Source: Andrew's monotone chain (1979)."""
    ordered = sorted(set(points))
    if len(ordered) < 3:
        return tuple(ordered)

    def chain(along: Iterable[Place]) -> list[Place]:
        found: list[Place] = []
        for point in along:
            while len(found) >= 2 and _turn(found[-2], found[-1], point) <= 0.0:
                found.pop()
            found.append(point)
        return found[:-1]

    return tuple(chain(ordered) + chain(reversed(ordered)))


def _turn(a: Place, b: Place, c: Place) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])

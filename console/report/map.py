"""The map of a report: the world as a page draws it, the paths of bodies, and the places of lost packets.

Places are x, y in m, in the world frame.
"""

from __future__ import annotations

from collections import Counter, deque
from itertools import groupby
from math import isnan
from operator import itemgetter
from typing import Any, Final, NamedTuple

from foosim.capture.rows import PacketRow
from foosim.console.report.tallies import Reservoir
from foosim.console.shown.drawing import Drawing
from foosim.console.shown.tracks import is_jump
from foosim.deployment.network.rules import selects
from foosim.deployment.schema import Deployment
from foosim.vhub.line_of_sight.placement import World
from foosim.world.frame import Frame
from foosim.world.scene import ORIGIN

FRAMES_KEPT: Final = 256
"""Captured frames whose places are kept, for packets whose loss is known late."""
PATH_POINTS: Final = 200, 1000
"""Places of a body that are kept: in a world of many bodies, and of few."""
ALL_POINTS: Final = 50_000
LOSSES_KEPT: Final = 2000
LINKS_OF_LOSSES: Final = 50
DIGITS_M: Final = 4

Place = tuple[float, float]


class Loss(NamedTuple):
    """A lost packet: the middle between its ends, or the end with a known place."""

    at: Place
    cause: str
    source: str
    destination: str
    sent_ns: int


class _Way:
    """The places of a body in pieces, thinned to at most `most`."""

    def __init__(self, most: int) -> None:
        self.last: Place = (0.0, 0.0)
        self._most = most
        self._last_ns = -1
        """-1 where the next place begins a piece."""
        self._points: list[tuple[int, Place]] = []
        """Numbers of pieces, and places."""
        self._piece, self._stride, self._count = 0, 1, 0

    def cut(self) -> None:
        """End the piece at its last place."""
        if self._last_ns >= 0 and self._points[-1] != (self._piece, self.last):
            self._points.append((self._piece, self.last))
        self._last_ns = -1

    def add(self, at_ns: int, place: Place) -> None:
        """Take the next place."""
        if self._last_ns >= 0 and is_jump(self.last, place, at_ns - self._last_ns):
            self.cut()
        if self._last_ns < 0:
            self._piece, self._count = self._piece + 1, 0
        if self._count % self._stride == 0:
            self._points.append((self._piece, place))
        self.last, self._last_ns, self._count = place, at_ns, self._count + 1
        if len(self._points) > self._most:
            del self._points[1::2]
            self._stride *= 2

    def pieces(self) -> list[list[Place]]:
        """Return the pieces, each to its last place."""
        end = (self._piece, self.last)
        points = self._points if self._points[-1] == end or self._last_ns < 0 else [*self._points, end]
        return [[place for _, place in piece] for _, piece in groupby(points, itemgetter(0))]


class MapMaker:
    """Takes frames and lost packets in the order of the file."""

    def __init__(self, deployment: Deployment) -> None:
        self._tick_ns = deployment.tick_ns
        self._drawing = Drawing(deployment)
        self._world = World(deployment, deployment.network)
        bodies, written = self._drawing.entities, list(deployment.network.places)
        self._placed = [
            name
            for name in deployment.endpoints()
            if self._world.body(name) in bodies or any(selects([glob], name) for glob in written)
        ]
        """The endpoints with a known place."""
        least, most = PATH_POINTS
        self._points = max(least, min(most, ALL_POINTS // max(1, len(bodies))))
        self._frame: Frame | None = None
        self._frames: deque[tuple[int, dict[str, Place]]] = deque(maxlen=FRAMES_KEPT)
        self._ways: dict[str, _Way] = {}
        """Of each body that was present."""
        self._losses: Reservoir[Loss] = Reservoir(LOSSES_KEPT, "losses")
        self._placeless = 0
        self._counts: Counter[tuple[str, str, str]] = Counter()

    def take_frame(self, frame: Frame) -> None:
        """Take the next captured frame."""
        self._frame = frame
        self._world.turn_to(frame)
        at_ns = frame.tick * self._tick_ns
        absent = {entity.name for entity in frame.layout.entities if entity.is_absent(frame.numbers)}
        placed = [name for name in self._placed if self._world.body(name) not in absent]
        self._frames.append((at_ns, {name: self._world.antenna(name, ORIGIN)[:2] for name in placed}))
        for body in self._drawing.entities:
            if body not in absent:
                way = self._ways.setdefault(body, _Way(self._points))
                way.add(at_ns, self._world.antenna(body, ORIGIN)[:2])
            elif body in self._ways:
                self._ways[body].cut()

    def take_loss(self, row: PacketRow) -> None:
        """Take a dropped packet."""
        self._counts[row.source, row.destination, row.cause] += 1
        # Those of the last captured frame at or before, or of the first one that is kept.
        first = self._frames[0][1] if self._frames else {}
        places = next((places for at_ns, places in reversed(self._frames) if at_ns <= row.sent_ns), first)
        ends = [places[end] for end in (row.source, row.destination) if end in places]
        if not ends:
            self._placeless += 1
            return
        at = sum(x for x, _ in ends) / len(ends), sum(y for _, y in ends) / len(ends)
        self._losses.add(Loss(at, row.cause, row.source, row.destination, row.sent_ns))

    def result(self) -> dict[str, Any]:
        """Return the map: `tracks` of bodies, `standing` endpoints without a body, `losses`, the `lost` packets,
        those `placeless` among them, and the `links` with most losses."""
        present = {name for name, row in self._drawing.entities.items() if not isnan(self._poses()[row][0])}
        tracks = [
            {
                "name": name,
                "at": _rounded(way.last),
                "is_gone": name not in present,
                "pieces": [[_rounded(place) for place in piece] for piece in way.pieces()],
            }
            for name, way in sorted(self._ways.items())
        ]
        last = self._frames[-1][1] if self._frames else {}
        links = sorted(self._counts.items(), key=lambda entry: (-entry[1], entry[0]))[:LINKS_OF_LOSSES]
        return {
            "tracks": tracks,
            "standing": {name: at for name, at in last.items() if self._world.body(name) not in self._drawing.entities},
            "losses": [{**loss._asdict(), "at": _rounded(loss.at)} for loss in self._losses.kept],
            "lost": self._counts.total(),
            "placeless": self._placeless,
            "links": [(*ends, count) for ends, count in links],
        }

    def drawn(self) -> dict[str, Any]:
        """Return the scene as pages read it, without parts that are invisible from above, and the last poses.

        Both are empty where the capture has no frame.
        """
        if self._frame is None:
            return {"scene": None, "poses": []}
        scene = self._drawing.content()
        meshes = {key: {**mesh, "triangles": ""} for key, mesh in scene["meshes"].items()}
        kept = {key: scene[key] for key in ("links", "scenery", "bodies", "bounds")}
        poses = [[None if isnan(number) else round(number, 6) for number in row] for row in self._poses()]
        return {"scene": {**kept, "meshes": meshes}, "poses": poses}

    def _poses(self) -> list[list[float]]:
        if self._frame is None:
            return [[float("nan")] * 7 for _ in self._drawing.links]
        poses: list[list[float]] = self._drawing.poser.poses(self._frame.values).tolist()
        return poses


def _rounded(place: Place) -> Place:
    return round(place[0], DIGITS_M), round(place[1], DIGITS_M)

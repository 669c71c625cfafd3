"""Recorded poses as a source of the page: a recorded reality, beside a capture or as a ghost in it.

What has the name of a link or an entity of the other source is drawn as that; all else is a small sphere.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Mapping
from math import nan
from pathlib import Path
from typing import Any, Final

import numpy as np

from foosim.console.clock.comparing import Compare, compare
from foosim.console.clock.deck import VERBS, Clock, Deck
from foosim.console.recorded.poses_csv import BadPoses, read_tracks
from foosim.console.shown.scene_json import scene_content
from foosim.console.shown.source import About, Answered, Curve, Feed, InvalidRequest, Moment, Wanted
from foosim.console.shown.tracks import Pose, Track
from foosim.deployment.schema import Deployment
from foosim.world.assembly.world import build_scene
from foosim.world.layout import build_layout

TICK_NS: Final = 1_000_000
"""Of a table that is looked at by itself."""
MARKER_M: Final = 0.03
MARKER_COLOUR: Final = (0.9, 0.6, 0.1, 1.0)
UNSEEN_HZ: Final = 2.0
BYTES_MAX: Final = 4 * 1024**3
NOWHERE: Final = (nan,) * 7
"""The pose of a link without one at a time."""


def load_tracks(path: Path) -> dict[str, Track]:
    """Return the tracks of a file. Raises BadPoses."""
    try:
        if path.stat().st_size > BYTES_MAX:
            raise BadPoses(f"{path}: larger than {BYTES_MAX} bytes")
        with path.open(encoding="utf-8", newline="") as lines:
            return read_tracks(lines, str(path))
    except UnicodeDecodeError as error:
        raise BadPoses(f"{path}: not a text in UTF-8, {error.reason} at byte {error.start}") from None
    except OSError as error:
        raise BadPoses(f"{path}: cannot be read, {error.strerror or error}") from None


class PosesSource:
    """A table of poses. Without a `clock` it has a deck of its own, else it follows."""

    def __init__(
        self,
        path: Path,
        clock: Clock | None = None,
        offset_ns: int = 0,
        deployment: Deployment | None = None,
        compare: Compare | None = None,
    ) -> None:
        """`offset_ns`: the table's time at time 0 of the clock. `deployment`: whose links are drawn. `compare`:
        what it is compared with. Raises BadPoses.
        """
        self.tracks: Final = load_tracks(path)
        first_ns = min(int(track.times_ns[0]) for track in self.tracks.values())
        last_ns = max(int(track.times_ns[-1]) for track in self.tracks.values())
        self.offset_ns: Final = offset_ns
        self._deck: Deck | None = None
        """The clock, where it is this table's own."""
        if clock is None:
            clock = self._deck = Deck(first_ns // TICK_NS, -(-last_ns // TICK_NS), TICK_NS, time.monotonic_ns)
        self.clock: Final = clock
        first, last = ((time_ns - offset_ns) // clock.tick_ns for time_ns in (first_ns, last_ns))
        self._covers = first, last
        verbs = VERBS if self._deck is not None else ()
        world = "" if deployment is None else deployment.world
        self.about = About("poses", path.name, world, clock.tick_ns, verbs, (first, last))
        self._scene = _scene(self.tracks, deployment)
        self._compare = compare
        self._wanted = Wanted()

    def covers(self) -> tuple[int, int]:
        """Return the first and the last tick of the clock at which something is known."""
        return self._covers

    def want(self, wanted: Wanted) -> None:
        self._wanted = wanted
        self.clock.changed()

    def where(self, time_ns: int) -> dict[str, Pose]:
        """Return the known poses at a time of the clock, by name."""
        found = {name: track.at(time_ns + self.offset_ns) for name, track in self.tracks.items()}
        return {name: pose for name, pose in found.items() if pose is not None}

    async def run(self, feed: Feed) -> None:
        feed.describe(self.about, self._scene)
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._show(feed))
            if self._compare is not None:
                tasks.create_task(compare(feed, self.clock, self._compare, lambda: self.where, self.covers))

    async def _show(self, feed: Feed) -> None:
        names = [link["name"] for link in self._scene["links"]]
        clock, jumps = self.clock, self.clock.jumps
        shown: tuple[int, int, bool] | None = None
        while True:
            seen, time_ns = clock.changes, clock.time_ns()
            wish = time_ns, clock.jumps, clock.paused
            if wish != shown:
                known = self.where(time_ns)
                rows = [(*known[name][0], *known[name][1]) if name in known else NOWHERE for name in names]
                poses = np.array(rows, np.float32).reshape(len(names), 7)
                moment = Moment(time_ns / clock.tick_ns, poses, np.empty(0), clock.jumps != jumps, clock.paused)
                feed.show(moment)
                shown, jumps = wish, clock.jumps
            period_ns = round(1e9 / (self._wanted.hz or UNSEEN_HZ))
            await clock.wait(None if clock.paused else clock.clock_ns() + period_ns, seen)

    def eyes(self) -> None:
        """It has no frames."""

    async def request(self, verb: str, arguments: Mapping[str, Any], who: str) -> Answered:
        if self._deck is None:
            raise InvalidRequest("recorded poses follow the first source: send the request to that one")
        return self._deck.request(verb, arguments, lambda tick, later: tick + (1 if later else -1))

    async def history(self, curve: Curve) -> tuple[str, str, list[tuple[float, float]]]:
        return "", "", []


def _scene(tracks: Mapping[str, Track], deployment: Deployment | None) -> dict[str, Any]:
    """Return the scene of a table: shapes of the deployment's entities, markers for other names."""
    links: list[dict[str, Any]] = []
    models: dict[str, str] = {}
    known: dict[str, dict[str, Any]] = {}
    content: dict[str, Any] = {}
    if deployment is not None:
        layout = build_layout(deployment)
        scene = build_scene(deployment, layout)
        content = scene_content(deployment, layout, scene)
        known = {link["name"]: link for link in content["links"]}
        last = {name: body.links[-1].name for name, body in scene.bodies.items()}
        known |= {name: known[link] for name, link in last.items()}
        models = {name: body.model for name, body in scene.bodies.items()}
    marker = {"kind": "sphere", "radius": MARKER_M, "position": (0.0, 0.0, 0.0), "orientation": (0.0, 0.0, 0.0, 1.0)}
    for name in tracks:
        shapes = known[name]["shapes"] if name in known else [{**marker, "colour": MARKER_COLOUR, "name": ""}]
        links.append({"name": name, "body": name, "shapes": shapes})
    still = {"robot": False, "removable": False, "pushable": False, "settable": {}}
    bodies = [
        {"name": name, "model": models.get(name, ""), "links": [place], **still} for place, name in enumerate(tracks)
    ]
    empty = {"layout": "", "scenery": [], "fields": [], "commands": [], "sensors": [], "marks": {}}
    return {**empty, "meshes": content.get("meshes", {}), "links": links, "bodies": bodies, "bounds": _bounds(tracks)}


def _bounds(tracks: Mapping[str, Track]) -> tuple[list[float], list[float]]:
    places = np.concatenate([track.poses[:, :3] for track in tracks.values()])
    low, high = places.min(axis=0) - MARKER_M, places.max(axis=0) + MARKER_M
    return low.tolist(), high.tolist()

"""Converts messages of a running system: frames to moments, statuses to messages, requests to marks.

Pure.
"""

from __future__ import annotations

import re
from base64 import b64decode
from collections import OrderedDict
from collections.abc import Callable, Collection, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

from foosim.common.errors import Malformed
from foosim.console.live.history import History
from foosim.console.live.watched import Watched
from foosim.console.shown.drawing import Drawing
from foosim.console.shown.links import Links
from foosim.console.shown.source import About, Curve, Moment, Wanted
from foosim.console.shown.timeline import NETWORK, Mark, WorldEvents
from foosim.deployment.loader import load_deployment
from foosim.deployment.network.rules import Event
from foosim.deployment.network.settings_text import event_words
from foosim.deployment.schema import Deployment
from foosim.launcher.display import recovery_text
from foosim.protocol.codec import decode
from foosim.protocol.messages import Commit
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.frame import Frame, frame_from_bytes
from foosim.world.layout import build_layout

ASKERS_KEPT: Final = 256
_OWN_NAME: Final = re.compile(r"(operator|viewer)-([0-9]+)-[0-9a-f]{7}")
_CERTIFIED: Final = re.compile(r"\.[0-9a-f]{7}$")
LINKS_EVERY: Final = 2
"""Statuses: the vHub counts links anew twice a second."""
Files = Callable[[Deployment], Mapping[str, bytes]]
"""Fetches the files that a deployment names."""


@dataclass(frozen=True, slots=True)
class World:
    """One layout of a run: how it is drawn, what its links are, the frame that it is described with."""

    drawing: Drawing
    links: Links
    first: Frame | None


def readable(name: str) -> str:
    """Return an operator's name without what makes it unique: `operator (process 4711)`, or that of its certificate."""
    alone = _OWN_NAME.fullmatch(name)
    return f"{alone[1]} (process {alone[2]})" if alone else _CERTIFIED.sub("", name)


class Following:
    """The known state of one run."""

    def __init__(self, about: About) -> None:
        self.about = about
        self.is_stale = False
        """Frames came that do not fit the layout."""
        self._text = ""
        self._world: World | None = None
        self._frame: Frame | None = None
        """The newest one that was shown."""
        self._is_paused = self._has_changed = False
        self._history, self._wanted = History(about.tick_ns), Wanted()
        self._marks = StatusMarks()
        self._events: WorldEvents | None = None
        self._planned: list[Event] = []
        """Events of the deployment's network that are not marked yet, the last one first."""
        self._watched: Watched | None = None
        self._statuses = 0
        self._disturbers: dict[int, str] = {}
        """The requester of an event of the network, by the tick from which it applies."""
        self.stopped_by = ""
        """The requester of the run's end; empty without one."""
        self._askers: OrderedDict[tuple[str, int, str], str] = OrderedDict()
        """The requesting browser, by the request's sender, tick and verb."""

    # --- the world ---------------------------------------------------------------------------------------------------

    def world_of(self, what: Mapping[str, Any], files: Files) -> World:
        """Return the world of an answer to `describe`: the present one where it is the same.

        It may take a while, and changes nothing: for a thread. Raises Refused for what cannot be read.
        """
        known = self._world
        if known is not None and what["deployment"] == self._text:
            deployment = known.drawing.deployment
            if known.drawing.layout.digest.hex() == what["layout"]:
                return replace(known, first=_first(known.drawing, what))
        else:
            known = None
            deployment = load_deployment(what["deployment"], what["deployment_name"])
            if deployment.files():
                deployment = deployment.with_assets(files(deployment))
        layout = build_layout(deployment)
        if layout.digest.hex() != what["layout"]:
            raise Malformed(
                f"run {what['run']} has another layout of its deployment: another version of foosim runs it"
            )
        drawing = Drawing(deployment, layout)
        links = Links(deployment) if known is None else known.links
        return World(drawing, links, _first(drawing, what))

    def turn_to(self, what: Mapping[str, Any], world: World) -> bool:
        """Show this world from here on; return whether its scene is new."""
        self._text, self.is_stale = what["deployment"], False
        before, self._world = self._world, world
        deployment = world.drawing.deployment
        self.about = replace(self.about, name=what["run"], world=deployment.world, tick_ns=deployment.tick_ns)
        is_new = before is None or before.drawing is not world.drawing
        if is_new:
            self._frame = None
            if before is None or before.drawing.deployment is not deployment:
                self._events, self._watched = WorldEvents(deployment), Watched(deployment)
                self._history = History(deployment.tick_ns)
                self._history.listen(self._wanted)
                self._planned = sorted(deployment.network.events, key=lambda event: event.at_ns, reverse=True)
            world.links.turn_to(world.drawing.scene)
        return is_new

    def content(self) -> dict[str, Any]:
        """Return the scene of the world as pages read it."""
        assert self._world is not None, "described first"
        return self._world.drawing.content()

    def first_moment(self) -> Moment | None:
        """Return the moment of the frame that came with the description."""
        assert self._world is not None, "described first"
        world, frame = self._world, self._world.first
        if frame is None or (self._frame is not None and self._frame.tick == frame.tick):
            return None
        self._frame = frame
        return world.drawing.moment(frame, jump=True, paused=self._is_paused)

    # --- frames ------------------------------------------------------------------------------------------------------

    def read(self, payload: bytes) -> tuple[World, Frame] | None:
        """Return the frame of a commit; None, and the layout is stale, where it does not fit."""
        world = self._world
        if world is None:
            return None
        try:
            commit = decode(Commit, payload)
            frame = frame_from_bytes(commit.tick, world.drawing.layout, commit.values, commit.outboxes)
        except Malformed:
            self.is_stale = True
            return None
        if frame.digest != commit.digest:
            self.is_stale = True
            return None
        return world, frame

    def show(self, world: World, frame: Frame) -> Moment:
        """Return the moment of a frame that was just read."""
        jump = self._frame is None or frame.tick < self._frame.tick
        self._frame = frame
        self._history.keep_frame(frame)
        if self._watched is not None:
            self._watched.keep(frame)
        return world.drawing.moment(frame, jump=jump, paused=self._is_paused)

    def overlays(self, wanted: Collection[str]) -> list[dict[str, Any]]:
        """Return the messages with the overlays of the newest frame."""
        if self._world is None or self._frame is None:
            return []
        return self._world.drawing.overlays(self._frame, wanted)

    def listen(self, wanted: Wanted) -> None:
        """Set what browsers watch from now on: nothing else is received."""
        self._wanted = wanted
        self._history.listen(wanted)

    def points(self, curve: Curve) -> Callable[[], list[tuple[float, float]]]:
        """Return a function that makes the recorded points of a curve, in any thread."""
        return list if self._world is None else self._history.reader(curve, self._world.drawing.layout)

    # --- statuses ----------------------------------------------------------------------------------------------------

    def watch_arguments(self, wanted: Wanted, hz_max: float) -> dict[str, Any]:
        """Return the arguments of a lease request, without names that this world does not have."""
        assert self._world is not None, "described first"
        deployment = self._world.drawing.deployment
        ends = set(deployment.endpoints())
        links = [link for link in wanted.links if ends.issuperset(link)]
        robots = deployment.robots
        readings = [pair for pair in wanted.readings if pair[0] in robots and pair[1] in robots[pair[0]].sensors]
        return {"hz": min(wanted.hz, hz_max), "links": links, "readings": readings}

    def asked(self, sender: str, tick: int, verb: str, who: str) -> None:
        """Record which browser has sent a request."""
        self._askers[sender, tick, verb] = who
        if verb == "down":
            self.stopped_by = who
        if len(self._askers) > ASKERS_KEPT:
            self._askers.popitem(last=False)

    def take_status(self, status: dict[str, Any]) -> list[dict[str, Any]]:
        """Return the messages that a status makes, itself among them."""
        requests = [
            {**asked, "who": self._askers.get((asked["who"], asked["tick"], asked["verb"]), readable(asked["who"]))}
            for asked in status["requests"]
        ]
        status = {**status, "requests": requests}
        self._disturbers = {asked["tick"]: asked["who"] for asked in requests if asked["verb"] == "network"}
        self.stopped_by = next((asked["who"] for asked in requests if asked["verb"] == "down"), self.stopped_by)
        was_paused, self._is_paused = self._is_paused, status["state"] == "paused"
        self._has_changed = was_paused != self._is_paused
        messages: list[dict[str, Any]] = [{"type": "status", "status": status}]
        marks = self._marks.new(status)
        while self._planned and self._planned[-1].at_ns <= status["ticks"] * status["tick_ns"]:
            event = self._planned.pop()
            marks.append(asdict(Mark(event.at_ns // status["tick_ns"], NETWORK, event_words(event))))
        if self._events is not None and self._frame is not None:
            marks += map(asdict, self._events.take(self._frame))
        if marks:
            messages.append({"type": "marks", "marks": marks})
        if self._statuses % LINKS_EVERY == 0 and self._world is not None:
            if self._frame is not None:
                self._world.links.move(self._frame)
            messages.append(self._world.links.message(status))
        self._statuses += 1
        if self._watched is not None:
            messages += self._watched.readings(status["watched"])
        for message in messages:
            self._history.keep(message)
        return messages

    def explained(self, status: Mapping[str, Any], wanted: Wanted) -> list[dict[str, Any]]:
        """Return the messages about links that are watched. It takes a while: for a thread."""
        report, drops = status["watched"], status["watched"].get("drops", {})
        watched = self._watched
        if watched is None:
            return []
        links = [link for link in wanted.links if f"{link[0]}>{link[1]}" in drops]
        return watched.drops(report, links, status["ticks"] * status["tick_ns"], self._disturbers)

    def standing_moment(self) -> Moment | None:
        """Return the last moment again where the run has just paused or gone on, which pages show."""
        if not self._has_changed or self._world is None or self._frame is None:
            return None
        self._has_changed = False
        return self._world.drawing.moment(self._frame, paused=self._is_paused)


def _first(drawing: Drawing, what: Mapping[str, Any]) -> Frame | None:
    """Return the frame that a description has; before the first tick of a run from the start that is frame 0."""
    if what["frame"] is None:
        is_start = what["tick"] == 0
        return initial_frame(drawing.deployment) if is_start else None
    commit = decode(Commit, b64decode(what["frame"]))
    return frame_from_bytes(commit.tick, drawing.layout, commit.values, commit.outboxes)


class StatusMarks:
    """What is marked on the time line out of statuses: losses and returns, requests, each once."""

    def __init__(self) -> None:
        self._recoveries = 0
        self._requests: set[tuple[Any, ...]] = set()

    def new(self, status: Mapping[str, Any]) -> list[dict[str, Any]]:
        """Return the marks that a status adds."""
        marks = []
        for entry in status["recoveries"][self._recoveries :]:
            if entry["outage_ms"] is None:
                break  # it is marked when it has ended
            marks.append({"tick": entry["tick"], "kind": "recovery", "text": recovery_text(entry)})
            self._recoveries += 1
        requests = [(asked["tick"], asked["verb"], asked["text"], asked["who"]) for asked in status["requests"]]
        for tick, verb, text, who in requests:
            if (tick, verb, text, who) not in self._requests:
                marks.append({"tick": tick, "kind": "request", "text": f"{who}: {text}"})
        self._requests = set(requests)
        return marks

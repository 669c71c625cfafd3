"""Converts messages of a running system: frames to moments, statuses to messages, requests to marks.

Pure.
"""

from __future__ import annotations

import re
from base64 import b64decode
from collections import OrderedDict
from collections.abc import Callable, Collection, Mapping
from dataclasses import asdict, replace
from functools import partial
from typing import Any, Final

from foosim.common.errors import BadValue, Malformed
from foosim.console.live.history import History
from foosim.console.live.watched import WatchList
from foosim.console.shown.drawing import Drawing
from foosim.console.shown.links import Links
from foosim.console.shown.source import About, Curve, Eyes, Moment, Wanted
from foosim.console.shown.timeline import NETWORK, Mark, WorldEvents
from foosim.deployment.loader import load_deployment
from foosim.deployment.network.settings_text import event_words
from foosim.deployment.schema import Deployment
from foosim.launcher.display import recovery_text
from foosim.protocol.codec import decode
from foosim.protocol.messages import Commit
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.frame import Frame, frame_from_bytes

REQUESTERS_KEPT: Final = 256
_OWN_NAME: Final = re.compile(r"(operator|viewer)-([0-9]+)-[0-9a-f]{7}")
_CERTIFIED: Final = re.compile(r"\.[0-9a-f]{7}$")
LINKS_EVERY: Final = 2
"""Statuses: the vHub counts links anew twice a second."""
Files = Callable[[Deployment], Mapping[str, bytes]]
"""Fetches the files that a deployment names."""


class World:
    """The known world of a run: its drawing, and the kept part of the received data."""

    def __init__(self, deployment: Deployment) -> None:
        self.drawing = Drawing(deployment)
        self.links = Links(deployment, self.drawing.entities)
        self.events, self.watched = WorldEvents(deployment), WatchList(deployment)
        self.history = History(deployment.tick_ns)
        self.planned = sorted(deployment.network.events, key=lambda event: event.at_ns, reverse=True)
        """Unmarked events of the deployment's network, the last one first."""
        self.newest: Frame | None = None
        """The newest frame that was shown."""


def readable(name: str) -> str:
    """Return an operator's name without its unique part: `operator (process 4711)`, or that of its certificate."""
    alone = _OWN_NAME.fullmatch(name)
    return f"{alone[1]} (process {alone[2]})" if alone else _CERTIFIED.sub("", name)


class Following:
    """The known state of one run."""

    def __init__(self, about: About) -> None:
        self.about = about
        self._text = ""
        self._world: World | None = None
        self._is_paused = self._has_changed = False
        self._wanted = Wanted()
        self._recoveries = 0
        self._marked: set[tuple[Any, ...]] = set()
        """The recoveries and the requests that are marked."""
        self._statuses = 0
        self._disturbers: dict[int, str] = {}
        """The requester of an event of the network, by the tick from which it applies."""
        self.stopped_by = ""
        """The requester of the run's end; empty without one."""
        self._requesters: OrderedDict[tuple[str, int, str], str] = OrderedDict()
        """The requesting browser, by the request's sender, tick and verb."""

    # --- the world ---------------------------------------------------------------------------------------------------

    def world_of(self, what: Mapping[str, Any], files: Files) -> World:
        """Return the world of an answer to `describe`: the present one where it is the same.

        It may take a while, and changes nothing: for a thread. Raises Refused for unreadable content.
        """
        if self._world is not None and what["deployment"] == self._text:
            return self._world
        deployment = load_deployment(what["deployment"], what["deployment_name"])
        if deployment.files():
            deployment = deployment.with_assets(files(deployment))
        world = World(deployment)
        if world.drawing.layout.digest.hex() != what["layout"]:
            raise Malformed(f"run {what['run']} has another layout: another version of foosim runs it")
        return world

    def turn_to(self, what: Mapping[str, Any], world: World) -> bool:
        """Show this world from here on; return whether its scene is new."""
        is_new = world is not self._world
        if is_new:
            self._text, self._world = what["deployment"], world
            deployment = world.drawing.deployment
            self.about = replace(self.about, name=what["run"], world=deployment.world, tick_ns=deployment.tick_ns)
            world.history.listen(self._wanted)
        return is_new

    def content(self) -> dict[str, Any]:
        """Return the scene of the world as pages read it."""
        return self._described.drawing.content()

    def check_present(self, robot: object) -> None:
        """Raise BadValue for a robot that is absent in the newest frame."""
        newest = None if self._world is None else self._world.newest
        if newest is not None and any(
            one.name == robot and one.is_absent(newest.numbers) for one in newest.layout.robots
        ):
            raise BadValue("the robot is absent: add it first", robot)

    @property
    def _described(self) -> World:
        assert self._world is not None, "described first"
        return self._world

    def first_moment(self, frame: Frame | None) -> Moment | None:
        """Return the moment of the frame that came with the description; None where it is shown already."""
        world = self._described
        if frame is None or (world.newest is not None and world.newest.tick == frame.tick):
            return None
        world.newest = frame
        return world.drawing.moment(frame, jump=True, paused=self._is_paused)

    # --- frames ------------------------------------------------------------------------------------------------------

    def show(self, payload: bytes) -> Moment | None:
        """Return the moment of a commit; None for a commit of another world."""
        world = self._world
        if world is None:
            return None
        try:
            commit = decode(Commit, payload)
            frame = _frame_of(world.drawing, commit)
        except Malformed:
            return None
        if frame.digest != commit.digest:
            return None
        jump = world.newest is None or frame.tick < world.newest.tick
        world.newest = frame
        moment = world.drawing.moment(frame, jump=jump, paused=self._is_paused)
        world.history.keep_frame(frame.tick, moment.values)
        world.watched.keep(frame)
        return moment

    def eyes(self) -> Eyes | None:
        """Return what draws the pictures of cameras at the newest frame; None before the first one."""
        world = self._world
        if world is None or world.newest is None:
            return None
        return world.newest.tick, partial(world.drawing.picture, world.newest)

    def overlays(self, wanted: Collection[str]) -> list[dict[str, Any]]:
        """Return the messages with the overlays of the newest frame."""
        world = self._world
        return [] if world is None or world.newest is None else world.drawing.overlays(world.newest, wanted)

    def listen(self, wanted: Wanted) -> None:
        """Set the data that browsers watch from now on: nothing else is received."""
        self._wanted = wanted
        if self._world is not None:
            self._world.history.listen(wanted)

    def points(self, curve: Curve) -> Callable[[], list[tuple[float, float]]]:
        """Return a function that makes the recorded points of a curve, in any thread."""
        return list if self._world is None else self._world.history.reader(curve)

    # --- statuses ----------------------------------------------------------------------------------------------------

    def watch_arguments(self, wanted: Wanted, hz_max: float) -> dict[str, Any]:
        """Return the arguments of a lease request, without names that this world does not have."""
        deployment = self._described.drawing.deployment
        ends = set(deployment.endpoints())
        links = [link for link in wanted.links if ends.issuperset(link)]
        robots = deployment.robots
        readings = [pair for pair in wanted.readings if pair[0] in robots and pair[1] in robots[pair[0]].sensors]
        return {"hz": min(wanted.hz, hz_max), "links": links, "readings": readings}

    def keep_requester(self, sender: str, tick: int, verb: str, who: str) -> None:
        """Keep which browser has sent a request."""
        self._requesters[sender, tick, verb] = who
        if verb == "down":
            self.stopped_by = who
        if len(self._requesters) > REQUESTERS_KEPT:
            self._requesters.popitem(last=False)

    def take_status(self, status: dict[str, Any]) -> list[dict[str, Any]]:
        """Return the messages that follow from a status, itself among them."""
        world = self._described
        requests = [
            {**one, "who": self._requesters.get((one["who"], one["tick"], one["verb"]), readable(one["who"]))}
            for one in status["requests"]
        ]
        status = {**status, "requests": requests}
        self._disturbers = {one["tick"]: one["who"] for one in requests if one["verb"] == "network"}
        self.stopped_by = next((one["who"] for one in requests if one["verb"] == "down"), self.stopped_by)
        was_paused, self._is_paused = self._is_paused, status["state"] == "paused"
        self._has_changed = was_paused != self._is_paused
        messages: list[dict[str, Any]] = [{"type": "status", "status": status}]
        marks = self._new_marks(status)
        while world.planned and world.planned[-1].at_ns <= status["ticks"] * status["tick_ns"]:
            event = world.planned.pop()
            marks.append(asdict(Mark(event.at_ns // status["tick_ns"], NETWORK, event_words(event))))
        if world.newest is not None:
            marks += map(asdict, world.events.take(world.newest))
        if marks:
            messages.append({"type": "marks", "marks": marks})
        if self._statuses % LINKS_EVERY == 0:
            if world.newest is not None:
                world.links.move(world.newest)
            messages.append(world.links.message(status))
        self._statuses += 1
        messages += world.watched.readings(status["watched"])
        for message in messages:
            world.history.keep(message)
        return messages

    def _new_marks(self, status: Mapping[str, Any]) -> list[dict[str, Any]]:
        """Return the marks that a status adds: losses and returns, requests, each once."""
        marks = []
        for entry in status["recoveries"][self._recoveries :]:
            if entry["outage_ms"] is None:
                break  # it is marked when it has ended
            marks.append({"tick": entry["tick"], "kind": "recovery", "text": recovery_text(entry)})
            self._recoveries += 1
        requests = [(one["tick"], one["verb"], one["text"], one["who"]) for one in status["requests"]]
        for tick, verb, text, who in requests:
            if (tick, verb, text, who) not in self._marked:
                marks.append({"tick": tick, "kind": "request", "text": f"{who}: {text}"})
        self._marked = set(requests)
        return marks

    def explained(self, status: Mapping[str, Any], wanted: Wanted) -> list[dict[str, Any]]:
        """Return the messages about links that are watched. It takes a while: for a thread."""
        report, drops = status["watched"], status["watched"].get("drops", {})
        links = [link for link in wanted.links if f"{link[0]}>{link[1]}" in drops]
        return self._described.watched.drops(report, links, status["ticks"] * status["tick_ns"], self._disturbers)

    def standing_moment(self) -> Moment | None:
        """Return the last moment again where the run has just paused or resumed, which pages show."""
        world = self._world
        if not self._has_changed or world is None or world.newest is None:
            return None
        self._has_changed = False
        return world.drawing.moment(world.newest, paused=self._is_paused)


def first_frame(drawing: Drawing, what: Mapping[str, Any]) -> Frame | None:
    """Return the frame of a description; before the first tick of a run from the start that is frame 0."""
    if what["frame"] is None:
        is_start = what["tick"] == 0
        return initial_frame(drawing.deployment) if is_start else None
    return _frame_of(drawing, decode(Commit, b64decode(what["frame"])))


def _frame_of(drawing: Drawing, commit: Commit) -> Frame:
    """Return the frame of a commit. Raises Malformed."""
    return frame_from_bytes(commit.tick, drawing.layout, commit.values, commit.outboxes)

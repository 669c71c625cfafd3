"""The sources of a page: a running system, a capture, a replay, recorded poses; all behind one interface.

A `Source` runs inside the console's event loop and feeds a `Feed` with its world: its scene, its moments, and messages
in the form that pages read (docs/reference/console.md lists them). It knows no browser; `want` gives what all browsers
together look at. Whatever takes longer than a millisecond or waits goes into a thread of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from foosim.common.errors import Refused

Kind = Literal["live", "capture", "replay", "poses"]
Link = tuple[str, str]
"""Names of sender and receiver."""
Reading = tuple[str, str]
"""Names of a robot and of its channel."""
Eyes = tuple[int, Callable[[str, str, str], bytes]]
"""A tick, and a function for any thread that draws PNG: of a robot's camera, its channel, the kind of the picture."""
FIGURES: Final = ("offered", "delivered", "dropped", "loss", "delay_ms", "queue_ms")
"""What can be plotted of a link."""


class InvalidRequest(Refused):
    """A source has no such verb, or not for this browser; the text lists the valid ones."""


@dataclass(frozen=True, slots=True)
class About:
    """The description of a source, sent before its scene."""

    kind: Kind
    name: str
    """Of the run, or of the file."""
    world: str
    tick_ns: int
    verbs: tuple[str, ...]
    """The verbs of an operator."""
    span: tuple[int, int] | None = None
    """First and last tick of a source with an end."""


@dataclass(frozen=True, slots=True)
class Moment:
    """The visible state at one tick."""

    tick: float
    poses: NDArray[np.float32]
    """Of each link of the scene, in its order, shape (links, 7): x, y, z in m, quaternion x, y, z, w; world frame. Not
    a number where it is absent, or where its pose is not known."""
    values: NDArray[np.float64]
    """The frame's numbers, which the scene's `fields` index; NaN for absent entities, empty without a frame."""
    jump: bool = False
    """Not the moment after the one before: paths are cut here."""
    paused: bool = False


@dataclass(frozen=True, slots=True)
class Wanted:
    """The union of all browsers' subscriptions to one source."""

    readers: int = 0
    """How many browsers there are."""
    hz: float = 0.0
    """Moments a second; 0 when no browser draws them."""
    overlays: frozenset[str] = frozenset()
    links: tuple[Link, ...] = ()
    """Whose last drops are explained."""
    readings: tuple[Reading, ...] = ()
    """Whose values are plotted."""


@dataclass(frozen=True, slots=True)
class Answered:
    """Result of a request; `tick` is the one from which it holds."""

    text: str
    tick: int
    accepted: bool = True


@dataclass(frozen=True, slots=True)
class Curve:
    """One plotted thing: a number of the frame, a figure of a link, a value of the status, a number of a reading."""

    id: str
    field: int | None = None
    link: Link | None = None
    figure: str = ""
    status: str = ""
    """A path into the status, its keys joined by dots."""
    reading: Reading | None = None
    index: int = 0
    """Which of the reading's numbers."""


class Feed(Protocol):
    """Receives a source's messages. Called in the event loop's thread."""

    def describe(self, about: About, scene: Mapping[str, Any]) -> None:
        """Publish the scene (`scene_json.scene_content`) and the description of the source."""

    def show(self, moment: Moment) -> None:
        """Publish a moment; `poses` has as many rows as the scene has links."""

    def publish(self, message: Mapping[str, Any]) -> None:
        """Publish a message of one of the types `status`, `links`, `overlay`, `watched`, `readings`, `marks`,
        `compared`, `presence`, `note`; the number of the source is added."""


class Source(Protocol):
    """A world that a page shows."""

    @property
    def about(self) -> About:
        """Its description, valid before it runs and updated afterwards."""

    async def run(self, feed: Feed) -> None:
        """Publish the world to the feed until cancelled or complete."""

    def want(self, wanted: Wanted) -> None:
        """Take note of what the browsers look at. Called at each change, in the event loop's thread."""

    def eyes(self) -> Eyes | None:
        """Return what draws the pictures of cameras at the shown frame; None without a frame."""

    async def request(self, verb: str, arguments: Mapping[str, Any], who: str) -> Answered:
        """Execute a request; `who` names the browser. Raises Refused with the reason."""

    async def history(self, curve: Curve) -> tuple[str, str, list[tuple[float, float]]]:
        """Return name, unit and points (tick, value) of a curve so far; no points without a history."""

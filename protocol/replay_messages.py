"""The messages of a replay: what a capture is played as, to whoever listens on the replay plane.

Times are the capture's simulated ns. All of it travels on one channel, whose keys end in what it is (`STREAMS`): who
reads them all has one order. Requests and answers are those of `messages`. Neighbours: `channels`, `message_types`.
"""

from __future__ import annotations

from typing import Annotated, Final

from msgspec import Meta

from foosim.protocol import limits
from foosim.protocol.message_types import Counter, Item, Message, Name, Numbers, Payload, Text, Vector

PACKETS, POSES, SCENE, LOG, ROWS, CLOCK = "packets", "poses", "scene", "log", "rows", "clock"
STREAMS: Final = (PACKETS, POSES, SCENE, LOG, ROWS, CLOCK)
"""What a played message is: the last part of its key."""
LinkName = Annotated[str, Meta(min_length=1, max_length=2 * limits.NAME_LENGTH_MAX + 1)]
"""A body and its link, as `red.goal/slide`."""


class PlayedPacket(Message, frozen=True):
    """A packet, at the time at which it reached its receiver."""

    time_ns: Counter
    source: Name
    destination: Name
    channel: Name
    sequence: Counter
    copy: Counter
    sent_ns: Counter
    due_ns: Counter
    payload: Payload


class PlayedPose(Item, frozen=True):
    """Where a link is: m, and a quaternion x, y, z, w, in the world frame."""

    link: LinkName
    position: Vector
    orientation: tuple[float, float, float, float]


class PlayedPoses(Message, frozen=True):
    """The captured poses of all links at a time."""

    time_ns: Counter
    poses: Annotated[list[PlayedPose], Meta(max_length=limits.PACKETS_PER_MESSAGE_MAX)]


class PlayedScene(Message, frozen=True):
    """What there is to see and where it hangs: a Foxglove SceneUpdate, as Protobuf has it.

    It stands where it was captured; at a time from which is played it is the one that holds there.
    """

    time_ns: Counter
    update: Numbers


class PlayedLine(Message, frozen=True):
    """A line of the run's log."""

    time_ns: Counter
    level: Name
    text: Text


class PlayedRow(Message, frozen=True):
    """A row of any other kind, as the capture has it: JSON."""

    time_ns: Counter
    topic: Name
    row: Numbers


class ReplayClock(Message, frozen=True):
    """Where a replay is. `jumps` counts seeks and rounds of a loop: with it time goes on from elsewhere.

    `state` is `playing`, `paused`, `waiting` (for its beginning) or `ended`, which is the last message of each stream;
    `rate` is as people write it.
    """

    time_ns: Counter
    rate: Text
    state: Name
    jumps: Counter


Played = PlayedPacket | PlayedPoses | PlayedScene | PlayedLine | PlayedRow | ReplayClock

"""The messages of a replay on the replay plane.

Times are the capture's simulated ns. They share one channel, whose keys end in the stream: a reader of all streams
receives one order. Requests and answers are those of `messages`.
"""

from __future__ import annotations

from typing import Annotated, Final

from msgspec import Meta

from foosim.common import limits
from foosim.common.struct_types import Counter, Item, Message, Name, Numbers, Payload, Text, Vector

PACKETS, POSES, SCENE, LOG, ROWS, CLOCK = "packets", "poses", "scene", "log", "rows", "clock"
STREAMS: Final = (PACKETS, POSES, SCENE, LOG, ROWS, CLOCK)
"""The streams: the last part of a message's key."""
LinkName = Annotated[str, Meta(min_length=1, max_length=limits.NAME_LENGTH_MAX + 1 + limits.PART_NAME_LENGTH_MAX)]
"""A body and its link, as `red.attack/slide`."""


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
    """The pose of a link in the world frame: position in m, orientation as a quaternion x, y, z, w."""

    link: LinkName
    position: Vector
    orientation: tuple[float, float, float, float]


class PlayedPoses(Message, frozen=True):
    """The captured poses of all links at a time."""

    time_ns: Counter
    poses: Annotated[list[PlayedPose], Meta(max_length=limits.PACKETS_PER_MESSAGE_MAX)]


class PlayedScene(Message, frozen=True):
    """The scene from this time on: a Foxglove SceneUpdate as Protobuf.

    Its time is that of its capture; at the beginning of a replay or after a seek it is the newest one before.
    """

    time_ns: Counter
    update: Numbers


class PlayedLine(Message, frozen=True):
    """A line of the run's log."""

    time_ns: Counter
    level: Name
    text: Text


class PlayedRow(Message, frozen=True):
    """A row of any other topic (without its `/`), as JSON."""

    time_ns: Counter
    topic: Name
    row: Numbers


class ReplayClock(Message, frozen=True):
    """The time and state of a replay. `jumps` counts seeks and rounds of a loop.

    `state` is `playing`, `paused` or `ended`, which is the last message of each stream; `rate` is `realtime`, `fast` or
    a factor such as `2x`.
    """

    time_ns: Counter
    rate: Text
    state: Name
    jumps: Counter


Played = PlayedPacket | PlayedPoses | PlayedScene | PlayedLine | PlayedRow | ReplayClock

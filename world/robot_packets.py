"""Packets between a robot and the network: delivered to it, sent by it, or waiting in its outbox."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from foosim.common import limits
from foosim.common.struct_types import Counter, Item, Name, Payload


class Delivered(Item, frozen=True):
    """One packet that reaches a robot."""

    due_ns: Counter
    source: Name
    sequence: Counter
    copy: Counter
    destination: Name
    channel: Name
    payload: Payload


class RobotPacket(Item, frozen=True):
    """One packet that a robot sends. An empty `destination` is a broadcast to all subscribers of the channel."""

    robot: Name
    index: Annotated[int, Meta(ge=0, lt=limits.ROBOT_PACKETS_PER_TICK_MAX)]
    destination: Annotated[str, Meta(max_length=limits.NAME_LENGTH_MAX)]
    channel: Name
    payload: Payload


class OutboxPacket(Item, frozen=True):
    """One packet that waits in a robot's outbox for the next tick."""

    destination: Name
    channel: Name
    payload: Payload


class Outbox(Item, frozen=True):
    """The bytes in the outbox of the entity at `index` of the layout; entities with an empty one are left out."""

    index: Counter
    packets: Annotated[bytes, Meta(min_length=1, max_length=limits.OUTBOX_BYTES_MAX)]


Outboxes = Annotated[list[Outbox], Meta(max_length=limits.ENTITIES_MAX)]

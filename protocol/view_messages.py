"""The message by which the supervisor tells the vHub what people look at.

Neighbours: `message_types` has what messages share, `supervisor.viewing` says it, `vhub.watching` takes it.
"""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from foosim.protocol import limits
from foosim.protocol.message_types import Message, Name

Pairs = Annotated[list[tuple[Name, Name]], Meta(max_length=limits.WATCHED_MAX)]


class Watched(Message, frozen=True):
    """The links (source, destination) and readings (robot, channel) that somebody looks at; all others nobody does."""

    links: Pairs
    readings: Pairs

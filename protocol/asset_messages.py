"""The messages by which files travel that a deployment refers to; the same rules as for all others.

Neighbours: `message_types` has what they share, `fetching` says and takes them.
"""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from foosim.protocol import limits
from foosim.protocol.message_types import Counter, Digest, Message, Name


class Fetch(Message, frozen=True):
    """A process that builds the world asks for the file with this digest, from the byte at `offset` on."""

    name: Name
    boot: Name
    digest: Digest
    offset: Counter


class Piece(Message, frozen=True):
    """The bytes at `offset` of the file of `size` bytes with this digest."""

    name: Name
    boot: Name
    digest: Digest
    offset: Counter
    size: Annotated[int, Meta(ge=0, le=limits.ASSET_BYTES_MAX)]
    content: Annotated[bytes, Meta(max_length=limits.ASSET_PIECE_BYTES)]

"""Building blocks of messages: bounded field types, and the two kinds of struct.

Decoding validates by these: negative counters, oversized texts, lists and bytes are refused.
"""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from foosim.common import limits

Counter = Annotated[int, Meta(ge=0, le=limits.COUNTER_MAX)]
Name = Annotated[str, Meta(min_length=1, max_length=limits.NAME_LENGTH_MAX)]
Text = Annotated[str, Meta(max_length=limits.TEXT_LENGTH_MAX)]
Digest = Annotated[bytes, Meta(min_length=32, max_length=32)]
Payload = Annotated[bytes, Meta(max_length=limits.PAYLOAD_BYTES_MAX)]
Numbers = Annotated[bytes, Meta(max_length=limits.MESSAGE_BYTES_MAX)]
Names = Annotated[list[Name], Meta(max_length=limits.ENTITIES_MAX)]
Vector = tuple[float, float, float]

VERSION_SUFFIX = f".{limits.PROTOCOL_VERSION}"


def _tag(class_name: str) -> str:
    return class_name.lower() + VERSION_SUFFIX


class Message(msgspec.Struct, frozen=True, array_like=True, tag=_tag, forbid_unknown_fields=True, gc=False):
    """Base of every wire message: array form, a tag with the version, no unknown fields."""


class Item(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True, gc=False):
    """A part of a message, without a tag of its own."""

"""The one encode and the one decode of the wire.

Decoding consumes all bytes, respects the channel's size limit, checks the version in the tag and the whole schema, and
raises one typed error, `Malformed`. If the rule about trailing bytes were relaxed, two readers could see two messages
in one payload.
"""

from __future__ import annotations

from collections.abc import Hashable
from functools import cache
from threading import Lock
from typing import Any, TypeVar

import msgspec

from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.common.struct_types import VERSION_SUFFIX

T = TypeVar("T")

_encoder = msgspec.msgpack.Encoder()
_anything = msgspec.msgpack.Decoder()
_making = Lock()
"""msgspec reads a type's annotations when its first decoder is made; two threads that do so at once crash (0.22)."""


def encode(message: msgspec.Struct | list[Any]) -> bytes:
    """Return the MessagePack bytes of a message (or of a list of items)."""
    return _encoder.encode(message)


@cache
def _decoder(kind: Hashable) -> msgspec.msgpack.Decoder[Any]:
    with _making:
        return msgspec.msgpack.Decoder(kind)


def decode(kind: type[T], payload: bytes, bytes_max: int = limits.MESSAGE_BYTES_MAX) -> T:
    """Return the message of type `kind` that `payload` holds, or raise `Malformed`."""
    if len(payload) > bytes_max:
        raise Malformed(f"{len(payload)} bytes, at most {bytes_max} are allowed")
    message: T = decode_any(kind, payload)
    return message


def decode_any(kind: Any, payload: bytes) -> Any:
    """Return the message of `kind`, which may be a union of types; for payloads whose size is bounded already."""
    try:
        return _decoder(kind).decode(payload)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise Malformed(_reason(payload, error)) from None


def _reason(payload: bytes, error: Exception) -> str:
    """Describe the defect; a message of another protocol version is named as such."""
    try:
        content = _anything.decode(payload)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return f"no MessagePack message: {error}"
    if isinstance(content, list) and content and isinstance(content[0], str) and "." in content[0]:
        version = content[0].rpartition(".")[2]
        if version != VERSION_SUFFIX[1:]:
            return f"protocol version {version[:20]}, this is {VERSION_SUFFIX[1:]}"
    return str(error)

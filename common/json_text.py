"""JSON for people and scripts."""

from __future__ import annotations

from typing import Any

import msgspec

from foosim.common.errors import Malformed

_encoder = msgspec.json.Encoder()


def encode_json(content: Any) -> bytes:
    """Return JSON bytes."""
    return _encoder.encode(content)


def decode_json(payload: bytes) -> Any:
    """Return the content of JSON bytes, or raise `Malformed`."""
    try:
        return msgspec.json.decode(payload)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise Malformed(f"no JSON: {error}") from None

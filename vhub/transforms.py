"""Poses read back from a capture: the links of a FrameTransforms message, as `viewing` writes them.

The library that writes such messages reads none, and four nested messages do not justify a protobuf package: this reads
the wire format (https://protobuf.dev/programming-guides/encoding) as far as FrameTransforms needs it, and passes by
fields that it does not know. Neighbours: `viewing` writes, exports and replays read.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from foosim.protocol.scene import Quaternion, Vector
from foosim.vhub.rows import CaptureError

_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5
_TRANSFORMS: Final = 1
_CHILD, _TRANSLATION, _ROTATION = 3, 4, 5
"""Fields of a FrameTransform; those of its vectors are x, y, z (and w) from 1 on."""
_DOUBLE: Final = struct.Struct("<d")

Content = bytes | int


@dataclass(frozen=True, slots=True)
class LinkPose:
    """Where a link is in the world frame: position in m, orientation as a quaternion x, y, z, w."""

    link: str
    position: Vector
    orientation: Quaternion


def read_poses(data: bytes) -> list[LinkPose]:
    """Return the links of a FrameTransforms message, in its order. Raises CaptureError for what is none."""
    try:
        return [_link_pose(content) for number, content in _fields(data) if number == _TRANSFORMS]
    except (ValueError, IndexError, struct.error) as error:  # a text that is no UTF-8 is a ValueError
        raise CaptureError(f"poses that cannot be read: {error}") from None


def _link_pose(content: Content) -> LinkPose:
    link = ""
    position, orientation = [0.0] * 3, [0.0] * 4
    for number, value in _fields(_bytes(content)):
        if number == _CHILD:
            link = _bytes(value).decode()
        elif number == _TRANSLATION:
            _read_doubles(_bytes(value), position)
        elif number == _ROTATION:
            _read_doubles(_bytes(value), orientation)
    x, y, z, w = orientation
    return LinkPose(link, (position[0], position[1], position[2]), (x, y, z, w))


def _read_doubles(data: bytes, numbers: list[float]) -> None:
    """Write the doubles of a vector's message into `numbers`; those that are 0 are left out of it."""
    for number, value in _fields(data):
        if 1 <= number <= len(numbers):
            (numbers[number - 1],) = _DOUBLE.unpack(_bytes(value))


def _bytes(content: Content) -> bytes:
    if isinstance(content, int):
        raise ValueError("a number where a message is expected")
    return content


def _fields(data: bytes) -> Iterator[tuple[int, Content]]:
    """Yield number and content of each field of a message: bytes, or an integer for a varint."""
    at = 0
    while at < len(data):
        key, at = _varint(data, at)
        number, kind = key >> 3, key & 7
        if kind == _VARINT:
            value, at = _varint(data, at)
            yield number, value
            continue
        if kind == _BYTES:
            length, at = _varint(data, at)
        elif kind in (_FIXED64, _FIXED32):
            length = 8 if kind == _FIXED64 else 4
        else:
            raise ValueError(f"a field of kind {kind}")
        if length > len(data) - at:
            raise ValueError(f"a field of {length} bytes where {len(data) - at} are left")
        yield number, data[at : at + length]
        at += length


def _varint(data: bytes, at: int) -> tuple[int, int]:
    value = shift = 0
    while shift < 64:
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
        shift += 7
    raise ValueError("a number that does not end")

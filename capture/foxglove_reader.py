"""What viewers look at, read back from a capture: poses, lines of the log, and scenes with other names.

The library that writes such messages reads none, and a few nested messages do not justify a protobuf package: this
reads the wire format (https://protobuf.dev/programming-guides/encoding) as far as FrameTransforms, Log and SceneUpdate
need it, and passes by fields that it does not know.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from foosim.capture.mcap.checks import CaptureError
from foosim.world.scene import Quaternion, Vector

_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5
_TRANSFORMS: Final = 1
_CHILD, _TRANSLATION, _ROTATION = 3, 4, 5
"""Fields of a FrameTransform; its vectors have the fields x, y, z (and w) from 1 on."""
_LOG_LEVEL, _LOG_TEXT = 2, 3
_LEVELS: Final = {1: "debug", 2: "info", 3: "warning", 4: "error", 5: "fatal"}
_NAMES_IN_SCENE: Final = {1: (3,), 2: (2, 3)}
"""By the field of a SceneUpdate, deletions and entities: its fields that name a link."""
_DOUBLE: Final = struct.Struct("<d")

Content = bytes | int


@dataclass(frozen=True, slots=True)
class LinkPose:
    """Where a link is in the world frame: position in m, orientation as a quaternion x, y, z, w."""

    link: str
    position: Vector
    orientation: Quaternion


def read_poses(data: bytes) -> list[LinkPose]:
    """Return the links of a FrameTransforms message, in its order. Raises CaptureError for any other content."""
    try:
        return [_link_pose(content) for number, content in _fields(data) if number == _TRANSFORMS]
    except (ValueError, IndexError, struct.error) as error:  # invalid UTF-8 is a ValueError
        raise CaptureError(f"poses that cannot be read: {error}") from None


def read_log(data: bytes) -> tuple[str, str]:
    """Return level and text of a Log message. Raises CaptureError for any other content."""
    level, text = "info", ""
    try:
        for number, content in _fields(data):
            if number == _LOG_LEVEL and isinstance(content, int):
                level = _LEVELS.get(content, level)
            elif number == _LOG_TEXT:
                text = _bytes(content).decode()
    except (ValueError, IndexError) as error:
        raise CaptureError(f"a line of the log that cannot be read: {error}") from None
    return level, text


def renamed_scene(data: bytes, rename: Callable[[str], str]) -> bytes:
    """Return a SceneUpdate message with other names of links. Raises CaptureError for any other content."""

    def named(content: bytes) -> bytes:
        return rename(content.decode()).encode()

    def in_fields(numbers: tuple[int, ...]) -> Callable[[bytes], bytes]:
        return lambda content: _rewritten(content, dict.fromkeys(numbers, named))

    try:
        return _rewritten(data, {number: in_fields(names) for number, names in _NAMES_IN_SCENE.items()})
    except (ValueError, IndexError) as error:
        raise CaptureError(f"a scene that cannot be read: {error}") from None


def _rewritten(data: bytes, changes: Mapping[int, Callable[[bytes], bytes]]) -> bytes:
    """Return a message with some of its fields of bytes changed, and all others as they are."""
    parts: list[bytes] = []
    at = 0
    for number, kind, start, stop in _places(data):
        change = changes.get(number)
        if change is not None and kind == _BYTES:
            content = change(data[start:stop])
            parts.append(_varint_bytes(number << 3 | _BYTES) + _varint_bytes(len(content)) + content)
        else:
            parts.append(data[at:stop])
        at = stop
    return b"".join(parts)


def _varint_bytes(value: int) -> bytes:
    content = bytearray()
    while value > 0x7F:
        content.append(value & 0x7F | 0x80)
        value >>= 7
    content.append(value)
    return bytes(content)


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
    """Write the doubles of a vector's message into `numbers`; a message leaves out zeros."""
    for number, value in _fields(data):
        if 1 <= number <= len(numbers):
            (numbers[number - 1],) = _DOUBLE.unpack(_bytes(value))


def _bytes(content: Content) -> bytes:
    if isinstance(content, int):
        raise ValueError("a number where a message is expected")
    return content


def _fields(data: bytes) -> Iterator[tuple[int, Content]]:
    """Yield number and content of each field of a message: bytes, or an integer for a varint."""
    for number, kind, start, stop in _places(data):
        yield number, _varint(data, start)[0] if kind == _VARINT else data[start:stop]


def _places(data: bytes) -> Iterator[tuple[int, int, int, int]]:
    """Yield number and kind of each field of a message, and where its content starts and stops."""
    at = 0
    while at < len(data):
        key, at = _varint(data, at)
        number, kind = key >> 3, key & 7
        if kind == _VARINT:
            stop = _varint(data, at)[1]
        elif kind == _BYTES:
            length, at = _varint(data, at)
            stop = at + length
        elif kind in (_FIXED64, _FIXED32):
            stop = at + (8 if kind == _FIXED64 else 4)
        else:
            raise ValueError(f"a field of kind {kind}")
        if stop > len(data):
            raise ValueError(f"a field of {stop - at} bytes where {len(data) - at} are left")
        yield number, kind, at, stop
        at = stop


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

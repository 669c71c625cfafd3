"""What viewers look at, read back from a capture: poses, lines of the log, and scenes with other names.

The library that writes such messages reads none: their classes follow from the schemas that it has.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

from foxglove.messages import FrameTransforms, Log, SceneUpdate
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.message import DecodeError

from foosim.capture.foxglove import view_schema
from foosim.capture.mcap.checks import CaptureError
from foosim.world.scene import Quaternion, Vector

_LEVELS: Final = {1: "debug", 2: "info", 3: "warning", 4: "error", 5: "fatal"}


@dataclass(frozen=True, slots=True)
class LinkPose:
    """Where a link is in the world frame: position in m, orientation as a quaternion x, y, z, w."""

    link: str
    position: Vector
    orientation: Quaternion


def read_poses(data: bytes) -> list[LinkPose]:
    """Return the links of a FrameTransforms message, in its order. Raises CaptureError for any other content."""
    found = []
    for its in _read(FrameTransforms, data, "poses that cannot be read").transforms:
        at, turned = its.translation, its.rotation
        found.append(LinkPose(its.child_frame_id, (at.x, at.y, at.z), (turned.x, turned.y, turned.z, turned.w)))
    return found


def read_log(data: bytes) -> tuple[str, str]:
    """Return level and text of a Log message. Raises CaptureError for any other content."""
    line = _read(Log, data, "a line of the log that cannot be read")
    return _LEVELS.get(line.level, "info"), line.message


def renamed_scene(data: bytes, rename: Callable[[str], str]) -> bytes:
    """Return a SceneUpdate message with other names of links. Raises CaptureError for any other content."""
    scene = _read(SceneUpdate, data, "a scene that cannot be read")
    for one in (*scene.deletions, *scene.entities):
        one.id = rename(one.id)
    for entity in scene.entities:
        entity.frame_id = rename(entity.frame_id)
    content: bytes = scene.SerializeToString()
    return content


def _read(kind: Any, data: bytes, problem: str) -> Any:
    try:
        return _class_of(kind).FromString(data)
    except DecodeError as error:
        raise CaptureError(f"{problem}: {error}") from None


@cache
def _class_of(kind: Any) -> Any:
    """Return the class that reads a Foxglove message."""
    name, _, content = view_schema(kind)
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(content).file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(name))

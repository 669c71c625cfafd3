"""The readings of sensors for viewers: as the Foxglove message that a sensor names
(`world/component_types/shown.py`), of any other sensor from a plug-in as JSON.

Each of them has a topic, `/readings/ROBOT/CHANNEL`. A message is the reading as the robot sent it: after modifiers,
before the network.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from typing import Any, Final, TypeAlias

from foxglove.messages import LaserScan, LocationFix, Pose, PoseInFrame, Quaternion, Timestamp, Vector3

from foosim.capture.foxglove import WORLD_FRAME, view_schema
from foosim.capture.rows import json_schema
from foosim.common.errors import Malformed
from foosim.common.json_text import encode_json
from foosim.deployment.schema import Deployment
from foosim.world.assembly.world import build_scene
from foosim.world.component_types.payloads import PayloadCodec
from foosim.world.component_types.per_field import codec_of
from foosim.world.component_types.settings import SensorSettings
from foosim.world.component_types.shown import LASER_SCAN, LOCATION_FIX, MESSAGES, POSE, POSE_IN_FRAME
from foosim.world.components.mounted import link_index
from foosim.world.layout import build_layout
from foosim.world.placing import FIRST_LINK, MountedAt
from foosim.world.robot_packets import RobotPacket
from foosim.world.scene import Quaternion as Turn
from foosim.world.scene import Vector, from_rpy

READINGS: Final = "/readings"
MESSAGE_TYPES: Final[Mapping[str, Any]] = {
    LASER_SCAN: LaserScan,
    LOCATION_FIX: LocationFix,
    POSE_IN_FRAME: PoseInFrame,
}
assert MESSAGE_TYPES.keys() == MESSAGES.keys()
_SECOND_NS: Final = 1_000_000_000

Make: TypeAlias = Callable[[Timestamp, Any], bytes]
"""Makes the message of a reading."""
TopicSchema: TypeAlias = tuple[str, tuple[str, str, bytes]]
"""The encoding of a topic's messages; name, encoding and content of their schema."""


def shown_topics(deployment: Deployment) -> dict[str, TopicSchema]:
    """Return the topics of a deployment's readings that are shown."""
    return {
        _topic(robot, channel): ("protobuf", view_schema(MESSAGE_TYPES[message]))
        if message
        else ("json", _json_schema(deployment.robots[robot].sensors[channel]))
        for (robot, channel), message in _shown(deployment).items()
    }


def _json_schema(sensor: SensorSettings) -> tuple[str, str, bytes]:
    """Return that of a kind of sensor's readings: an object with their fields, each number with its `unit`."""
    codec = codec_of(sensor.component_type)
    schema = json_schema(codec.kind)
    for field in codec.fields:
        if field.unit:
            schema["properties"][field.name]["unit"] = field.unit
    return f"foosim.reading.{sensor.kind}", "jsonschema", encode_json(schema)


class ShownReadings:
    """Makes the messages of a deployment's readings that are shown."""

    def __init__(self, deployment: Deployment) -> None:
        self.topics: Final = shown_topics(deployment)
        self._tick_ns = deployment.tick_ns
        self._makers: dict[tuple[str, str], tuple[str, PayloadCodec, Make]] = {}
        shown = _shown(deployment)
        frames = _Frames(deployment) if LASER_SCAN in shown.values() else None
        for (robot, channel), message in shown.items():
            settings: Any = deployment.robots[robot].sensors[channel]
            make: Make = _MAKES.get(message, _fields)
            if message == LASER_SCAN:
                assert frames is not None
                make = partial(_scan, *frames.of(robot, settings), settings.bearings)
            self._makers[robot, channel] = _topic(robot, channel), codec_of(settings.component_type), make

    def messages(self, tick: int, packets: Iterable[RobotPacket]) -> Iterator[tuple[str, bytes]]:
        """Yield topic and message of each of the robots' packets at a tick that is such a reading.

        An invalid payload of its sensor has none.
        """
        at = Timestamp(*divmod(tick * self._tick_ns, _SECOND_NS))
        for packet in packets:
            maker = self._makers.get((packet.robot, packet.channel))
            if maker is None:
                continue
            topic, codec, make = maker
            try:
                reading = codec.decode(packet.payload)
            except Malformed:
                continue
            yield topic, make(at, reading)


def _topic(robot: str, channel: str) -> str:
    return f"{READINGS}/{robot}/{channel}"


def _shown(deployment: Deployment) -> dict[tuple[str, str], str]:
    """Return the name of the message of each sensor that is shown, by robot and channel; empty for JSON."""
    found = {}
    for robot, its in sorted(deployment.robots.items()):
        for channel, settings in sorted(its.sensors.items()):
            sensor = settings.component_type
            if sensor.shown_as or not sensor.is_own:
                found[robot, channel] = sensor.shown_as
    return found


class _Frames:
    """The links of robots, which are frames of `/tf`."""

    def __init__(self, deployment: Deployment) -> None:
        self._bodies = build_scene(deployment, build_layout(deployment)).bodies

    def of(self, robot: str, settings: Any) -> tuple[str, Pose]:
        """Return the link that carries a sensor, and the place of the sensor in its frame: the setting `at`
        (`MountedAt`), else the first link itself."""
        where = getattr(settings, "at", FIRST_LINK)
        where = where if isinstance(where, MountedAt) else FIRST_LINK
        body = self._bodies[robot]
        return body.links[link_index(body, where.link)].name, _placed(where.position, where.orientation)


# --- messages --------------------------------------------------------------------------------------------------------


def _fields(at: Timestamp, reading: Any) -> bytes:
    return encode_json(reading)


def _pose(at: Timestamp, reading: Any) -> bytes:
    if set(POSE) <= set(reading.__struct_fields__):
        place, turned = (reading.x, reading.y, reading.z), (reading.qx, reading.qy, reading.qz, reading.qw)
    else:
        place, turned = (reading.x, reading.y, 0.0), from_rpy(0.0, 0.0, reading.heading)
    return PoseInFrame(timestamp=at, frame_id=WORLD_FRAME, pose=_placed(place, turned)).encode()


def _location(at: Timestamp, reading: Any) -> bytes:
    place = {name: getattr(reading, name) for name in ("latitude", "longitude", "altitude")}
    return LocationFix(timestamp=at, **place).encode()


def _scan(link: str, pose: Pose, bearings: tuple[float, float], at: Timestamp, reading: Any) -> bytes:
    first, last = bearings
    ranges = list(reading.distances)
    scan = LaserScan(timestamp=at, frame_id=link, pose=pose, start_angle=first, end_angle=last, ranges=ranges)
    return scan.encode()


_MAKES: Final[Mapping[str, Make]] = {LOCATION_FIX: _location, POSE_IN_FRAME: _pose}


def _placed(place: Vector, turned: Turn) -> Pose:
    (x, y, z), (qx, qy, qz, qw) = place, turned
    return Pose(position=Vector3(x=x, y=y, z=z), orientation=Quaternion(x=qx, y=qy, z=qz, w=qw))

"""Readings that name a Foxglove message are in the capture as this message, which other people's tools decode."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from math import cos, pi, sin
from pathlib import Path
from typing import Any, Final

import jsonschema
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from foosim.capture.cut import cut_capture
from foosim.capture.export import export_capture
from foosim.capture.reader import CaptureData, open_capture
from foosim.library.generic.laser_scanner import LaserScannerSettings, directions
from foosim.simulation.run import rehearse
from foosim.world.component_types.per_field import codec_of
from foosim.world.component_types.registry import find_component
from foosim.world.components.fitted import sensors_of
from foosim.world.components.view import SensingView
from tests.own_components import TABLE, folder_on_path, written

SETS: Final = (
    "robots.rover01.sensors.place={kind: pose_3d, rate: 50 Hz, at: {x: 20 cm, z: 50 cm}}",
    "robots.rover01.sensors.fix={kind: gps, rate: 10 Hz, at: {z: 1 m}}",
    "robots.rover01.sensors.eye={kind: laser_scanner, rate: 10 Hz, rays: 7, angle: 90 deg, range: 9 m,"
    " at: {x: 30 cm, z: 20 cm, yaw: 180 deg}}",
    "origin={latitude: 45 deg, longitude: 10 deg}",
    "capture.frames_every='1 tick'",
)
TOPICS: Final = {
    "/readings/rover01/eye": "foxglove.LaserScan",
    "/readings/rover01/fix": "foxglove.LocationFix",
    "/readings/rover01/place": "foxglove.PoseInFrame",
    "/readings/rover01/pose": "foxglove.PoseInFrame",
}
TICKS: Final = 60


@pytest.fixture(scope="module")
def shown(fleet_text: Callable[..., str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("shown") / "run.mcap"
    rehearse(fleet_text(1, *SETS), "hall.yaml", TICKS, capture=path)
    return path


@pytest.fixture(scope="module")
def capture(shown: Path) -> CaptureData:
    return open_capture(shown)


def messages_of(path: Path, channel: str) -> dict[int, Any]:
    """The messages of a channel of the rover, by log time (ns); each has it as its own time, too."""
    with path.open("rb") as file:
        found = {}
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for schema, topic, message, content in reader.iter_decoded_messages(f"/readings/rover01/{channel}"):
            assert schema is not None and schema.name == TOPICS[topic.topic]
            assert content.timestamp.ToNanoseconds() == message.log_time == message.publish_time
            assert message.log_time not in found
            found[message.log_time] = content
    assert len(found) > 1
    return found


def readings_of(capture: CaptureData, channel: str, times: dict[int, Any]) -> dict[int, Any]:
    """What the sensor without modifiers reads in the captured frames of these times (ns)."""
    deployment, found = capture.deployment, {}
    for index, tick in enumerate(capture.frames.ticks.tolist()):
        if (at_ns := tick * deployment.tick_ns) in times:
            frame = capture.frames.frame(index)
            its = sensors_of(deployment, frame.layout, frame.layout["rover01"])
            one = next(one for one in its if one.channel == channel)
            found[at_ns] = one.sample(SensingView(tick, frame.numbers, frame.values))
    assert found.keys() == times.keys()
    return found


def pose_of(pose: Any) -> tuple[float, ...]:
    at, turned = pose.position, pose.orientation
    return at.x, at.y, at.z, turned.x, turned.y, turned.z, turned.w


def test_each_such_sensor_has_a_topic_and_those_of_one_message_share_its_schema(shown: Path) -> None:
    with shown.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    found = {channel.topic: channel for channel in summary.channels.values() if channel.topic.startswith("/readings")}
    assert {topic: summary.schemas[channel.schema_id].name for topic, channel in found.items()} == TOPICS
    assert {channel.message_encoding for channel in found.values()} == {"protobuf"}
    assert found["/readings/rover01/pose"].schema_id == found["/readings/rover01/place"].schema_id


def test_a_planar_pose_is_shown_as_it_was_sent_with_its_noise(shown: Path, capture: CaptureData) -> None:
    packets = capture.packets.where(capture.packets.channel == "pose")
    sent = {
        at: codec_of(find_component("sensor", "pose")).decode(payload)
        for at, payload in zip(packets.sent_ns, packets.payload, strict=True)
    }
    messages = messages_of(shown, "pose")
    assert messages.keys() == sent.keys()
    for at_ns, message in messages.items():
        half = sent[at_ns].heading / 2
        assert message.frame_id == "world"
        expected = (sent[at_ns].x, sent[at_ns].y, 0.0, 0.0, 0.0, sin(half), cos(half))
        assert pose_of(message.pose) == pytest.approx(expected, abs=1e-12)


def test_a_pose_in_space_is_shown_in_the_world(shown: Path, capture: CaptureData) -> None:
    messages = messages_of(shown, "place")
    for at_ns, reading in readings_of(capture, "place", messages).items():
        of_reading = reading.x, reading.y, reading.z, reading.qx, reading.qy, reading.qz, reading.qw
        assert (messages[at_ns].frame_id, pose_of(messages[at_ns].pose)) == ("world", of_reading)


def test_a_place_on_earth_is_shown_as_a_fix_without_subscribers(shown: Path, capture: CaptureData) -> None:
    assert "fix" not in set(capture.packets.channel)
    messages = messages_of(shown, "fix")
    for at_ns, reading in readings_of(capture, "fix", messages).items():
        fix = messages[at_ns]
        assert (fix.latitude, fix.longitude, fix.altitude) == (reading.latitude, reading.longitude, reading.altitude)
        assert fix.latitude == pytest.approx(45, abs=0.01)


def test_a_scan_is_shown_in_the_frame_of_its_link_where_it_is_mounted(shown: Path, capture: CaptureData) -> None:
    messages = messages_of(shown, "eye")
    for at_ns, reading in readings_of(capture, "eye", messages).items():
        scan = messages[at_ns]
        assert scan.frame_id == "rover01" and tuple(scan.ranges) == reading.distances and len(scan.ranges) == 7
        assert (scan.start_angle, scan.end_angle) == pytest.approx((-pi / 4, pi / 4))
        assert pose_of(scan.pose) == pytest.approx((0.3, 0.0, 0.2, 0.0, 0.0, 1.0, 0.0), abs=1e-12)


def test_a_cut_has_the_readings_from_its_first_frame_on(shown: Path, tmp_path: Path) -> None:
    whole = messages_of(shown, "place")
    begin = sorted(whole)[len(whole) // 2]
    cut_capture(shown, tmp_path / "cut.mcap", begin)
    left = messages_of(tmp_path / "cut.mcap", "place")
    assert {at: pose_of(one.pose) for at, one in left.items()} == {
        at: pose_of(one.pose) for at, one in whole.items() if at >= begin
    }


@pytest.mark.parametrize(("rays", "angle"), [(1, "90 deg"), (4, "360 deg"), (7, "270 deg")])
def test_bearings_are_those_of_the_first_and_the_last_beam(rays: int, angle: str) -> None:
    its: dict[str, Any] = {"kind": "laser_scanner", "rate": "10 Hz", "rays": rays, "angle": angle, "range": "9 m"}
    settings = LaserScannerSettings.model_validate(its)
    (*_, last), (first, *_) = (list(directions(rays, settings.angle)) for _ in range(2))
    for bearing, way in zip(settings.bearings, (first, last), strict=True):
        assert (cos(bearing), sin(bearing), 0.0) == pytest.approx(way)


OWN_SENSOR: Final = """
class Told(Struct, frozen=True):
    slide: Metres
    words: str
    ticks: list[int]
    more: "Told | None" = None


@sensor("own", SensorSettings, Told)
class Sensor(Own):
    def __init__(self, settings, at):
        pass

    def sample(self, view):
        return Told(0.25, "grün", [view.tick, -1])
"""


def test_a_sensor_of_somebodys_own_is_shown_as_json_and_exported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also when nobody receives its readings; those of foosim's own are in packets, or Foxglove's messages."""
    written(folder_on_path(tmp_path, monkeypatch), OWN_SENSOR)
    own = "{kind: 'own_form:Sensor', rate: 50 Hz}"
    sets = ("engine=pure", f"robots.red.goal.sensors.own={own}", f"robots.red.attack.sensors.own={own}")
    heard = "players.player-red.robots={red.goal: [encoder, own], camera: [ball]}"
    path = tmp_path / "run.mcap"
    rehearse(TABLE.read_text(), TABLE.name, 30, None, (*sets, heard), capture=path)
    found: dict[str, list[Any]] = {}
    with path.open("rb") as file:
        for schema, topic, message in make_reader(file, validate_crcs=True).iter_messages():
            if topic.topic.startswith("/readings"):
                assert schema is not None and (schema.encoding, topic.message_encoding) == ("jsonschema", "json")
                told, content = json.loads(schema.data), json.loads(message.data)
                jsonschema.Draft202012Validator(told).validate(content)
                assert told["properties"]["slide"] == {"type": "number", "unit": "m"}
                found.setdefault(topic.topic, []).append((message.log_time, content))
    assert found.keys() == {"/readings/red.goal/own", "/readings/red.attack/own"}
    for readings in found.values():
        assert readings == [
            (tick * 2_000_000, {"slide": 0.25, "words": "grün", "ticks": [tick, -1], "more": None})
            for tick in range(0, 30, 10)
        ]
    export_capture(path, "packets", tmp_path / "packets.csv")
    with (tmp_path / "packets.csv").open(newline="", encoding="utf-8") as stream:
        sent = [line for line in csv.DictReader(stream) if line["channel"] == "own"]
    told = [(int(line["sent_ns"]), json.loads(line["value"])) for line in sent]
    assert told == found["/readings/red.goal/own"] and {line["destination"] for line in sent} == {"player-red"}

"""The capture: what goes in comes out, by our reader and by other people's."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jsonschema
import msgspec
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.records import Chunk, Message, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap_protobuf.decoder import DecoderFactory

from foosim.capture.foxglove import VIEW_TYPES
from foosim.capture.info import capture_info
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.reader import CaptureData, open_capture
from foosim.capture.rows import ROW_TYPES, EpochRow, OwnerRow, json_schema
from foosim.library.table.settings import table_of
from foosim.vhub.recording.model_hash import model_hash
from foosim.world.assembly.world import build_scene
from foosim.world.frame import CHAIN_START, chain_next
from foosim.world.kinematics import forward_kinematics
from foosim.world.scene import drawn, looks_of
from tests.vhub.conftest import RECOVERED, noise

if TYPE_CHECKING:
    from tests.vhub.conftest import HubRun


@pytest.fixture(scope="module")
def capture(path: Path) -> CaptureData:
    return open_capture(path)


# --- what goes in comes out ------------------------------------------------------------------------------------------


def test_ticks_with_their_inputs_come_back(capture: CaptureData, hub_run: HubRun) -> None:
    assert capture.finished and capture.ticks.tolist() == list(range(65))
    captured = list(capture.captured_ticks())
    assert [tick.tick for tick in captured] == list(range(65))
    for tick, closing, digest in zip(captured, hub_run.closings, capture.digests, strict=True):
        frame = closing.frame
        assert tick.digest == closing.digest == frame.digest == digest.tobytes()
        assert list(tick.entities) == [frame.entity_digest(entity) for entity in frame.layout.entities]
        assert tick.edits == list(closing.edits)
        assert tick.delivered == list(closing.delivered)


def test_frames_come_back_at_their_ticks_with_the_first_and_the_last(capture: CaptureData, hub_run: HubRun) -> None:
    frames = capture.frames
    assert frames.values.shape == (len(frames), frames.layout.size)
    for index, tick in enumerate(frames.ticks):
        kept = hub_run.closings[tick].frame
        assert frames.frame(index).digest == kept.digest
        assert frames.frame(index).outboxes == kept.outboxes
        joint = frames.column("red.goal", "joint_positions")
        assert joint[index].tolist() == kept.vector("red.goal", "joint_positions", 2)
        assert frames.column("red.attack", "down")[index] == kept.at("red.attack", "down")


def test_a_column_has_gaps_where_the_entity_was_absent(capture: CaptureData, hub_run: HubRun) -> None:
    frames = capture.frames
    assert frames.ticks.tolist() == [0, 10, 20, 30, 40, 50, 60, 64] and len(frames) == 8
    kept = [hub_run.closings[tick].frame for tick in frames.ticks]
    positions = frames.column("ball", "position", 3)
    assert positions.tolist() == [frame.vector("ball", "position", 3) for frame in kept]
    added = frames.column("ball-2", "position", 3)
    assert np.isnan(added).all(axis=1).tolist() == [True] * 3 + [False] * 2 + [True] * 3
    assert added[3:5].tolist() == [frame.vector("ball-2", "position", 3) for frame in kept[3:5]]
    assert np.isnan(frames.column("ball-2", "contacts", 1)).tolist() == [True] * 3 + [False] * 2 + [True] * 3
    for index in (0, 3, 7, -1, -8):
        assert frames.frame(index).digest == kept[index].digest
    for index in (8, -9):
        with pytest.raises(IndexError):
            frames.frame(index)
    with pytest.raises(CaptureError, match=r"no frame has an entity 'ball2', nearest is ball-2"):
        frames.column("ball2", "position", 3)
    with pytest.raises(CaptureError, match=r"ball has no field 'positions', nearest is position; it has .*velocity"):
        frames.column("ball", "positions", 3)


def test_poses_are_those_of_the_one_forward_kinematics(capture: CaptureData, hub_run: HubRun) -> None:
    poses = {name: capture.poses(name) for name in ("red.goal/slide", "red.goal/spin", "red.goal", "ball", "ball-2")}
    assert poses["ball"].ticks.tolist() == [0, 10, 20, 30, 40, 50, 60, 64]
    assert poses["ball-2"].ticks.tolist() == [30, 40]
    assert poses["red.goal"].positions.tolist() == poses["red.goal/spin"].positions.tolist()
    for index, tick in enumerate(poses["ball"].ticks):
        frame = hub_run.closings[tick].frame
        scene = build_scene(hub_run.deployment, frame.layout)
        for name in ("red.goal", "ball"):
            for link, at, turned in forward_kinematics(scene.bodies[name], frame.layout[name], frame.numbers):
                assert capture.poses(link).positions[index].tolist() == list(at)
                assert capture.poses(link).orientations[index].tolist() == list(turned)
    with pytest.raises(CaptureError, match=r"nothing with a body is called 'red\.gaol', nearest is red\.goal"):
        capture.poses("red.gaol")


def test_packets_come_back_as_columns(capture: CaptureData, hub_run: HubRun) -> None:
    """Those of one closing in the order of their log times, which is not that of their fates."""
    in_time = [sorted(closing.fates, key=lambda flight: flight.sent_ns) for closing in hub_run.closings]
    assert in_time != [closing.fates for closing in hub_run.closings]
    flights = [flight for fates in in_time for flight in fates]
    packets = capture.packets
    account = hub_run.state.packets
    assert len(packets) == len(flights) == account.offered
    for name in ("source", "destination", "channel", "rule", "sequence", "copy", "sent_ns", "stamp_ns", "payload"):
        assert getattr(packets, name).tolist() == [getattr(flight, name) for flight in flights], name
    assert packets.arrival_tick.tolist() == [flight.arrival_tick for flight in flights]
    assert packets.size.tolist() == [len(flight.payload) for flight in flights]
    delivered = packets.where(packets.fate == "delivered")
    assert len(delivered) == account.delivered
    assert (delivered.due_ns >= delivered.sent_ns).all() and (delivered.cause == "").all()
    lost = packets.where(packets.cause == "random_loss")
    assert (lost.due_ns == -1).all() and (lost.fate == "dropped").all()
    slow = packets.where(packets.rule == "slow")
    assert set(slow.loss_word.tolist()) == {None}
    assert set(slow.source.tolist()) == {"watcher"}


def test_what_the_run_was_is_in_the_capture(capture: CaptureData, hub_run: HubRun) -> None:
    about = capture.about
    assert about.metadata == {
        "model_hash": model_hash(hub_run.deployment),
        "run": "run-1",
        "fingerprint": "00",
        "format": "4",
        "world": "table",
        "seed": "1",
        "tick_ns": "2000000",
        "deployment": "table.yaml",
    }
    assert about.end == {"reason": "enough"}
    assert about.deployment_text == hub_run.text and capture.deployment == hub_run.deployment
    assert about.versions["numpy"] == np.__version__ and {"pybullet", "mujoco-core"} <= about.versions.keys()
    assert [(client.tick, client.client, client.event) for client in capture.clients] == [
        (0, "player-blue", "joins"),
        (0, "player-red", "joins"),
        (3, "watcher", "joins"),
        (35, "watcher", "leaves"),
        (50, "watcher", "joins"),
    ]
    with pytest.raises(CaptureError, match="no rows of '/tock', there are " + ", ".join(sorted(ROW_TYPES))):
        list(capture.rows("/tock"))


def test_epochs_come_back_with_nodes_owners_and_arithmetic(capture: CaptureData, hub_run: HubRun, path: Path) -> None:
    first, second = rows = list(capture.rows("/epochs"))
    assert rows == list(capture.epochs) and all(isinstance(row, EpochRow) for row in rows)
    assert isinstance(first, EpochRow) and isinstance(second, EpochRow)
    assert [(row.tick, row.epoch, row.digest) for row in capture.epochs] == [(0, 1, "01" * 32), (28, 2, "02" * 32)]
    assert first.roster == second.roster == ["n1", "n2"]
    robots = list(hub_run.deployment.robots)
    assert first.owners == [OwnerRow(robot, "n1") for robot in robots]
    assert second.owners == [OwnerRow(robot, "n2") for robot in robots]
    assert (first.arithmetic, second.arithmetic) == ("", noise(32, "arithmetic").hex())
    info = capture_info(path)
    assert (info.nodes, info.arithmetic) == (("n1", "n2"), (second.arithmetic,))


def test_recoveries_come_back_as_the_commits_told_them(capture: CaptureData) -> None:
    assert list(capture.rows("/recoveries")) == list(capture.recoveries)
    found = [(r.what, r.name, r.reason, r.tick, r.epoch, r.wall_outage_ns) for r in capture.recoveries]
    assert found == [msgspec.structs.astuple(told) for each in RECOVERED.values() for told in each]


def test_the_summary_of_a_capture(path: Path, hub_run: HubRun) -> None:
    info = capture_info(path)
    account = hub_run.state.packets
    chain = CHAIN_START
    for closing in hub_run.closings[1:]:
        chain = chain_next(chain, closing.digest)
    assert (info.ticks, info.tick_ns, info.duration_ns) == (64, 2_000_000, 128_000_000)
    assert (info.digest, info.chain) == (hub_run.closings[-1].digest.hex(), chain.hex())
    assert info.packets == {
        "offered": account.offered,
        "delivered": account.delivered,
        "dropped": account.dropped,
        "in_flight": account.in_flight,
    }
    assert info.topics == {
        "/ages": 12,
        "/clients": 5,
        "/epochs": 2,
        "/frame": 8,
        "/layout": 1,
        "/log": 3,
        "/metrics": 12,
        "/packets": account.offered,
        "/recoveries": 3,
        "/scene": 3,
        "/tf": 9,
        "/tick": 65,
    }
    assert info.recoveries == 3
    assert info.finished and info.bytes == path.stat().st_size


def test_two_writers_write_the_same_rows(path: Path, chunked: bytes) -> None:
    """Whatever chunks they make of them."""

    def messages(content: bytes) -> list[tuple[str, int, int, int, bytes]]:
        found = make_reader(BytesIO(content)).iter_messages(log_time_order=False)
        return [(c.topic, m.log_time, m.publish_time, m.sequence, m.data) for _, c, m in found]

    once, again = messages(path.read_bytes()), messages(chunked)
    for topic in [*ROW_TYPES, *VIEW_TYPES]:
        rows = [message for message in once if message[0] == topic]
        assert rows and rows == [message for message in again if message[0] == topic]


# --- by other people's tools -----------------------------------------------------------------------------------------


def test_the_mcap_library_reads_it_with_checksums_and_index(path: Path, hub_run: HubRun) -> None:
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert reader.get_header().profile == "foosim"
        summary = reader.get_summary()
        assert summary is not None and summary.statistics is not None
        counts = {summary.channels[c].topic: n for c, n in summary.statistics.channel_message_counts.items()}
        assert counts == capture_info(path).topics
        assert summary.statistics.message_count == sum(counts.values())
        assert (summary.statistics.message_start_time, summary.statistics.message_end_time) == (0, 128_000_000)
        times = [message.log_time for _, _, message in reader.iter_messages("/tick", starting_at=50_000_000)]
        assert times == list(range(50_000_000, 130_000_000, 2_000_000))
        assert {a.name: a.data.decode() for a in reader.iter_attachments()}["deployment.yaml"] == hub_run.text
        assert {m.name for m in reader.iter_metadata()} == {"foosim", "foosim.digests", "foosim.end"}
    with path.open("rb") as file:
        assert sum(1 for _ in StreamReader(file, validate_crcs=True).records) > sum(counts.values())


def test_every_chunk_tells_the_times_of_its_messages(chunked: bytes) -> None:
    """By these a viewer that seeks chooses its chunks."""
    chunks = [c for c in StreamReader(BytesIO(chunked), emit_chunks=True).records if isinstance(c, Chunk)]
    summary = make_reader(BytesIO(chunked)).get_summary()
    assert summary is not None and len(chunks) == len(summary.chunk_indexes) > 8
    for chunk, index in zip(chunks, summary.chunk_indexes, strict=True):
        times = [
            message.log_time for message in breakup_chunk(chunk, validate_crc=True) if isinstance(message, Message)
        ]
        assert (chunk.message_start_time, chunk.message_end_time) == (min(times), max(times))
        assert (index.message_start_time, index.message_end_time) == (min(times), max(times))


def test_rows_are_json_valid_by_the_schemas_in_the_file(path: Path) -> None:
    with path.open("rb") as file:
        seen: Counter[str] = Counter()
        validators: dict[str, Any] = {}
        for schema, channel, message in make_reader(file).iter_messages(list(ROW_TYPES)):
            assert isinstance(schema, Schema) and (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            if channel.topic not in validators:
                assert json.loads(schema.data) == json_schema(ROW_TYPES[channel.topic])
                validators[channel.topic] = jsonschema.Draft202012Validator(json.loads(schema.data))
            validators[channel.topic].validate(json.loads(message.data))
            seen[channel.topic] += 1
        assert seen.keys() == ROW_TYPES.keys()


def decoded(path: Path, topic: str) -> Iterator[Any]:
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, _, _, content in reader.iter_decoded_messages(topic):
            yield content


def test_viewers_get_poses_of_all_links(path: Path, hub_run: HubRun) -> None:
    messages = list(decoded(path, "/tf"))
    ticks = [0, 10, 20, 25, 30, 40, 45, 50, 60]
    assert [message.transforms[0].timestamp.ToNanoseconds() for message in messages] == [2_000_000 * t for t in ticks]
    for tick, message in zip(ticks, messages, strict=True):
        frame = hub_run.closings[tick].frame
        scene = build_scene(hub_run.deployment, frame.layout)
        expected = {}
        for name, body in scene.bodies.items():
            if frame.layout[name].is_absent(frame.numbers):
                continue
            for link, at, turned in forward_kinematics(body, frame.layout[name], frame.numbers):
                expected[link] = (*at, *turned)
        got = {}
        for transform in message.transforms:
            assert transform.parent_frame_id == "world"
            t, r = transform.translation, transform.rotation
            got[transform.child_frame_id] = (t.x, t.y, t.z, r.x, r.y, r.z, r.w)
        assert got == expected


def test_viewers_get_the_scene_at_the_start_and_when_it_changes(path: Path, hub_run: HubRun) -> None:
    first, added, removed = decoded(path, "/scene")
    scene = build_scene(hub_run.deployment, hub_run.closings[0].frame.layout)
    links = {link.name: link for body in scene.bodies.values() for link in body.links}
    assert {entity.id for entity in first.entities} == {"scenery", *links} - {"ball-2"}
    for entity in first.entities:
        assert entity.frame_locked and entity.frame_id == ("world" if entity.id == "scenery" else entity.id)
        shapes = [*drawn(scene.scenery)] if entity.id == "scenery" else looks_of([links[entity.id]])[0][1]
        assert len(entity.cubes) + len(entity.spheres) + len(entity.cylinders) == len(shapes) > 0
    ball = next(entity for entity in first.entities if entity.id == "ball").spheres[0]
    assert (ball.size.x, ball.color.r, ball.color.a) == (2 * table_of(hub_run.deployment).ball.radius, 1.0, 1.0)
    assert "ball-2" in {entity.id for entity in added.entities}
    assert (
        [deletion.id for deletion in removed.deletions] == [deletion.id for deletion in first.deletions] == ["ball-2"]
    )
    assert not added.deletions


def test_viewers_get_the_log(path: Path) -> None:
    lines = [(m.timestamp.ToNanoseconds(), m.level, m.message) for m in decoded(path, "/log")]
    assert lines == [(0, 2, "kick-off"), (6_000_000, 3, "late"), (126_000_000, 4, "gone")]

"""The capture: what goes in comes out, by our reader and by other people's; a bad file is told as one."""

from __future__ import annotations

import json
import os
import struct
import subprocess
import sys
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jsonschema
import numpy as np
import pytest
import zstandard
from mcap.reader import make_reader
from mcap.records import Chunk, Message, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import CompressionType, Writer
from mcap_protobuf.decoder import DecoderFactory

from foosim.protocol import limits
from foosim.protocol.errors import Refused
from foosim.protocol.frame import CHAIN_START, chain_next
from foosim.protocol.scene import forward_kinematics
from foosim.protocol.table_scene import build_scene
from foosim.vhub import capture_writer
from foosim.vhub.capture_reader import CaptureData, capture_info, open_capture
from foosim.vhub.capture_writer import CaptureWriter
from foosim.vhub.mcap_file import CHUNK_BYTES_MAX, McapWriter
from foosim.vhub.rows import ROW_TYPES, CaptureError, row_schema
from foosim.vhub.viewing import VIEW_TYPES

if TYPE_CHECKING:
    from tests.vhub.conftest import HubRun

LOG_LINES = [("info", "kick-off", 0), ("warning", "late", 3), ("error", "gone", 63)]


def new_writer(path: Path, run: HubRun, say: Callable[[str, str], None] | None = None) -> CaptureWriter:
    return CaptureWriter(path, run.deployment, "table.yaml", run.text, {"run": "run-1", "fingerprint": "00"}, say)


def write(path: Path, run: HubRun) -> Path:
    writer = new_writer(path, run)
    for closing in run.closings:
        writer.keep(closing)
    for line in LOG_LINES:
        writer.log(*line)
    writer.finish({"reason": "enough"})
    return path


@pytest.fixture(scope="module")
def path(hub_run: HubRun, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("captures") / "run.mcap", hub_run)


@pytest.fixture(scope="module")
def chunked(hub_run: HubRun, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The same run in a file of many small chunks."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(capture_writer, "BATCH_ROWS", 40)
        patch.setattr(capture_writer, "CHUNK_BYTES", 1)
        return write(tmp_path_factory.mktemp("captures") / "chunked.mcap", hub_run).read_bytes()


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
    blocks = capture.frame_blocks
    assert [block.ticks.tolist() for block in blocks] == [[0, 10, 20], [30, 40], [50, 60, 64]]
    for block in blocks:
        assert block.values.shape == (len(block), block.layout.size)
        for index, tick in enumerate(block.ticks):
            kept = hub_run.closings[tick].frame
            assert block.frame(index).digest == kept.digest
            assert block.frame(index).outboxes == kept.outboxes
        joint = block.column("red.goal", "joint_positions", 2)
        assert joint[0].tolist() == block.frame(0).vector("red.goal", "joint_positions", 2)
        assert block.column("red.attack", "down")[0] == block.frame(0).at("red.attack", "down")
    with pytest.raises(CaptureError, match=r"frames of 3 layouts \(from 0, 30, 50\): frame_blocks"):
        _ = capture.frames


def test_poses_are_those_of_the_one_forward_kinematics(capture: CaptureData, hub_run: HubRun) -> None:
    poses = {name: capture.poses(name) for name in ("red.goal/slide", "red.goal/spin", "red.goal", "ball", "ball2")}
    assert poses["ball"].ticks.tolist() == [0, 10, 20, 30, 40, 50, 60, 64]
    assert poses["ball2"].ticks.tolist() == [30, 40]
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
    flights = [flight for closing in hub_run.closings for flight in closing.fates]
    packets = capture.packets
    account = hub_run.core.statistics()
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
        "run": "run-1",
        "fingerprint": "00",
        "format": "1",
        "world": "table",
        "seed": "1",
        "tick_ns": "2000000",
        "deployment": "table.yaml",
    }
    assert about.end == {"reason": "enough"}
    assert about.deployment_text == hub_run.text and capture.deployment == hub_run.deployment
    assert about.versions["numpy"] == np.__version__ and "pybullet" in about.versions
    assert [(client.tick, client.client, client.event) for client in capture.clients] == [
        (0, "player-blue", "joins"),
        (0, "player-red", "joins"),
        (3, "watcher", "joins"),
        (35, "watcher", "leaves"),
        (50, "watcher", "joins"),
    ]
    with pytest.raises(CaptureError, match="no rows of '/tock', there are /clients, /frame, /layout, /packets, /tick"):
        list(capture.rows("/tock"))


def test_the_summary_of_a_capture(path: Path, hub_run: HubRun) -> None:
    info = capture_info(path)
    account = hub_run.core.statistics()
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
        "/clients": 5,
        "/frame": 8,
        "/layout": 3,
        "/log": 3,
        "/packets": account.offered,
        "/scene": 3,
        "/tf": 9,
        "/tick": 65,
    }
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
        assert {m.name for m in reader.iter_metadata()} == {"foosim", "foosim.end"}
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
                assert json.loads(schema.data) == row_schema(ROW_TYPES[channel.topic])
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
    assert {entity.id for entity in first.entities} == {"scenery", *links}
    for entity in first.entities:
        assert entity.frame_locked and entity.frame_id == ("world" if entity.id == "scenery" else entity.id)
        shapes = scene.scenery if entity.id == "scenery" else links[entity.id].shapes
        assert len(entity.cubes) + len(entity.spheres) + len(entity.cylinders) == len(shapes) > 0
    ball = next(entity for entity in first.entities if entity.id == "ball").spheres[0]
    assert (ball.size.x, ball.color.r, ball.color.a) == (2 * hub_run.deployment.table.ball.radius, 1.0, 1.0)
    assert "ball2" in {entity.id for entity in added.entities}
    assert [deletion.id for deletion in removed.deletions] == ["ball2"]
    assert not first.deletions and not added.deletions


def test_viewers_get_the_log(path: Path) -> None:
    lines = [(m.timestamp.ToNanoseconds(), m.level, m.message) for m in decoded(path, "/log")]
    assert lines == [(0, 2, "kick-off"), (6_000_000, 3, "late"), (126_000_000, 4, "gone")]


# --- files that are not finished, not ours, or damaged ----------------------------------------------------------------


def test_an_unfinished_file_gives_what_is_whole(chunked: bytes, hub_run: HubRun, tmp_path: Path) -> None:
    path = tmp_path / "cut.mcap"
    ends: set[int] = set()
    for size in [*range(0, len(chunked), 1499), *range(len(chunked) - 40, len(chunked), 3)]:
        path.write_bytes(chunked[:size])
        try:
            capture = open_capture(path)
        except CaptureError:
            assert not ends, size
            continue
        ticks = capture.ticks.tolist()
        assert ticks == list(range(len(ticks))) and not capture.finished
        assert 0 <= capture.about.unfinished_bytes <= size
        for tick, closing in zip(capture.captured_ticks(), hub_run.closings, strict=False):
            assert (tick.digest, tick.delivered) == (closing.digest, list(closing.delivered))
        assert len(capture.packets) <= hub_run.core.statistics().offered
        ends.add(len(ticks))
    assert len(ends) > 8 and 65 in ends and 0 in ends
    path.write_bytes(chunked)
    assert open_capture(path).finished


def test_a_killed_writer_leaves_what_was_flushed(hub_run: HubRun, tmp_path: Path) -> None:
    """Without finishing, all rows reach the file by themselves; the process is then killed."""
    path = tmp_path / "killed.mcap"
    writer = new_writer(path, hub_run)
    for closing in hub_run.closings:
        writer.keep(closing)
    while writer.synced_tick < 64:
        pass
    content = path.read_bytes()
    writer.finish()
    (tmp_path / "then.mcap").write_bytes(content)
    capture = open_capture(tmp_path / "then.mcap")
    assert capture.ticks.tolist() == list(range(65)) and not capture.finished
    assert len(capture.packets) == hub_run.core.statistics().offered
    assert capture.about.end == {} and capture.frame_blocks[-1].ticks.tolist() == [50, 60]


def test_a_capture_is_never_overwritten(path: Path, hub_run: HubRun, tmp_path: Path) -> None:
    content = path.read_bytes()
    with pytest.raises(CaptureError, match=rf"{path.name}: exists already; a capture is never overwritten"):
        new_writer(path, hub_run)
    assert path.read_bytes() == content
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(CaptureError, match=r"file/run\.mcap: cannot be created"):
        new_writer(tmp_path / "file" / "run.mcap", hub_run)


def refused(path: Path) -> str:
    """The error of a file that no way of reading takes, without the path."""
    texts = set()
    for read in (open_capture, capture_info):
        with pytest.raises(CaptureError) as caught:
            read(path)
        texts.add(str(caught.value).replace(str(path), "FILE"))
    assert len(texts) == 1
    return texts.pop()


def mcap_with(path: Path, profile: str, metadata: dict[str, str] | None, text: str | None = None) -> Path:
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.NONE)
        writer.start(profile=profile)
        if metadata is not None:
            writer.add_metadata("foosim", metadata)
        if text is not None:
            writer.add_attachment(0, 0, "deployment.yaml", "application/yaml", text.encode())
        schema = writer.register_schema("x", "jsonschema", b"{}")
        writer.add_message(writer.register_channel("/tick", "json", schema), 5, b'{"tick": -1}', 5, 0)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def test_what_is_no_capture_is_told_so(tmp_path: Path, hub_run: HubRun) -> None:
    path = tmp_path / "other.mcap"
    assert refused(path) == "FILE: cannot be read, No such file or directory"
    path.write_bytes(b"\x89PNG\r\n and so on")
    assert refused(path) == "FILE: no MCAP file, it does not start with b'\\x89MCAP0\\r\\n'"
    about = {"format": "1", "deployment": "table.yaml"}
    assert refused(mcap_with(path, "ros2", None)) == "FILE: no capture of foosim, its profile is 'ros2', not 'foosim'"
    assert refused(mcap_with(path, "foosim", {**about, "format": "2"})) == "FILE: format '2' of a capture, this reads 1"
    assert refused(mcap_with(path, "foosim", about)) == "FILE: the capture has no deployment"
    row = mcap_with(path, "foosim", about, hub_run.text)
    assert refused(row).startswith("FILE: /tick at 5 ns: ")
    with pytest.raises(Refused):
        open_capture(mcap_with(path, "foosim", about, "format: 1\nworld: [\n"))


def test_ticks_that_go_back_are_refused(hub_run: HubRun, tmp_path: Path) -> None:
    path = tmp_path / "back.mcap"
    writer = new_writer(path, hub_run)
    for tick in (0, 2, 1):
        writer.keep(hub_run.closings[tick])
    writer.finish()
    with pytest.raises(CaptureError, match=r"back\.mcap: tick 1 comes behind tick 2"):
        open_capture(path)


def test_damaged_files_are_refused_or_read_and_nothing_else(chunked: bytes, tmp_path: Path) -> None:
    """Bits flipped at many places: a checksum or a schema notices, or the bit stood where nothing depends on it."""
    path = tmp_path / "damaged.mcap"
    verdicts: Counter[str] = Counter()
    for number in range(90):
        content = bytearray(chunked)
        place = number * 7919 * 31 % len(content)
        content[place] ^= 1 << number % 8
        path.write_bytes(content)
        try:
            capture = open_capture(path)
            list(capture.captured_ticks())
            _ = capture.packets
            capture_info(path)
            verdicts["read"] += 1
        except CaptureError as error:
            assert str(error).startswith(str(path))
            verdicts["refused"] += 1
    assert verdicts["refused"] > 50 and verdicts["read"] > 0


def chunk_record(size: int, compression: bytes, data: bytes) -> bytes:
    content = struct.pack("<QQQII", 0, 0, size, 0, len(compression)) + compression + struct.pack("<Q", len(data)) + data
    return struct.pack("<BQ", 6, len(content)) + content


BOMB = zstandard.ZstdCompressor().compress(bytes(1 << 28))
"""A few KiB that unpack to 256 MiB."""


@pytest.mark.parametrize(
    ("record", "text"),
    [
        (chunk_record(1 << 40, b"", b""), f"a chunk of {1 << 40} bytes, at most {CHUNK_BYTES_MAX} are read"),
        (
            chunk_record(10, b"zstd", BOMB),
            "unpacks to 11 bytes or more instead of 10",
        ),
        (chunk_record(10, b"zstd", b"nonsense"), "a damaged record, zstd"),
        (chunk_record(10, b"lz4", b""), "compression 'lz4', read are 'zstd' and none"),
        (chunk_record(3, b"", b"abc"), "a damaged record, "),
        (chunk_record(9, b"", struct.pack("<BQ", 5, 1 << 50)), "bytes in a chunk with 0 left"),
        (chunk_record(31, b"", struct.pack("<BQHIQQ", 5, 22, 77, 0, 0, 0)), "channel 77, which is not declared"),
        (struct.pack("<BQ", 5, CHUNK_BYTES_MAX + 1), "it is longer than the file"),
    ],
)
def test_a_hostile_record_costs_no_more_than_a_chunk(record: bytes, text: str, tmp_path: Path) -> None:
    path = tmp_path / "hostile.mcap"
    parts: list[bytes] = []
    McapWriter(parts.append, "foosim")
    path.write_bytes(b"".join(parts) + record + b"\x89MCAP0\r\n")
    assert text in refused(path)


# --- a writer that lags, a disk that fails ----------------------------------------------------------------------------


class Gated(CaptureWriter):
    """A writer whose thread waits for a gate before each item."""

    gate = threading.Event()

    def _write_item(self, item: Any) -> None:
        self.gate.wait()
        super()._write_item(item)


def test_a_lagging_writer_slows_the_run_says_so_once_and_loses_nothing(
    hub_run: HubRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(limits, "CAPTURE_QUEUE_ROWS_MAX", 30)
    said: list[tuple[str, str]] = []
    Gated.gate.clear()

    def say(level: str, text: str) -> None:
        """The run stands still in `keep` until the writer goes on."""
        said.append((level, text))
        Gated.gate.set()

    path = tmp_path / "slow.mcap"
    writer = Gated(path, hub_run.deployment, "table.yaml", hub_run.text, {}, say)
    for closing in hub_run.closings:
        writer.keep(closing)
        assert writer.statistics().queued_rows <= max(30, 1 + len(closing.fates))
    writer.finish()
    assert writer.statistics().waits > 0 and writer.statistics().queued_rows == 0
    assert [level for level, _ in said] == ["warning"]
    assert said[0][1].startswith(f"the run waits for its capture {path}: ")
    capture = open_capture(path)
    assert len(capture.ticks) == 65 and len(capture.packets) == hub_run.core.statistics().offered


class Failing(CaptureWriter):
    """A writer whose disk is full after a while."""

    room = 40_000

    def _write_bytes(self, content: bytes) -> None:
        self.room -= len(content)
        if self.room < 0:
            raise OSError(28, os.strerror(28))
        super()._write_bytes(content)


def test_a_disk_error_is_raised_to_the_owner_and_said_once(
    hub_run: HubRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(capture_writer, "CHUNK_BYTES", 1)
    monkeypatch.setattr(capture_writer, "BATCH_ROWS", 40)
    monkeypatch.setattr(limits, "CAPTURE_QUEUE_ROWS_MAX", 100)
    said: list[tuple[str, str]] = []
    path = tmp_path / "full.mcap"
    writer = Failing(
        path, hub_run.deployment, "table.yaml", hub_run.text, {}, lambda level, text: said.append((level, text))
    )
    error = rf"{path.name}: cannot be written, No space left on device"
    with pytest.raises(CaptureError, match=error):
        for closing in hub_run.closings:
            writer.keep(closing)
        writer.finish()
    for _ in range(2):
        with pytest.raises(CaptureError, match=error):
            writer.finish()
    assert [level for level, _ in said if level == "error"] == ["error"]
    capture = open_capture(path)
    assert not capture.finished and 0 < len(capture.ticks) < 65


def test_a_disk_that_is_full_at_the_start_is_told_at_once(
    hub_run: HubRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Failing, "room", 100)
    with pytest.raises(CaptureError, match="cannot be written, No space left on device"):
        Failing(tmp_path / "full.mcap", hub_run.deployment, "table.yaml", hub_run.text, {})


def test_a_process_that_ends_without_finishing_is_not_held_up(hub_run: HubRun, tmp_path: Path) -> None:
    program = """if True:
        import pathlib, sys
        from foosim.protocol.deployment_file import load_deployment
        from foosim.vhub.capture_writer import CaptureWriter
        text = sys.stdin.read()
        CaptureWriter(pathlib.Path(sys.argv[1]), load_deployment(text, "t"), "t", text, {})
    """
    path = tmp_path / "left.mcap"
    subprocess.run([sys.executable, "-c", program, str(path)], check=True, input=hub_run.text.encode())
    assert not open_capture(path).finished


def test_an_empty_run_is_a_capture_too(hub_run: HubRun, tmp_path: Path) -> None:
    writer = new_writer(tmp_path / "empty.mcap", hub_run)
    writer.finish()
    writer.finish()
    capture = open_capture(tmp_path / "empty.mcap")
    assert capture.finished and len(capture.ticks) == len(capture.packets) == 0
    assert capture.digests.shape == (0, 32) and capture.frame_blocks == ()
    assert capture_info(tmp_path / "empty.mcap").ticks == 0
    assert capture.clients == ()

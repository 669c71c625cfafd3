"""The entries of a replay: the order of release, selections, names, parts of a capture."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import msgspec
import pytest
from foxglove.messages import SceneUpdate
from mcap.records import Schema
from mcap_protobuf.decoder import DecoderFactory

from foosim.capture.mcap.checks import CaptureError
from foosim.capture.reader import Scan, deployment_of, open_capture, read_about
from foosim.capture.rows import PacketRow
from foosim.common.errors import BadValue
from foosim.library.table.settings import LINE_NAMES
from foosim.protocol.codec import decode
from foosim.protocol.replay_messages import (
    LOG,
    PACKETS,
    POSES,
    ROWS,
    SCENE,
    PlayedLine,
    PlayedPacket,
    PlayedPoses,
    PlayedRow,
    PlayedScene,
)
from foosim.simulation.play.core import Span
from foosim.simulation.play.entries import Entries, Entry, Selection, make_selection
from foosim.simulation.play.main import entries_at, read_span
from tests.simulation.conftest import TICK_NS, TICKS, damaged, messages_of, rewritten, with_row

MS = 1_000_000


def played(path: Path, selection: Selection | None = None) -> list[Entry]:
    return list(entries_at(path, Entries(deployment_of(read_about(path)), selection or Selection()), 0))


def selected(path: Path, **options: list[str]) -> Counter[str]:
    selection = make_selection(deployment_of(read_about(path)), **options)
    return Counter(entry.topic for entry in played(path, selection))


def test_delivered_packets_are_played_in_the_order_of_their_release(run: Path) -> None:
    entries = played(run)
    assert [entry.time_ns for entry in entries] == sorted(entry.time_ns for entry in entries)
    packets = [decode(PlayedPacket, entry.payload) for entry in entries if entry.stream == PACKETS]
    rows = [row for row in open_capture(run).rows("/packets") if isinstance(row, PacketRow)]
    delivered = {(row.source, row.sequence, row.destination): row for row in rows if row.fate == "delivered"}
    assert {(p.source, p.sequence, p.destination) for p in packets} == delivered.keys()
    assert len(packets) == len(delivered) < len(rows)
    for packet in packets:
        row = delivered[packet.source, packet.sequence, packet.destination]
        assert packet.time_ns == row.arrival_tick * TICK_NS, "robots, and players in lockstep, hear at ticks"
        assert (packet.payload, packet.channel, packet.sent_ns) == (row.payload, row.channel, row.sent_ns)


def test_a_free_running_client_hears_between_ticks(run: Path, tmp_path: Path) -> None:
    """As it joined decides, not as it is declared. What waited for a tick comes with that one."""
    changed = []
    for message in messages_of(run):
        row = msgspec.json.decode(message.data) if message.topic in ("/clients", "/packets") else {}
        fields: dict[str, int] = {}
        if message.topic == "/clients":
            fields = {"period": 0}
        elif row.get("destination") == "player-red" and row["fate"] == "delivered":
            fields = {"arrival_tick": -(-row["due_ns"] // TICK_NS)}
        changed.append(with_row(message, **fields) if fields else message)
    free = rewritten(run, tmp_path / "free.mcap", changed)
    packets = [decode(PlayedPacket, entry.payload) for entry in played(free) if entry.stream == PACKETS]
    red = [packet for packet in packets if packet.destination == "player-red"]
    blue = [packet for packet in packets if packet.destination == "player-blue"]
    assert len(red) > 100 and all(packet.time_ns == packet.due_ns for packet in red)
    assert len(blue) > 100 and all(packet.time_ns % TICK_NS == 0 < packet.time_ns - packet.due_ns for packet in blue)


def test_packets_are_put_in_order_over_the_rows_of_two_ticks(run: Path) -> None:
    """A robot's packet of the next tick has its row before a client's that is due earlier."""
    messages = messages_of(run)
    ticks = [message for message in messages if message.topic == "/tick"]
    packet = next(message for message in messages if b'"fate":"delivered"' in message.data)
    to_robot = with_row(packet, destination="red.goal", due_ns=11 * MS, arrival_tick=6)
    to_client = with_row(packet, destination="hand", due_ns=11_500_000, arrival_tick=6)
    scan = Scan(run)
    entries = Entries(deployment_of(read_about(run)), Selection())
    stream = [ticks[5], to_robot, ticks[6], to_client, ticks[7], ticks[8]]
    assert [entry.time_ns for entry in entries.of(stream, scan.decode)] == [11_500_000, 12 * MS]


def test_poses_and_rows_are_played_as_they_stand(run: Path) -> None:
    entries = played(run)
    capture = open_capture(run)
    poses = [decode(PlayedPoses, entry.payload) for entry in entries if entry.stream == POSES]
    ball = capture.poses("ball")
    at = {int(tick) * TICK_NS: position for tick, position in zip(ball.ticks, ball.positions, strict=True)}
    for message in poses:
        (position,) = (pose.position for pose in message.poses if pose.link == "ball")
        assert message.time_ns not in at or position == tuple(at[message.time_ns])
    rows = [decode(PlayedRow, entry.payload) for entry in entries if entry.stream == ROWS]
    assert Counter(row.topic for row in rows) == {"clients": 2, "epochs": 1, "layout": 1, "ages": 10, "metrics": 8}
    theirs = [message.data for message in messages_of(run) if message.topic == "/clients"]
    assert [row.row for row in rows if row.topic == "clients"] == theirs


def test_scenes_and_the_log_are_played_as_they_stand(run: Path) -> None:
    entries = played(run)
    scenes = [decode(PlayedScene, entry.payload) for entry in entries if entry.stream == SCENE]
    theirs = [message for message in messages_of(run) if message.topic == "/scene"]
    assert [(scene.time_ns, scene.update) for scene in scenes] == [(message.log_ns, message.data) for message in theirs]
    assert len(scenes) == 2, "one at the start, one where a ball was added"
    lines = [decode(PlayedLine, entry.payload) for entry in entries if entry.stream == LOG]
    assert len(lines) == len([message for message in messages_of(run) if message.topic == "/log"]) > 0
    assert {line.level for line in lines} <= {"info", "warning", "error"}
    assert any(line.text.startswith("supervisor: ") for line in lines)


def test_names_are_changed_in_scenes(run: Path) -> None:
    selection = make_selection(deployment_of(read_about(run)), ["/scene"], remaps=["red.goal:=keeper", "ball:=sphere"])
    before, after = (
        [scene_of(decode(PlayedScene, entry.payload).update) for entry in played(run, chosen) if entry.stream == SCENE]
        for chosen in (Selection(("/scene",)), selection)
    )
    for old, new in zip(before, after, strict=True):
        ids = [entity.id for entity in new.entities]
        assert {"keeper/slide", "keeper/spin", "sphere", "scenery"} < set(ids) and "ball" not in ids
        for one, other in zip(old.entities, new.entities, strict=True):
            other.id, other.frame_id = one.id, one.frame_id
        assert str(old) == str(new), "nothing else changes"


def scene_of(update: bytes) -> Any:
    """A SceneUpdate by other people's reader."""
    schema = SceneUpdate.get_schema()
    decoder = DecoderFactory().decoder_for("protobuf", Schema(1, schema.data, schema.encoding, schema.name))
    assert decoder is not None
    return decoder(update)


def test_what_is_selected_is_played_and_nothing_else(run: Path) -> None:
    everything = selected(run)
    assert "/tick" not in everything and "/frame" not in everything and everything["/tf"] > 20
    assert selected(run, topics=["/tick"]) == {"/tick": TICKS + 1}
    camera = selected(run, topics=["/packets/camera"])
    assert set(camera) == {"/packets/camera/player-blue/ball", "/packets/camera/player-red/ball"}
    assert camera["/packets/camera/player-red/ball"] == everything["/packets/camera/player-red/ball"]
    from_red = selected(run, topics=["/packets/player-red", "/tf"])
    assert set(from_red) == {"/tf", *(f"/packets/player-red/red.{line}/position" for line in LINE_NAMES)}
    assert selected(run, topics=["/packets/cam"]) == {}, "names are whole"


def test_names_are_changed_in_packets_and_poses(run: Path) -> None:
    deployment = deployment_of(read_about(run))
    remaps = ["camera:=eye", "red.goal:=keeper", "ball:=sphere", "/ball:=/seen"]
    selection = make_selection(deployment, topics=["/packets", "/tf"], remaps=remaps)
    entries = played(run, selection)
    packets = [decode(PlayedPacket, entry.payload) for entry in entries if entry.stream == PACKETS]
    assert {p.channel for p in packets if p.source == "eye"} == {"seen"}
    names = {packet.source for packet in packets} | {packet.destination for packet in packets}
    assert {"eye", "keeper"} < names and not {"camera", "red.goal"} & names
    poses = next(decode(PlayedPoses, entry.payload) for entry in entries if entry.stream == POSES)
    assert {"sphere", "keeper/slide", "keeper/spin", "red.attack/slide"} < {pose.link for pose in poses.poses}
    assert any(entry.topic.startswith("/packets/camera/") for entry in entries), "counted by their captured names"


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"topics": ["/packet"]}, r"--topic: not one of .*, '/packet', nearest is '/packets'"),
        ({"topics": ["packets"]}, r"--topic: .*nearest is '/packets'"),
        ({"topics": ["/scenes"]}, r"--topic: not one of .*, '/scenes', nearest is '/scene'"),
        ({"remaps": ["camera"]}, r"--remap: not OLD:=NEW"),
        ({"remaps": ["camera:=Eye"]}, r"--remap: not OLD:=NEW"),
        ({"remaps": ["/ball:=seen"]}, r"--remap: not OLD:=NEW"),
        ({"remaps": ["camra:=eye"]}, r"no such endpoint or body, 'camra', nearest is 'camera'"),
        ({"remaps": ["camera:=red.goal"]}, r"two would have this name, 'red.goal'"),
        ({"remaps": ["camera:=eye", "camera:=see"]}, r"renamed twice, 'camera'"),
        ({"remaps": ["camera:=eye", "red.goal:=eye"]}, r"two would have this name, 'eye'"),
    ],
)
def test_bad_options_are_named(run: Path, options: dict[str, list[str]], text: str) -> None:
    with pytest.raises(BadValue, match=text):
        make_selection(deployment_of(read_about(run)), **options)


def test_two_names_may_change_places(run: Path) -> None:
    selection = make_selection(deployment_of(read_about(run)), remaps=["camera:=red.goal", "red.goal:=camera"])
    assert selection.names == {"camera": "red.goal", "red.goal": "camera"}


# --- parts of a capture ----------------------------------------------------------------------------------------------


def test_any_part_is_read_as_a_part_of_the_whole(run: Path) -> None:
    """Also where chunks before it are skipped: nothing is left out at its beginning."""
    everything = played(run)
    end_ns = TICKS * TICK_NS
    entries = Entries(deployment_of(read_about(run)), Selection())
    for from_ns in (0, 1, 100 * MS, 254 * MS + 1, 599 * MS, end_ns, 3 * MS):
        found = list(entries_at(run, entries, from_ns))
        if from_ns:
            shown = [entry for entry in everything if entry.stream == SCENE and entry.time_ns < from_ns][-1]
            update = decode(PlayedScene, shown.payload).update
            assert decode(PlayedScene, found.pop(0).payload) == PlayedScene(from_ns, update), "the scene at that time"
        assert found == [entry for entry in everything if entry.time_ns >= from_ns]


def test_the_span_is_read_from_heads_of_chunks(run: Path) -> None:
    span, about = read_span(run)
    assert (span.first_ns, span.last_ns, about.finished) == (0, TICKS * TICK_NS, True)
    assert read_span(run, 100 * MS, 120 * MS)[0] == Span(100 * MS, 120 * MS)
    assert read_span(run, None, 10_000 * MS)[0] == Span(0, TICKS * TICK_NS)
    with pytest.raises(BadValue, match="--from: the capture has 0 s to 600 ms, '1 s'"):
        read_span(run, 1000 * MS)
    with pytest.raises(BadValue, match="--until: before the beginning"):
        read_span(run, 100 * MS, 50 * MS)


def test_damage_is_reported_after_the_entries_before_it(run: Path, tmp_path: Path) -> None:
    path = damaged(run, tmp_path / "damaged.mcap")
    entries: list[Entry] = []
    with pytest.raises(CaptureError, match=r"damaged.mcap: byte "):
        for entry in entries_at(path, Entries(deployment_of(read_about(run)), Selection()), 0):
            entries.append(entry)  # what came before the error counts
    assert entries and entries == played(run)[: len(entries)]

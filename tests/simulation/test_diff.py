"""Captures compared: equal runs are equal, one changed packet is found in its channel, row and field."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from foosim.capture import diff as diff_module
from foosim.capture.diff import diff_captures, first_difference
from foosim.capture.foxglove import POSES
from foosim.capture.mcap.format import Message
from foosim.capture.rows import CLIENTS, EPOCHS, FRAME, PACKETS, TICK
from foosim.common.errors import BadValue
from tests.simulation.conftest import capture_to, messages_of, replay, rewritten, with_row


def changed(run: Path, tmp_path: Path, number: int, **fields: object) -> Path:
    """The run with other fields in one of its packets."""
    messages = messages_of(run)
    index = [index for index, message in enumerate(messages) if message.topic == PACKETS][number]
    messages[index] = with_row(messages[index], **fields)
    return rewritten(run, tmp_path / "changed.mcap", messages)


def test_equal_runs_are_equal_whatever_their_chunks(run: Path, again: Path) -> None:
    found = diff_captures(run, again)
    assert found.equal and found.first is None and found.about == ()
    rows = {topic: tuple(channel.rows) for topic, channel in found.channels.items()}
    assert rows[TICK] == (301, 301) and rows[PACKETS][0] == rows[PACKETS][1] > 500 and "/log" not in rows
    assert all(channel.equal == channel.rows[0] for channel in found.channels.values())
    done = replay("diff", run, again)
    assert done.code == 0 and done.out.startswith("equal: ") and "/packets: " in done.out


def test_one_packet_is_found_with_its_field_and_both_values(run: Path, tmp_path: Path) -> None:
    other = changed(run, tmp_path, 100, due_ns=7)
    found = diff_captures(run, other)
    packet = [message for message in messages_of(run) if message.topic == PACKETS][100]
    first = found.first
    assert first is not None and (first.topic, first.row, first.field, first.b) == (PACKETS, 100, "due_ns", "7")
    assert first.a == str(msgspec.json.decode(packet.data)["due_ns"])
    assert (first.time_ns, first.tick) == (packet.log_ns, packet.log_ns // 2_000_000)
    assert [topic for topic, channel in found.channels.items() if channel.first is not None] == [PACKETS]
    done = replay("diff", run, other, "--json")
    assert done.code == 1
    content = msgspec.json.decode(done.out)
    assert content["first"]["field"] == "due_ns" and content["channels"][PACKETS]["equal"] == 100
    assert "row 100, due_ns" in replay("diff", run, other).out


def test_what_clocks_told_and_what_is_ignored_is_not_compared(run: Path, tmp_path: Path) -> None:
    other = changed(run, tmp_path, 3, wall_released_ns=123, due_ns=7)
    assert not diff_captures(run, other).equal
    assert diff_captures(run, other, ["due_ns"]).equal
    ignoring = diff_captures(run, other, [PACKETS])
    assert ignoring.equal and PACKETS not in ignoring.channels
    assert replay("diff", run, other, "--ignore", "due_ns").code == 0


def test_a_row_that_one_lacks_is_named_on_either_side(run: Path, tmp_path: Path) -> None:
    messages = messages_of(run)
    last = max(index for index, message in enumerate(messages) if message.topic == PACKETS)
    shorter = rewritten(run, tmp_path / "shorter.mcap", [*messages[:last], *messages[last + 1 :]])
    count = sum(message.topic == PACKETS for message in messages)
    for pair, sides in (((run, shorter), ("a row", "no such row")), ((shorter, run), ("no such row", "a row"))):
        found = diff_captures(*pair)
        first = found.first
        assert first is not None and (first.topic, first.row, first.field, first.a, first.b) == (
            PACKETS, count - 1, "", *sides
        )  # fmt: skip
        assert sorted(found.channels[PACKETS].rows) == [count - 1, count]


def test_rows_out_of_step_are_compared_by_channel_with_a_bounded_lead(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Poses that stand much later in one file are no difference, as long as they can be held."""
    messages = messages_of(run)
    poses = [message for message in messages if message.topic == POSES]
    late = rewritten(run, tmp_path / "late.mcap", [*(m for m in messages if m.topic != POSES), *poses])
    assert diff_captures(run, late).equal and diff_captures(late, run).equal
    monkeypatch.setattr(diff_module, "AHEAD_MAX", 2)
    found = diff_captures(run, late)
    assert found.first is not None and (found.first.topic, found.first.row) == (POSES, 0)


def test_poses_frames_and_other_runs_name_their_numbers(run: Path, tmp_path: Path) -> None:
    other = capture_to(tmp_path / "short.mcap", 100)
    moved = rewritten(run, tmp_path / "moved.mcap", map(flip_last_byte, messages_of(run)))
    found = diff_captures(run, moved)
    frame, poses = found.channels[FRAME].first, found.channels[POSES].first
    assert frame is not None and frame.field.startswith("values[") and float(frame.a) != float(frame.b)
    assert poses is not None and poses.field.endswith("orientation[3]") and float(poses.a) != float(poses.b)
    found = diff_captures(run, other)
    assert found.channels[TICK].rows == [301, 101] and found.channels[TICK].equal == 101
    assert found.channels[CLIENTS].first is None and found.channels[EPOCHS].first is None


def flip_last_byte(message: Message) -> Message:
    """The last number of poses and frames, changed in its last bits."""
    if message.topic == POSES:
        data = message.data[:-3] + bytes([message.data[-3] ^ 1]) + message.data[-2:]
        return Message(message.topic, message.log_ns, message.publish_ns, message.sequence, data)
    if message.topic == FRAME:
        row = msgspec.json.decode(message.data)
        return with_row(message, values="AAAAAAAA8D8" + row["values"][11:])
    return message


def test_differences_within_rows_have_a_path() -> None:
    ignored = frozenset({"x"})
    a = {"wall_s": 1, "x": 2, "list": [{"y": 1, "x": 1}, {"y": 2}], "z": 0}
    assert first_difference(a, {**a, "wall_s": 2, "x": 3}, ignored) is None
    assert first_difference(a, {**a, "list": [{"y": 1}, {"y": 3}]}, ignored) == ("list[1].y", 2, 3)
    assert first_difference(a, {**a, "list": [{"y": 1}]}, ignored) == ("list", "2 of them", "1 of them")
    assert first_difference(a, {"list": a["list"]}, ignored) == ("z", 0, "no such field")
    assert first_difference(1, 1.0, ignored) == ("", 1, 1.0), "an integer that became a float is a difference"


def test_a_field_that_a_file_leaves_out_has_its_default(run: Path, tmp_path: Path) -> None:
    """Some writers leave out what has its default, others do not: the rows are equal."""
    messages = messages_of(run)
    added = next(index for index, message in enumerate(messages) if b'"kind":"add"' in message.data)
    row = msgspec.json.decode(messages[added].data)
    edits = [{name: value for name, value in edit.items() if value not in ([], "")} for edit in row["edits"]]
    assert edits != row["edits"]
    messages[added] = with_row(messages[added], edits=edits)
    assert diff_captures(run, rewritten(run, tmp_path / "short.mcap", messages)).equal


def test_what_cannot_be_ignored_is_named(run: Path) -> None:
    with pytest.raises(BadValue, match=r"--ignore: no field of a row, 'due_n', nearest is 'due_ns'"):
        diff_captures(run, run, ["due_n"])
    with pytest.raises(BadValue, match=r"--ignore: no channel, '/packet', nearest is '/packets'"):
        diff_captures(run, run, ["/packet"])

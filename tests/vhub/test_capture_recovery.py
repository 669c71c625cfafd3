"""Captures that a killed writer left: recovered to valid files, cut anywhere, with a journal and without."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import pytest
from mcap.reader import make_reader
from mcap.records import DataEnd
from mcap.stream_reader import StreamReader

from foosim.capture import index as capture_index
from foosim.capture.index import UNSYNCED_BYTES
from foosim.capture.info import capture_info
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.mcap.format import MAGIC, McapFile, Message
from foosim.capture.reader import open_capture
from foosim.common.errors import Failed, Refused
from foosim.runtime.disk import Room
from foosim.runtime.journal import Journal, JournalError
from foosim.vhub.recording import recovery
from foosim.vhub.recording.recorder import Recorder
from foosim.vhub.recording.recovery import UNCLEAN, Recovered, recover_capture, recovered_path

if TYPE_CHECKING:
    from tests.vhub.conftest import HubRun

LAST = 63
"""The last tick that the journal has; frame 64 ended the run and was committed only."""


@pytest.fixture
def journals(hub_run: HubRun, tmp_path: Path) -> Path:
    """The folder of the run's whole journal."""
    with Journal(tmp_path / "journals", "vhub") as journal:
        for record in hub_run.records:
            journal.append(record)
    return tmp_path / "journals"


def cut(tmp_path: Path, content: bytes) -> Path:
    path = tmp_path / "cut.mcap"
    path.write_bytes(content)
    return path


def recovered(path: Path, journals: Path | None = None) -> Recovered:
    """Recover a capture to another file, the one of the call before going; the one that is left stays as it is."""
    before, out = path.read_bytes(), path.with_name("recovered.mcap")
    out.unlink(missing_ok=True)
    found = recover_capture(path, journals, out)
    assert found is not None and found.path == out and path.read_bytes() == before
    assert not list(path.parent.glob(".*")), "nothing else is left"
    return found


def rows(path: Path, last: int = LAST) -> dict[str, list[dict[str, Any]]]:
    """Return the rows up to a tick of all topics but the log, without what only a clock knew, and views as they are."""
    kept: dict[str, list[dict[str, Any]]] = {}
    with path.open("rb") as stream:
        for content in McapFile(stream, path.stat().st_size, str(path)).contents():
            if isinstance(content, Message) and content.topic != "/log" and content.log_ns <= last * 2_000_000:
                row: dict[str, Any] = {"data": content.data}
                if content.data[:1] == b"{":
                    row = {k: v for k, v in msgspec.json.decode(content.data).items() if not k.startswith("wall_")}
                row["place"] = content.log_ns, content.publish_ns, content.sequence
                kept.setdefault(content.topic, []).append(row)
    return kept


def read_by_others(path: Path) -> int:
    """Read a file by its summary and its indexes, as viewers do; return the number of messages."""
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None and summary.statistics is not None
        by_channel: dict[int, int] = {}
        for _, channel, _ in reader.iter_messages():
            by_channel[channel.id] = by_channel.get(channel.id, 0) + 1
        counts = summary.statistics.channel_message_counts
        assert {number: count for number, count in counts.items() if count} == by_channel
        assert len(summary.chunk_indexes) == summary.statistics.chunk_count
        assert len(list(reader.iter_attachments())) == 2 and len(list(reader.iter_metadata())) >= 2
        stream.seek(0)
        ends = [record for record in StreamReader(stream, validate_crcs=True).records if isinstance(record, DataEnd)]
        assert [bool(end.data_section_crc) for end in ends] == [True]
        return summary.statistics.message_count


def first_chunk(content: bytes) -> int:
    """Return how many bytes of a capture describe it."""
    return content.index(b"versions.json") + 2000


def cuts(content: bytes) -> Sequence[int]:
    return [*range(first_chunk(content), len(content) - 1, 12_973), len(content) - 1]


def test_cut_anywhere_the_journal_gives_what_is_missing(
    chunked: bytes, path: Path, journals: Path, hub_run: HubRun, tmp_path: Path
) -> None:
    whole = rows(path)
    starts: set[int] = set()
    for size in cuts(chunked):
        found = recovered(cut(tmp_path, chunked[:size]), journals)
        made = rows(found.path)
        made["/epochs"] = whole["/epochs"]  # the journal of these tests has none
        last = [row for row in made["/frame"] if row not in whole["/frame"]]
        assert [row["tick"] for row in last] in ([], [LAST]), size  # the last one stands in every capture
        made["/frame"] = [row for row in made["/frame"] if row not in last]
        assert made == whole, size
        capture = open_capture(found.path)
        assert capture.recoveries == open_capture(path).recoveries, "how long they took was told by a commit"
        assert capture.finished and capture.about.end["reason"] == UNCLEAN and found.problem == ""
        assert len(capture.packets) == hub_run.core.statistics().offered
        assert read_by_others(found.path) == sum(capture_info(found.path).topics.values())
        assert found.tick == int(capture.ticks[-1]) >= LAST
        starts.add(found.tick + 1 - found.added_ticks)
        assert recover_capture(found.path, journals) is None
    assert len(starts) > 3


def test_cut_anywhere_without_a_journal_every_whole_chunk_stays(chunked: bytes, tmp_path: Path) -> None:
    for size in cuts(chunked)[::2]:
        path = cut(tmp_path, chunked[:size])
        before = rows(path, 64)
        found = recovered(path)
        after = rows(found.path, 64)
        assert open_capture(found.path).finished and read_by_others(found.path) > 0
        assert found.problem == "there is no journal of it" and found.added_ticks == 0
        assert after == before and found.tick == len(before.get("/tick", ())) - 1


def test_a_chunk_whose_indexes_were_cut_stays(chunked: bytes, tmp_path: Path) -> None:
    """Every byte between a chunk and the end of its indexes."""
    with (tmp_path / "whole").open("wb+") as stream:
        stream.write(chunked)
        stream.seek(0)
        summary = make_reader(stream).get_summary()
    assert summary is not None
    chunk = summary.chunk_indexes[3]
    end = chunk.chunk_start_offset + chunk.chunk_length
    for size in range(end, end + chunk.message_index_length + 1, 61):
        path = cut(tmp_path, chunked[:size])
        before = rows(path)
        found = recovered(path)
        assert rows(found.path) == before
        assert read_by_others(found.path) == sum(map(len, before.values())) + 1  # the line about the recovery


def test_bytes_that_were_never_written_are_left_out(
    chunked: bytes, journals: Path, hub_run: HubRun, tmp_path: Path
) -> None:
    """A machine without power leaves zeros: a vHub goes on over them only where its journal has what they were."""
    size = len(chunked) * 2 // 3
    path = cut(tmp_path, chunked[:size] + bytes(20_000))
    assert recovered(path).problem.endswith("there is no journal of it")
    with pytest.raises(CaptureError, match=r"cut or damaged; \d+ bytes .* would be lost, no journal has tick \d+"):
        Recorder(path, hub_run.deployment, "table.yaml", hub_run.text, {"run": "run-1"}, None, LAST)
    found = recovered(path, journals)
    assert found.tick == LAST and found.is_whole and open_capture(found.path).finished


def test_damage_before_the_end_loses_nothing_that_no_journal_has(
    chunked: bytes, journals: Path, tmp_path: Path
) -> None:
    content = bytearray(chunked[: len(chunked) * 3 // 4])
    content[len(chunked) // 2] ^= 1
    path = cut(tmp_path, bytes(content))
    found = recovered(path)
    assert re.fullmatch(r".*cut\.mcap: byte \d+: a damaged record, .*; there is no journal of it", found.problem)
    assert open_capture(found.path).ticks.tolist() == list(range(found.tick + 1)) and 0 < found.tick < 40
    found = recovered(path, journals)
    assert found.is_whole and found.added_ticks > 20
    assert open_capture(found.path).ticks.tolist() == list(range(LAST + 1))


def test_what_was_in_flight_is_written_once(path: Path, journals: Path, hub_run: HubRun, tmp_path: Path) -> None:
    """The end was written, the summary was not."""
    content = path.read_bytes()
    for size in range(len(content) - 4000, len(content) - 1, 499):
        found = recovered(cut(tmp_path, content[:size]), journals)
        assert found.tick == 64 and found.added_ticks == 0
        assert len(open_capture(found.path).packets) == hub_run.core.statistics().offered


def test_a_journal_that_does_not_fit_is_told_and_changes_nothing(
    chunked: bytes, hub_run: HubRun, journals: Path, tmp_path: Path
) -> None:
    half = chunked[: len(chunked) // 2]
    before = rows(cut(tmp_path, half))
    other = tmp_path / "other"
    with Journal(other, "vhub") as journal:
        head = msgspec.msgpack.decode(hub_run.records[0])
        head[1] = "run-2"
        journal.append(msgspec.msgpack.encode(head))
    found = recovered(cut(tmp_path, half), other)
    assert found.problem == "its journal cannot be used: it is not that of run run-1"
    assert rows(found.path) == before and "run-1" in str(found)
    late = tmp_path / "late"
    with Journal(late, "vhub") as journal:
        for record in (hub_run.head, *hub_run.records[65:]):
            journal.append(record)
    found = recovered(cut(tmp_path, half), late)
    assert found.problem == "its journal starts at tick 64 only" and rows(found.path) == before
    with Journal(journals, "vhub"), pytest.raises(JournalError, match="being written by another process"):
        recover_capture(cut(tmp_path, half), journals)
    assert (tmp_path / "cut.mcap").read_bytes() == half


def test_a_file_that_is_there_is_not_overwritten(chunked: bytes, tmp_path: Path) -> None:
    path = cut(tmp_path, chunked[: len(chunked) // 2])
    found = recover_capture(path)
    assert found is not None and found.path == recovered_path(path) == tmp_path / "cut.recovered.mcap"
    before = found.path.read_bytes()
    with pytest.raises(CaptureError, match=r"cut\.recovered\.mcap: exists already"):
        recover_capture(path)
    with pytest.raises(Failed, match=r"\.new\.mcap\.part: cannot be created"):
        recover_capture(path, out=path / "new.mcap")
    assert found.path.read_bytes() == before


def test_the_reserve_of_the_disk_is_kept(chunked: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = cut(tmp_path, chunked[: len(chunked) // 2])
    room = Room((64 << 20) + path.stat().st_size - 1, 64 << 20, "on its disk")
    monkeypatch.setattr(recovery, "room_on_disk", lambda place, reserve: room)
    told = (
        r"cut\.recovered\.mcap: needs 0\.0\d+ MiB or more, there are 64\.1 MiB left on its disk, the reserve is 64 MiB"
    )
    with pytest.raises(CaptureError, match=told):
        recover_capture(path)
    assert [left.name for left in tmp_path.iterdir()] == ["cut.mcap"]


def test_a_journal_that_is_damaged_gives_what_is_before(chunked: bytes, hub_run: HubRun, tmp_path: Path) -> None:
    with Journal(tmp_path / "gap", "vhub") as journal:
        for record in [*hub_run.records[:51], *hub_run.records[52:]]:
            journal.append(record)
    found = recovered(cut(tmp_path, chunked[: len(chunked) // 2]), tmp_path / "gap")
    assert found.tick == 49 and "record 51 of the vHub's journal does not follow on tick 49" in found.problem
    assert open_capture(found.path).ticks.tolist() == list(range(50))


def test_no_capture_is_refused(tmp_path: Path) -> None:
    for content in (b"", MAGIC, b"#!/bin/sh\n"):
        with pytest.raises(Refused, match=r"cut\.mcap: "):
            recover_capture(cut(tmp_path, content))
        assert (tmp_path / "cut.mcap").read_bytes() == content


@pytest.mark.parametrize("unsynced", [20_000, UNSYNCED_BYTES])
def test_a_writer_goes_on_with_what_it_left(
    chunked: bytes, path: Path, hub_run: HubRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, unsynced: int
) -> None:
    """As a vHub does that was killed and started again: it feeds all of its journal, and the run goes on."""
    monkeypatch.setattr(capture_index, "UNSYNCED_BYTES", unsynced)
    whole = rows(path, 64)
    for size in (10, first_chunk(chunked), len(chunked) // 2, len(chunked) - 3000):
        going = cut(tmp_path, chunked[:size])
        metadata = {"run": "run-1", "fingerprint": "00"}
        writer = Recorder(going, hub_run.deployment, "table.yaml", hub_run.text, metadata, None, 0)
        for epoch in hub_run.epochs:
            writer.keep(epoch)
        for closing in hub_run.closings:
            writer.keep(closing)
        writer.finish({"reason": "enough"})
        made = rows(going, 64)
        assert {topic: sorted(map(str, found)) for topic, found in made.items()} == {
            topic: sorted(map(str, found)) for topic, found in whole.items()
        }
        assert open_capture(going).about.metadata == open_capture(path).about.metadata
        read_by_others(going)
    with pytest.raises(CaptureError, match="is finished; a capture is never overwritten"):
        Recorder(going, hub_run.deployment, "table.yaml", hub_run.text, metadata, None, 0)
    for_another_run = cut(tmp_path, chunked[: len(chunked) // 2])
    with pytest.raises(CaptureError, match="is that of run run-1, not of run run-2"):
        Recorder(for_another_run, hub_run.deployment, "table.yaml", hub_run.text, {"run": "run-2"}, None, 0)
    assert for_another_run.read_bytes() == chunked[: len(chunked) // 2]

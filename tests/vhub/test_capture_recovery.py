"""Captures that a killed writer left: recovered to valid files, cut anywhere, with a journal and without."""

from __future__ import annotations

import random
import re
import shutil
from collections.abc import Iterator, Sequence
from io import BytesIO
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
from foosim.capture.parts import Joined, files_from, first_there
from foosim.capture.reader import open_capture
from foosim.common.errors import Failed, Refused
from foosim.protocol.codec import decode_any
from foosim.runtime.disk import Room
from foosim.runtime.journal import Journal, JournalError
from foosim.vhub.recording import recovery
from foosim.vhub.recording.recorder import Recorder
from foosim.vhub.recording.recovery import UNCLEAN, Recovered, recover_capture, recovered_path
from foosim.vhub.state.records import Closing, HubRecord, TickRecord
from foosim.vhub.state.resume import first_tick_of, recall
from tests.vhub.conftest import BY_TIME, EPOCH_AT, METADATA, NAME, with_sets

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
    """Return the rows up to a tick of all topics but the log, without what only a clock knew, and views as they are.

    Without the frame that each capture ends with.
    """
    kept: dict[str, list[dict[str, Any]]] = {}
    for content in Joined(path).contents():
        if isinstance(content, Message) and content.topic != "/log" and content.log_ns <= last * 2_000_000:
            row: dict[str, Any] = {"data": content.data}
            if content.data[:1] == b"{":
                row = {k: v for k, v in msgspec.json.decode(content.data).items() if not k.startswith("wall_")}
            row["place"] = content.log_ns, content.publish_ns, content.sequence
            kept.setdefault(content.topic, []).append(row)
    if "/frame" in kept:
        kept["/frame"] = [row for row in kept["/frame"] if row["tick"] % 10 == 0]
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
    return content.index(b"versions.json") + 2100


def journal_until(run: HubRun, tick: int) -> list[bytes]:
    """The run's journal as a machine leaves it that is lost after the record of a tick."""
    for at, raw in enumerate(run.journal):
        record = decode_any(HubRecord, raw)
        if isinstance(record, TickRecord) and record.tick == tick:
            return run.journal[: at + 1]
    raise AssertionError(f"no record {tick}")


def resume(path: Path, run: HubRun, records: Sequence[bytes]) -> None:
    """Continue an unfinished capture to the run's end as a vHub does whose journal has these records."""
    had = open_capture(path) if first_there(path).exists() else None
    described = run.deployment, NAME, run.text, METADATA
    writer = Recorder(path, *described, None, first_tick_of(run.deployment, records))
    if had is not None:
        assert writer.begun_with.tick <= max(had.ticks.tolist(), default=-1)  # a chunk without its indexes comes again
    past = recall(run.deployment, "run-1", records, writer.begun_with, 0)
    assert past is not None
    if past.known is not None:
        writer.keep(past.known)
    for item in past.kept:
        writer.keep(item)
    known = 0 if past.epoch is None else past.epoch.epoch
    for epoch in run.epochs:
        if epoch.epoch > known:
            writer.keep(epoch)
    for closing in run.closings:
        if closing.frame.tick > past.fold.state.closed:
            writer.keep(closing)
    writer.finish({"reason": "enough"})
    found, capture = writer.statistics(), open_capture(path)
    assert found.offered == found.written >= len(capture.ticks) + len(capture.packets), "of the whole capture"
    assert found.bytes == sum(file.stat().st_size for file in files_from(path))


def killed(content: bytes, parts: Path, folder: Path) -> Iterator[Path]:
    """What a writer leaves that is killed: within one file, or within one of several, or between two of them."""
    rng = random.Random(67)
    chunk = make_reader(BytesIO(content)).get_summary().chunk_indexes[3]  # type: ignore[union-attr]
    indexes = chunk.chunk_start_offset + chunk.chunk_length
    sizes = [rng.randrange(first_chunk(content), len(content)) for _ in range(8)]
    sizes += [rng.randrange(indexes, indexes + chunk.message_index_length) for _ in range(3)]
    sizes += [indexes, first_chunk(content), *(len(content) - rng.randrange(1, 4000) for _ in range(4))]
    for size in sizes:
        folder.mkdir()
        yield cut(folder, content[:size])
        shutil.rmtree(folder)
    files = files_from(parts)
    for count in range(1, len(files)):
        whole = files[count].stat().st_size
        for size in (-1, rng.randrange(9, whole), whole - rng.randrange(1, 9_000)):
            folder.mkdir()
            for file in files[:count]:
                shutil.copy(file, folder)
            if size >= 0:
                (folder / files[count].name).write_bytes(files[count].read_bytes()[:size])
            yield folder / parts.name
            shutil.rmtree(folder)


def assert_whole(path: Path, whole: Path, last: int = LAST) -> None:
    """A capture has the rows of the one of the run that was not killed, each once, and other tools read its files."""
    made, expected = rows(path, last), rows(whole, last)
    for topic in {*made, *expected}:  # the tests' capture has epochs in another place among the rows of their tick
        if topic == "/epochs":
            assert [row["epoch"] for row in made[topic]] == [row["epoch"] for row in expected[topic]]
        else:
            assert made[topic] == expected[topic], topic
    capture, other = open_capture(path), open_capture(whole)
    assert capture.finished and capture.recoveries == other.recoveries and len(capture.packets) == len(other.packets)
    assert capture.ticks.tolist() == list(range(len(capture.ticks)))
    assert read_by_others(files_from(path)[-1]) > 0


@pytest.mark.parametrize("closed", [0, EPOCH_AT, LAST])
def test_a_restarted_vhub_writes_what_is_missing_wherever_it_was_killed(
    chunked: bytes,
    parts: Path,
    path: Path,
    hub_run: HubRun,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    closed: int,
) -> None:
    """Its journal ends at `closed`, with the machine perhaps, and files may be further. No row is written twice.

    Without a split the ordered end makes one file of the capture; else the files that were left stay, and the next
    one can be read by itself.
    """
    records = journal_until(hub_run, closed)
    for number, left in enumerate(killed(chunked, parts, tmp_path / "left")):
        before = {file: file.read_bytes() for file in files_from(left)}
        is_split = number % 2 == 1
        monkeypatch.setattr(capture_index, "UNSYNCED_BYTES", (20_000, UNSYNCED_BYTES)[number // 2 % 2])
        resume(left, with_sets(hub_run, BY_TIME) if is_split else hub_run, records)
        assert_whole(left, path, 64)
        assert open_capture(left).about.end == {"reason": "enough"}
        assert capture_info(left).chain == capture_info(path).chain
        after = files_from(left)
        if not is_split:
            assert [*left.parent.iterdir()] == [left], "nothing else stays"
            assert open_capture(left).about.metadata == open_capture(path).about.metadata
            continue
        for file, content in before.items():
            assert file.read_bytes() == content or open_capture(file).finished, "what was left stays as it is"
        for file in after[1:]:
            content = before.get(file, b"")
            if content and not any(
                isinstance(one, Message) for one in McapFile(BytesIO(content), len(content), "").contents()
            ):
                continue  # its writer was killed within its first chunk: the next file has its rows
            alone = open_capture(file)
            assert alone.frames.ticks[0] == alone.ticks[0] and capture_info(file).chain == capture_info(path).chain


def test_wherever_a_writer_was_killed_the_journal_gives_what_is_missing(
    chunked: bytes, parts: Path, path: Path, hub_run: HubRun, tmp_path: Path
) -> None:
    with Journal(tmp_path / "whole", "vhub") as journal:
        for record in hub_run.journal:
            journal.append(record)
    for left in killed(chunked, parts, tmp_path / "left"):
        before = {file: file.read_bytes() for file in files_from(left)}
        kept = rows(left, 64)
        alone = recover_capture(left, None, left.with_name("alone.mcap"))
        assert alone is not None and alone.problem == "there is no journal of it" and alone.added_ticks == 0
        assert rows(alone.path, 64) == kept
        assert read_by_others(alone.path) == sum(capture_info(alone.path).topics.values())
        found = recover_capture(left, tmp_path / "whole", left.with_name("made.mcap"))
        assert found is not None and found.is_whole and found.tick >= LAST
        assert_whole(found.path, path)
        assert open_capture(found.path).about.end["reason"] == UNCLEAN
        assert recover_capture(found.path, tmp_path / "whole") is None
        assert {file: file.read_bytes() for file in before} == before and not list(left.parent.glob(".*"))


def test_a_run_that_ends_where_its_journal_does_loses_nothing(chunked: bytes, hub_run: HubRun, tmp_path: Path) -> None:
    """The journal ends at tick 20: the run ends there, and what the capture has of later ticks stays, row for row."""
    file = cut(tmp_path, chunked[: len(chunked) * 2 // 3])
    before, records = rows(file), journal_until(hub_run, 20)
    described = hub_run.deployment, NAME, hub_run.text, METADATA
    writer = Recorder(file, *described, None, first_tick_of(hub_run.deployment, records))
    past = recall(hub_run.deployment, "run-1", records, writer.begun_with, 0)
    assert past is not None and not past.kept and past.fold.state.closed == 20 < writer.begun_with.tick
    assert past.committed is not None
    end = Closing(past.committed[2], past.committed[2].digest, [], [], fates=past.fold.state.in_flight())
    for _ in range(2):
        writer.keep(end)
    writer.finish({"reason": "lost vhub"})
    assert rows(file) == before and open_capture(file).finished
    read_by_others(file)


def test_a_finished_capture_and_one_of_another_run_are_not_continued(
    path: Path, chunked: bytes, hub_run: HubRun, tmp_path: Path
) -> None:
    described = hub_run.deployment, NAME, hub_run.text
    with pytest.raises(CaptureError, match="is finished; a capture is never overwritten"):
        Recorder(path, *described, {"run": "run-1"}, None, 0)
    left = cut(tmp_path, chunked[: len(chunked) // 2])
    with pytest.raises(CaptureError, match="is that of run run-1, not of run run-2"):
        Recorder(left, *described, {"run": "run-2"}, None, 0)
    assert left.read_bytes() == chunked[: len(chunked) // 2] and [*tmp_path.iterdir()] == [left]


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
    with pytest.raises(Failed, match=r"new\.mcap: cannot be written"):
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


def test_no_capture_is_refused(tmp_path: Path) -> None:
    for content in (b"", MAGIC, b"#!/bin/sh\n"):
        with pytest.raises(Refused, match=r"cut\.mcap: "):
            recover_capture(cut(tmp_path, content))
        assert (tmp_path / "cut.mcap").read_bytes() == content

"""Captures whose disk gets full, or refuses, or that reach what they may have: nothing is lost silently."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING

import pytest
from mcap.reader import make_reader

from foosim.capture import contents as capture_contents
from foosim.capture import file as capture_file
from foosim.capture import writer as capture_writer
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.parts import files_from
from foosim.capture.reader import open_capture
from foosim.common import limits
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.runtime import disk
from foosim.runtime.disk import Level, Room
from foosim.vhub.recording.disk_watch import RoomWatch
from foosim.vhub.recording.recorder import Recorder
from foosim.vhub.recording.recovery import recover_capture
from tests.vhub.conftest import BY_TIME

if TYPE_CHECKING:
    from tests.vhub.conftest import HubRun

KIB = 1024


class Disk:
    """A disk that has some room, and refuses what is more with an error; a part of that is written."""

    def __init__(self, room: int, monkeypatch: pytest.MonkeyPatch, number: int = errno.ENOSPC) -> None:
        self.room = room
        self.looks: Callable[[int], int] = lambda free: free
        """What a look at the disk finds: others may take what is left behind it."""
        self._number = number
        self._write = capture_contents.write_all
        monkeypatch.setattr(capture_file, "write_all", self.write)
        monkeypatch.setattr(disk, "free_bytes", lambda place: self.looks(max(0, self.room)))

    def write(self, file: int, content: bytes) -> None:
        if len(content) > self.room:
            self._write(file, content[: self.room])
            raise OSError(self._number, os.strerror(self._number))
        self.room -= len(content)
        self._write(file, content)


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A chunk for each batch of a few closings: a full disk is met between two of them."""
    monkeypatch.setattr(capture_contents, "CHUNK_BYTES", 1)
    monkeypatch.setattr(capture_writer, "BATCH_ROWS", 20)
    monkeypatch.setattr(limits, "CAPTURE_QUEUE_ROWS_MAX", 60)


def new_writer(path: Path, run: HubRun, *sets: str) -> Recorder:
    if not sets:
        return Recorder(path, run.deployment, "table.yaml", run.text, {"run": "run-1"})
    text = apply_sets(run.text, "table.yaml", sets)
    return Recorder(path, load_deployment(text, "table.yaml"), "table.yaml", text, {"run": "run-1"})


def feed(writer: Recorder, run: HubRun) -> list[Level]:
    """Hand over the whole run; return the levels that the writer came to on the way."""
    assert writer.state.level is Level.FINE
    for closing in run.closings:
        writer.keep(closing)
    writer.finish({"reason": "enough"})
    return [state.level for state in writer.states]


def assert_accounted(writer: Recorder, run: HubRun) -> None:
    """Every tick and packet is in the file, or counted as refused."""
    found = writer.statistics()
    offered = sum(1 + len(closing.fates) for closing in run.closings)
    assert found.offered == offered == found.written + found.refused and found.queued_rows == 0
    capture = open_capture(writer.path)
    assert len(capture.ticks) + len(capture.packets) == found.written


def assert_valid(path: Path) -> None:
    """Other people's reader finds an end, and every message by its indexes."""
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None and summary.statistics is not None
        assert len(list(reader.iter_messages())) == summary.statistics.message_count


def test_at_the_reserve_a_run_that_is_to_end_is_captured_to_its_end(
    hub_run: HubRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Disk(450 * KIB, monkeypatch)
    writer = new_writer(tmp_path / "run.mcap", hub_run, "capture.reserve=384 KiB")
    assert feed(writer, hub_run) == [Level.LOW, Level.FULL]
    room = RoomWatch(writer, tmp_path, 1)
    ((level, said),) = room.look(0)  # which comes when the thread is already two levels further
    assert level == "warning" and said.startswith("room gets little, at the reserve the run ends: ")
    assert room.ends == ("the capture", writer.state.text) and room.look(0) == []
    assert writer.stops_world and "left on its disk, the reserve is 384 KiB" in writer.state.text
    assert writer.statistics().refused == 0
    assert_accounted(writer, hub_run)
    assert_valid(writer.path)
    assert open_capture(writer.path).about.end == {"reason": "enough"}


def test_a_run_that_goes_on_without_its_capture_has_a_valid_one_up_to_there(
    hub_run: HubRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Disk(300 * KIB, monkeypatch)
    writer = new_writer(tmp_path / "run.mcap", hub_run, "capture.reserve=200 KiB", "capture.on_full=continue_unlogged")
    assert feed(writer, hub_run) == [Level.LOW, Level.OUT] and not writer.stops_world
    assert_accounted(writer, hub_run)
    assert_valid(writer.path)
    capture = open_capture(writer.path)
    assert capture.finished and 0 < len(capture.ticks) < 65
    assert capture.about.end["reason"] == f"not captured further: {writer.state.text}"
    assert capture.about.end["last_tick"] == str(capture.ticks[-1])


def test_a_disk_that_is_full_at_the_start_is_reported_at_once(
    hub_run: HubRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Disk(100, monkeypatch)
    with pytest.raises(CaptureError, match="cannot be written, No space left on device"):
        new_writer(tmp_path / "full.mcap", hub_run)


@pytest.mark.parametrize(("number", "sets"), [(errno.ENOSPC, ()), (errno.EIO, ()), (errno.ENOSPC, (BY_TIME,))])
def test_a_disk_that_refuses_leaves_what_is_whole(
    hub_run: HubRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, sets: tuple[str, ...]
) -> None:
    """Others take the room that a look has found: the write itself fails, in the midst of a chunk or of the end; of
    several files, also in what the next one begins with."""
    outcomes, counts = set(), set()
    taken = Disk(0, monkeypatch, number)
    taken.looks = lambda free: 1 << 40
    for room in [*range(40_000, 112_000, 8_765), 150_000]:
        taken.room = room
        writer = new_writer(tmp_path / f"{room}.mcap", hub_run, *sets)
        feed(writer, hub_run)
        assert_accounted(writer, hub_run)
        capture, files = open_capture(writer.path), files_from(writer.path)
        assert all(open_capture(file).about.versions for file in files), "none that is only begun"
        counts.add(len(files))
        assert capture.about.unfinished_bytes == 0, "nothing that is cut stays"
        refused = writer.statistics().refused
        outcomes.add((writer.state.level, capture.finished, refused > 0))
        if writer.state.level is not Level.FINE:
            assert f"cannot be written, {os.strerror(number)}" in writer.state.text
        taken.room = 1 << 30
        found = recover_capture(writer.path)
        assert (found is None) == capture.finished
        assert_valid(writer.path if found is None else found.path)
    assert (len(counts) > 1) == bool(sets)
    if sets:
        return
    assert (Level.FINE, True, False) in outcomes and (Level.OUT, False, True) in outcomes, outcomes
    assert (Level.OUT, False, False) in outcomes, "a disk that took all rows and refused the end"


def test_the_quota_is_kept(hub_run: HubRun, tmp_path: Path) -> None:
    """With room for less than the run, and whatever the disk has."""
    for quota, on_full in ((100, "continue_unlogged"), (100, "stop_world"), (400, "stop_world")):
        path = tmp_path / f"{quota}-{on_full}.mcap"
        writer = new_writer(path, hub_run, f"capture.max_bytes={quota} KiB", f"capture.on_full={on_full}")
        levels = feed(writer, hub_run)
        assert_accounted(writer, hub_run)
        assert_valid(path)
        assert path.stat().st_size <= quota * KIB
        assert levels[-1:] == ([] if quota == 400 else [Level.OUT])
        if quota == 100:
            assert "of the 102400 B that it may have, the reserve is 12800 B" in writer.state.text


def test_on_a_slow_disk_a_capture_is_closing_until_it_has_its_end(
    hub_run: HubRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    writer, write = new_writer(tmp_path / "run.mcap", hub_run), capture_contents.write_all
    gate, ended = Event(), Event()
    room, writer.on_end = RoomWatch(writer, tmp_path, 1), ended.set
    monkeypatch.setattr(limits, "CAPTURE_QUEUE_ROWS_MAX", 1_000_000)
    monkeypatch.setattr(capture_file, "write_all", lambda file, content: gate.wait() and write(file, content))
    for closing in hub_run.closings:
        writer.keep(closing)
    writer.begin_finish({"reason": "enough"})
    before = room.recording
    gate.set()
    writer.finish()
    after = room.recording
    assert (before["state"], after["state"], ended.is_set()) == ("closing", "on", True)
    assert before["written"] < before["offered"] == after["offered"] == after["written"]
    assert before["bytes"] < after["bytes"] <= writer.path.stat().st_size


def test_levels_of_room() -> None:
    levels = [Room(left, 100, "").level for left in (200, 199, 100, 99, 25, 24, 0, -5)]
    assert levels == [Level.FINE, Level.LOW, Level.LOW, Level.FULL, Level.FULL, Level.OUT, Level.OUT, Level.OUT]
    assert str(Room(-5, 64_000_000, "on its disk")) == "0 MB left on its disk, the reserve is 64 MB"
    assert str(Room(40_000_000, 64 << 20, "on its disk")) == "38.1 MiB left on its disk, the reserve is 64 MiB"


def test_on_a_disk_that_others_fill_what_was_whole_stays(
    hub_run: HubRun, small_disk: Callable[[int], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """They take all that is left between a look and the next write, which fails in its midst, and so does the end."""
    path, write = small_disk(256) / "run.mcap", capture_contents.write_all
    others = path.with_name("others")

    def others_write_first(file: int, content: bytes) -> None:
        if os.fstat(file).st_size > 64 * KIB and not others.exists():
            with pytest.raises(OSError, match=os.strerror(errno.ENOSPC)):
                others.write_bytes(bytes(256 * KIB))
        write(file, content)

    with monkeypatch.context() as patch:
        patch.setattr(capture_file, "write_all", others_write_first)
        writer = new_writer(path, hub_run, "capture.reserve=64 KiB")
        levels = feed(writer, hub_run)
    assert levels == [Level.OUT]
    full = os.strerror(errno.ENOSPC)
    assert f"cannot be written, {full}; its end could not be written, {full}" in writer.state.text
    assert writer.statistics().written > 0 < writer.statistics().refused
    assert_accounted(writer, hub_run)
    assert not open_capture(path).finished and open_capture(path).about.unfinished_bytes == 0
    others.unlink()
    found = recover_capture(path)
    assert found is not None
    assert_valid(found.path)

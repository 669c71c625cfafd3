"""Captures that are unfinished, damaged or hostile, and writers that lag or fail: told as what they are."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
import zstandard

from foosim.capture import file as capture_file
from foosim.capture import writer as capture_writer
from foosim.capture.info import capture_info
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.mcap.format import CHUNK_BYTES_MAX
from foosim.capture.mcap.writer import McapWriter
from foosim.capture.reader import open_capture
from foosim.common import limits
from foosim.common.errors import Refused
from foosim.vhub.recording.disk_watch import DiskProgress
from foosim.vhub.recording.recorder import Recorder

if TYPE_CHECKING:
    from tests.vhub.conftest import HubRun


def new_writer(path: Path, run: HubRun, say: Callable[[str, str], None] | None = None) -> Recorder:
    return Recorder(path, run.deployment, "table.yaml", run.text, {}, say)


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
        assert len(capture.packets) <= hub_run.state.packets.offered
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
    assert len(capture.packets) == hub_run.state.packets.offered
    assert capture.about.end == {} and capture.frames.ticks.tolist() == [*range(0, 61, 10)]


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


def mcap_with(
    path: Path, profile: str, metadata: dict[str, str] | None, text: str | None = None, *, checks: bool = True
) -> Path:
    written: list[bytes] = []
    writer = McapWriter(written.append, profile)
    if metadata is not None:
        writer.add_metadata("foosim", metadata)
    if text is not None:
        writer.add_attachment("deployment.yaml", "application/yaml", text.encode())
    if checks:
        writer.add_checks()
    writer.add_message(writer.add_channel("/tick", "json", ("x", "jsonschema", b"{}")), 5, 5, 0, b'{"tick": -1}')
    writer.finish()
    path.write_bytes(b"".join(written))
    return path


def test_what_is_no_capture_is_told_so(tmp_path: Path, hub_run: HubRun) -> None:
    path = tmp_path / "other.mcap"
    assert refused(path) == "FILE: cannot be read, No such file or directory"
    path.write_bytes(b"\x89PNG\r\n and so on")
    assert refused(path) == "FILE: no MCAP file, it does not start as one"
    about = {"format": "4", "deployment": "table.yaml"}
    assert refused(mcap_with(path, "ros2", None)) == "FILE: no capture of foosim, its profile is 'ros2', not 'foosim'"
    for other in ("", "2", "3", "5", "04"):
        unsupported = f"FILE: format '{other}' of the capture is unsupported, valid is '4'"
        assert refused(mcap_with(path, "foosim", {**about, "format": other})) == unsupported
    assert refused(mcap_with(path, "foosim", about)) == "FILE: the capture has no deployment"
    lacking = mcap_with(path, "foosim", about, hub_run.text, checks=False)
    assert refused(lacking) == "FILE: the capture lacks its metadata 'foosim.digests'"
    row = mcap_with(path, "foosim", about, hub_run.text)
    assert refused(row).startswith("FILE: /tick at 5 ns: ")
    with pytest.raises(Refused):
        open_capture(mcap_with(path, "foosim", about, "format: 2\nworld: [\n"))


def test_what_is_cut_off_before_its_first_row_is_named_so(chunked: bytes, tmp_path: Path) -> None:
    """Up to its first chunk a capture has its description alone, or a part of it."""
    path, described = tmp_path / "cut.mcap", chunked.index(b"foosim.digests")
    for size in (*range(8, described, 97), described):
        path.write_bytes(chunked[:size])
        assert refused(path) == "FILE: the capture is cut off before its first row"


def test_ticks_that_go_back_are_refused(hub_run: HubRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(capture_file.CaptureFile, "_has", lambda file, tick: False)
    path = tmp_path / "back.mcap"
    writer = new_writer(path, hub_run)
    for tick in (0, 2, 1):
        writer.keep(hub_run.closings[tick])
    writer.finish()
    with pytest.raises(CaptureError, match=r"back\.mcap: tick 1 follows tick 2"):
        open_capture(path)


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
        (chunk_record(31, b"", struct.pack("<BQHIQQ", 5, 22, 77, 0, 0, 0)), "channel 77, which is undeclared"),
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


class Gated(Recorder):
    """A writer whose thread waits for a gate before each item."""

    gate = threading.Event()

    def _write_item(self, item: Any) -> None:
        self.gate.wait()
        super()._write_item(item)


def test_a_lagging_writer_slows_the_run_says_so_once_and_loses_nothing(
    hub_run: HubRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(limits, "CAPTURE_QUEUE_ROWS_MAX", 30)
    monkeypatch.setattr(capture_writer, "WAIT_S", 1e-4)
    said, waits = list[tuple[str, str]](), list[int]()
    Gated.gate.clear()

    def say(level: str, text: str) -> None:
        """The run stands still in `keep` until the writer goes on, and is told so again and again meanwhile."""
        said.append((level, text))

    def wait() -> None:
        waits.append(1)
        if len(waits) == 3:
            Gated.gate.set()

    path = tmp_path / "slow.mcap"
    writer = Gated(path, hub_run.deployment, "table.yaml", hub_run.text, {}, say)
    writer.while_waiting = wait
    for closing in hub_run.closings:
        writer.keep(closing)
        assert writer.statistics().queued_rows <= max(30, 1 + len(closing.fates))
    writer.finish()
    assert len(waits) >= 3 and writer.statistics().waits > 0 and writer.statistics().queued_rows == 0
    assert [level for level, _ in said] == ["warning"]
    assert said[0][1].startswith(f"the run waits for its capture {path}: ")
    capture = open_capture(path)
    assert len(capture.ticks) == 65 and len(capture.packets) == hub_run.state.packets.offered


def test_the_disk_is_asked_for_its_progress_while_a_sync_lasts(
    hub_run: HubRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, goes_on, sync = threading.Event(), threading.Event(), os.fdatasync

    def slow(file: int) -> None:
        begun.set()
        goes_on.wait()
        sync(file)

    writer = Recorder(tmp_path / "slow.mcap", hub_run.deployment, "table.yaml", hub_run.text, {})
    device = writer.path.stat().st_dev
    account = tmp_path / f"{os.major(device)}:{os.minor(device)}" / "stat"
    account.parent.mkdir()
    disk = DiskProgress(writer.path, tmp_path)
    monkeypatch.setattr(os, "fdatasync", slow)
    writer.begin_finish({})
    begun.wait()
    assert writer.is_syncing and writer.is_closing
    counted = [disk.look(True, now_ns) for now_ns in (0, 5 * 10**8, 10**9, 2 * 10**9)]
    assert counted == [1, 1, 2, 3], "the kernel does not tell"
    for written in (8, 8, 16):
        account.write_text(f"1 0 8 0 2 0 {written} 0 1 0 0\n", "ascii")
        assert disk.look(True, 3 * 10**9) == 2 + written
    assert disk.look(False, 3 * 10**9) == 0
    goes_on.set()
    writer.finish()
    assert not writer.is_syncing


def test_a_process_that_ends_without_finishing_is_not_held_up(hub_run: HubRun, tmp_path: Path) -> None:
    program = """if True:
        import pathlib, sys
        from foosim.deployment.loader import load_deployment
        from foosim.vhub.recording.recorder import Recorder
        text = sys.stdin.read()
        Recorder(pathlib.Path(sys.argv[1]), load_deployment(text, "t"), "t", text, {})
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
    assert capture.digests.shape == (0, 32) and len(capture.frames) == 0
    assert capture_info(tmp_path / "empty.mcap").ticks == 0
    assert capture.clients == ()

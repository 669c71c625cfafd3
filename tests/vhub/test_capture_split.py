"""Captures in several files: together they are the one that is not split, and each can be read by itself."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec
import pytest

from foosim.capture import contents as capture_contents
from foosim.capture import writer as capture_writer
from foosim.capture.cut import cut_capture
from foosim.capture.info import capture_info
from foosim.capture.mcap.checks import CaptureError
from foosim.capture.mcap.format import McapFile, Message
from foosim.capture.parts import Joined, files_from
from foosim.capture.reader import open_capture, read_about
from foosim.runtime.journal import Journal
from foosim.vhub.recording.recovery import recover_capture
from tests.vhub.conftest import BY_TIME
from tests.vhub.conftest import write_capture as write
from tests.vhub.test_capture_recovery import read_by_others

if TYPE_CHECKING:
    from tests.vhub.conftest import HubRun


def messages(path: Path) -> list[Message]:
    return [content for content in Joined(path).contents() if isinstance(content, Message)]


@pytest.fixture
def copied(parts: Path, tmp_path: Path) -> Path:
    for file in files_from(parts):
        shutil.copy(file, tmp_path)
    return tmp_path / parts.name


def names(path: Path) -> list[str]:
    return sorted(file.name for file in path.parent.glob("*.mcap"))


NAMES = ["run.mcap", *(f"run_{number:04d}.mcap" for number in range(1, 7))]


def test_all_files_together_have_the_rows_of_one(parts: Path, path: Path) -> None:
    assert [file.name for file in files_from(parts)] == NAMES
    assert messages(parts) == messages(path)
    capture, whole = open_capture(parts), open_capture(path)
    assert capture.finished and capture.about.end == whole.about.end
    assert capture.ticks.tolist() == whole.ticks.tolist() and (capture.digests == whole.digests).all()
    assert capture.clients == whole.clients and capture.epochs == whole.epochs
    assert {**capture_info(parts).topics} == {**capture_info(path).topics}
    assert capture_info(parts).chain == capture_info(path).chain
    assert capture_info(parts).bytes == sum(file.stat().st_size for file in files_from(parts))
    assert capture_info(parts).parts == tuple(NAMES) and capture_info(path).parts == ("run.mcap",)


def test_each_file_stands_by_itself(parts: Path, path: Path, tmp_path: Path) -> None:
    chains = {}
    for at, file in enumerate(files_from(parts)):
        alone = tmp_path / "alone" / file.name
        alone.parent.mkdir(exist_ok=True)
        shutil.copy(file, alone)
        capture, info = open_capture(alone), capture_info(alone)
        first = 10 * at
        assert capture.ticks.tolist() == list(range(first, first + 10 if at < 6 else 65))
        assert capture.finished is (at == 6), "the rest of it is not here"
        assert int(capture.frames.ticks[0]) == first
        assert capture.epochs and capture.about.deployment_text == open_capture(parts).about.deployment_text
        assert read_by_others(alone) > 0
        if at:
            assert (info.metadata["part"], info.metadata["part_after"]) == (str(at), NAMES[at - 1])
            assert (info.metadata["cut_from"], info.metadata["cut_tick"]) == ("run.mcap", str(first))
        chains[at] = info.chain
        alone.unlink()
        cut_capture(path, tmp_path / f"{at}.mcap", first * 2_000_000, (first + 9 if at < 6 else 64) * 2_000_000)
        cut = open_capture(tmp_path / f"{at}.mcap")
        assert {row.client for row in cut.clients} == {row.client for row in capture.clients}
        assert capture_info(tmp_path / f"{at}.mcap").chain == info.chain
    assert chains[6] == capture_info(path).chain


def test_what_is_read_is_a_file_and_all_behind_it(parts: Path, path: Path) -> None:
    rest = open_capture(parts.with_name("run_0003.mcap"))
    assert rest.ticks.tolist() == list(range(30, 65)) and rest.finished
    assert messages(rest.path)[-50:] == messages(path)[-50:]


def test_a_file_ends_when_it_is_large(
    hub_run: HubRun, path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(capture_writer, "BATCH_ROWS", 40)
    monkeypatch.setattr(capture_contents, "CHUNK_BYTES", 1)
    write(tmp_path / "run.mcap", hub_run, "capture.split_size=64 KiB")
    files = files_from(tmp_path / "run.mcap")
    assert messages(files[0]) == messages(path)
    assert len(files) > 1 and all(file.stat().st_size > 64 * 1024 for file in files[:-1])


def test_a_file_begins_with_a_frame_that_is_there_anyway(hub_run: HubRun, tmp_path: Path) -> None:
    every = "capture.frames_every=25 ticks"
    write(tmp_path / "one" / "run.mcap", hub_run, every)
    write(tmp_path / "run.mcap", hub_run, every, "capture.split_time=22 ms")
    assert messages(tmp_path / "run.mcap") == messages(tmp_path / "one" / "run.mcap")
    begun = {}
    for file in files_from(tmp_path / "run.mcap"):
        with file.open("rb") as stream:
            contents = list(McapFile(stream, file.stat().st_size, file.name).contents())
        alone = [content for content in contents if isinstance(content, Message)]
        ticks = [msgspec.json.decode(message.data)["tick"] for message in alone if message.topic == "/tick"]
        begun[ticks[0]] = sum(message.topic == "/layout" for message in alone)
    assert begun == {0: 1, 25: 1, 50: 1}, "the layout is repeated in each file"


def test_a_cut_is_one_file(parts: Path, path: Path, tmp_path: Path) -> None:
    for source, out in ((parts, "one.mcap"), (path, "other.mcap")):
        cut_capture(source, tmp_path / out, 30 * 2_000_000, 55 * 2_000_000)
    assert messages(tmp_path / "one.mcap") == messages(tmp_path / "other.mcap")
    one, other = (read_about(tmp_path / name).metadata for name in ("one.mcap", "other.mcap"))
    assert one == other


# --- what is missing, or of others -----------------------------------------------------------------------------------


def test_a_file_that_is_missing_is_named(copied: Path) -> None:
    (copied.parent / "run_0003.mcap").unlink()
    for named in ("run.mcap", "run_0001.mcap"):
        with pytest.raises(CaptureError, match=r"run_0003\.mcap: is missing, run_0004\.mcap follows it"):
            open_capture(copied.parent / named)
    assert open_capture(copied.parent / "run_0004.mcap").ticks[0] == 40
    copied.unlink()
    with pytest.raises(CaptureError, match=r"run\.mcap: is missing, run_0001\.mcap follows it"):
        open_capture(copied)


def test_without_its_last_files_a_capture_has_no_end(copied: Path) -> None:
    for number in (5, 6):
        (copied.parent / f"run_000{number}.mcap").unlink()
    capture = open_capture(copied)
    assert not capture.finished and capture.ticks[-1] == 49 and not read_about(copied).finished
    assert capture.about.end["continues_in"] == "run_0005.mcap"


def test_a_file_of_another_run_or_without_its_end_is_refused(copied: Path, hub_run: HubRun, tmp_path: Path) -> None:
    second = copied.parent / "run_0002.mcap"
    content = second.read_bytes()
    second.write_bytes(content[: len(content) // 2])
    with pytest.raises(CaptureError, match=r"run_0002\.mcap: it has no end, and run_0003\.mcap follows it"):
        open_capture(copied)
    second.write_bytes((copied.parent / "run_0004.mcap").read_bytes())
    with pytest.raises(CaptureError, match=r"run_0002\.mcap: does not follow run_0001\.mcap"):
        open_capture(copied)
    with pytest.raises(CaptureError, match=r"run_0001\.mcap: exists already"):
        copied.unlink()
        write(copied, hub_run, BY_TIME)


def test_others_of_like_names_are_left_alone(path: Path, tmp_path: Path) -> None:
    for name in ("run.mcap", "run_0001.mcap", "run_12.mcap"):
        shutil.copy(path, tmp_path / name)
    assert files_from(tmp_path / "run.mcap") == [tmp_path / "run.mcap"]


# --- only the last ---------------------------------------------------------------------------------------------------


def test_only_the_last_is_kept(hub_run: HubRun, path: Path, tmp_path: Path) -> None:
    run = tmp_path / "run.mcap"
    write(run, hub_run, BY_TIME, "capture.last=50 ms")
    assert names(run) == NAMES[3:], "of 50 ms before tick 60 something is in the file of ticks 30 to 39"
    capture = open_capture(run)
    assert capture.ticks.tolist() == list(range(30, 65)) and capture.finished
    info = capture_info(run)
    assert (info.first_tick, info.metadata["last"], info.metadata["cut_tick"]) == (30, "50 ms", "30")
    assert info.chain == capture_info(path).chain
    assert messages(run)[-50:] == messages(path)[-50:]
    (tmp_path / "run_0004.mcap").unlink()
    with pytest.raises(CaptureError, match=r"run_0004\.mcap: is missing, run_0005\.mcap follows it"):
        open_capture(run)


def test_what_is_kept_of_a_killed_writer_is_recovered_to_one_file(hub_run: HubRun, path: Path, tmp_path: Path) -> None:
    run = tmp_path / "run.mcap"
    write(run, hub_run, BY_TIME, "capture.last=50 ms")
    last = files_from(run)[-1]
    last.write_bytes(last.read_bytes()[:-100])
    with Journal(tmp_path / "journals", "vhub") as journal:
        for record in hub_run.journal:
            journal.append(record)
    found = recover_capture(run, tmp_path / "journals")
    assert found is not None and found.is_whole and found.path == tmp_path / "run.recovered.mcap"
    info, capture = capture_info(found.path), open_capture(found.path)
    assert capture.ticks.tolist() == list(range(30, 65)) and capture.finished and info.parts == (found.path.name,)
    assert info.first_tick == 30 and "last" not in info.metadata and info.chain == capture_info(path).chain


def test_what_was_let_go_does_not_count(hub_run: HubRun, tmp_path: Path) -> None:
    """All files together are larger than the capture may be; those that are there never are."""
    sizes = [file.stat().st_size for file in files_from(write(tmp_path / "a" / "run.mcap", hub_run, BY_TIME).path)]
    quota = f"capture.max_bytes={max(sum(sizes[at : at + 4]) for at in range(4)) // 1024 + 40} KiB"
    writer = write(tmp_path / "run.mcap", hub_run, BY_TIME, "capture.last=20 ms", quota, "capture.reserve=64 KiB")
    assert writer.statistics().refused == 0 and open_capture(tmp_path / "run.mcap").ticks[-1] == 64
    assert writer.statistics().bytes == sum(file.stat().st_size for file in files_from(tmp_path / "run.mcap"))
    without = write(tmp_path / "b" / "run.mcap", hub_run, BY_TIME, quota, "capture.reserve=64 KiB")
    assert without.statistics().refused > 0, "what is not let go counts"

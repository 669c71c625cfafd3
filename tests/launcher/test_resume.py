"""Journals that are damaged: nobody goes on over them, and what is said has the place and the command that helps."""

from __future__ import annotations

import re
import shlex
from dataclasses import replace
from pathlib import Path
from typing import Final

import pytest

from foosim.capture.reader import open_capture
from foosim.capture.start_frame import read_branch
from foosim.common.errors import Refused
from foosim.deployment.loader import load_deployment
from foosim.launcher.plan import make_plan
from foosim.launcher.resume import check_journals, plan_again
from foosim.launcher.run_options import RunOptions, launch_of, launched_options
from foosim.protocol import channels
from foosim.runtime import journal as journal_module
from foosim.runtime.journal import Journal, Records, journal_files
from foosim.runtime.run_folder import LAUNCH_FILE, LAUNCHER_FILE, RunFolder, create_run
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings
from tests.conftest import Typed

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
TICKS: Final = 60
SETS: Final = ("engine=pure", "players={}")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, dict[str, list[bytes]]]:
    """A capture without its end, and the records of both journals."""
    records: dict[str, list[bytes]] = {}
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    settings = Settings(on_journal=lambda process, record: records.setdefault(process, []).append(record))
    rehearse(TABLE.read_text(), TABLE.name, TICKS, 2, [*SETS, "capture.frames_every=4 ticks"], settings, capture=path)
    return path.read_bytes()[:-2000], records


@pytest.fixture
def folder(run: tuple[bytes, dict[str, list[bytes]]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> RunFolder:
    """The folder of a run whose launcher was killed with everything."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    folder = create_run("table", "rehearsal")
    capture = tmp_path / "a run.mcap"
    capture.write_bytes(run[0])
    folder.write_launch(launch_of(RunOptions(TABLE, sets=SETS), capture))
    (folder.path / LAUNCHER_FILE).touch()
    for stem, records in run[1].items():
        with Journal(folder.journals, stem) as journal:
            for record in records:
                journal.append(record)
    return folder


def damage(folder: RunFolder, stem: str, record: int) -> str:
    """Flip a bit in the midst of a record; return where it stands."""
    (path,) = journal_files(folder.journals, stem)
    records = Records(path)
    starts = [records.valid_bytes, *(records.valid_bytes for _ in records)]
    content = bytearray(path.read_bytes())
    content[(starts[record] + starts[record + 1]) // 2] ^= 1
    path.write_bytes(content)
    return f"{path}: byte {starts[record]}: record {record + 1} is damaged, {len(starts) - record - 2} whole records"


def test_a_run_that_would_end_at_once_for_want_of_room_is_left_as_it_is(typed: Typed, folder: RunFolder) -> None:
    launch = folder.launch()
    assert launch is not None and launch.capture
    sets = (*SETS, "capture.reserve=1000 TiB")
    folder.write_launch(launch_of(RunOptions(TABLE, sets=sets), Path(launch.capture)))
    before = {path: path.read_bytes() for path in folder.path.rglob("*") if path.is_file()}
    done = typed()("up", "--resume", folder.name)
    assert done.code == 3 and done.err.startswith(f"{Path(launch.capture).parent}: ")
    assert "TiB left on its disk, the reserve is 1000 TiB (capture.reserve): make room" in done.err
    assert {path: path.read_bytes() for path in folder.path.rglob("*") if path.is_file()} == before


def refused(folder: RunFolder) -> str:
    with pytest.raises(Refused) as caught:
        plan_again(folder)
    assert caught.value.exit_code == 3
    return str(caught.value)


def test_all_options_are_gone_on_with(folder: RunFolder, tmp_path: Path) -> None:
    options = RunOptions(TABLE, "2x", "9 s", 7, "a.mcap@1s", SETS, "pure", "10.0.0.1:7", True, Path("certs"), True)
    folder.write_launch(launch_of(options, None))
    here = Path.cwd()
    assert launched_options(folder) == replace(options, pki=here / "certs", branch=str(here / "a.mcap@1s"))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ('{"file": "deploy/table.yaml", "capture": ""}', "it has no capture and options"),
        ('{"capture": "", "options": {"file": "table.yaml", "speed": "2x"}}', "there is no option speed"),
        (
            '{"capture": "", "options": {"file": "table.yaml", "pace": 2}}',
            r"Expected `str \| null`, got `int` - at `\$.pace`",
        ),
    ],
)
def test_a_launch_file_of_another_version_is_refused(folder: RunFolder, content: str, said: str) -> None:
    (folder.path / LAUNCH_FILE).write_text(content)
    assert re.search(rf"launch.json was written by another version of foosim, or is damaged: {said}", refused(folder))


@pytest.mark.parametrize("stem", [channels.SUPERVISOR, channels.VHUB])
def test_a_damaged_record_is_told_with_the_command_that_begins_a_new_run(
    folder: RunFolder, stem: str, tmp_path: Path
) -> None:
    where = damage(folder, stem, 30)
    text = refused(folder)
    assert text.startswith(f"run rehearsal cannot be resumed: {where} after it; tick "), text
    told = re.search(r"; tick (\d+) is the last before it\. A new run begins with the last captured frame: (.*)", text)
    assert told is not None and 10 < int(told[1]) <= 30
    words = shlex.split(told[2])
    assert words[:3] == ["foosim", "up", str(TABLE)] and words[-2] == "--from"
    assert words[3:7] == ["--set", SETS[0], "--set", SETS[1]]
    branch = read_branch(words[-1], load_deployment(TABLE.read_text(), TABLE.name))
    assert branch.start.origin.tick == open_capture(tmp_path / "a run.mcap").frame_ticks[-1] > 40
    assert make_plan(RunOptions(TABLE, sets=SETS, branch=words[-1])).start == branch.start


def test_a_journal_whose_only_record_is_damaged_is_said_to_have_none(folder: RunFolder) -> None:
    (path,) = journal_files(folder.journals, channels.SUPERVISOR)
    records = Records(path)
    next(records)
    path.write_bytes(path.read_bytes()[: records.valid_bytes - 1])
    what = f"no file of the journal of supervisor in {folder.journals} has a whole record"
    assert refused(folder).startswith(f"run rehearsal cannot be resumed: {what}. A new run begins")


def test_what_helps_is_said_where_there_is_no_capture(folder: RunFolder, tmp_path: Path) -> None:
    damage(folder, channels.SUPERVISOR, 30)
    (tmp_path / "a run.mcap").write_bytes(b"nonsense")
    assert "No new run can begin with its capture: " in refused(folder) and "no MCAP file" in refused(folder)
    (tmp_path / "a run.mcap").unlink()
    assert "a run.mcap: cannot be read, No such file" in refused(folder)
    folder.write_launch(launch_of(RunOptions(TABLE, sets=SETS), None))
    assert refused(folder).endswith("The run has no capture to begin a new one with")


def test_a_torn_end_is_gone_on_from(folder: RunFolder, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also a hole amid what was not synced, when the machine was started again."""
    options = RunOptions(TABLE, sets=SETS)
    for stem in (channels.SUPERVISOR, channels.VHUB):
        (path,) = journal_files(folder.journals, stem)
        path.write_bytes(path.read_bytes()[:-7] + bytes(4096))
    check_journals(folder, options)
    monkeypatch.setattr(journal_module, "machine_start", lambda: "another start")
    for stem in (channels.SUPERVISOR, channels.VHUB):
        damage(folder, stem, 50)
    check_journals(folder, options)

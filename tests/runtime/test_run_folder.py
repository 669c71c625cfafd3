"""The folder of a run: found without an address while its supervisor lives, and not a moment longer."""

from pathlib import Path

import pytest

from foosim.common.errors import BadValue, Refused
from foosim.runtime.run_folder import (
    KEPT_RUNS,
    NoRun,
    RunFolder,
    RunInfo,
    create_run,
    find_run,
    live_runs,
    open_run,
    run_exists,
    runs_folder,
)


@pytest.fixture(autouse=True)
def _state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))


def info(folder: RunFolder, started: str = "2026-03-01T12:00:00.000000Z") -> RunInfo:
    """A run file's content."""
    return RunInfo(folder.name, "table", "/deploy/table.yaml", 4711, started, "tcp/127.0.0.1:7000")


def start(name: str, started: str) -> RunFolder:
    """A folder as a live supervisor has it."""
    folder = create_run("table", name)
    folder.hold()
    folder.write_info(info(folder, started))
    return folder


def test_it_lies_in_the_state_folder_of_the_platform(tmp_path: Path) -> None:
    folder = create_run("table")
    assert folder.path.parent == runs_folder() == tmp_path / "foosim" / "runs"
    assert folder.name.startswith("table-")
    assert folder.logs.is_dir() and folder.journals.is_dir()
    assert folder.log("red") == folder.logs / "red.log"


def test_two_runs_begun_in_the_same_second_have_two_names() -> None:
    assert len({create_run("table").name for _ in range(3)}) == 3


def test_a_run_is_live_as_long_as_its_supervisor_holds_it() -> None:
    folder = create_run("table", "mine")
    folder.write_info(info(folder))
    assert not folder.is_live()
    assert live_runs() == []
    folder.hold()
    assert folder.is_live()
    assert [live.name for live in live_runs()] == ["mine"]
    folder.release()
    assert not folder.is_live()


def test_a_run_has_one_supervisor() -> None:
    folder = create_run("table", "mine")
    folder.hold()
    with pytest.raises(NoRun, match="run mine has a supervisor already"):
        RunFolder(folder.path).hold()


def test_a_run_that_does_not_listen_yet_is_said_to_start() -> None:
    create_run("table", "mine").hold()
    with pytest.raises(NoRun, match="run mine is starting, and does not listen yet"):
        find_run("mine")


def test_the_newest_live_run_is_meant_when_none_is_named() -> None:
    start("first", "2026-03-01T12:00:00.000000Z")
    start("third", "2026-03-01T12:00:02.000000Z").release()
    start("second", "2026-03-01T12:00:01.000000Z")
    assert find_run().name == "second"
    assert find_run("first").name == "first"
    with pytest.raises(NoRun, match="run third is over"):
        find_run("third")
    assert open_run("third").name == "third"


def test_without_a_live_run_it_says_how_to_start_one() -> None:
    with pytest.raises(NoRun, match="no run is live; foosim up FILE starts one") as caught:
        find_run()
    assert caught.value.exit_code == 1


def test_a_name_that_is_no_run_gets_the_nearest_one() -> None:
    start("table-monday", "2026-03-01T12:00:00.000000Z")
    with pytest.raises(NoRun, match="no run 'table-mondya', nearest is table-monday"):
        find_run("table-mondya")
    for outside in ("../runs/table-monday", "/", "", ".."):
        assert not run_exists(outside)
        with pytest.raises(NoRun):
            find_run(outside)


def test_a_name_that_is_taken_or_none_is_refused() -> None:
    folder = create_run("table", "mine")
    assert create_run("table", "mine").path == folder.path, "nothing has run in it: it was made for who asks now"
    folder.hold_launcher()
    with pytest.raises(Refused, match="there is a run mine already"):
        create_run("table", "mine")
    with pytest.raises(BadValue, match=r"--run: a name is a lower case letter, .*, '\.\./mine'"):
        create_run("table", "../mine")


def test_old_runs_go_and_live_ones_stay() -> None:
    start("live", "2026-03-01T00:00:00.000000Z")
    for number in range(KEPT_RUNS + 3):
        start(f"over-{number:02d}", f"2026-03-01T12:00:{number:02d}.000000Z").release()
    create_run("table", "last")
    names = sorted(path.name for path in runs_folder().iterdir())
    assert names == ["last", "live", *(f"over-{number:02d}" for number in range(4, KEPT_RUNS + 3))]

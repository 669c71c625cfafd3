"""The result of a run, whoever is left to tell it: always of one shape, with the capture that is there."""

from __future__ import annotations

import gc
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Final

import msgspec
import pytest

from foosim.capture.parts import FOOTER
from foosim.common.errors import Refused
from foosim.launcher import console_child
from foosim.launcher.outcome import Outcome, plan_facts, result_without_supervisor, with_capture
from foosim.launcher.plan import make_plan
from foosim.launcher.resume import plan_again, supervisor_records
from foosim.launcher.run_options import RunOptions, launch_of
from foosim.launcher.up import Up
from foosim.protocol.actions import Journal as JournalAction
from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.protocol.codec import decode_any
from foosim.protocol.messages import End
from foosim.protocol.run_status import UNFINISHED
from foosim.runtime.command import DONE, FAILED, REFUSED
from foosim.runtime.journal import Journal, Records, journal_files
from foosim.runtime.roles.shell import Process
from foosim.runtime.run_folder import RunFolder, create_run
from foosim.runtime.transport.session import Session
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings, System
from foosim.supervisor.main import SupervisorShell
from foosim.supervisor.main import _history as history_of
from foosim.supervisor.records import Record, fold
from tests.conftest import Typed

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
TICKS: Final = 60
OF_THE_TABLE: Final = {"score", "own_goals", "clock_s", "is_over", "winner", "ball"}
"""What rules and kits show of a frame: a run of which nothing was heard has none."""


class Run:
    """A rehearsed run, its capture, and both journals, as processes leave them in a run's folder."""

    def __init__(self, folder: Path) -> None:
        self.capture = folder / "run.mcap"
        settings = Settings(run="mine", keeps_journals=True)
        systems: list[System] = []
        sets = ["engine=pure"]
        self.result = rehearse(
            TABLE.read_text(), TABLE.name, TICKS, None, sets, settings, prepare=systems.append, capture=self.capture
        ).json
        self.system = systems[0]
        self.cut = folder / "cut.mcap"
        self.cut.write_bytes(self.capture.read_bytes()[: -FOOTER.size])


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return Run(tmp_path_factory.mktemp("outcome"))


def test_a_result_without_a_supervisor_has_the_keys_of_any_other(run: Run) -> None:
    plan = make_plan(RunOptions(TABLE))
    blank = result_without_supervisor({"run": "mine", **plan_facts(plan.deployment)}, "lost supervisor: it is gone")
    assert blank.keys() == run.result.keys() - OF_THE_TABLE
    assert (blank["world"], blank["ticks"], blank["failed"]) == ("table", None, True)
    seen = result_without_supervisor(run.system.supervisor.status(0), "lost supervisor: it is gone")
    assert seen.keys() == blank.keys() and seen["ticks"] == TICKS and seen["digest"] == run.result["digest"]
    assert (seen["reason"], seen["failed"]) == ("lost supervisor: it is gone", True)


def test_a_capture_is_named_where_there_is_one_with_the_final_count_of_its_rows(run: Run) -> None:
    told = result_without_supervisor({}, "lost supervisor")
    assert with_capture(told, None)["capture"] is None
    assert with_capture(told, run.capture.with_name("none.mcap"))["capture"] is None
    found = with_capture(told, run.capture)
    assert found["capture"] == str(run.capture) and found["recording"]["state"] == "on"
    rows = found["recording"]["written"]
    assert rows >= TICKS + run.result["packets"]["offered"] and found["recording"]["offered"] == rows
    stale = {**told, "recording": {**found["recording"], "state": UNFINISHED, "written": 7, "offered": 9}}
    cut = with_capture(stale, run.cut)["recording"]
    assert (cut["state"], cut["written"], cut["offered"]) == (UNFINISHED, rows, rows)
    closed = {**told, "recording": {"state": "on", "problem": "", "offered": 5, "written": 5, "refused": 0}}
    assert with_capture(closed, run.capture)["recording"] == closed["recording"], "its writer has told it"


# --- runs that cannot go on ------------------------------------------------------------------------------------------


class Left:
    """The folder of a run whose launcher was killed with everything else."""

    def __init__(self, run: Run, capture: Path) -> None:
        self.folder: RunFolder = create_run("table", "mine")
        self.capture = capture
        options = RunOptions(TABLE, duration="120 ms", sets=("engine=pure",))
        self.folder.write_launch(launch_of(options, capture))
        (self.folder.path / "launcher").touch()
        with Journal(self.folder.journals, SUPERVISOR) as journal:
            for record in run.system.journal:
                journal.append(record)
        core = run.system.hub
        core.capture_file = str(capture)
        with Journal(self.folder.journals, VHUB) as journal:
            journal.append(JournalAction(core.head()).record)

    def journal(self, stem: str) -> Path:
        return journal_files(self.folder.journals, stem)[-1]


@pytest.fixture
def left(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Left:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    capture = tmp_path / "run.mcap"
    capture.write_bytes(run.cut.read_bytes())
    return Left(run, capture)


def damage(path: Path) -> None:
    """Flip a bit of the first record."""
    content = bytearray(path.read_bytes())
    content[40] ^= 1
    path.write_bytes(content)


@pytest.mark.parametrize(
    "what",
    ["whole", "supervisor gone", "supervisor", "no journal", "vhub gone", "vhub", "capture", "another", "finished"],
)
def test_a_run_that_cannot_go_on_says_so_before_anything_starts(run: Run, left: Left, what: str) -> None:
    folder, capture = left.folder, left.folder.path.parents[3] / "run.mcap"
    problems = {
        "whole": "",
        "supervisor gone": f"run mine has no journal to resume from in {folder.journals}",
        "supervisor": f"{left.journal(SUPERVISOR)}: byte ",
        "no journal": f"run mine cannot be resumed: {left.journal(SUPERVISOR)}: no journal of this version",
        "vhub gone": f"the vHub's journal is gone from {folder.journals}",
        "vhub": f"{left.journal(VHUB)}: ",
        "capture": f"{capture}: no MCAP file",
        "another": f"{capture}: was overwritten, it is the capture of run theirs",
        "finished": f"{capture}: is finished, and a capture is never overwritten",
    }
    if what == "capture":
        capture.write_bytes(b"something else that is not a capture")
    elif what == "another":
        capture.unlink()
        theirs = Settings(run="theirs")
        rehearse(TABLE.read_text(), TABLE.name, 2, None, ["engine=pure"], theirs, capture=capture)
    elif what == "finished":
        capture.write_bytes(run.capture.read_bytes())
    elif what.endswith(" gone"):
        left.journal(what.removesuffix(" gone")).unlink()
    elif what == "no journal":
        left.journal(SUPERVISOR).write_bytes(b"something else that is no journal")
    elif what != "whole":
        damage(left.journal(what))
    if what == "whole":
        plan, path = plan_again(folder)
        assert path == capture and plan.ticks == TICKS
        return
    with pytest.raises(Refused) as refused:
        plan_again(folder)
    assert problems[what] in str(refused.value), refused.value
    command = f"foosim up {TABLE} --for '120 ms' --set engine=pure"
    if what in ("capture", "another"):
        assert str(refused.value).endswith(f"; {command} begins a new run"), "what is there has no frame of this run"
    else:
        assert f". A new run begins with the last captured frame: {command} --from {capture}@" in str(refused.value)


def test_a_supervisor_goes_on_from_no_journal_that_has_nothing_and_from_none_that_is_damaged(left: Left) -> None:
    plan, folder = make_plan(RunOptions(TABLE, sets=("engine=pure",))), left.folder
    settings, records = plan.settings(folder.name), partial(supervisor_records, folder, plan.options)
    damage(left.journal(SUPERVISOR))
    with pytest.raises(Refused, match=r"run mine cannot be resumed: .*head of the file is damaged"):
        history_of(settings, plan.deployment, folder, records)
    left.journal(SUPERVISOR).write_bytes(b"")
    begun = history_of(settings, plan.deployment, folder, records)
    assert begun is None, "the one before was killed when it had made the file: the run begins"


def test_a_resume_of_a_run_that_has_ended_reports_its_result(run: Run, left: Left, typed: Typed) -> None:
    os.rename(left.folder.path.parents[3] / "run.mcap", "run.mcap")
    again = create_run("table", "over")
    again.write_launch(launch_of(RunOptions(TABLE), Path("run.mcap")))
    again.write_result({**run.result, "run": "over", "reason": "done"})
    supervisor = typed()
    code, out, err = supervisor("up", "--resume", "over", "--json")
    assert code == 0 and '"reason":"done"' in out and out.count("\n") == 1 and '"capture":"' in out
    assert "run over has ended: done" in err
    again.write_result({**run.result, "run": "over", "reason": "lost red", "failed": True})
    assert supervisor("up", "--resume", "over").code == 1


def test_a_resume_imports_the_players_before_anything_starts(left: Left, typed: Typed) -> None:
    sets = "engine=pure", "players.player-red.class=gone_since:Acts"
    capture = left.folder.path.parents[3] / "run.mcap"
    left.folder.write_launch(launch_of(RunOptions(TABLE, duration="120 ms", sets=sets), capture))
    done = typed()("up", "--resume", "mine")
    assert done.code == 2 and "players.player-red.class: there is no module gone_since" in done.err
    assert left.folder.result() is None and left.folder.info() is None


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (("up", "none.yaml"), 2),
        (("up", TABLE, "--set", "seed=dragon"), 2),
        (("up", TABLE, "--capture", TABLE), 3),
        (("up", "--resume", "nobody"), 1),
        (("up", "--resume", "nobody", "--pace", "fast"), 2),
        (("up",), 2),
    ],
)
def test_json_is_one_object_whatever_is_refused(
    arguments: tuple[str | Path, ...], code: int, typed: Typed, run: Run
) -> None:
    done = typed()(*arguments, "--json")
    (line,) = done.out.splitlines()
    content = msgspec.json.decode(line)
    assert done.code == code and content.keys() == run.result.keys() - OF_THE_TABLE
    assert content["failed"] and content["reason"] == done.err.rstrip("\n")


def test_json_is_one_object_also_of_a_run_that_was_killed(
    typed: Typed, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))

    def kill(self: Up) -> Outcome:
        self._interrupts = 2
        self._launch(SUPERVISOR, ["sleep", "100"])
        monkeypatch.setattr(self, "_start", self._continues)
        return run_whole(self)

    run_whole = Up.run

    monkeypatch.setattr(Up, "run", kill)
    done = typed()("up", TABLE, "--no-capture", "--json", "--processes", "each")
    (line,) = done.out.splitlines()
    content = msgspec.json.decode(line)
    assert content.keys() == run.result.keys() - OF_THE_TABLE and done.err.endswith("killed\n")
    assert done.code == 130 and content["summary"] == [] and content["solvers"] == {}
    assert content["failed"] and content["reason"] == "killed by a second Ctrl-C"


@contextmanager
def supervised(left: Left, records: Iterable[bytes] | None = None) -> Iterator[tuple[Process, SupervisorShell]]:
    """A supervisor's process in a run's folder, whose journal is begun anew; it resumes from `records`."""
    left.journal(SUPERVISOR).unlink()
    plan = make_plan(RunOptions(TABLE, duration="120 ms", sets=("engine=pure",)))
    thresholds = gc.get_threshold()
    with Session.router("tcp/127.0.0.1:0") as session, Journal(left.folder.journals, SUPERVISOR) as written:
        history = None if records is None else fold(plan.deployment, records)
        process = Process(SUPERVISOR)
        settings = plan.settings(left.folder.name)
        yield process, SupervisorShell(process, settings, None, left.folder, session, written, history)
    gc.set_threshold(*thresholds)
    gc.unfreeze()


@pytest.mark.parametrize("is_closed", [True, False])
def test_a_capture_that_has_its_end_is_not_cut_off_whatever_was_heard_of_its_vhub(
    run: Run, left: Left, is_closed: bool
) -> None:
    """The farewell was lost: the file says whether it was closed."""
    left.capture.write_bytes((run.capture if is_closed else run.cut).read_bytes())
    with supervised(left) as (process, supervisor):
        supervisor.core.finish("stopped", failed=False)
        supervisor.core.state.finished, supervisor.core.state.cut_off = True, "the capture is cut off: nobody said how"
        process.add(supervisor)
        assert process.run() == (DONE if is_closed else FAILED)
    told = left.folder.result()
    assert told is not None and told["failed"] != is_closed
    assert told["reason"] == ("stopped" if is_closed else "stopped; the capture is cut off: nobody said how")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_a_signal_while_up_imports_leaves_a_result(
    typed: Typed, monkeypatch: pytest.MonkeyPatch, number: signal.Signals
) -> None:
    before = signal.getsignal(number)
    monkeypatch.setattr(console_child, "page_of", lambda *options: signal.raise_signal(number))
    done = typed()("up", TABLE, "--no-capture", "--json")
    (line,) = done.out.splitlines()
    content = msgspec.json.decode(line)
    assert content["reason"] == f"{number.name} ended foosim up before the run began"
    assert (done.code, done.err, content["failed"]) == (FAILED, f"{content['reason']}\n", True)
    assert signal.getsignal(number) is before


AMID_AN_IMPORT = """
import signal, sys

class Signals:
    def find_spec(self, name, path, target=None):
        if name == sys.argv[-1]:
            signal.raise_signal(signal.SIGTERM)

sys.meta_path.insert(0, Signals())
from foosim.cli import main
main()
"""


@pytest.mark.parametrize("module", ["typer", "foosim.launcher.begin"])
def test_a_signal_while_the_command_itself_is_imported_leaves_a_result(module: str) -> None:
    words = "up", str(TABLE), "--no-capture", "--json", "--run", module
    done = subprocess.run([sys.executable, "-c", AMID_AN_IMPORT, *words], capture_output=True, text=True, check=False)
    content = msgspec.json.decode(done.stdout.splitlines()[-1])
    reason = "SIGTERM ended foosim up before the run began"
    assert (done.returncode, done.stderr, content["reason"], content["run"]) == (FAILED, f"{reason}\n", reason, module)


def test_a_supervisor_that_is_started_after_the_end_does_not_wait_for_a_vhub_that_is_done(run: Run, left: Left) -> None:
    left.capture.write_bytes(run.capture.read_bytes())
    with supervised(left, list(Records(left.journal(SUPERVISOR)))) as (_, shell):
        assert shell.core.state.end is not None and shell.core.failover.waits_for_hub(time.monotonic_ns())
        assert shell.is_over()
        left.capture.write_bytes(run.cut.read_bytes())
        assert not shell.is_over(), "its vHub may complete it"
        shell.leave()


def test_of_a_run_that_is_not_gone_on_with_no_result_is_written(left: Left) -> None:
    """So it can be resumed again."""
    journal = left.journal(SUPERVISOR)
    records = [raw for raw in Records(journal) if not isinstance(decode_any(Record, raw), End)]
    with supervised(left, records) as (process, supervisor):
        supervisor.core.finish("lost vhub", failed=True)
        process.add(supervisor)
        assert process.run() == REFUSED and supervisor.core.state.abandoned == "lost vhub"
    assert left.folder.result() is None

"""What the launcher does with processes that end early, again and again, and with those that somebody asks for."""

from __future__ import annotations

import io
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from itertools import count
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

import msgspec
import pytest

from foosim.client import control
from foosim.launcher.console_child import ADDRESSES
from foosim.launcher.display import Display
from foosim.launcher.liveness import QUESTION_S, UNANSWERED_MAX, WAITS_S
from foosim.launcher.outcome import capture_lines
from foosim.launcher.plan import make_plan
from foosim.launcher.processes import Child
from foosim.launcher.run_options import RunOptions
from foosim.launcher.up import END_S, Up
from foosim.protocol.channels import SUPERVISOR, VHUB
from foosim.protocol.run_status import NOT_RECORDED
from foosim.runtime.command import REFUSED
from foosim.runtime.run_folder import RESULT_FILE, RunInfo

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
KILLED: Final = "kill -9 $$"
PLAYER: Final = "player-red"
STAYS: Final = ("players.player-red.restart=false",)


class Launched(Up):
    """A launcher of the table, whose processes are what a test makes of them, and what it displays."""

    def __init__(self, *sets: str, processes: str = "each", pki: Path | None = None, **more: Any) -> None:
        self.said = io.StringIO()
        options = RunOptions(TABLE, sets=sets, processes=processes, pki=pki)
        super().__init__(make_plan(options), None, Display(self.said), "run", **more)
        self.now_s = 0.0

    def plays(self, name: str, script: str, *, has_ended: bool = True) -> Child:
        """Start a process that is a script, which writes down that it was started; return it, ended as a rule."""
        path = self.folder.path / name
        path.write_text(f'#!/bin/sh\necho started >>"$0.log"\n{script}\n')
        path.chmod(0o755)
        self._launch(name, [str(path)])
        return self.ended(name) if has_ended else self._launcher.children[name]

    def ended(self, name: str) -> Child:
        child = self._launcher.children[name]
        child.process.wait()
        return child

    def starts(self, name: str) -> int:
        """How often such a process was started; the last one has ended."""
        self.ended(name)
        return (self.folder.path / f"{name}.log").read_text().count("started")

    def goes_on(self, name: str) -> int:
        """Let what follows the end of a process happen, in the longest time that it takes; return `starts`."""
        self.ended(name)
        self._restart_ended(self.now_s, has_status=True)
        self.now_s += max(WAITS_S)
        self._restart_ended(self.now_s, has_status=True)
        return self.starts(name)

    def listens(self, child: Child) -> None:
        """Write the run file of a supervisor."""
        self.folder.write_info(RunInfo("run", "table", str(TABLE), child.process.pid, "", "tcp/127.0.0.1:1"))

    def hears(self, **status: Any) -> None:
        """Have the supervisor answer a request."""
        told = {"begun": True, "recoveries": [], "processes": {}, "starts": {}, "recording": NOT_RECORDED, **status}
        self._show(SimpleNamespace(status=lambda timeout_s, give_up: told))  # type: ignore[arg-type]


Launching = Callable[..., Launched]


@pytest.fixture
def launched(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Launching]:
    """Makes launchers; their children end with the test."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    made: list[Launched] = []

    def make(*sets: str, **more: Any) -> Launched:
        made.append(Launched(*sets, **more))
        return made[-1]

    yield make
    for up in made:
        up._launcher.kill()
        with suppress(OSError):  # it has closed its pipe itself
            up._launcher.close()


def test_a_node_that_was_given_up_is_started_when_somebody_asks_for_it(launched: Launching) -> None:
    up = launched()
    up._has_begun = True
    up.plays("red", "exit 1")
    assert [up.goes_on("red") for _ in range(7)] == [2, 3, 4, 5, 6, 6, 6]
    assert up.said.getvalue().endswith(
        f"red ended with exit code 1, is given up; foosim start red tries it again; its log is {up.folder.log('red')}\n"
    )
    up._start_wanted({"red": 1, "blue": 1})
    assert up.goes_on("red") == 8, "once for the word, and once again after the first wait"
    up._start_wanted({"red": 1, "blue": 1})
    assert up.goes_on("red") == 9, "a word is heard once"
    assert up.said.getvalue().count("restarts in 0.5 s") == 2


@pytest.mark.parametrize(
    ("name", "ends", "sets", "has_begun", "comes_back", "ends_run"),
    [
        ("red", KILLED, (), False, True, False),
        ("red", "exit 1", (), False, False, True),
        ("red", "exit 3", (), False, False, True),
        ("red", KILLED, (), True, True, False),
        ("red", "exit 1", (), True, True, False),
        ("red", "exit 3", (), True, False, False),
        (PLAYER, KILLED, (), True, True, False),
        (PLAYER, KILLED, STAYS, True, False, True),
        (PLAYER, KILLED, STAYS, False, True, False),
        (PLAYER, "exit 1", (), True, False, True),
        (PLAYER, "exit 1", (), False, False, True),
    ],
)
def test_what_follows_when_a_node_or_a_player_ends(
    launched: Launching, name: str, ends: str, sets: tuple[str, ...], has_begun: bool, comes_back: bool, ends_run: bool
) -> None:
    """Before the first tick one that something else has ended is started again, also a player that is not to be: it has
    not acted. A player that ends by itself has failed; a process that is refused never comes back."""
    up = launched(*sets)
    up._has_begun = has_begun
    assert up._ends_run(up.plays(name, ends)) == ends_run
    assert up.goes_on(name) == 1 + comes_back
    if name == "red":
        is_given_up = has_begun and ends == "exit 3"
        assert ("is given up; foosim start red tries it again" in up.said.getvalue()) == is_given_up
    elif comes_back:
        assert [up.goes_on(name) for _ in range(5)][-1] == 6 and up._ends_run(up.ended(name)), "given up"
        assert "player-red was killed by SIGKILL" in up.said.getvalue()
        assert "is given up; its log" in up.said.getvalue()


def test_a_node_that_is_started_before_it_has_ended_starts_again(launched: Launching) -> None:
    """It was stopped, which its process hears as a refusal, and somebody was quick."""
    up = launched()
    up._has_begun = True
    waits = 'while [ ! -e "$0.go" ]; do sleep 0.01; done'
    up.plays("red", f"{waits}\nexit {REFUSED}", has_ended=False)
    up._start_wanted({"red": 1})
    (up.folder.path / "red.go").touch()
    assert [up.goes_on("red") for _ in range(3)] == [2, 2, 2], "once for the word, and then it is refused"


@pytest.mark.parametrize(
    ("ends", "listened", "comes_back", "reason"),
    [
        (KILLED, False, True, "lost supervisor: it was killed by SIGKILL, not by foosim"),
        ("exit 1", False, False, "lost supervisor: it ended with exit code 1"),
        ("exit 1", True, True, "lost supervisor: it ended with exit code 1"),
        ("exit 0", True, True, "lost supervisor: it ended with exit code 0"),
        ("echo run mine cannot continue: no journal; exit 3", True, False, "run mine cannot continue: no journal"),
        ("echo MemoryError; exit 1", True, True, "lost supervisor: it ended with exit code 1: too little memory"),
    ],
)
def test_what_follows_when_the_supervisor_ends(
    launched: Launching, monkeypatch: pytest.MonkeyPatch, ends: str, listened: bool, comes_back: bool, reason: str
) -> None:
    """Whatever becomes of it, there is a result, of the shape of any other."""
    up = launched()
    supervisor = up.plays(SUPERVISOR, ends)
    if listened:
        up.listens(supervisor)
    outcome = up._outcome()
    assert outcome.failed and outcome.result["reason"] == reason and outcome.result["run"] == "run"
    assert up._supervisor_comes_back(supervisor, 0.0) == comes_back
    up.ended(SUPERVISOR)
    up._interrupts = 2
    monkeypatch.setattr(up, "_start", up._continues)
    killed = up.run()
    assert killed.is_killed and killed.result.keys() == outcome.result.keys()
    assert killed.result["reason"] == "killed by a second Ctrl-C"


@pytest.mark.parametrize(("sets", "comes_back"), [((), True), (STAYS, False)])
def test_a_process_with_a_player_that_must_not_restart_is_not_started_again(
    launched: Launching, sets: tuple[str, ...], comes_back: bool
) -> None:
    up = launched(*sets, processes="one")
    up._has_begun = True
    assert up._supervisor_comes_back(up.plays("one", KILLED), 0.0) == comes_back


@pytest.mark.parametrize(("processes", "allowed_s"), [("each", 5), ("one", 15)])
def test_a_supervisor_that_hangs_is_killed_and_beside_players_given_up_the_second_time(
    launched: Launching, processes: str, allowed_s: int
) -> None:
    """It may take as long as a player may, deadlines.lockstep_fast; what hangs is in a player, which would do so again.
    Nothing counts before it has said where it listens."""
    up = launched(processes=processes)
    up._has_begun = True
    name = SUPERVISOR if processes == "each" else "one"
    for again in (True, processes == "each"):
        process = up.plays(name, "exec sleep 100", has_ended=False)
        for _ in range(0 if up.folder.info() else 3 * UNANSWERED_MAX):
            up._supervisor_watch.unanswered(QUESTION_S)
            up._end_stalled_supervisor(process)
        up.listens(process)
        up._end_stalled_supervisor(process)
        for _ in range(allowed_s - 1):
            up._supervisor_watch.unanswered(QUESTION_S)
        up._end_stalled_supervisor(process)
        assert process.exit_code is None
        up._supervisor_watch.unanswered(QUESTION_S)
        up._end_stalled_supervisor(process)
        process.process.wait()
        assert up._outcome().result["reason"].endswith(f"killed by up: it had not answered for {allowed_s} s")
        up._start_due = lambda now_s: None  # type: ignore[method-assign]
        assert up._supervisor_comes_back(process, 0.0) == again
        up._restarts.forget(name)
    killed = f"{name} does not answer any more: it is killed (it had not answered for {allowed_s} s)\n"
    assert up.said.getvalue().count(killed) == 2


def test_the_console_ends_last_when_it_is_known_how_the_run_ended(
    launched: Launching, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So that it can tell its pages: the supervisor's result, with what `up` knows better."""
    waits, seen, up = tmp_path / "waits", tmp_path / "seen", launched()

    def start() -> bool:
        up.plays(SUPERVISOR, "exit 0")
        up._lost = up.plays("red", "exit 1")
        up.folder.write_result({**up.unended(""), "reason": "stopped", "failed": False})
        result = up.folder.path / RESULT_FILE
        page = f'trap "cp {result} {seen}; exit" TERM; touch {waits}; while :; do sleep 0.01; done'
        up._console._launcher.start("console", ["sh", "-c", page], up.folder.log("console"))
        while not waits.exists():
            time.sleep(0.01)
        return False

    monkeypatch.setattr(up, "_start", start)
    outcome = up.run()
    told = msgspec.json.decode(seen.read_bytes())
    assert told["reason"] == outcome.result["reason"] == "lost red: it ended with exit code 1"


def test_without_a_terminal_the_address_of_the_page_comes_before_the_run(launched: Launching, tmp_path: Path) -> None:
    up = launched(console=[])
    console, display = up._console, up.display
    console._launcher.start("console", ["sleep", "100"], tmp_path / "log")
    with display, console:
        display.say("run run")
        console.look()
        assert up.said.getvalue() == ""
        (console._folder.path / ADDRESSES).write_text('{"text": "console: http://127.0.0.1:1/"}')
        console.look()
        assert up.said.getvalue() == "console: http://127.0.0.1:1/\nrun run\n"


def test_the_command_that_is_printed_for_another_machine_has_no_path_of_this_one(
    launched: Launching, tmp_path: Path
) -> None:
    """Neither that of the certificates nor that of the deployment."""
    up = launched("nodes.blue.launch=manual", pki=tmp_path / "pki")
    up._begin(up.plan.processes["blue"], RunInfo("run", "table", str(TABLE), 1, "", "tls/192.0.2.7:7400"))
    assert up.said.getvalue() == (
        "waiting for node blue; start it on its machine, DIR being the folder of its certificate there: "
        "foosim role node --name blue --connect tls/192.0.2.7:7400 --pki DIR\n"
    )


def test_one_failure_is_printed_once(launched: Launching) -> None:
    """Of a player that fails: in the reason, not again as the end of its log."""
    up = launched()
    up._has_begun = True
    reason = "player-red failed at tick 5: ValueError: too much (own.py:4: raise)"
    up.plays(SUPERVISOR, "")
    log = up.plays(PLAYER, f"echo 'Traceback (most recent call last):\n{reason}'; exit 1").log
    up._look_for_lost(0.0)
    for result, head in (
        (reason, f"player-red ended with exit code 1; its log is {log}"),
        ("lost player-red: it ended with exit code 1", f"the log of player-red is {log}"),
    ):
        lines = up._lost_lines({"reason": result})
        assert lines[0] == head
        assert [result, *lines].count(f"    {reason}") == (result != reason) and "    Traceback" in lines[1]


@pytest.mark.parametrize(
    ("name", "ends_by", "reason", "line"),
    [
        (
            PLAYER,
            "exit 0",
            "player-red has not answered tick 101 for 2 s (deadlines.lockstep_fast)",
            "the log of {} is",
        ),
        (VHUB, "exit 1", "lost vhub: it cannot continue: no journal", "{} ended with exit code 1; its log is"),
    ],
)
def test_the_log_of_the_process_that_the_reason_names_is_shown(
    launched: Launching, name: str, ends_by: str, reason: str, line: str
) -> None:
    up = launched()
    up._has_begun = True
    up.plays(SUPERVISOR, "")
    log = up.plays(name, ends_by).log
    up.folder.write_result({**up.unended(reason), "reason": reason, "failed": True})
    assert up._outcome().lines[:2] == (f"the run has ended: {reason}", f"{line.format(name)} {log}")


def test_a_supervisor_that_ends_before_the_launcher_connects_has_ended_in_order(launched: Launching) -> None:
    up = launched()
    up.listens(up.plays(SUPERVISOR, ""))
    with ExitStack() as stack:
        assert up._connect(stack) is None
    up._watch()


def test_a_supervisor_that_cannot_be_reached_yet_is_tried_again_until_it_counts_as_hanging(
    launched: Launching, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(control, "CONNECT_S", 0.0)
    up = launched("deadlines.start=5 s")
    supervisor, seconds = up.plays(SUPERVISOR, "exec sleep 100", has_ended=False), count(0.0)
    with ExitStack() as stack:
        up.folder.write_info(RunInfo("run", "table", str(TABLE), 0, "", "tcp/127.0.0.1:1"))
        assert up._connect(stack) is None, "the run file is that of a supervisor before, this one is only starting"
        up.listens(supervisor)
        monkeypatch.setattr(up, "_time_of", lambda child: next(seconds))
        for _ in range(5):
            up._end_stalled_supervisor(supervisor)
            assert supervisor.exit_code is None and not supervisor.killed
            assert up._connect(stack) is None, "it lives: the run goes on, and another attempt follows"
        up._end_stalled_supervisor(supervisor)
    assert supervisor.killed == "it could not be connected to for 5 s (deadlines.start)"


def test_a_capture_that_was_cut_off_is_named_with_the_command_that_completes_it(tmp_path: Path) -> None:
    capture, journals = tmp_path / "run.mcap", tmp_path / "journals"
    capture.write_bytes(b"\x89MCAP0\r\n")
    assert capture_lines(capture, {"recording": NOT_RECORDED}, journals) == [
        f"capture {capture} (unfinished)",
        f"complete it with: foosim capture recover {capture} --journals {journals}",
    ]
    assert capture_lines(capture, None, journals) == [f"capture {capture} (unfinished)"], "the run can be resumed"


def test_a_run_that_was_told_to_end_is_given_time_as_long_as_its_supervisor_says_that_it_closes_its_capture(
    launched: Launching,
) -> None:
    up = launched()
    up.plays(SUPERVISOR, "exec sleep 100", has_ended=False)
    up._has_begun = up._has_ended = up._end_requested = True
    up._interrupts, up._ending_s = 1, time.monotonic() - END_S - 1
    assert not up._continues(), "it would be cut off"
    recording = {**NOT_RECORDED, "state": "closing", "offered": 9, "written": 4, "bytes": 1_000_000}
    up.hears(state="ended", recording=recording)
    assert up._continues() and up.said.getvalue() == "closing the capture: 5 rows are left, 1.0 MB are written\n"


@pytest.mark.parametrize(
    ("state", "stopped", "lost"), [("running", False, True), ("running", True, False), ("ended", False, False)]
)
def test_a_player_that_ends_with_exit_code_0_while_the_run_goes_on_is_lost_at_once(
    launched: Launching, monkeypatch: pytest.MonkeyPatch, state: str, stopped: bool, lost: bool
) -> None:
    up = launched()
    up.plays(SUPERVISOR, "exec sleep 100", has_ended=False)
    up.plays(PLAYER, "exit 0")
    monkeypatch.setattr(up.display, "show", lambda status, now_s: None)
    monkeypatch.setattr(up._stalled_watch, "look", lambda *about: {})
    up.hears(state=state, processes={PLAYER: {"stopped": stopped}})
    up._continues()
    up._continues()
    assert bool(up._ending_s) == lost
    up._launcher.stop()
    ended = "lost supervisor: it was killed by up: the run is over"
    assert up._outcome().result["reason"] == ("lost player-red: it ended with exit code 0" if lost else ended)


def test_where_the_run_can_be_resumed_nobody_is_told_to_end(
    launched: Launching, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Who is told so finishes what it has; who is killed leaves it as it is."""
    up = launched()

    def start() -> bool:
        """The supervisor has ended before the vHub was told how to go on."""
        ends = "trap 'echo was told to end; exit 1' TERM; echo ready; while true; do sleep 0.01; done"
        log = up.plays(VHUB, ends, has_ended=False).log
        while "ready" not in log.read_text():
            time.sleep(0.001)
        up.plays(SUPERVISOR, "exit 3")
        return False

    monkeypatch.setattr(up, "_start", start)
    assert up.run().failed
    assert up.folder.log(VHUB).read_text() == "ready\n"

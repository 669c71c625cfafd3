"""What the launcher does with processes that end early, again and again, and with those that somebody asks for."""

from __future__ import annotations

import io
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from itertools import count
from pathlib import Path
from types import SimpleNamespace
from typing import Final

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


Launched = Callable[..., tuple[Up, io.StringIO]]


@pytest.fixture
def launched(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Launched]:
    """Makes a launcher of the table with settings, and what it displays; its children end with the test."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    made: list[Up] = []

    def make(*sets: str, processes: str = "each") -> tuple[Up, io.StringIO]:
        said = io.StringIO()
        made.append(Up(make_plan(RunOptions(TABLE, sets=sets, processes=processes)), None, Display(said), "run"))
        return made[-1], said

    yield make
    for up in made:
        up._launcher.kill()
        with suppress(OSError):  # it has closed its pipe itself
            up._launcher.close()


def test_a_node_that_was_given_up_is_started_when_somebody_asks_for_it(launched: Launched, tmp_path: Path) -> None:
    up, said = launched()
    (tmp_path / "node").write_text('#!/bin/sh\necho started >>"$0.log"\nexit 1\n')
    (tmp_path / "node").chmod(0o755)
    up._launch("red", [str(tmp_path / "node")])
    up._has_begun = True
    now_s = 0.0

    def ends() -> int:
        """Let it end, and what follows happen; return how often it was started."""
        nonlocal now_s
        child: Child = up._launcher.children["red"]
        child.process.wait()
        up._restart_ended(now_s)
        now_s += max(WAITS_S)
        up._restart_ended(now_s)
        up._launcher.children["red"].process.wait()
        return (tmp_path / "node.log").read_text().count("started")

    assert [ends() for _ in range(7)] == [2, 3, 4, 5, 6, 6, 6]
    assert said.getvalue().endswith(
        f"red ended with exit code 1, is given up; foosim start red tries it again; its log is {up.folder.log('red')}\n"
    )
    up._start_wanted({"red": 1, "blue": 1})
    assert ends() == 8, "once for the word, and once again after the first wait"
    up._start_wanted({"red": 1, "blue": 1})
    assert ends() == 9, "a word is heard once"
    assert said.getvalue().count("restarts in 0.5 s") == 2


@pytest.mark.parametrize(
    ("ends", "has_begun", "starts", "ends_run"),
    [
        ("kill -9 $$", False, 2, False),
        ("exit 1", False, 1, True),
        ("exit 3", False, 1, True),
        ("kill -9 $$", True, 2, False),
        ("exit 1", True, 2, False),
        ("exit 3", True, 1, False),
    ],
)
def test_what_follows_when_a_node_ends(
    launched: Launched, tmp_path: Path, ends: str, has_begun: bool, starts: int, ends_run: bool
) -> None:
    """Before the first tick one that something else has ended is started again; one that is refused never is."""
    up, said = launched()
    (tmp_path / "node").write_text(f'#!/bin/sh\necho started >>"$0.log"\n{ends}\n')
    (tmp_path / "node").chmod(0o755)
    up._launch("red", [str(tmp_path / "node")])
    up._has_begun = has_begun
    up._launcher.children["red"].process.wait()
    assert up._ends_run(up._launcher.children["red"]) == ends_run
    for now_s in (0.0, 1.0, 1.0):
        up._restart_ended(now_s, has_status=True)
        up._launcher.children["red"].process.wait()
    assert (tmp_path / "node.log").read_text().count("started") == starts
    is_given_up = has_begun and ends == "exit 3"
    assert ("is given up; foosim start red tries it again" in said.getvalue()) == is_given_up


@pytest.mark.parametrize(
    ("ends", "listened", "comes_back", "reason"),
    [
        ("kill -9 $$", False, True, "lost supervisor: it was killed by SIGKILL, not by foosim"),
        ("exit 1", False, False, "lost supervisor: it ended with exit code 1"),
        ("exit 1", True, True, "lost supervisor: it ended with exit code 1"),
        ("exit 0", True, True, "lost supervisor: it ended with exit code 0"),
        ("echo run mine cannot continue: no journal; exit 3", True, False, "run mine cannot continue: no journal"),
        ("echo MemoryError; exit 1", True, True, "lost supervisor: it ended with exit code 1: too little memory"),
    ],
)
def test_what_follows_when_the_supervisor_ends(
    launched: Launched, monkeypatch: pytest.MonkeyPatch, ends: str, listened: bool, comes_back: bool, reason: str
) -> None:
    """Whatever becomes of it, there is a result, of the shape of any other."""
    up, _ = launched()
    up._launch(SUPERVISOR, ["sh", "-c", ends])
    supervisor = up._launcher.children[SUPERVISOR]
    supervisor.process.wait()
    if listened:
        up.folder.write_info(RunInfo("run", "table", str(TABLE), supervisor.process.pid, "", "tcp/127.0.0.1:1"))
    outcome = up._outcome()
    assert outcome.failed and outcome.result["reason"] == reason and outcome.result["run"] == "run"
    assert up._supervisor_comes_back(supervisor, 0.0) == comes_back
    up._launcher.children[SUPERVISOR].process.wait()
    up._interrupts = 2
    monkeypatch.setattr(up, "_start", up._continues)
    killed = up.run()
    assert killed.is_killed and killed.result.keys() == outcome.result.keys()
    assert killed.result["reason"] == "killed by a second Ctrl-C"


def test_the_console_ends_last_when_it_is_known_how_the_run_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So that it can tell its pages: the supervisor's result, with what `up` knows better."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    waits, seen = tmp_path / "waits", tmp_path / "seen"

    def start(up: Up) -> bool:
        for name, code in ((SUPERVISOR, 0), ("red", 1)):
            up._launch(name, ["sh", "-c", f"exit {code}"])
            up._launcher.children[name].process.wait()
        up.folder.write_result({**up.unended(""), "reason": "stopped", "failed": False})
        up._lost = up._launcher.children["red"]
        result = up.folder.path / RESULT_FILE
        page = f'trap "cp {result} {seen}; exit" TERM; touch {waits}; while :; do sleep 0.01; done'
        up._console._launcher.start("console", ["sh", "-c", page], up.folder.log("console"))
        while not waits.exists():
            time.sleep(0.01)
        return False

    monkeypatch.setattr(Up, "_start", start)
    outcome = Up(make_plan(RunOptions(TABLE, processes="each")), None, Display(io.StringIO()), "run").run()
    told = msgspec.json.decode(seen.read_bytes())
    assert told["reason"] == outcome.result["reason"] == "lost red: it ended with exit code 1"


def test_without_a_terminal_the_address_of_the_page_comes_before_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    said = io.StringIO()
    display = Display(said)
    console = Up(make_plan(RunOptions(TABLE, processes="each")), None, display, "run", console=[])._console
    console._launcher.start("console", ["sleep", "100"], tmp_path / "log")
    with display, console:
        display.say("run run")
        console.look()
        assert said.getvalue() == ""
        (console._folder.path / ADDRESSES).write_text('{"text": "console: http://127.0.0.1:1/"}')
        console.look()
        assert said.getvalue() == "console: http://127.0.0.1:1/\nrun run\n"


def test_the_command_that_is_printed_for_another_machine_has_no_path_of_this_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither that of the certificates nor that of the deployment."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    said = io.StringIO()
    options = RunOptions(TABLE, sets=("nodes.blue.launch=manual",), pki=tmp_path / "pki", processes="each")
    up = Up(make_plan(options), None, Display(said), "run")
    up._begin(up.plan.processes["blue"], RunInfo("run", "table", str(TABLE), 1, "", "tls/192.0.2.7:7400"))
    assert said.getvalue() == (
        "waiting for node blue; start it on its machine, DIR being the folder of its certificate there: "
        "foosim role node --name blue --connect tls/192.0.2.7:7400 --pki DIR\n"
    )


def test_one_failure_is_printed_once(launched: Launched) -> None:
    """Of a player that fails: in the reason, not again as the end of its log."""
    up, _ = launched()
    up._has_begun = True
    reason = "player-red failed at tick 5: ValueError: too much (own.py:4: raise)"
    log = f"Traceback (most recent call last):\n{reason}"
    for name, ends in ((SUPERVISOR, "true"), ("player-red", f"echo '{log}'; exit 1")):
        up._launch(name, ["sh", "-c", ends])
        up._launcher.children[name].process.wait()
    up._look_for_lost(0.0)
    for result, head in (
        (reason, f"player-red ended with exit code 1; its log is {up.folder.log('player-red')}"),
        ("lost player-red: it ended with exit code 1", f"the log of player-red is {up.folder.log('player-red')}"),
    ):
        lines = up._lost_lines({"reason": result})
        assert lines[0] == head
        assert [result, *lines].count(f"    {reason}") == (result != reason) and "    Traceback" in lines[1]


@pytest.mark.parametrize(
    ("name", "ends_by", "reason", "line"),
    [
        (
            "player-red",
            "true",
            "player-red has not answered tick 101 for 2 s (deadlines.lockstep_fast)",
            "the log of player-red is",
        ),
        ("vhub", "false", "lost vhub: it cannot continue: no journal", "vhub ended with exit code 1; its log is"),
    ],
)
def test_the_log_of_the_process_that_the_reason_names_is_shown(
    launched: Launched, name: str, ends_by: str, reason: str, line: str
) -> None:
    up, _ = launched()
    up._has_begun = True
    for child, command in ((SUPERVISOR, "true"), (name, ends_by)):
        up._launch(child, [command])
        up._launcher.children[child].process.wait()
    up.folder.write_result({**up.unended(reason), "reason": reason, "failed": True})
    log = up._launcher.children[name].log
    assert up._outcome().lines[:2] == (f"the run has ended: {reason}", f"{line} {log}")


def test_a_supervisor_that_hangs_is_killed_and_that_is_said(launched: Launched) -> None:
    up, said = launched()
    up._launch(SUPERVISOR, ["sleep", "100"])
    supervisor = up._launcher.children[SUPERVISOR]
    for _ in range(3 * UNANSWERED_MAX):
        up._supervisor_watch.unanswered(QUESTION_S)
        up._end_stalled_supervisor(supervisor)
    assert supervisor.exit_code is None, "it has not said where it listens"
    up.folder.write_info(RunInfo("run", "table", str(TABLE), supervisor.process.pid, "", "tcp/127.0.0.1:1"))
    up._end_stalled_supervisor(supervisor)
    for _ in range(UNANSWERED_MAX):
        up._supervisor_watch.unanswered(QUESTION_S)
    up._end_stalled_supervisor(supervisor)
    supervisor.process.wait()
    assert said.getvalue() == ("supervisor does not answer any more: it is killed (it had not answered for 5 s)\n")
    assert up._outcome().result["reason"] == "lost supervisor: it was killed by up: it had not answered for 5 s"


def test_a_process_with_players_that_hangs_twice_is_given_up(
    launched: Launched, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It may take as long as a player may; what makes it hang is in a player, which would do so again."""
    up, said = launched(processes="one")
    up._has_begun = True
    for again in (True, False):
        up._launch("one", ["sleep", "100"])
        process = up._launcher.children["one"]
        up.folder.write_info(RunInfo("run", "table", str(TABLE), process.process.pid, "", "tcp/127.0.0.1:1"))
        up._end_stalled_supervisor(process)
        for _ in range(14):
            up._supervisor_watch.unanswered(QUESTION_S)
        up._end_stalled_supervisor(process)
        assert process.exit_code is None, "deadlines.lockstep_fast is 10 s"
        up._supervisor_watch.unanswered(QUESTION_S)
        up._end_stalled_supervisor(process)
        process.process.wait()
        monkeypatch.setattr(up, "_start_due", lambda now_s: None)
        assert up._supervisor_comes_back(process, 0.0) == again
        up._restarts.forget("one")
    assert "one does not answer any more: it is killed (it had not answered for 15 s)" in said.getvalue()


@pytest.mark.parametrize(("sets", "comes_back"), [((), True), (("players.player-red.restart=false",), False)])
def test_a_process_with_a_player_that_must_not_restart_is_not_started_again(
    launched: Launched, monkeypatch: pytest.MonkeyPatch, sets: tuple[str, ...], comes_back: bool
) -> None:
    up, _ = launched(*sets, processes="one")
    up._has_begun = True
    up._launch("one", ["sh", "-c", "kill -9 $$"])
    process = up._launcher.children["one"]
    process.process.wait()
    monkeypatch.setattr(up, "_start_due", lambda now_s: None)
    assert up._supervisor_comes_back(process, 0.0) == comes_back


@pytest.mark.parametrize(
    ("ends", "sets", "begun", "starts", "ends_run"),
    [
        ("kill -9 $$", (), True, 2, False),
        ("kill -9 $$", ("players.player-red.restart=false",), True, 1, True),
        ("kill -9 $$", ("players.player-red.restart=false",), False, 2, False),
        ("exit 1", (), True, 1, True),
        ("exit 1", (), False, 1, True),
    ],
)
def test_a_player_is_started_again_when_a_signal_has_ended_it(
    launched: Launched, tmp_path: Path, ends: str, sets: tuple[str, ...], begun: bool, starts: int, ends_run: bool
) -> None:
    """One that ends by itself has failed. The sixth time within a minute it is given up, and the run ends. Before the
    first tick `restart: false` says nothing: the player has not acted."""
    up, said = launched(*sets)
    (tmp_path / "player").write_text(f'#!/bin/sh\necho started >>"$0.log"\n{ends}\n')
    (tmp_path / "player").chmod(0o755)
    up._launch("player-red", [str(tmp_path / "player")])
    up._has_begun = begun
    now_s = 0.0

    def ended() -> bool:
        child: Child = up._launcher.children["player-red"]
        child.process.wait()
        return up._ends_run(child)

    def go_on() -> int:
        nonlocal now_s
        up._restart_ended(now_s, has_status=True)
        now_s += max(WAITS_S)
        up._restart_ended(now_s, has_status=True)
        up._launcher.children["player-red"].process.wait()
        return (tmp_path / "player.log").read_text().count("started")

    assert ended() == ends_run and go_on() == starts
    if not ends_run:
        assert [go_on() for _ in range(5)][-1] == 6 and ended()
        assert "player-red was killed by SIGKILL" in said.getvalue() and "is given up; its log" in said.getvalue()


def test_a_node_that_is_started_before_it_has_ended_starts_again(launched: Launched, tmp_path: Path) -> None:
    """It was stopped, which its process hears as a refusal, and somebody was quick."""
    up, _ = launched()
    waits = 'while [ ! -e "$0.go" ]; do sleep 0.01; done'
    (tmp_path / "node").write_text(f'#!/bin/sh\necho started >>"$0.log"\n{waits}\nexit {REFUSED}\n')
    (tmp_path / "node").chmod(0o755)
    up._launch("red", [str(tmp_path / "node")])
    up._has_begun = True
    up._start_wanted({"red": 1})
    (tmp_path / "node.go").touch()
    for now_s in (0.0, max(WAITS_S), 2 * max(WAITS_S), 3 * max(WAITS_S)):
        up._launcher.children["red"].process.wait()
        up._restart_ended(now_s, has_status=True)
    up._launcher.children["red"].process.wait()
    assert (tmp_path / "node.log").read_text().count("started") == 2, "once for the word, and then it is refused"


def test_a_supervisor_that_ends_before_the_launcher_connects_has_ended_in_order(launched: Launched) -> None:
    up, _ = launched()
    up._launch(SUPERVISOR, ["true"])
    supervisor = up._launcher.children[SUPERVISOR]
    up.folder.write_info(RunInfo("run", "table", str(TABLE), supervisor.process.pid, "", "tcp/127.0.0.1:1"))
    supervisor.process.wait()
    with ExitStack() as stack:
        assert up._connect(stack) is None
    up._watch()


def test_a_supervisor_that_cannot_be_reached_yet_is_tried_again_until_it_counts_as_hanging(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.setattr(control, "CONNECT_S", 0.0)
    options = RunOptions(TABLE, processes="each", sets=("deadlines.start=5 s",))
    up = Up(make_plan(options), None, Display(io.StringIO()), "run")
    up._launch(SUPERVISOR, ["sleep", "100"])
    with ExitStack() as stack:
        up.folder.write_info(RunInfo("run", "table", str(TABLE), 0, "", "tcp/127.0.0.1:1"))
        assert up._connect(stack) is None, "the run file is that of a supervisor before, this one is only starting"
    pid = up._launcher.children[SUPERVISOR].process.pid
    up.folder.write_info(RunInfo("run", "table", str(TABLE), pid, "", "tcp/127.0.0.1:1"))
    supervisor, seconds = up._launcher.children[SUPERVISOR], count(0.0)
    monkeypatch.setattr(up, "_time_of", lambda child: next(seconds))
    with ExitStack() as stack:
        for _ in range(5):
            up._end_stalled_supervisor(supervisor)
            assert supervisor.exit_code is None and not supervisor.killed
            assert up._connect(stack) is None, "it lives: the run goes on, and another attempt follows"
        up._end_stalled_supervisor(supervisor)
    assert supervisor.killed == "it could not be connected to for 5 s (deadlines.start)"
    up._launcher.kill()
    up._launcher.close()


def test_a_capture_that_was_cut_off_is_named_with_the_command_that_completes_it(tmp_path: Path) -> None:
    capture, journals = tmp_path / "run.mcap", tmp_path / "journals"
    capture.write_bytes(b"\x89MCAP0\r\n")
    assert capture_lines(capture, {"recording": NOT_RECORDED}, journals) == [
        f"capture {capture} (unfinished)",
        f"complete it with: foosim capture recover {capture} --journals {journals}",
    ]
    assert capture_lines(capture, None, journals) == [f"capture {capture} (unfinished)"], "the run can be resumed"


def test_a_run_that_was_told_to_end_is_given_time_as_long_as_its_supervisor_says_that_it_closes_its_capture(
    launched: Launched,
) -> None:
    up, said = launched()
    up._launch(SUPERVISOR, ["sleep", "100"])
    recording = {**NOT_RECORDED, "state": "closing", "offered": 9, "written": 4, "bytes": 1_000_000}
    told = {"state": "ended", "begun": True, "recoveries": [], "processes": {}, "starts": {}, "recording": recording}
    closing = SimpleNamespace(status=lambda timeout_s, give_up: told)
    up._has_begun = up._has_ended = up._end_requested = True
    up._interrupts, up._ending_s = 1, time.monotonic() - END_S - 1
    assert not up._continues(), "it would be cut off"
    up._show(closing)  # type: ignore[arg-type]
    assert up._continues() and said.getvalue() == "closing the capture: 5 rows are left, 1.0 MB are written\n"


@pytest.mark.parametrize(
    ("state", "stopped", "lost"), [("running", False, True), ("running", True, False), ("ended", False, False)]
)
def test_a_player_that_ends_with_exit_code_0_while_the_run_goes_on_is_lost_at_once(
    launched: Launched, monkeypatch: pytest.MonkeyPatch, state: str, stopped: bool, lost: bool
) -> None:
    up, _ = launched()
    up._launch(SUPERVISOR, ["sleep", "100"])
    up._launch("player-red", ["sh", "-c", "exit 0"])
    up._launcher.children["player-red"].process.wait()
    told = {"state": state, "begun": True, "recoveries": [], "starts": {}, "recording": NOT_RECORDED}
    told["processes"] = {"player-red": {"stopped": stopped}}
    monkeypatch.setattr(up.display, "show", lambda status, now_s: None)
    monkeypatch.setattr(up._stalled_watch, "look", lambda *about: {})
    up._show(SimpleNamespace(status=lambda timeout_s, give_up: told))  # type: ignore[arg-type]
    up._continues()
    up._continues()
    assert bool(up._ending_s) == lost
    up._launcher.stop()
    reason = "lost player-red: it ended with exit code 0"
    ended = "lost supervisor: it was killed by up: the run is over"
    assert up._outcome().result["reason"] == (reason if lost else ended)


class Fails(Up):
    """A run whose supervisor has ended before the vHub was told how to go on."""

    def _start(self) -> bool:
        ends = "trap 'echo was told to end; exit 1' TERM; echo ready; while true; do sleep 0.01; done"
        self._launch(VHUB, ["sh", "-c", ends])
        while "ready" not in self.folder.log(VHUB).read_text():
            time.sleep(0.001)
        self._launch(SUPERVISOR, ["sh", "-c", "exit 3"])
        self._launcher.children[SUPERVISOR].process.wait()
        return False


def test_where_the_run_can_be_resumed_nobody_is_told_to_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Who is told so finishes what it has; who is killed leaves it as it is."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    up = Fails(make_plan(RunOptions(TABLE, processes="each")), None, Display(io.StringIO()), "run")
    assert up.run().failed
    assert up.folder.log(VHUB).read_text() == "ready\n"

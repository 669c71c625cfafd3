"""What a rehearsal shows while it runs, a player that does not return, and a Ctrl-C."""

from __future__ import annotations

import ctypes
import json
import re
import signal
import threading
from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar, Final

import pytest
from typer.testing import CliRunner

from foosim.capture.reader import open_capture
from foosim.cli import rehearse as rehearse_command
from foosim.cli.capture.command import app as replay_app
from foosim.cli.rehearse import app
from foosim.client.player import Commands, Player, Samples
from foosim.common.errors import Refused
from foosim.common.units import Pace
from foosim.deployment.schema import Deployment
from foosim.runtime.disk import free_bytes
from foosim.simulation import attendant
from foosim.simulation.attendant import INTERRUPTS_MAX, LOOK_S, STOOD_S, Onlooker
from foosim.simulation.run import rehearse
from foosim.simulation.settings import AtWork
from foosim.supervisor.core import SupervisorCore
from foosim.supervisor.settings import RunSettings
from tests.turns import BY_PERIOD

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
HANGS_AT: Final = 30
SETS: Final = (
    "engine=pure",
    "substeps=1",
    *BY_PERIOD,
    "players.player-red.class=tests.simulation.test_attendant:Hangs",
)


def looks_on() -> tuple[Onlooker, SupervisorCore]:
    run = RunSettings("run", TABLE.name, TABLE.read_text(), Pace("fast"), 10_000)
    core = SupervisorCore(run, bytes(32), 0)
    return Onlooker(core.state, 0.0), core


def test_a_line_each_second_tells_time_speed_score_and_who_is_waited_for() -> None:
    onlooker, core = looks_on()
    lines = []
    for look in range(1, 101):  # five seconds
        core.state.frame.tick = 10 * look
        name = "n1" if look % 4 else "player-red"
        lines.append(onlooker.look(look * LOOK_S, AtWork(name, turns=look)))
    assert [at for at, line in enumerate(lines, 1) if line] == [20, 40, 60, 80, 100]
    world = "red 0 : 0 blue, ball at +0.000 +0.000 +0.018 m"
    assert lines[39] == f"0.80 s of 20.00 s simulated, 0.40x, {world}, waits for n1 (75 %)"


def test_a_player_is_overdue_by_the_time_of_one_turn_in_which_this_process_ran() -> None:
    onlooker, _ = looks_on()
    now_s, acts = 0.0, AtWork("player-red", 105, acts=True, turns=7)

    def hangs(seconds: float, every_s: float = LOOK_S) -> str:
        nonlocal now_s
        for _ in range(round(seconds / every_s)):
            now_s += every_s
            onlooker.look(now_s, acts)
        return onlooker.overdue(acts)

    assert hangs(9.9) == ""
    assert hangs(0.2) == "player-red has not answered tick 105 for 10 s (deadlines.lockstep_fast)"
    acts.turns += 1
    assert onlooker.overdue(acts) == "" and hangs(9.9) == "", "another turn has its own time"
    acts.turns += 1
    assert hangs(600.0, every_s=60.0) == "", "this process was stopped: ten looks at it"
    assert hangs(10.0 - 9 * STOOD_S - LOOK_S) == "" and hangs(2 * LOOK_S) != ""
    acts.acts = False
    assert onlooker.overdue(acts) == "", "a node takes as long as it takes"
    acts.turns, acts.acts, acts.tick = 20, True, -1
    assert hangs(59.9) == ""
    assert hangs(0.2) == "player-red has not joined for 60 s (deadlines.start)"


class Hangs(Player):
    """A player that does not return from one tick."""

    how: ClassVar[Any]
    hangs: ClassVar[bool] = False

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        pass

    def act(self, tick: int, samples: Samples) -> Commands:
        if tick == HANGS_AT:
            Hangs.hangs = True
            try:
                Hangs.how()
            finally:
                Hangs.hangs = False
        return {}


@pytest.fixture
def only_hanging_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    """The attendant's clock goes on while the player hangs alone: no machine is too slow for the ticks before."""
    now_s = 0.0

    def monotonic() -> float:
        nonlocal now_s
        now_s += STOOD_S if Hangs.hangs else 0.0
        return now_s

    monkeypatch.setattr(attendant, "time", SimpleNamespace(monotonic=monotonic))


def rehearsed(*options: str) -> Any:
    return CliRunner().invoke(app, [str(TABLE), *options, *(word for setting in SETS for word in ("--set", setting))])


def test_the_command_shows_lines_of_progress(monkeypatch: pytest.MonkeyPatch) -> None:
    lines: list[str] = []
    shown = threading.Event()

    def note(line: str) -> None:
        lines.append(line)
        shown.set()

    monkeypatch.setattr(rehearse_command, "_note", note)
    monkeypatch.setattr(attendant, "LINE_S", 0.0)
    Hangs.how = shown.wait
    assert rehearsed("--for", "0.1 s").exit_code == 0
    what = r"0\.\d\d s of 0\.10 s simulated, [0-9.]+x, red 0 : 0 blue, ball at [-+.0-9 ]+ m, waits for "
    assert all(re.match(what, line) for line in lines)


def loops() -> None:
    """A loop in Python."""
    while True:
        try:
            raise KeyError("never")
        except KeyError:
            continue


@pytest.mark.usefixtures("only_hanging_counts")
@pytest.mark.parametrize("how", [loops, threading.Event().wait], ids=["loops", "waits"])
def test_a_player_that_hangs_ends_the_run_in_order(how: Any, tmp_path: Path) -> None:
    Hangs.how, capture = how, tmp_path / "run.mcap"
    ran = rehearsed("--for", "0.2 s", "--json", "--capture", str(capture), "--set", "deadlines.lockstep_fast=0.2 s")
    reason = f"player-red has not answered tick {HANGS_AT} for 0.2 s (deadlines.lockstep_fast)"
    result = json.loads(ran.stdout)
    assert (ran.exit_code, result["reason"], result["ticks"]) == (1, reason, HANGS_AT + 1)
    assert "in act" in ran.stderr and "Hangs.how()" in ran.stderr, "the stack where it hangs"
    assert f"reason: {reason}" in CliRunner().invoke(replay_app, ["info", str(capture)]).stdout


def test_a_rehearsal_that_has_failed_says_why_and_where_its_capture_is(tmp_path: Path) -> None:
    Hangs.how, capture = {}.popitem, tmp_path / "run.mcap"
    ran = rehearsed("--for", "0.2 s", "--capture", str(capture))
    failed, where = ran.stdout.splitlines()[-2:]
    assert failed.startswith(f"the rehearsal has failed: player-red failed at tick {HANGS_AT}: KeyError: ")
    assert (ran.exit_code, where) == (1, f"capture {capture}")


def test_a_capture_without_room_is_refused_before_the_rehearsal_begins(tmp_path: Path) -> None:
    ran = rehearsed("--for", "0.2 s", "--capture", str(tmp_path / "run.mcap"), "--set", "capture.reserve=1000 TiB")
    assert isinstance(ran.exception, Refused) and "the reserve is 1000 TiB" in str(ran.exception)
    assert not list(tmp_path.iterdir())
    low = f"capture.reserve={int(0.7 * free_bytes(tmp_path))} B"
    ran = rehearsed("--for", "2 ms", "--capture", str(tmp_path / "run.mcap"), "--set", low)
    assert ran.exit_code == 0 and ran.stderr.startswith("warning: room gets little, at the reserve the run ends: ")


@pytest.mark.usefixtures("only_hanging_counts")
def test_one_that_cannot_be_interrupted_is_given_up(capfd: pytest.CaptureFixture[str]) -> None:
    """A mutex that is locked twice is waited for in C, whatever signals come."""
    library, mutex = ctypes.CDLL(None), ctypes.create_string_buffer(64)

    def locks_twice() -> None:
        library.pthread_mutex_lock(mutex)
        library.pthread_mutex_lock(mutex)

    given_up: list[dict[str, Any]] = []

    def stuck(result: dict[str, Any]) -> None:
        given_up.append(result)
        library.pthread_mutex_unlock(mutex)

    Hangs.how = locks_twice
    sets = (*SETS, "deadlines.lockstep_fast=0.1 s")
    run = rehearse(TABLE.read_text(), TABLE.name, 60, 1, sets, on_stuck=stuck).json
    (result,) = given_up
    reason = f"player-red has not answered tick {HANGS_AT} for 0.1 s (deadlines.lockstep_fast)"
    assert (result["reason"], result["failed"], result["ticks"]) == (reason, True, HANGS_AT + 1)
    assert "locks_twice" in capfd.readouterr().err, f"after {INTERRUPTS_MAX} interrupts its stack is shown"
    assert run["reason"] == reason, "by the interrupts that waited for it"


def test_a_ctrl_c_ends_in_order_and_the_last_line_says_how_far_it_came(tmp_path: Path) -> None:
    Hangs.how, capture = lambda: signal.raise_signal(signal.SIGINT), tmp_path / "run.mcap"
    ran = rehearsed("--for", "60 s", "--json", "--capture", str(capture))
    result = json.loads(ran.stdout)
    assert (ran.exit_code, result["reason"]) == (0, "stopped") and HANGS_AT < result["ticks"] < HANGS_AT + 10
    assert "a second Ctrl-C ends it at once" in ran.stderr
    last = f"interrupted at {result['ticks'] * 0.002:.2f} s of 60.00 s, capture {capture}"
    assert ran.stderr.splitlines()[-1] == last


def test_a_second_ctrl_c_ends_it_at_once(tmp_path: Path) -> None:
    def twice() -> None:
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)

    Hangs.how, capture = twice, tmp_path / "run.mcap"
    ran = rehearsed("--for", "60 s", "--capture", str(capture))
    assert ran.exit_code == 130 or isinstance(ran.exception, KeyboardInterrupt) or "Aborted" in ran.stderr
    assert f"interrupted at 0.06 s of 60.00 s, capture {capture} (unfinished)" in ran.stderr
    assert not open_capture(capture).about.finished

"""What the launcher does with processes that end early, again and again, and with those that somebody asks for."""

from __future__ import annotations

import io
from contextlib import ExitStack
from pathlib import Path
from typing import Final

import pytest

from foosim.protocol.channels import SUPERVISOR
from foosim.protocol.session import ConnectError
from foosim.supervisor import control
from foosim.supervisor.display import Display
from foosim.supervisor.launcher import Child
from foosim.supervisor.plan import RunOptions, make_plan
from foosim.supervisor.restarts import WAITS_S
from foosim.supervisor.run_folder import RunInfo
from foosim.supervisor.up import Up

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"


def test_a_node_that_was_given_up_is_started_when_somebody_asks_for_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    said = io.StringIO()
    up = Up(make_plan(RunOptions(TABLE)), None, Display(said), "run")
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
        f"red ended with exit code 1, is given up; foosim-supervisor start red tries it again; its log is "
        f"{up.folder.log('red')}\n"
    )
    up._start_wanted({"red": 1, "blue": 1})
    assert ends() == 8, "once for the word, and once again after the first wait"
    up._start_wanted({"red": 1, "blue": 1})
    assert ends() == 9, "a word is heard once"
    assert said.getvalue().count("starts again in 0.5 s") == 2
    up._launcher.close()


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
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ends: str, has_begun: bool, starts: int, ends_run: bool
) -> None:
    """Before the first tick one that something else has ended is started again; one that is refused never is."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    said = io.StringIO()
    up = Up(make_plan(RunOptions(TABLE)), None, Display(said), "run")
    (tmp_path / "node").write_text(f'#!/bin/sh\necho started >>"$0.log"\n{ends}\n')
    (tmp_path / "node").chmod(0o755)
    up._launch("red", [str(tmp_path / "node")])
    up._has_begun = has_begun
    up._launcher.children["red"].process.wait()
    assert up._ends_run(up._launcher.children["red"]) == ends_run
    for now_s in (0.0, 1.0, 1.0):
        up._restart_ended(now_s, knows=True)
        up._launcher.children["red"].process.wait()
    assert (tmp_path / "node.log").read_text().count("started") == starts
    is_given_up = has_begun and ends == "exit 3"
    assert ("is given up; foosim-supervisor start red tries it again" in said.getvalue()) == is_given_up
    up._launcher.close()


def test_a_supervisor_that_ends_before_the_launcher_connects_has_ended_in_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    up = Up(make_plan(RunOptions(TABLE)), None, Display(io.StringIO()), "run")
    up._launch(SUPERVISOR, ["true"])
    supervisor = up._launcher.children[SUPERVISOR]
    up.folder.write_info(RunInfo("run", "table", str(TABLE), supervisor.process.pid, "", "tcp/127.0.0.1:1"))
    supervisor.process.wait()
    with ExitStack() as stack:
        assert up._connect(stack) is None
    up._watch()
    up._launcher.close()


def test_a_supervisor_that_runs_and_lets_nobody_in_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.setattr(control, "CONNECT_S", 0.0)
    up = Up(make_plan(RunOptions(TABLE)), None, Display(io.StringIO()), "run")
    up._launch(SUPERVISOR, ["sleep", "100"])
    with ExitStack() as stack:
        up.folder.write_info(RunInfo("run", "table", str(TABLE), 0, "", "tcp/127.0.0.1:1"))
        assert up._connect(stack) is None, "the run file is that of a supervisor before, this one is only starting"
    pid = up._launcher.children[SUPERVISOR].process.pid
    up.folder.write_info(RunInfo("run", "table", str(TABLE), pid, "", "tcp/127.0.0.1:1"))
    with ExitStack() as stack, pytest.raises(ConnectError, match="no router answers at"):
        up._connect(stack)
    up._launcher.kill()
    up._launcher.close()

"""How children are ended that do not end by themselves: a player writes to its log first where it hangs."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from foosim.launcher.processes import Child, Launcher

HANGS = """
import signal
from foosim.runtime.process import end_with_stack
end_with_stack()
signal.signal(signal.SIGTERM, signal.SIG_IGN)
def hangs():
    print("ready", flush=True)
    while True:
        signal.pause()
hangs()
"""


@pytest.mark.parametrize(
    "end", [lambda _, child: child.kill("it hangs"), lambda launcher, _: launcher.stop(0.0)], ids=["killed", "stopped"]
)
def test_a_player_that_hangs_shows_where_before_it_is_killed(
    end: Callable[[Launcher, Child], None], tmp_path: Path
) -> None:
    launcher, log = Launcher(), tmp_path / "player-red.log"
    with log.open("wb") as file:
        process = subprocess.Popen([sys.executable, "-c", HANGS], stdout=subprocess.PIPE, stderr=file, process_group=0)
    assert process.stdout is not None and process.stdout.readline() == b"ready\n"
    child = launcher.children["player-red"] = Child(
        "player-red",
        (
            "foosim",
            "role",
            "player",
        ),
        log,
        process,
    )
    end(launcher, child)
    assert process.wait() == -signal.SIGUSR1
    assert "in hangs\n" in log.read_text()
    process.stdout.close()
    launcher.close()

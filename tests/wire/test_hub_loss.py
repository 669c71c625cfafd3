"""A real vHub that is killed where it cannot go on, and where its capture has just been created."""

from __future__ import annotations

import re
import signal
from typing import TYPE_CHECKING, Final

import pytest

from foosim.capture.reader import open_capture
from tests.wire.conftest import LONG, NO_CAPTURE_TO_CLOSE, in_process
from tests.wire.test_run import NODES, last_json

if TYPE_CHECKING:
    from tests.wire.conftest import House


def test_a_run_whose_vhub_cannot_go_on_ends_in_order_and_says_why(house: House) -> None:
    """Its journal cannot be read any more: however often it was started again, it would not come back.

    Its end is shown with its log, whether the launcher sees it, and starts another one, before it sees the run's end.
    """
    up = house.up("--json", *NO_CAPTURE_TO_CLOSE, *in_process("null", "vhub"), *in_process("main", *NODES))
    house.ticking(5)
    for journal in house.live().journals.glob("vhub-*.journal"):
        journal.write_bytes(b"nothing of a journal")
    house.kill("vhub")
    code, out, err = house.end(up)
    assert code == 1, err
    content = last_json(out)
    assert content["failed"] and content["reason"].startswith("lost vhub: it cannot go on: ")
    assert "vhub-000001.journal: no journal of this version" in content["reason"]
    assert err.count("vhub was killed by SIGKILL, not by foosim, starts again") == 1 and "is given up" not in err
    assert re.search(r"vhub ended with exit code 1(, starts again)?; its log is \S+/vhub\.log\n", err), err


TRAP: Final = """
import os, signal, sys
is_near = False

def trap(event, arguments):
    global is_near
    if is_near and event != "os.kill" and os.path.lexists("run.mcap"):
        os.kill(os.getpid(), signal.SIGKILL)
    is_near = is_near or event == "open" and str(arguments[0]) == "run.mcap"

sys.addaudithook(trap)
"""
"""Python reads this at its start: it ends the process at whatever it does first when the capture has been created."""


def test_a_vhub_that_is_killed_when_it_has_created_its_capture_goes_on_with_it(
    house: House, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = ["--set", "players={}", "--set", "engine=pure", "--set", "nodes={red: {robots: ['*']}}"]
    run += ["--for", "20 ms", "--pace", "fast", "--set", LONG]
    supervisor = house.start("foosim", "run", house.table, *run)
    connect = ["--connect", house.wait_for("the run file", house.live().info).simulation]
    hub = ["foosim", "role", "vhub", *connect, "--capture", "run.mcap", "--run-folder", str(house.folder / "hub")]
    (house.folder / "sitecustomize.py").write_text(TRAP)
    with monkeypatch.context() as trapped:
        trapped.setenv("PYTHONPATH", str(house.folder))
        code, _, err = house.run(*hub)
    capture = house.folder / "run.mcap"
    assert code == -signal.SIGKILL and capture.exists(), err
    again = house.start(*hub)
    for process in (supervisor, again, house.start("foosim", "role", "node", "--name", "red", *connect)):
        code, _, err = house.end(process)
        assert code == 0, err
    assert open_capture(capture).about.finished and open_capture(capture).ticks.tolist() == list(range(11))

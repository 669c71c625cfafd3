"""A real supervisor that is killed and has no launcher: the others end, and all that are started again go on."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Final

from foosim.capture.reader import open_capture
from foosim.runtime.run_folder import open_run
from foosim.simulation.run import rehearse
from foosim.vhub.recording.recovery import recover_capture
from tests.wire.conftest import LONG

if TYPE_CHECKING:
    import subprocess

    from tests.wire.conftest import House


ONE_NODE: Final = "nodes={red: {robots: ['*']}}"
"""Where each process is started by hand, and a node is as good as two."""


def test_who_is_left_alone_holds_and_ends(house: House) -> None:
    """Without a launcher nobody starts the supervisor again. The run has not ended: the vHub leaves its capture as a
    kill would. It can be recovered, and the run goes on with it as soon as all are started again."""
    run = ["--set", "players={}", "--set", "engine=pure", "--set", ONE_NODE, "--set", LONG]
    run += ["--set", "deadlines.orphan=1 s"]
    supervisor = house.start("foosim", "run", house.table, *run)
    info = house.wait_for("the run file", house.live().info)
    connect = ["--connect", info.simulation]
    capture = house.folder / "alone.mcap"
    hub = ("--capture", capture, "--run-folder", house.folder / "hub")

    def start_others(*connect: str) -> list[subprocess.Popen[str]]:
        return [
            house.start("foosim", "role", "node", "--name", "red", *connect),
            house.start("foosim", "role", "vhub", *connect, *hub),
        ]

    others = start_others(*connect)
    house.ticking(5)
    supervisor.kill()
    for other in others:
        code, _, err = house.end(other)
        assert code == 1 and "lost the supervisor, and it has not come back" in err, err
    assert f"leaves its capture {capture} unfinished: a restarted vHub can resume it" in err
    assert not open_capture(capture).about.finished
    copy = Path(shutil.copy(capture, house.folder / "copy.mcap"))
    recovered = recover_capture(copy, house.folder / "hub" / "journals")
    assert recovered is not None and recovered.is_whole and recovered.tick >= 5, "its journal is there, and fits"
    other_file = [*run[:-1], "deadlines.orphan=2 s", "--run", info.run]
    code, _, err = house.run("foosim", "run", house.table, *other_file)
    assert code == 3 and f"run {info.run} was started with another deployment" in err
    again = house.start("foosim", "run", house.table, *run, "--run", info.run)
    others = start_others("--connect", house.wait_for("the run file", house.live().info).simulation)
    house.ticking(recovered.tick + 50)
    assert house.ask("foosim", "down")[0] == 0
    for process in (again, *others):
        code, _, err = house.end(process)
        assert code == 0, err
    result = open_run(info.run).result()
    assert result is not None and result["reason"] == "stopped" and result["ticks"] >= recovered.tick + 50
    sets = ["players={}", "engine=pure", ONE_NODE]
    same = rehearse(house.table.read_text(), "table.yaml", result["ticks"], None, sets).json
    assert result["digest"] == same["digest"] and result["packets"] == same["packets"]
    whole = open_capture(capture)
    assert whole.about.finished and whole.ticks.tolist() == list(range(result["ticks"] + 1))
    code, _, err = house.run("foosim", "run", house.table, *run, "--run", info.run)
    assert code == 3 and f"run {info.run} has ended" in err

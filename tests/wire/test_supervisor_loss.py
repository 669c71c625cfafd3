"""A real supervisor that is killed or hangs: another one goes on, and the world is the one that would have been."""

from __future__ import annotations

import shutil
import signal
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from foosim.capture.reader import open_capture
from foosim.client.asking import answer_to, ask
from foosim.client.control import Control
from foosim.common.json_text import encode_json
from foosim.protocol import channels
from foosim.protocol.codec import encode
from foosim.protocol.messages import Request
from foosim.runtime.run_folder import open_run
from foosim.simulation.run import rehearse
from foosim.vhub.recording.recovery import recover_capture
from tests.wire.conftest import LIMIT_S, LONG, in_process
from tests.wire.test_run import last_json

if TYPE_CHECKING:
    import subprocess

    from tests.wire.conftest import House


ONE_NODE: Final = "nodes={red: {robots: ['*']}}"
"""Where each process is started by hand, and a node is as good as two."""


def is_back(control: Control, times: int) -> dict[str, Any] | None:
    """The status, once so many supervisors have taken over."""
    status = control.status()
    came = sum(entry["what"] == "supervisor" for entry in status["recoveries"])
    return status if came >= times and status["state"] != "recovering" else None


def test_a_run_survives_a_supervisor_that_is_killed_and_one_that_hangs(house: House) -> None:
    alone = *in_process("null", "supervisor"), *in_process("main", "nodes.blue")
    up = house.up("--json", "--engine", "pure", *alone, players=True)
    house.ticking(5)
    with Control(house.info().simulation) as control:
        house.kill("supervisor")
        house.wait_for("the supervisor to be back", lambda: is_back(control, 1))
        moved = control.ask("move", robot="red.goal", node="blue")
        house.kill("supervisor", signal.SIGSTOP)
        status = house.wait_for("another supervisor", lambda: is_back(control, 2))
        assert "red.goal" in status["nodes"]["blue"]["owned"]
        paused = control.ask("pause")
        house.kill("supervisor")
        status = house.wait_for("a third supervisor", lambda: is_back(control, 3))
        assert status["state"] == "paused"
        house.wait_for("what was released", lambda: control.status()["ticks"] == paused.tick)
        for answer in (moved, paused):  # the same request, the same answer, by whoever gives it
            again = encode(Request(answer.sender, answer.id, "status", encode_json({})))
            take = answer_to(channels.ANSWER, answer.id)
            wire, inbox = control._wire, control._inbox
            assert ask(wire, inbox, channels.REQUEST, answer.sender, again, take, LIMIT_S) == answer
        control.ask("resume")
        house.ticking(paused.tick + 100)
        control.ask("down")
    code, out, err = house.end(up)
    assert code == 0, err
    content = last_json(out)
    back = [entry for entry in content["recoveries"] if entry["what"] == "supervisor"]
    assert len(back) == 3 and all(entry["outage_ms"] > 0 for entry in back)
    assert err.count("the supervisor was started again") == 3
    (log,) = (house.folder / "state" / "foosim" / "runs").glob("*/logs/red.log")
    told = [log.read_text().count(text) for text in ("lost the supervisor: waits", "the supervisor is back")]
    assert told == [3, 3]
    assert content["reason"] == "stopped" and content["moves"] == 1
    assert open_capture(house.folder / content["capture"]).about.finished
    assert house.processes_with(str(house.folder)) == {}
    same = rehearse(house.table.read_text(), "table.yaml", content["ticks"], None, ["engine=pure"]).json
    assert content["digest"] == same["digest"] and content["packets"] == same["packets"]
    assert content["handovers"] == same["handovers"]


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


def test_a_supervisor_that_is_started_again_by_hand_goes_on(house: House) -> None:
    run = ["--set", "players={}", "--set", "engine=pure", "--set", ONE_NODE, "--set", LONG]
    run += ["--for", "2 s", "--pace", "fast"]
    first = house.start("foosim", "run", house.table, *run)
    info = house.wait_for("the run file", house.live().info)
    connect = ["--connect", info.simulation]
    others = [house.start("foosim", "role", "node", "--name", "red", *connect)]
    others.append(house.start("foosim", "role", "vhub", *connect, "--no-capture", "--run-folder", house.folder / "hub"))
    house.ticking(5)
    first.kill()
    again = house.start("foosim", "run", house.table, *run, "--run", info.run)
    code, _, err = house.end(again)
    assert code == 0, err
    for other in others:
        assert house.end(other)[0] == 0
    result = open_run(info.run).result()
    assert result is not None and result["ticks"] == 1000
    same = rehearse(house.table.read_text(), "table.yaml", 1000, None, ["players={}", "engine=pure", ONE_NODE]).json
    assert result["digest"] == same["digest"]
    code, _, err = house.run("foosim", "run", house.table, *run, "--run", info.run)
    assert code == 3 and f"run {info.run} has ended" in err

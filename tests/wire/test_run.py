"""A run of real processes through the commands: it ends in order, whoever ends it, and says who was lost."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from itertools import chain
from typing import TYPE_CHECKING, Any, Final

import pytest

from foosim.capture.reader import open_capture
from foosim.capture.rows import PacketRow
from foosim.client import control
from foosim.client.control import Control, RequestRefused
from foosim.deployment.loader import load_deployment
from foosim.library.table.settings import LINE_NAMES, TEAMS
from foosim.protocol import channels
from foosim.protocol.codec import decode
from foosim.protocol.messages import Commit
from foosim.runtime.roles.standstill import CLOSED
from foosim.runtime.transport.inbox import Inbox
from foosim.simulation.verify import verify_capture
from foosim.world.frame import frame_from_bytes
from foosim.world.layout import build_layout
from tests.wire.conftest import LIMIT_S, LONG, NO_CAPTURE_TO_CLOSE, in_process

if TYPE_CHECKING:
    from tests.wire.conftest import House

NODES: Final = ("nodes.red", "nodes.blue")


def last_json(out: str) -> dict[str, Any]:
    """The object in the last line."""
    content = json.loads(out.splitlines()[-1])
    assert isinstance(content, dict)
    return content


def assert_finished(house: House, content: dict[str, Any]) -> None:
    """The capture that a result names is finished and has the run's last frame."""
    about = open_capture(house.folder / content["capture"]).about
    assert about.finished
    assert about.end["reason"] == content["reason"]


def test_a_run_goes_on_whatever_is_asked_wrongly_and_dies_with_its_launcher(house: House) -> None:
    """It listens where it is told, the radio plane one port higher; its processes stand in groups of their own."""
    port = free_port()
    up = house.up("--listen", f"127.0.0.1:{port}", "--set", "clients={}", each=True)
    info = house.info()
    assert info.simulation.endswith(f":{port}")
    assert info.radio.endswith(f":{port + 1}")
    before = house.ticking(5)["ticks"]
    lines = house.processes_with(f"--connect run:{info.run}")
    assert any("foosim role node --name red --connect" in line for line in lines.values()), lines
    assert any("foosim role vhub --connect" in line for line in lines.values()), lines
    pids = [info.pid, *lines]
    assert all(os.getpgid(pid) == pid for pid in pids)
    logs = {path.name for path in house.live().logs.iterdir()}
    assert logs == {"supervisor.log", "vhub.log", "red.log", "blue.log"}
    assert_wrong_names_are_refused_with_the_nearest_one(house)
    assert_a_node_of_another_world_is_refused(house, info.simulation)
    assert_a_viewer_sees_and_cannot_touch()
    status = house.ticking(before + 1)
    assert (status["state"], status["epoch"]) == ("running", 1)
    up.kill()
    house.wait_for("the end of the children", lambda: not any(os.path.exists(f"/proc/{pid}/exe") for pid in pids))


def assert_wrong_names_are_refused_with_the_nearest_one(house: House) -> None:
    robots = ", ".join(sorted(["camera", *(f"{team}.{line}" for team in TEAMS for line in LINE_NAMES)]))
    refused = (3, "", f"no robot 'red.gaol'; there are {robots}, nearest is red.goal\n")
    assert house.ask("foosim", "move", "red.gaol", "blue") == refused
    code, _, err = house.ask("foosim", "status", "--run", "tabel")
    assert code == 1 and "no run 'tabel'" in err
    with pytest.raises(RequestRefused, match="no node 'green'; there are blue, red"):
        control.request("move", robot="red.goal", node="green")


def assert_a_viewer_sees_and_cannot_touch() -> None:
    inbox = Inbox(100)
    with control.connect(role="viewer") as viewer:
        described = viewer.describe()
        viewer.view(inbox)
        assert viewer.request("watch", hz=50).accepted
        deployment = load_deployment(described["deployment"], described["deployment_name"])
        assert viewer.files(deployment) == {}, "this world has none"
        key, _, payload = inbox.take(LIMIT_S)[0]
        shown = decode(Commit, payload)
        frame = frame_from_bytes(shown.tick, build_layout(deployment), shown.values, shown.outboxes)
        assert key == channels.VIEW.key and frame.digest == shown.digest
        with pytest.raises(RequestRefused, match="'down' is for operators: a viewer may request status, "):
            viewer.request("down")


def assert_a_node_of_another_world_is_refused(house: House, address: str) -> None:
    code, _, err = house.run("foosim", "role", "node", "--name", "red", "--connect", address, "--world", "chess")
    assert code == 3 and "refused by the supervisor: world chess, this is table" in err


def test_ctrl_c_before_the_supervisor_listens_ends_it_in_order(house: House) -> None:
    up = house.up("--json", *in_process("main", "nodes.red"))
    house.read_until(up.stderr, "run table-")
    up.send_signal(signal.SIGINT)
    code, out, err = house.end(up)
    assert (code, last_json(out)["reason"]) == (0, "stopped"), err
    assert house.processes_with(str(house.folder)) == {}


def test_a_second_ctrl_c_kills_everything(house: House) -> None:
    up = house.up("--pace", "fast", *in_process("null", "vhub"), *in_process("main", *NODES))
    house.ticking()
    info = house.info()
    house.kill("vhub", signal.SIGSTOP)  # so that the run cannot end in order
    up.send_signal(signal.SIGINT)
    house.read_until(up.stdout, "a second Ctrl-C kills it")
    up.send_signal(signal.SIGINT)
    code, _, err = house.end(up)
    (capture,) = (house.folder / "captures").iterdir()
    assert (code, err) == (130, f"killed\ncapture captures/{capture.name} (unfinished)\n")
    assert house.processes_with(f"run:{info.run}") == {}


TRIPS = """
from pathlib import Path

from foosim.library.table.players.football import Team

class Trips(Team):
    def __init__(self, deployment, parameters):
        super().__init__(deployment, {"team": "red"})
        self.wire = Path(parameters["wire"])

    def act(self, tick, samples):
        if self.wire.exists():
            raise SystemExit(0) from LookupError("tripped")
        return super().act(tick, samples)
"""


def test_a_player_that_is_killed_plays_again_and_one_that_raises_ends_the_run(
    house: House, monkeypatch: pytest.MonkeyPatch
) -> None:
    (house.folder / "own_trips.py").write_text(TRIPS)
    monkeypatch.setenv("PYTHONPATH", str(house.folder))
    wire = house.folder / "wire"
    player = f"players.player-red.parameters={{team: red, wire: {wire}}}"
    own = "--set", "players.player-red.class=own_trips:Trips", "--set", player
    alone = in_process("null", "players.player-red", "players.player-blue"), in_process("main", *NODES)
    up = house.up("--json", "--pace", "fast", *own, *chain(*alone), players=True)
    house.ticking(50)
    house.kill("player-blue")
    entry = house.wait_for("a player that is back", lambda: next(iter(house.ticking()["recoveries"]), None))
    assert (entry["what"], entry["name"]) == ("player", "player-blue") and entry["reason"].startswith(CLOSED)
    house.ticking(entry["tick"] + 50)
    wire.touch()
    code, out, err = house.end(up)
    content = last_json(out)
    raised = next(at for at, line in enumerate(TRIPS.splitlines(), 1) if "raise" in line)
    place = f"(own_trips.py:{raised})"
    said, _, where = content["reason"].partition(": SystemExit: 0 ")
    assert (code, content["failed"], where) == (1, True, place), err
    assert err.count(content["reason"]) == 1, "a failure is printed once"
    assert said.startswith("player-red failed at tick ") and content["reason"] in err
    assert "player-blue was killed by SIGKILL" in err and "restarts in 0.5 s" in err
    (run,) = (house.folder / "state" / "foosim" / "runs").iterdir()
    log = (run / "logs" / "player-red.log").read_text()
    assert "Traceback (most recent call last):" in log and "LookupError: tripped" in log
    assert log.count(content["reason"]) == 1
    assert verify_capture(house.folder / content["capture"]).equal


NO_HUB = """
import os, sys

if "vhub" in sys.orig_argv:
    print("no licence here", file=sys.stderr, flush=True)
    os._exit(1)
"""
"""What every Python reads at its start."""


def test_a_child_that_the_supervisor_never_knew_fails_the_run(house: House, monkeypatch: pytest.MonkeyPatch) -> None:
    (house.folder / "sitecustomize.py").write_text(NO_HUB)
    monkeypatch.setenv("PYTHONPATH", str(house.folder))
    alone = in_process("null", "vhub"), in_process("main", *NODES)
    code, out, err = house.end(house.up("--json", *NO_CAPTURE_TO_CLOSE, *chain(*alone)))
    content = last_json(out)
    assert code == 1
    assert (content["reason"], content["failed"]) == ("lost vhub: it ended with exit code 1", True)
    assert "the run has ended: lost vhub: it ended with exit code 1\n" in err
    assert "the log of vhub is " in err and "\n    no licence here\n" in err


def test_a_vhub_that_cannot_open_its_capture_is_gone_at_once(house: House) -> None:
    (house.folder / "file").touch()
    run = house.start("foosim", "run", house.table, "--set", LONG, *NO_CAPTURE_TO_CLOSE, "--run", "mine")
    info = house.wait_for("the run file", house.live().info)
    code, _, err = house.run("foosim", "role", "vhub", "--connect", info.simulation, "--capture", "file/run.mcap")
    assert code == 3 and "file/run.mcap: cannot be created" in err
    assert "; the run has not started, and waits" in house.read_until(run.stderr, f"lost the vHub: {CLOSED}")
    run.send_signal(signal.SIGTERM)
    code, _, err = house.end(run)
    assert code == 0 and "run ends at tick 0: stopped" in err


COUNTED: Final = """
import os
from foosim.runtime.roles.loop import Loop

go_round, rounds = Loop.go_round, 0
file = os.open(os.path.join(os.path.dirname(__file__), f"{os.getpid()}.rounds"), os.O_CREAT | os.O_WRONLY)

def counted(loop):
    global rounds
    rounds += 1
    os.pwrite(file, b"%020d" % rounds, 0)
    go_round(loop)

Loop.go_round = counted
"""
"""Python reads this at its start: each process writes down how often its loop has gone round."""
ROUNDS_PER_S: Final = 100


def test_what_a_person_asks_takes_effect_at_the_tick_that_the_answer_names(
    house: House, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A Ctrl-C then ends the run in order."""
    (house.folder / "sitecustomize.py").write_text(COUNTED)
    with monkeypatch.context() as counted:
        counted.setenv("PYTHONPATH", str(house.folder))
        up = house.up("--json", "--capture", "run.mcap", players=True)
    house.ticking(50)
    cut, healed = cut_and_healed(house)
    assert_top_shows_it(house)
    code, out, _ = house.ask("foosim", "pause", "--json")
    paused = json.loads(out)
    assert (code, paused["text"]) == (0, f"paused at tick {paused['tick']}")
    tick = paused["tick"]
    with control.connect() as asked:
        assert_paused_at(house, asked, tick)
        assert_it_sleeps(house)
        assert asked.request("step", count=10).tick == tick
        assert_paused_at(house, asked, tick + 10)
        assert_the_world_changes_as_asked(house, asked, tick + 10)
        assert asked.request("rate", pace="fast").accepted
        resumed = asked.request("resume")
        assert resumed.text == f"resumed at tick {resumed.tick}"
        house.wait_for("ticks", lambda: asked.status()["ticks"] > resumed.tick)
        assert asked.status()["pace"] == "fast"
        house.wait_for("its load", lambda: asked.status()["processes"]["supervisor"]["busy"] > 0.0)
    up.send_signal(signal.SIGINT)
    code, out, err = house.end(up)
    assert code == 0, err
    content = last_json(out)
    assert (content["reason"], content["failed"], content["moves"]) == ("stopped", False, 1)
    assert_finished(house, content)
    assert_packets_were_cut(house, cut, healed)


def cut_and_healed(house: House) -> tuple[int, int]:
    """A partition by `foosim net` and its heal: the ticks at which they take effect."""
    code, out, err = house.ask("foosim", "net", "partition", "player-red", "rest", "--json")
    assert code == 0, err
    cut = json.loads(out)["tick"]
    assert house.ask("foosim", "net", "partition", "player-rde", "rest") == (
        3,
        "",
        "partition[0][0]: a selector that matches no endpoint, 'player-rde', nearest is 'player-red'\n",
    )
    house.ticking(cut + 20)
    code, out, err = house.ask("foosim", "net", "heal", "--json")
    healed = json.loads(out)["tick"]
    assert (code, json.loads(out)["text"]) == (0, f"heal all, at tick {healed}")
    status = house.ticking(healed + 20)
    assert [told["tick"] for told in status["disruptions"]["last"]] == [cut, healed]
    return cut, healed


def assert_top_shows_it(house: House) -> None:
    top = house.start("foosim", "net", "top")
    first = house.read_until(top.stdout, "· tick ")
    line = house.read_until(top.stdout, "camera to player-red")
    assert "links" in first and "partition" in line and "/s, offered" in line
    top.send_signal(signal.SIGINT)
    assert house.end(top)[0] == 0


def assert_packets_were_cut(house: House, cut: int, healed: int) -> None:
    """The capture has what the partition cost, and `explain` knows why."""
    capture = open_capture(house.folder / "run.mcap")
    rows = [row for row in capture.rows("/packets") if isinstance(row, PacketRow)]
    lost = [row for row in rows if row.cause == "partition" and row.arrival_tick < 0]
    ticks = {row.sent_ns // capture.deployment.tick_ns for row in lost}
    assert ticks and min(ticks) >= cut and max(ticks) < healed
    one = next(row for row in lost if row.source == "camera")
    code, out, err = house.ask("foosim", "net", "explain", "run.mcap", f"camera:{one.sequence}:player-red")
    assert code == 0, err
    assert "policy        at sending cut by request 0, from " in out and ": partition\n" in out
    assert out.endswith("dropped at sending: partition (policy)\n")


def assert_it_sleeps(house: House) -> None:
    """No process looks round busily: a loop goes round for messages and deadlines, which come some 10 times a second.

    Rounds are counted by the clock of these deadlines, so that a slow machine makes them fewer, never more.
    """
    info, red = house.info(), house.pid_of("red")
    pids = [info.pid, *house.processes_with(f"--connect run:{info.run}")]
    assert len(pids) == 3, "main, with supervisor, vHub and players, and the nodes"

    def rounds(pid: int) -> int:
        return int((house.folder / f"{pid}.rounds").read_bytes())

    begun_s, before = time.monotonic(), {pid: rounds(pid) for pid in pids}
    house.wait_for("rounds of a node", lambda: rounds(red) >= before[red] + 40)
    gone = {pid: rounds(pid) - before[pid] for pid in pids}
    assert max(gone.values()) <= ROUNDS_PER_S * (time.monotonic() - begun_s), gone


def assert_paused_at(house: House, asked: Control, tick: int) -> None:
    """What is released is computed, and no more."""
    house.wait_for(f"tick {tick}", lambda: asked.status()["ticks"] == tick)
    status = asked.status()
    assert (status["state"], status["ticks"], status["released"]) == ("paused", tick, tick)


def assert_the_world_changes_as_asked(house: House, asked: Control, tick: int) -> None:
    """Push, add, move and remove, each at the first tick that is not yet released."""
    at_rest = asked.status()["ball"]["position"]
    assert asked.request("push", impulse=(0.02, 0.01, 0.0)).tick == tick
    assert asked.request("add", name="ball", at="0.15,0.1").text == f"ball-2 added at tick {tick}"
    moved = asked.request("move", robot="red.goal", node="blue")
    assert moved.text == f"red.goal moved to blue at tick {tick}"
    asked.request("step", count=30)
    assert_paused_at(house, asked, tick + 30)
    assert asked.status()["ball"]["position"] != at_rest
    assert "red.goal" in asked.status()["nodes"]["blue"]["owned"]
    with pytest.raises(RequestRefused, match="ball is always in the world"):
        asked.request("remove", name="ball")
    assert asked.request("remove", name="ball-2").tick == tick + 30
    asked.request("step", count=5)
    assert_paused_at(house, asked, tick + 35)
    with pytest.raises(RequestRefused, match="no free body 'ball-2'; there are ball"):
        asked.request("push", impulse=(0.0, 0.0, 0.0), name="ball-2")


def altered_node(house: House, change: str, name: str, address: str) -> tuple[int, str]:
    """A node of which something was changed before it starts; return its exit code and errors."""
    program = f"{change}; from foosim.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", program, "role", "node", "--name", name, "--connect", address],
        cwd=house.folder,
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
    )
    return done.returncode, done.stderr


def test_a_run_waits_for_what_is_started_by_hand_and_ends_in_order_when_a_required_node_is_lost(house: House) -> None:
    by_hand = ("nodes.blue.launch=manual", "players.player-blue.launch=manual", "players.player-blue.process=null")
    up = house.up("--json", *(f"--set={one}" for one in (*by_hand, "nodes.red.required=true")), players=True)
    line = house.read_until(up.stderr, "waiting for node blue; start it on its machine: ")
    command = line.split(": ", 1)[1].split()
    assert command[:6] == ["foosim", "role", "node", "--name", "blue", "--connect"]
    line = house.read_until(up.stderr, "waiting for player player-blue; start it in a terminal of its own: ")
    player = house.start(*line.split(": ", 1)[1].split())
    house.wait_for("the others", lambda: control.status()["waiting_for"] == "blue")
    other_cpu = "from foosim.node import main; main.library_fingerprint = lambda: bytes(32)"
    code, err = altered_node(house, other_cpu, "blue", command[6])
    assert code == 3 and "arithmetic fingerprint 0000000000000000, this is " in err
    blue = house.start(*command)
    house.ticking(5)
    house.kill("red")
    code, _, err = house.end(player)
    assert code == 0, err
    code, _, log = house.end(blue)
    assert code == 0, log
    code, out, err = house.end(up)
    assert code == 1 and f"the run has ended: lost red: {CLOSED}" in err, err
    content = last_json(out)
    assert content["reason"].startswith(f"lost red: {CLOSED}")
    assert content["failed"]
    for line in (f"takes part in run {content['run']}\n", f"the run has ended at tick {content['ticks']}: lost red: "):
        assert f" INFO    blue: {line}" in log, "a node that was started by hand says what it does"
    (run,) = (house.folder / "state" / "foosim" / "runs").iterdir()
    journals = {path.name for path in (run / "journals").iterdir()}
    assert journals >= {"supervisor-000001.journal", "vhub-000001.journal"}
    assert_finished(house, content)
    assert house.processes_with(str(house.folder)) == {}


DOZES: Final = """
import time
from msgspec import Struct
from foosim.world.component_types.quantities import Metres
from foosim.world.components.base import Sensor
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings


class Nothing(Struct, frozen=True):
    x: Metres


@sensor("dozes", SensorSettings, Nothing)
class Dozes(Sensor):
    def __init__(self, settings, at):
        pass

    def sample(self, view):
        if view.tick == 10:
            time.sleep(1.0)
        return Nothing(0.0)
"""


def test_a_component_that_hangs_is_named_with_its_node(house: House, monkeypatch: pytest.MonkeyPatch) -> None:
    (house.folder / "dozes.py").write_text(DOZES.replace("sleep(1.0)", "sleep(1000.0)"))
    monkeypatch.setenv("PYTHONPATH", str(house.folder))
    own = "robots.red.goal.sensors.dozes={kind: 'dozes:Dozes', rate: 100 Hz}"
    up = house.up(
        *("--json", "--set", own, "--set", "engine=pure", "--set", "on_node_loss=stop"),
        *("--set", "deadlines.tick_named=1 s", "--set", "deadlines.tick_lost=3 s", "--for", "60 ms", "--no-capture"),
        *in_process("main", "nodes.blue"),
    )
    code, out, err = house.end(up)
    assert code == 1, (out, err)
    assert re.search("^lost red: tick 10 is overdue by .* s$", last_json(out)["reason"]), (out, err)
    assert re.search(r"^red was killed by .* at dozes\.py:\d+ in sample; its log is ", err, re.MULTILINE), (out, err)


FACTOR: Final = "FACTOR = {}\n"
SCALED: Final = DOZES.replace("import time", "import time, factor").replace("Nothing(0.0)", "Nothing(factor.FACTOR)")


def test_a_node_with_another_source_of_a_form_is_refused(house: House, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a module that the component's own module imports; the node with the same source takes part."""
    other = house.folder / "other"
    other.mkdir()
    for folder, number in ((house.folder, 1.0), (other, 2.0)):
        (folder / "scaled.py").write_text(SCALED.replace("view.tick == 10", "False"))
        (folder / "factor.py").write_text(FACTOR.format(number))
    monkeypatch.setenv("PYTHONPATH", str(house.folder))
    own = "robots.red.goal.sensors.own={kind: 'scaled:Dozes', rate: 100 Hz}"
    up = house.up(
        *("--json", "--set", own, "--set", "engine=pure", "--set", "nodes.blue.launch=manual"),
        *("--for", "60 ms", "--no-capture"),
        *in_process("main", "nodes.red"),
    )
    line = house.read_until(up.stderr, "waiting for node blue; start it on its machine: ")
    command = line.split(": ", 1)[1].split()
    code, err = altered_node(house, f"import sys; sys.path.insert(0, {str(other)!r})", "blue", command[6])
    assert code == 3 and "sensor scaled:Dozes has version " in err and "install the same on all machines" in err, err
    assert house.end(house.start(*command))[0] == 0
    assert house.end(up)[0] == 0


def free_port() -> int:
    """A port that was free a moment ago, and whose next one was."""
    with socket.socket() as one, socket.socket() as other:
        one.bind(("127.0.0.1", 0))
        port = int(one.getsockname()[1])
        try:
            other.bind(("127.0.0.1", port + 1))
        except OSError:
            return free_port()
        return port

"""A real vHub that is killed: it comes back, and players, clients, frames and capture are those of a run without it."""

from __future__ import annotations

import re
import signal
from contextlib import suppress
from functools import partial
from itertools import chain
from typing import TYPE_CHECKING, Final

import pytest

from foosim.capture.reader import open_capture
from foosim.client.client import connect
from foosim.client.control import Control
from foosim.client.errors import RunEnded
from foosim.deployment.loader import load_deployment
from foosim.runtime.roles.standstill import CLOSED
from foosim.simulation.run import rehearse
from tests.wire.conftest import LIMIT_S, LONG, NO_CAPTURE_TO_CLOSE, in_process
from tests.wire.test_run import NODES, last_json
from tests.wire.test_same_bytes import PLAYERS, scribes

if TYPE_CHECKING:
    from foosim.client.client import Client
    from tests.wire.conftest import House

SETS = (
    "engine=pure",
    "clients={ear: {lockstep: false}, mouth: {lockstep: false}}",
    "network.links=[]",
    "table.rules.kickoff_delay=20 ms",
)


WITH_PLAYERS: Final = ("players.player-red", "players.player-blue")


class Talk:
    """Two free-running clients, and what the one that listens has heard."""

    def __init__(self, ear: Client, mouth: Client) -> None:
        self.ear, self.mouth = ear, mouth
        self.balls: list[int] = []
        self.words: list[int] = []
        self.said = 0

    def talk(self) -> bool:
        """The one sends a number to the other, which takes what has come."""
        self.said += 1
        self.mouth.send("ear", "talk", b"%d" % self.said)
        self.mouth.receive(0.001)
        for packet in self.ear.receive(0.02):
            if packet.source == "mouth":
                self.words.append(int(packet.payload))
            else:
                self.balls.append(packet.sequence)
        return True

    def assert_all_came_once(self, house: House) -> None:
        """Each word and each sample of the camera has come once, in order."""
        assert self.words == list(range(self.words[0], self.words[0] + len(self.words)))
        deployment = load_deployment(house.table.read_text(), "table.yaml")
        period = deployment.ticks(deployment.robots["camera"].sensors["ball"].rate_hz)
        ticks = [sequence >> 16 for sequence in self.balls]
        assert ticks == list(range(ticks[0], ticks[0] + period * len(ticks), period))

    def heard(self, words: int) -> bool:
        """Talk; whether so many words were heard."""
        return self.talk() and len(self.words) >= words

    def until_the_end(self) -> None:
        """Talk until the run is over."""
        with suppress(RunEnded):
            while True:
                self.talk()


def recovered(control: Control, times: int) -> bool:
    """Whether the run went on so often after a loss."""
    return sum(entry["outage_ms"] is not None for entry in control.status()["recoveries"]) >= times


def test_a_vhub_is_killed_twice_and_everything_is_as_if_it_was_not(
    house: House, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(PLAYERS))
    monkeypatch.syspath_prepend(str(PLAYERS))
    written, again = house.folder / "written", house.folder / "again"
    written.mkdir()
    again.mkdir()
    sets = [word for setting in (*SETS, *scribes(written)) for word in ("--set", setting)]
    apart = in_process("null", "vhub"), in_process("main", *NODES), in_process("players", *WITH_PLAYERS)
    up = house.up("--json", *sets, *chain(*apart), players=True)
    info = house.info()
    with (
        Control(info.simulation) as control,
        connect(info.radio, "ear", timeout_s=LIMIT_S) as ear,
        connect(info.radio, "mouth", timeout_s=LIMIT_S) as mouth,
    ):
        talk = Talk(ear, mouth)
        ear.listen([("camera", "ball")])
        mouth.listen()
        house.wait_for("words", lambda: talk.heard(5))
        for kill in (1, 2):
            house.kill("vhub")
            house.wait_for("the vHub to come back", partial(lambda n: talk.talk() and recovered(control, n), kill))
            house.wait_for("more words", partial(talk.heard, len(talk.words) + 5))
        house.wait_for("the last word", partial(talk.heard, len(talk.words) + mouth.statistics().sent - talk.words[-1]))
        assert ear.statistics().returns == mouth.statistics().returns == 2
        control.request("down")
        talk.until_the_end()
        assert ear.statistics().missing == 0
    code, out, err = house.end(up)
    assert code == 0, err
    content = last_json(out)
    told = [(entry["what"], entry["name"], entry["reason"].partition(":")[0]) for entry in content["recoveries"]]
    assert told == [("vhub", "vhub", CLOSED)] * 2 and err.count("lost the vHub") == 2
    assert content["reason"] == "stopped" and not content["failed"]
    talk.assert_all_came_once(house)

    same = rehearse(house.table.read_text(), "table.yaml", content["ticks"], None, [*SETS, *scribes(again)]).json
    assert content["digest"] == same["digest"]
    for name in ("red.txt", "blue.txt"):
        assert (written / name).read_text() == (again / name).read_text(), "each player was told everything once"
    path = house.folder / content["capture"]
    capture = open_capture(path)
    assert capture.about.finished
    assert [*path.parent.iterdir()] == [path], "the end has joined the files of the three processes"
    assert [tick.tick for tick in capture.captured_ticks()] == list(range(content["ticks"] + 1))
    packets = capture.packets
    keys = list(zip(packets.source, packets.sequence, packets.destination, packets.copy, strict=True))
    assert len(keys) == len(set(keys)) == content["packets"]["offered"], "each packet has one fate"
    recording = content["recording"]
    assert recording["offered"] == recording["written"] >= len(capture.ticks) + len(packets), "of all three processes"
    assert recording["bytes"] == path.stat().st_size
    assert house.processes_with(str(house.folder)) == {}


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
    assert content["failed"] and content["reason"].startswith("lost vhub: it cannot continue: ")
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

"""A run of real processes with certificates: it lets in whom it should.

Nodes, supervisor and vHub that are killed, hang or are stopped come back, and the world is the one without that.
"""

import signal
from pathlib import Path

from foosim.capture.reader import open_capture
from foosim.client import control
from foosim.client.client import connect
from foosim.client.control import Control
from foosim.launcher import pki
from foosim.runtime.roles.standstill import CLOSED
from foosim.runtime.transport.certificates import operator_credentials
from foosim.simulation.run import rehearse
from tests.wire.conftest import LIMIT_S, House, in_process
from tests.wire.test_run import last_json

CLIENTS = ("--set", "clients={hand: {}}", "--set", "players={}")


def certificates(folder: Path) -> Path:
    """Certificates for the table's processes, an operator and a client."""
    pki.init(folder)
    pki.issue(folder, ["supervisor", "vhub", "node.red", "node.blue", "client.hand", "operator.admin"])
    return folder


def test_a_run_with_certificates_lets_in_who_is_known(house: House) -> None:
    folder = certificates(house.folder / "certs")
    stranger = house.folder / "stranger"
    pki.init(stranger)
    pki.issue(stranger, ["node.red"])
    beside = in_process("main", "nodes.blue")
    running = house.up("--pki", folder, "--engine", "pure", "--no-capture", *CLIENTS, *beside)
    house.ticking()
    info = house.info()
    assert info.simulation.startswith("tls/127.0.0.1:") and info.radio.startswith("tls/127.0.0.1:")
    assert control.request("push", impulse=(0.01, 0.0, 0.0)).accepted, "the run file has the operator's certificate"
    with connect(info.radio, "hand", pki=folder, timeout_s=LIMIT_S) as client:
        client.subscribe("camera", "ball")
        client.listen()
        assert client.receive(LIMIT_S)
    node = ("foosim", "role", "node", "--connect", info.simulation)
    code, _, error = house.run(*node, "--name", "red", "--pki", stranger)
    assert code == 3 and "its certificate is not accepted here" in error, (code, error)
    code, _, error = house.run(*node, "--name", "red")
    assert code == 2 and "needs certificates: give their folder by --pki DIR" in error
    code, _, error = house.ask(*node, "--name", "green", "--pki", folder)
    assert code == 3 and "has no certificate of node.green; it has: client.hand, node.blue" in error
    control.request("down")
    code, output, _ = house.end(running)
    assert code == 0, output


def went_on(desk: Control, *what: str, times: int = 1) -> bool:
    """Whether all of this was lost or came so often, and the run went on each time."""
    entries = desk.status()["recoveries"]
    told = [(entry["what"], entry["name"]) for entry in entries if entry["outage_ms"] is not None]
    return all(told.count((kind, name)) >= times for kind, name in map(str.split, what))


def test_a_run_survives_kills_and_one_that_hangs_and_is_the_run_without(house: House) -> None:
    """A node, the supervisor (the router of one plane) and the vHub (that of the other): all dial and listen anew, with
    certificates. The world is the one that would have been."""
    folder = certificates(house.folder / "certs")
    pki.issue(folder, ["client.player-red", "client.player-blue"])
    apart = (
        *in_process("null", "supervisor", "vhub"),
        *in_process("players", "players.player-red", "players.player-blue"),
    )
    up = house.up("--json", "--engine", "pure", "--pki", folder, *apart, players=True)
    house.ticking(5)
    with Control(house.info().simulation, operator_credentials(folder)) as desk:
        house.kill("red")
        house.wait_for("red to come back", lambda: went_on(desk, "node red", "join red"))
        house.kill("supervisor")
        house.wait_for("another supervisor", lambda: went_on(desk, "supervisor supervisor"))
        house.kill("vhub")
        house.wait_for("the vHub to come back", lambda: went_on(desk, "vhub vhub"))
        house.kill("blue", signal.SIGSTOP)
        house.wait_for("blue to come back", lambda: went_on(desk, "node blue", "join blue"))
        house.kill("red")
        house.wait_for("red to come back again", lambda: went_on(desk, "node red", "join red", times=2))
        assert_it_is_stopped_and_started_from_another_terminal(house, desk)
        house.ticking(desk.status()["ticks"] + 20)
        last = desk.request("down").tick
    code, output, error = house.end(up)
    assert code == 0, error
    content = last_json(output)
    assert (content["ticks"], content["reason"], content["failed"]) == (last, "stopped", False)
    told = [(entry["what"], entry["name"]) for entry in content["recoveries"]]
    red, blue = ([("node", name), ("join", name)] for name in ("red", "blue"))
    assert told == [*red, ("supervisor", "supervisor"), ("vhub", "vhub"), *blue, *red, ("join", "red")]
    assert f"lost node red ({CLOSED}" in error
    assert error.count("blue does not answer any more: it is killed") == 1, "not the one that is started then"
    same = rehearse(house.table.read_text(), "table.yaml", content["ticks"], None, ["engine=pure"]).json
    assert content["digest"] == same["digest"] and content["packets"] == same["packets"]
    capture = house.folder / content["capture"]
    assert open_capture(capture).about.finished
    assert str(folder).encode() not in capture.read_bytes(), "where secrets are is nobody's business"
    assert house.processes_with(str(house.folder)) == {}


def assert_it_is_stopped_and_started_from_another_terminal(house: House, desk: Control) -> None:
    code, out, err = house.ask("foosim", "stop", "red")
    assert (code, err) == (0, "") and out.startswith("red stopped at tick "), err
    red = f"--name red --connect run:{house.info().run}"  # and no other run's on this machine
    house.wait_for("red to be gone", lambda: not house.processes_with(red))
    status = desk.status()
    assert status["processes"]["red"]["stopped"] and status["nodes"]["red"]["owned"] == []
    code, _, err = house.ask("foosim", "start", "red")
    assert code == 0, err
    house.wait_for("red to come back", lambda: went_on(desk, "join red", times=3))
    assert desk.status()["nodes"]["red"]["owned"] != []
    assert house.ask("foosim", "stop", "rde")[0] == 3

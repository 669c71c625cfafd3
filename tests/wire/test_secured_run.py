"""A run of real processes with certificates: it is the run that it is without them, and lets in whom it should."""

import json
from pathlib import Path

from foosim.client.client import connect
from foosim.protocol.certificates import operator_credentials
from foosim.rehearsal.rehearse import rehearse
from foosim.supervisor import control, pki
from foosim.supervisor.control import Control
from foosim.vhub.capture_reader import open_capture
from tests.wire.conftest import House

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
    running = house.up("--pki", folder, "--no-capture", *CLIENTS)
    house.ticking()
    info = house.info()
    assert info.simulation.startswith("tls/127.0.0.1:") and info.radio.startswith("tls/127.0.0.1:")
    assert control.push((0.01, 0.0, 0.0)).accepted, "the operator's certificate is found by the run file"
    with connect(info.radio, "hand", pki=folder) as client:
        client.subscribe("camera", "ball")
        client.listen()
        assert client.receive(100.0)
    code, _, error = house.run("foosim-node", "--name", "red", "--connect", info.simulation, "--pki", stranger)
    assert code == 3 and "its certificate is not accepted here" in error
    code, _, error = house.run("foosim-node", "--name", "red", "--connect", info.simulation)
    assert code == 2 and "needs certificates: say where they are by --pki DIR" in error
    code, _, error = house.run("foosim-node", "--name", "green", "--connect", info.simulation, "--pki", folder)
    assert code == 3 and "has no certificate of node.green; it has: client.hand, node.blue" in error
    control.down()
    code, output, _ = house.end(running)
    assert code == 0, output


def went_on(desk: Control, *what: str) -> bool:
    """Whether all of this was lost or came, and the run went on each time."""
    entries = desk.status()["recoveries"]
    told = [(entry["what"], entry["name"]) for entry in entries if entry["outage_ms"] is not None]
    return all(tuple(each.split()) in told for each in what)


def test_a_run_with_certificates_survives_kills_and_is_the_run_without(house: House) -> None:
    """A node, the supervisor (the router of one plane) and the vHub (that of the other): all dial and listen anew."""
    folder = certificates(house.folder / "certs")
    pki.issue(folder, ["client.player-red", "client.player-blue"])
    up = house.up("--json", "--engine", "pure", "--pki", folder, players=True)
    house.ticking(5)
    with Control(house.info().simulation, operator_credentials(folder)) as desk:
        house.kill("red")
        house.wait_for("red to come back", lambda: went_on(desk, "node red", "join red"))
        house.kill("supervisor")
        house.wait_for("another supervisor", lambda: went_on(desk, "supervisor supervisor"))
        house.kill("vhub")
        house.wait_for("the vHub to come back", lambda: went_on(desk, "vhub vhub"))
        house.ticking(desk.status()["ticks"] + 20)
        desk.ask("down")
    code, output, error = house.end(up)
    assert code == 0, error
    content = json.loads(output.splitlines()[-1])
    told = [(entry["what"], entry["name"]) for entry in content["recoveries"]]
    assert told == [("node", "red"), ("join", "red"), ("supervisor", "supervisor"), ("vhub", "vhub")]
    same = rehearse(house.table.read_text(), "table.yaml", content["ticks"], None, ["engine=pure"]).json
    assert content["digest"] == same["digest"] and content["packets"] == same["packets"]
    capture = house.folder / content["capture"]
    assert open_capture(capture).about.finished
    assert str(folder).encode() not in capture.read_bytes(), "where secrets are is nobody's business"
    assert house.processes_with(str(house.folder)) == {}

"""A run of real processes with certificates: it is the run that it is without them, and lets in whom it should."""

import json
from pathlib import Path

from foosim.client.client import connect
from foosim.protocol.deployment_file import apply_sets, read_deployment_text
from foosim.protocol.units import parse_pace
from foosim.rehearsal.rehearse import rehearse
from foosim.supervisor import control, pki
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


def test_certificates_change_nothing_in_the_world(house: House) -> None:
    folder = certificates(house.folder / "certs")
    pki.issue(folder, ["client.player-red", "client.player-blue"])
    short = ("--pace", "fast", "--for", "200ms", "--set", "engine=pure", "--json", "--pki", folder)
    code, output, error = house.end(house.up(*short, players=True))
    assert code == 0, error
    content = json.loads(output.splitlines()[-1])
    text = apply_sets(read_deployment_text(house.table), "table.yaml", ["engine=pure"])
    rehearsed = rehearse(text, "table.yaml", 100, nodes=None, pace=parse_pace("fast")).json
    for same in ("digest", "packets", "nodes"):
        assert content[same] == rehearsed[same], same
    capture = (house.folder / content["capture"]).read_bytes()
    assert str(folder).encode() not in capture, "where secrets are is nobody's business"

"""Roles that share processes: the same bytes in every shape, and what a killed process takes with it comes back."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final

import pytest

from foosim.capture.reader import open_capture
from foosim.common.units import parse_pace
from foosim.launcher import pki as certificates
from foosim.simulation.run import rehearse
from foosim.simulation.verify import verify_capture
from tests.apart import apart
from tests.simulation.test_verify import messages_of
from tests.wire.conftest import ONE, in_process
from tests.wire.test_run import last_json

if TYPE_CHECKING:
    from tests.wire.conftest import House

TICKS: Final = 150
PLAYERS: Final = ("players.player-red", "players.player-blue")
SHAPES: Final = {
    "one": ONE,
    "vhub and a node, players and a node": (
        *in_process("main", "vhub", "nodes.red"),
        *in_process("other", *PLAYERS, "nodes.blue"),
    ),
}


@pytest.fixture(autouse=True)
def table(house: House) -> None:
    """Each role has its own process, and the tests put some together."""
    house.table = house.folder / "table.yaml"
    house.table.write_text(apart())


@pytest.mark.parametrize("name", SHAPES)
def test_a_run_with_certificates_has_the_same_bytes_in_every_shape(house: House, name: str) -> None:
    """The supervisor's needs none for its nodes and players; another one's has the grants of all its roles."""
    folder = house.folder / "certs"
    who = ["supervisor", "vhub", "operator.admin"]
    if name != "one":
        who += ["process.main", "node.blue", "client.player-red", "client.player-blue"]
    certificates.init(folder)
    certificates.issue(folder, who)
    run = ["--pace", "fast", "--for", "300 ms", "--json", "--set", "capture.frames_every=1 tick", *SHAPES[name]]
    code, out, err = house.end(house.up("--pki", folder, *run, players=True))
    assert code == 0, err
    content, capture = last_json(out), house.folder / "run.mcap"
    text, fast = house.table.read_text(), parse_pace("fast")
    same = rehearse(text, "table.yaml", TICKS, None, ["capture.frames_every=1 tick"], pace=fast, capture=capture).json
    for key in ("digest", "packets", "nodes", "handovers", "score"):
        assert content[key] == same[key], key
    found, expected = messages_of(house.folder / content["capture"]), messages_of(capture)
    for topic in sorted(expected):
        assert found[topic] == expected[topic], topic
    assert house.processes_with(str(house.folder)) == {}


KILLED: Final = {
    "supervisor and a node": ("supervisor", "nodes.red"),
    "vhub and a node": ("vhub", "nodes.red"),
}
OTHERS: Final = ("nodes.blue", *PLAYERS)


def killed(house: House, process: str, *arguments: str) -> dict[str, Any]:
    """Kill a process of a run, let the run go on, and end it; return its result."""
    up = house.up("--json", "--engine", "pure", *arguments, players=True)
    ticks = house.ticking(5)["ticks"]
    code, _, err = house.ask("foosim", "stop", "red")
    assert code == 3 and re.search(rf"red shares process {process} with .*: it cannot be stopped alone", err)
    house.kill(process)
    house.ticking(ticks + 50)
    assert house.ask("foosim", "down")[0] == 0
    code, out, err = house.end(up)
    assert code == 0, err
    assert f"{process} was killed by SIGKILL, not by foosim, " in err
    assert house.processes_with(str(house.folder)) == {}
    return last_json(out)


@pytest.mark.parametrize("name", KILLED)
def test_a_process_without_players_that_is_killed_comes_back_to_the_same_world(house: House, name: str) -> None:
    others = (role for role in OTHERS if role not in KILLED[name])
    content = killed(house, "main", *in_process("main", *KILLED[name]), *in_process("other", *others))
    assert content["recoveries"], "the run has an account of it"
    same = rehearse(house.table.read_text(), "table.yaml", content["ticks"], None, ["engine=pure"]).json
    assert content["digest"] == same["digest"] and content["packets"] == same["packets"]
    assert open_capture(house.folder / content["capture"]).about.finished


def test_a_process_with_all_roles_that_is_killed_goes_on_with_players_of_new_memory(house: House) -> None:
    content = killed(house, "one", *ONE)
    assert "supervisor" in {entry["what"] for entry in content["recoveries"]}
    players = {entry["name"] for entry in content["recoveries"] if entry["what"] == "player"}
    assert players == {"player-blue", "player-red"}
    assert verify_capture(house.folder / content["capture"], 1).equal


def test_a_process_without_its_certificate_is_refused_before_anything_starts(house: House) -> None:
    folder = house.folder / "certs"
    certificates.init(folder)
    certificates.issue(folder, ["supervisor", "vhub", "node.red", "node.blue", "operator.admin"])
    code, _, err = house.end(house.up("--pki", folder, *in_process("main", "vhub", "nodes.red")))
    assert code == 3 and "has no certificate of process.main; it has: node.blue, node.red, operator.admin" in err

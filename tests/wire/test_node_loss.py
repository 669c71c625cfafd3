"""Real nodes that are killed or hang: they come back, and the world is the one that would have been."""

from __future__ import annotations

import signal
from typing import TYPE_CHECKING

from foosim.rehearsal.rehearse import rehearse
from foosim.supervisor.control import Control
from foosim.vhub.capture_reader import open_capture
from tests.wire.test_run import last_json

if TYPE_CHECKING:
    from tests.wire.conftest import House


def came(control: Control, name: str, times: int) -> bool:
    """Whether a node has come to a running world that often."""
    told = control.status()["recoveries"]
    return bool(sum(entry["what"] == "join" and entry["name"] == name for entry in told) >= times)


def test_a_run_survives_nodes_that_are_killed_and_one_that_hangs(house: House) -> None:
    up = house.up("--json", "--engine", "pure", players=True)
    house.ticking(5)
    with Control(house.info().simulation) as control:
        house.kill("red")
        house.wait_for("red to come back", lambda: came(control, "red", 1))
        house.kill("blue", signal.SIGSTOP)
        house.wait_for("blue to come back", lambda: came(control, "blue", 1))
        house.kill("red")
        house.wait_for("red to come back again", lambda: came(control, "red", 2))
        control.ask("down")
    code, out, err = house.end(up)
    assert code == 0, err
    content = last_json(out)
    told = [(entry["what"], entry["name"]) for entry in content["recoveries"]]
    assert told == [(what, name) for name in ("red", "blue", "red") for what in ("node", "join")]
    assert "lost node red (its connection closed)" in err
    assert err.count("blue does not answer any more: it is killed") == 1, "not the one that is started then"
    assert content["reason"] == "stopped" and not content["failed"]
    about = open_capture(house.folder / content["capture"]).about
    assert about.finished
    assert house.processes_with(str(house.folder)) == {}
    same = rehearse(house.table.read_text(), "table.yaml", content["ticks"], None, ["engine=pure"]).json
    assert content["digest"] == same["digest"] and content["packets"] == same["packets"]


def test_a_node_is_stopped_and_started_from_another_terminal(house: House) -> None:
    up = house.up("--json")
    house.ticking(5)
    code, out, err = house.ask("foosim-supervisor", "stop", "red")
    assert (code, err) == (0, "") and out.startswith("red stopped at tick "), err
    with Control(house.info().simulation) as control:
        red = f"--name red --connect {house.info().simulation}"  # and no other run's on this machine
        house.wait_for("red to be gone", lambda: not house.processes_with(red))
        status = control.status()
        assert status["processes"]["red"]["stopped"] and status["nodes"]["red"]["owned"] == []
        assert house.run("foosim-supervisor", "start", "red")[0] == 0
        house.wait_for("red to come back", lambda: came(control, "red", 1))
        assert control.status()["nodes"]["red"]["owned"] != []
    assert house.ask("foosim-supervisor", "stop", "rde")[0] == 3
    assert house.ask("foosim-supervisor", "down")[0] == 0
    code, out, err = house.end(up)
    assert code == 0 and last_json(out)["reason"] == "stopped", err

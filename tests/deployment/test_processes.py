"""Which roles of a run share a process, in each shape, and what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from foosim.common.errors import BadValue
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.processes import SHAPES, joint_processes, parse_shape, processes_of
from foosim.deployment.schema import Deployment
from tests.apart import apart

DEPLOY = Path(__file__).parents[2] / "deploy"


def deployed(*sets: str, file: str = "table.yaml") -> Deployment:
    text = apart() if file == "table.yaml" else (DEPLOY / file).read_text()
    return load_deployment(apply_sets(text, file, sets), file)


def roles(deployment: Deployment, shape: str) -> dict[str, tuple[str, ...]]:
    return {name: process.roles for name, process in processes_of(deployment, parse_shape(shape)).items()}


def test_each_role_has_a_process_of_its_own() -> None:
    found = roles(deployed("nodes.red.process=main", "supervisor.process=main"), "each")
    names = ["supervisor", "vhub", "blue", "red", "player-blue", "player-red"]
    assert list(found) == names and found == {name: (name,) for name in names}


def test_players_that_share_a_process_do_so_in_each_shape() -> None:
    sets = ("players.player-red.process=teams", "players.player-blue.process=teams")
    assert roles(deployed(*sets), "each")["teams"] == ("player-blue", "player-red")


def test_one_has_all_roles_of_a_machine_but_for_nodes_that_are_started_by_hand() -> None:
    assert roles(deployed(), "one") == {
        "one": ("vhub", "supervisor", "blue", "red", "player-blue", "player-red"),
    }
    assert roles(deployed("nodes.red.launch=manual"), "one") == {
        "one": ("vhub", "supervisor", "blue", "player-blue", "player-red"),
        "red": ("red",),
    }


def test_one_has_a_process_for_each_host() -> None:
    sets = (
        "hosts.left={address: 10.0.0.2}",
        "hosts.right={address: 10.0.0.3}",
        "nodes.red.host=left",
        "vhub.host=left",
    )
    found = roles(deployed(*sets, "nodes.blue.host=right"), "one")
    assert found == {
        "supervisor": ("supervisor",),
        "one-left": ("vhub", "red"),
        "blue": ("blue",),
        "one-players": ("player-blue", "player-red"),
    }


def test_the_deployment_says_which_roles_share() -> None:
    sets = ("supervisor.process=main", "vhub.process=main", "players.player-red.process=main")
    found = roles(deployed(*sets), "deployed")
    assert found["main"] == ("vhub", "supervisor", "player-red") and next(iter(found)) == "main"
    assert found["red"] == ("red",) and found["player-blue"] == ("player-blue",)


def test_processes_that_connect_with_several_roles_have_an_identity() -> None:
    sets = (
        "hosts.left={address: 10.0.0.2}",
        "nodes.red.host=left",
        "nodes.blue.host=left",
        "players.player-red.host=left",
    )
    assert list(joint_processes(deployed(*sets))) == ["one-left"]
    sets = ("vhub.process=hub", "nodes.red.process=hub", "supervisor.process=main", "nodes.blue.process=main")
    assert list(joint_processes(deployed(*sets))) == ["hub"], "the supervisor's connects to none"


def test_a_player_that_a_person_starts_has_a_process_of_its_own_in_each_shape() -> None:
    deployment = deployed("players.player-red.launch=manual")
    assert deployment.launch_of("player-red") == "manual" and deployment.launch_of("player-blue") == "local"
    for shape in SHAPES:
        assert ("player-red",) in roles(deployment, shape).values(), shape


def test_an_unknown_shape_is_refused_with_the_known_ones() -> None:
    with pytest.raises(BadValue, match=r"not a shape \(there are: deployed, each, one\)"):
        parse_shape("on")


def test_the_table_has_three_processes_of_which_two_are_nodes() -> None:
    table = load_deployment((DEPLOY / "table.yaml").read_text(), "table.yaml")
    assert roles(table, "deployed") == {
        "main": ("vhub", "supervisor", "player-blue", "player-red"),
        "blue": ("blue",),
        "red": ("red",),
    }
    assert all(len(process) == 1 for process in roles(table, "each").values())

"""Parameters of the shipped players: those of the deployments are taken, wrong ones are refused with the valid ones."""

from __future__ import annotations

from functools import cache
from typing import Any, Final

import pytest

from foosim.client.loading import load_player
from foosim.common.errors import BadValue
from foosim.deployment.schema import Deployment
from foosim.simulation.simulation import read_for_stepping
from tests.components.worlds import DEPLOY

FILES: Final = ("table.yaml", "warehouse.yaml", "yard.yaml", "workshop.yaml", "eyes.yaml", "cat_and_mouse.yaml")
CASES: Final[list[tuple[str, str, dict[str, Any], str]]] = [
    ("table.yaml", "player-red", {"tema": "red"}, "unknown parameter (there are: team), 'tema', nearest is 'team'"),
    ("table.yaml", "player-red", {"team": "green"}, "parameter team is not one of red, blue, 'green'"),
    ("table.yaml", "player-red", {"team": None}, "parameter team is not one of red, blue, null"),
    ("warehouse.yaml", "pilot01", {"rover": ""}, "parameter rover is not a rover (there are: rover01, "),
    ("warehouse.yaml", "pilot01", {"sped": 1.0}, "no parameter of a patrol (there are: "),
    ("warehouse.yaml", "pilot01", {"speed": 0}, "parameter speed is not a number above 0, 0"),
    ("warehouse.yaml", "pilot01", {"speed": True}, "parameter speed is not a number above 0, true"),
    ("warehouse.yaml", "pilot01", {"base": 7}, "parameter base is not a text, 7"),
    ("warehouse.yaml", "pilot01", {"base": "dispach"}, "parameter base is not a player (there are: dispatch, "),
    ("warehouse.yaml", "pilot01", {"low": 0.9, "high": 0.8}, "parameter high is not above low, at most 1, 0.8"),
    ("warehouse.yaml", "dispatch", {"cell": 2.5}, "a dispatch has only the parameter cell_m, 'cell'"),
    ("warehouse.yaml", "dispatch", {"cell_m": -1}, "parameter cell_m is not a number above 0, -1"),
    ("yard.yaml", "pilot-west", {"scout": "scout-wes"}, "parameter scout or partner is not a differential drive "),
    ("yard.yaml", "pilot-west", {"partner": "arm"}, "parameter scout or partner is not a differential drive "),
    ("yard.yaml", "pilot-west", {"crates": ["crate-9"], "goals": [1.0]}, "parameter crates names other than a box "),
    ("yard.yaml", "pilot-west", {"crates": ["crate-1"], "goals": [1.0, 2.0]}, "parameter goals has a number for each "),
    ("yard.yaml", "pilot-west", {"goals": ["x"]}, "parameter goals is not a list of numbers, "),
    ("yard.yaml", "pilot-west", {"speed": "fast"}, "parameter speed is not a number, 'fast'"),
    ("yard.yaml", "pilot-west", {"sped": 1.0}, "no parameter of a scout (there are: "),
    (
        "workshop.yaml",
        "foreman",
        {"porter": "forklift"},
        "a parameter names an unfit porter, crane or crate (there are: crane-east, ",
    ),
    (
        "workshop.yaml",
        "foreman",
        {"crates": ["crane-west"]},
        "a parameter names an unfit porter, crane or crate (there are: crate-1, ",
    ),
    (
        "workshop.yaml",
        "foreman",
        {"cranes": ["crane-west"]},
        "the parameters are name, porter, two cranes, and crates, ",
    ),
    (
        "workshop.yaml",
        "foreman",
        {"name": "nobody"},
        "porter/gripper takes no jobs from it (there are: foreman), 'nobody'",
    ),
    ("cat_and_mouse.yaml", "player-cat", {"speed": 1.0}, "a cat has no parameters, "),
    ("cat_and_mouse.yaml", "player-mouse", {"speed": 1.0}, "a mouse has no parameters, "),
    ("eyes.yaml", "north-driver", {"speed": 1.0}, "a floor seeker has no parameters, "),
    ("workshop.yaml", "foreman", {"speed": 1.0}, "the parameters are name, porter, two cranes, and crates, "),
]


@cache
def deployment_of(file: str) -> Deployment:
    return read_for_stepping(DEPLOY / file)


@pytest.mark.parametrize("file", FILES)
def test_players_are_made_with_the_parameters_of_their_deployments(file: str) -> None:
    deployment = deployment_of(file)
    for declared in deployment.players.values():
        load_player(declared.class_)(deployment, declared.parameters)


@pytest.mark.parametrize(("file", "name", "changed", "said"), CASES)
def test_a_wrong_parameter_is_refused(file: str, name: str, changed: dict[str, Any], said: str) -> None:
    deployment = deployment_of(file)
    declared = deployment.players[name]
    with pytest.raises(BadValue) as refused:
        load_player(declared.class_)(deployment, {**declared.parameters, **changed})
    assert str(refused.value).startswith(said), refused.value

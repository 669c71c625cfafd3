"""What a deployment says about who hears whom and who is on board of what: each mistake is one line with its place."""

from __future__ import annotations

from pathlib import Path

import pytest

from foosim.common.errors import DeploymentError
from foosim.deployment.loader import apply_sets, load_deployment
from tests.turns import BY_PERIOD

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"


@pytest.mark.parametrize(
    ("setting", "problem"),
    [
        ("player-red.hears={'rover*': [beacon]}",
         "players.player-red.hears: a selector that matches no other endpoint, 'rover*'"),
        ("player-red.hears={player-red: [beacon]}",
         "players.player-red.hears: a selector that matches no other endpoint, 'player-red', nearest is 'player-blue'"),
        ("player-red.hears={player-bleu: [beacon]}", "'player-bleu', nearest is 'player-blue'"),
        ("player-red.hears={'blue.*': [encode]}",
         "players.player-red.hears.'blue.*'[0]: blue.* has no such channel, 'encode', nearest is 'encoder'"),
        ("player-red.on=red.gaol", "players.player-red.on: unknown robot, 'red.gaol', nearest is 'red.goal'"),
    ],
)  # fmt: skip
def test_what_refers_to_nothing_is_refused(setting: str, problem: str) -> None:
    with pytest.raises(DeploymentError) as error:
        apply_sets(TABLE.read_text(), TABLE.name, [f"players.{setting}"])
    assert len(error.value.problems) == 1 and error.value.problems[0].endswith(problem)


def test_who_is_on_board_is_kept_and_clients_too() -> None:
    sets = ("players.player-red.on=red.goal", "clients={laptop: {on: camera}}")
    deployment = load_deployment(apply_sets(TABLE.read_text(), TABLE.name, sets), TABLE.name)
    assert (deployment.players["player-red"].on, deployment.clients["laptop"].on) == ("red.goal", "camera")
    assert deployment.players["player-blue"].on is None


def test_a_selector_over_robots_takes_those_that_have_the_channel() -> None:
    sets = (*BY_PERIOD, "players.player-red.hears={'*': [encoder, beacon]}", "players.player-red.robots={}")
    deployment = load_deployment(apply_sets(TABLE.read_text(), TABLE.name, sets), TABLE.name)
    heard = deployment.heard_by("player-red")
    assert ("camera", "encoder") not in heard and ("red.goal", "encoder") in heard
    assert [pair for pair in heard if pair[1] == "beacon"] == [("player-blue", "beacon")]

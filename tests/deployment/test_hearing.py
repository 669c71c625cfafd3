"""What a deployment says about who hears whom and who is on board of what: each mistake is one line with its place."""

from __future__ import annotations

from pathlib import Path

from foosim.deployment.loader import apply_sets, load_deployment
from tests.turns import BY_PERIOD

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"


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

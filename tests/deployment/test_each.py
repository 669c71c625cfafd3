"""Players and clients for each robot: their names, the signs that stand for it, and the robots that they select."""

from __future__ import annotations

from foosim.deployment.loader import load_deployment, with_owners
from tests.deployment.halls import PILOT, ROVER, TWO, hall


def test_what_is_made_is_in_the_place_of_its_entry() -> None:
    text = hall(ROVER + PILOT + TWO + "players: {z: {like: pilot, on: r-1, robots: {r-1: []}}, "
                "p$1: {like: pilot, each: r-*}, a: {like: pilot, on: r-1, robots: {r-1: []}}}\n")  # fmt: skip
    text = text.replace("robots: {r-1: []}", "robots: null")
    assert list(load_deployment(text, "f").players) == ["z", "p1", "p2", "a"]


def test_on_other_nodes_what_is_placed_by_the_node_is_not_placed() -> None:
    """Else a rehearsal on nodes n1 and n2 would need hosts of these names."""
    hosts = "hosts: {east: {address: 10.0.0.1}, west: {address: 10.0.0.2}}\n"
    players = "players: {p$1: {like: pilot, each: r-*, host: $node, process: on-$node}, p2: {process: own}}\n"
    text = hall(ROVER + PILOT + hosts + TWO + "nodes: {east: {robots: [r-1]}, west: {robots: [rest]}}\n" + players)
    declared = load_deployment(text, "f")
    assert [player.host for player in declared.players.values()] == ["east", "west"]
    others = load_deployment(with_owners(text, "f", {"n1": ["r-2"], "n2": ["r-1"]}, ["seed=7"]), "f")
    assert (others.owners(), others.seed) == ({"r-1": "n2", "r-2": "n1"}, 7)
    assert {name: player.process for name, player in others.players.items()} == {"p1": None, "p2": "own"}
    assert {player.host for player in others.players.values()} == {None}
    assert {**others.model_dump(), "nodes": 0, "players": 0, "seed": 0} == {
        **declared.model_dump(), "nodes": 0, "players": 0, "seed": 0}  # fmt: skip



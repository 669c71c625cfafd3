"""Players and clients for each robot: their names, the signs that stand for it, and the robots that they select."""

from __future__ import annotations

from foosim.deployment.loader import apply_sets, load_deployment, with_owners
from tests.deployment.halls import PATROL, PILOT, ROVER, TWO, hall, long_robot, same

ROBOTS: dict[str, object] = {"r-1": long_robot("1 m", "2 m"), "r-2": long_robot("3 m", "2 m")}

NO_ROBOT = "not a robot's name (names joined by dots; lower case letters, digits, - and _, a letter first), '$robot'"


def pilot(robot: str, **more: object) -> dict[str, object]:
    """A pilot that is written out."""
    return {"class": PATROL, "rate": "10 Hz", "on": robot, "robots": {robot: ["pose"]}, **more}


def test_there_is_a_player_for_each_robot() -> None:
    same(
        ROVER + PILOT + TWO + "players: {p$1: {like: pilot, each: r-*}}\n",
        ROBOTS,
        players={"p1": pilot("r-1"), "p2": pilot("r-2")},
    )


def test_signs_stand_for_robot_node_and_wildcards_in_names_keys_and_texts() -> None:
    clause = "parameters: {rover: $robot, 'x$$$1': ['$1-$2', 5, '$$']}, process: on-$node"
    same(
        ROVER
        + PILOT
        + TWO
        + "nodes: {east: {robots: [r-1]}, west: {robots: [rest]}}\n"
        + f"players: {{$robot-pilot: {{like: pilot, each: 'r?*', {clause}}}}}\n"
        + "clients: {'ear$1': {each: r-1..9, on: $robot}}\n",
        ROBOTS,
        nodes={"east": {"robots": ["r-1"]}, "west": {"robots": ["r-2"]}},
        players={
            f"r-{n}-pilot": pilot(
                f"r-{n}",
                parameters={"rover": f"r-{n}", "x$-": [f"--{n}", 5, "$"]},
                process=f"on-{node}",
            )
            for n, node in ((1, "east"), (2, "west"))
        },
        clients={"ear1": {"on": "r-1"}, "ear2": {"on": "r-2"}},
    )


def test_an_entry_of_its_name_holds_what_is_different_about_one() -> None:
    fast = "  fast: {like: pilot, rate: 50 Hz}\n"
    short = (
        ROVER + PILOT + fast + TWO + "players:\n  p2: {like: fast, hears: {$robot: [pose]}, robots: {r-2: [battery]}}\n"
        "  p$1: {like: pilot, each: '*-*', parameters: {rover: $robot}}\n  p1: {restart: false, parameters: null}\n"
    )
    short = short.replace("'*-*'", "r-*")
    hears = {"r-2": ["pose"]}
    same(
        short,
        ROBOTS,
        players={
            "p1": pilot("r-1", restart=False),
            "p2": {**pilot("r-2", parameters={"rover": "r-2"}), "rate": "50 Hz", "hears": hears,
                   "robots": {"r-2": ["battery"]}},
        },
    )  # fmt: skip


def test_a_player_selects_its_robots_and_a_name_says_more_than_a_selector() -> None:
    boss = (
        f"players: {{boss: {{class: '{PATROL}', rate: 1 Hz, robots: {{r-1..5: [pose], r-2: [battery], 'r*': []}}}}}}\n"
    )
    robots = {"r-1": ["pose"], "r-2": ["battery"]}
    same(ROVER + TWO + boss, ROBOTS, players={"boss": {"class": PATROL, "rate": "1 Hz", "robots": robots}})


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


def test_the_canonical_text_is_not_expanded() -> None:
    text = hall(ROVER + PILOT + TWO + "players: {p$1: {like: pilot, each: r-*}}\n")
    canonical = apply_sets(text, "f", [])
    assert "each: r-*" in canonical and "p1" not in canonical
    assert apply_sets(canonical, "c", []) == canonical

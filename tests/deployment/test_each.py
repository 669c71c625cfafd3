"""Players and clients for each robot: their names, the signs that stand for it, and the robots that they select."""

from __future__ import annotations

import pytest

from foosim.common import limits
from foosim.deployment.loader import apply_sets, load_deployment, with_owners
from tests.deployment.halls import PATROL, hall, long_robot, problems_of, same
from tests.deployment.test_templates import ROVER

TWO = "robots: {r-1: {like: rover, x: 1 m, y: 2 m}, r-2: {like: rover, x: 3 m, y: 2 m}}\n"
ROBOTS: dict[str, object] = {"r-1": long_robot("1 m", "2 m"), "r-2": long_robot("3 m", "2 m")}
PILOT = f"  pilot: {{class: '{PATROL}', rate: 10 Hz, on: $robot, robots: {{$robot: [pose]}}}}\n"

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


@pytest.mark.parametrize(
    ("players", "problems"),
    [
        ("p$1: {like: pilot, each: s-*}",
         ["10:28: players.'p$1'.each: a selector that matches no robot, 's-*'"]),
        ("p$1: {like: pilot, each: [r-1]}", ["10:28: players.'p$1'.each: not a selector, a list of 1"]),
        ("p$1: {like: pilot, each: 'R*'}",
         ["10:28: players.'p$1'.each: not a selector (a name, in which * and ? stand for anything, or a range as in "
          "a-1..9), 'R*'"]),
        ("p: {like: pilot, each: r-*}",
         ["10:3: players.p: the name of what is made for each robot has $robot or $1 in it, 'p', nearest is 'p-$1'"]),
        ("p: {like: pilot, each: r-1}",
         ["10:3: players.p: the name of what is made for each robot has $robot or $1 in it, 'p', "
          "nearest is 'p-$robot'"]),
        ("p$2: {like: pilot, each: r-*}",
         ["10:3: players.'p$2': a $ that stands for nothing here (valid are $$, $robot, $1), 'p$2'"]),
        ("p$1: {like: pilot, each: r-*, process: $rover}",
         ["10:42: players.'p$1': a $ that stands for nothing here (valid are $$, $robot, $1, $node), '$rover'"]),
        ("p$1: {like: pilot, each: r-*, process: on-$node, parameters: {node: $node}}",
         ["10:71: players.'p$1': a $ that stands for nothing here (valid are $$, $robot, $1), '$node'"]),
        ("$node-$1: {like: pilot, each: r-*}",
         ["10:3: players.'$node-$1': a $ that stands for nothing here (valid are $$, $robot, $1), '$node-$1'"]),
        ("p$1: {like: pilot, each: r-*, parameters: {$: 1}}",
         ["10:46: players.'p$1': a $ that stands for nothing here (valid are $$, $robot, $1), '$'"]),
        ("p$1: {like: pilot, each: r-*, parameters: {$robot: 1, r-2: 2}}",
         ["10:57: players.'p$1': a key that is given twice for r-2, 'r-2'"]),
        ("p$1: {like: pilot, each: r*-*}", ["10:3: players.'p$1': a name that is made twice, also by p$1, 'p'"]),
        ("p$1: {like: pilot, each: r-*}\n  p-$1: {like: pilot, each: r-*}\n  p$2: {like: pilot, each: '*-*'}",
         ["12:3: players.'p$2': a name that is made twice, also by p$1, 'p1'"]),
        ("player-with-a-very-very-long-name-$robot: {like: pilot, each: r-*}",
         ["10:3: players.'player-with-a-very-very-long-name-$robot': the name that it makes for r-1 has more than "
          "32 characters, 'player-with-a-very-very-long-name-r-1'"]),
        ("P$1: {like: pilot, each: r-*}",
         ["10:3: players: not a name (lower case letters, digits, - and _, a letter first), 'P1'"]),
        ("p$1: {like: pilto, each: r-*}",
         ["10:15: players.'p$1'.like: unknown template, 'pilto', nearest is 'pilot'"]),
        ("p$1: {like: pilot, each: r-*, robots: {$robot: [gps]}}",
         ["10:51: players.p1.robots.r-1[0]: r-1 has no such channel, 'gps'"]),
        ("p$1: {like: pilot, each: r-*, rate: 3 Hz}",
         ["10:39: players.p1.rate: not a whole number of ticks of 20 ms, '3 Hz', "
          "nearest is '50/17 Hz' and '3.125 Hz'"]),
        ("p$1: {like: pilot, each: r-*, robots: {'s*': [pose]}}",
         ["10:42: players.p1.robots: a selector that matches no robot, 's*'"]),
        ("p: {like: pilot}",
         [f"7:76: templates.pilot.on: {NO_ROBOT}", f"7:93: templates.pilot.robots: {NO_ROBOT}"]),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_once_where_it_is_written(players: str, problems: list[str]) -> None:
    assert problems_of(hall(f"{ROVER}{PILOT}{TWO}players:\n  {players}\n")) == problems


def test_players_are_counted_before_they_are_made() -> None:
    fleet = "robots: {r: {model: station, count: 1025, x: 0 m, y: 0 m, spacing: {x: 1 mm}}}\n"
    text = hall(
        PILOT.replace("  pilot", "templates:\n  pilot", 1) + fleet + "players: {p$1: {like: pilot, each: r-*}}\n"
    )
    most = limits.CLIENTS_MAX
    assert problems_of(text) == [f"4:11: players.'p$1': with it there are more than {most} players, 'p1025'"]


def test_a_node_that_is_unknown_is_no_sign() -> None:
    text = hall(
        ROVER + PILOT + TWO + "nodes: {a: {robots: [r-1]}}\nplayers: {p$1: {like: pilot, each: r-*, process: $node}}\n"
    )
    assert problems_of(text) == [
        "10:50: players.'p$1': a $ that stands for nothing here (valid are $$, $robot, $1), '$node'"
    ]


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

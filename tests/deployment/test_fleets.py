"""Fleets by `count`, players for `each` robot, selectors in the lists of nodes and of players: what they make, and what
is wrong with them."""

from __future__ import annotations

from collections.abc import Mapping
from decimal import Decimal
from fnmatch import fnmatchcase
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from foosim.common import limits, units
from foosim.common.errors import BadValue
from foosim.deployment.loader import load_deployment
from foosim.deployment.text.selection import Population, Selector, TooManyComparisons
from foosim.world.models.rover import RoverRobot
from tests.deployment.halls import PATROL, hall, long_robot, problems_of, same
from tests.deployment.test_templates import ROVER
from tests.kinematic_yard import yard_text

FLEET = ROVER + "robots:\n  rover: {like: rover, count: 12, x: -15 m, y: 10 m, spacing: {x: 1.25 m, y: -50 cm}}\n"
PILOTS = f"  pilot: {{class: '{PATROL}', rate: 10 Hz, on: $robot, robots: {{$robot: [pose]}}}}\n"


def test_a_count_makes_robots_each_further_by_the_spacing() -> None:
    same(
        ROVER + "robots: {r: {like: rover, count: 3, x: -1.5 m, y: 2 m, spacing: {x: 125 cm, y: -0.1 m}}}\n",
        {
            "r-1": long_robot("-1.5 m", "2 m"),
            "r-2": long_robot("-0.25 m", "1.9 m"),
            "r-3": long_robot("1 m", "1.8 m"),
        },
    )


def test_an_entry_of_its_name_holds_what_is_different_about_one() -> None:
    same(
        ROVER
        + "  bare: {model: rover, charge: 9 %, sensors: {}}\n"
        + "robots:\n  r-3: {like: bare}\n"
        + "  r: {like: rover, count: 3, x: 1 m, y: 2 m, spacing: {x: 1 m}}\n"
        + "  r-2: {y: 5 m, x: 7 m, charge: 50 %}\n  r-4: {like: rover, x: 9 m, y: 9 m}\n",
        {
            "r-1": long_robot("1 m", "2 m"),
            "r-2": long_robot("7 m", "5 m", charge="50 %"),
            "r-3": long_robot("3 m", "2 m", charge="9 %", sensors={}),
            "r-4": long_robot("9 m", "9 m"),
        },
    )


@pytest.mark.parametrize("at", [None, {}, {"yaw": "90 deg"}])
def test_what_stands_at_a_pose_is_spaced_from_the_origin_where_none_is_given(at: dict[str, str] | None) -> None:
    robot = {"model": "differential_drive", "count": 3, "spacing": {"x": "2 m", "y": "-50 cm"}}
    own = {"scout-3": {"at": {"x": "7 m"}}}
    text = yard_text({"scout": robot | ({} if at is None else {"at": at}), **own})
    robots: Mapping[str, Any] = load_deployment(text, "yard.yaml").robots
    places = [robots[name].at.position[:2] for name in ("scout-1", "scout-2", "scout-3")]
    assert places == [(0.0, 0.0), (2.0, -0.5), (7.0, -1.0)]


def test_scenery_has_counts_too_and_starts_at_its_default_place() -> None:
    pillar = {"shape": "cylinder", "radius": "20 cm", "length": "5 m", "radio": "concrete", "y": "-9 m"}
    short = (
        "scenery:\n  p: {shape: cylinder, count: 3, spacing: {x: 5 m, z: 10 mm}, radius: 20 cm, length: 5 m, "
        + "radio: concrete, y: -9 m}\n"
    )
    same(
        ROVER + "robots: {r: {like: rover, x: 1 m, y: 2 m}}\n" + short,
        {"r": long_robot("1 m", "2 m")},
        scenery={
            "p-1": pillar,
            "p-2": {**pillar, "x": "5 m", "z": "10 mm"},
            "p-3": {**pillar, "x": "10 m", "z": "0.02 m"},
        },
    )


def lengths(digits_max: int) -> st.SearchStrategy[str]:
    """Lengths of at most 10 m and 1 m, with up to four decimals."""
    digits, places = st.integers(-digits_max, digits_max), st.integers(1, 4)
    return st.builds(
        lambda n, k, unit: f"{Decimal(n).scaleb(-k):f} {unit}", digits, places, st.sampled_from(["mm", "cm"])
    )


@given(lengths(9_999), lengths(999), st.integers(2, 5))
def test_places_are_added_exactly_and_rounded_once(start: str, step: str, count: int) -> None:
    spacing = f"spacing: {{x: {step}, y: 1 m}}"
    text = f"robots: {{r: {{like: rover, count: {count}, x: {start}, y: 2 m, {spacing}}}}}\n"
    deployment = load_deployment(hall(ROVER + text), "f")
    for number in range(count):
        robot = deployment.robots[f"r-{number + 1}"]
        assert isinstance(robot, RoverRobot)
        exact = units.parse(start, units.LENGTH) + number * units.parse(step, units.LENGTH)
        assert (robot.x, robot.y) == (float(exact), 2.0 + number)


@pytest.mark.parametrize(
    ("robots", "problems"),
    [
        ("r: {like: rover, count: 0, x: 1 m, y: 1 m}", ["8:27: robots.r.count: not a whole number from 1 to 4096, 0"]),
        ("r: {like: rover, count: 4097, x: 1 m, y: 1 m}",
         ["8:27: robots.r.count: not a whole number from 1 to 4096, 4097"]),
        ("r: {like: rover, count: 1000000000, x: 1 m, y: 1 m}",
         ["8:27: robots.r.count: not a whole number from 1 to 4096, 1000000000"]),
        ("r: {like: rover, count: true, x: 1 m, y: 1 m}",
         ["8:27: robots.r.count: not a whole number from 1 to 4096, true"]),
        ("r: {like: rover, count: '3', x: 1 m, y: 1 m}",
         ["8:27: robots.r.count: not a whole number from 1 to 4096, '3'"]),
        ("r: {like: rover, count: 3000, x: 1 m, y: 1 m}\n  s: {like: rover, count: 3001, x: 1 m, y: 1 m}",
         ["9:27: robots.s.count: with it there are 6001 robots, more than 4096, 3001"]),
        ("abcdefghijklmnopqrstuvwxyz-123456: {like: rover, count: 3, x: 1 m, y: 1 m}",
         ["8:3: robots.abcdefghijklmnopqrstuvwxyz-123456: its names have up to 35 characters, more than 32, "
          "'abcdefghijklmnopqrstuvwxyz-123456-3'"]),
        ("r: {like: rover, count: 3, x: 1 m, y: 1 m}\n  r-2: {like: rover, count: 2}",
         ["9:22: robots.r-2: a count of what the count of r makes, 'count'"]),
        ("r: {like: rover, spacing: {x: 1 m}, x: 1 m, y: 1 m}",
         ["8:20: robots.r: a spacing of what has no count, 'spacing'"]),
        ("r: {like: rover, count: 3, spacing: 1 m, x: 1 m, y: 1 m}",
         ["8:39: robots.r.spacing: not a mapping, '1 m'"]),
        ("r: {like: rover, count: 3, spacing: {heading: 1 m, x: 1 kg}, x: 1 m, y: 1 m}",
         ["8:40: robots.r.spacing: not one of x, y, z, 'heading'",
          "8:57: robots.r.spacing.x: not a length (a number and one of m, cm, mm, um, km); "
          "kg measures a mass, '1 kg'"]),
        ("r: {like: rover, count: 3, spacing: {z: 1 m, y: 1 m}, x: 1 m, y: 1 m}",
         ["8:40: robots.r.spacing: unknown key (there are: x, y), 'z'"]),
        ("r: {like: rover, count: 3, spacing: {z: 1 m, y: 1 m}, x: 1 m, y: 1 m}\n  r-3: {z: 4 m, charge: 9 %}",
         ["8:40: robots.r.spacing: unknown key (there are: x, y), 'z'",
          "9:9: robots.r-3: unknown key (there are: model, spare, tags, sensors, actuators, rules, x, y, heading, "
          "charge), 'z'"]),
        ("r: {like: rover, count: 3, spacing: {x: 1 m}, y: 1 m}", ["8:6: robots.r-1: missing key, 'x'"]),
        ("r: {like: rover, count: 3, x: one, spacing: {x: 1 m}, y: 1 m}",
         ["8:33: robots.r-1.x: not a length (a number and one of m, cm, mm, um, km), 'one'"]),
        ("r: {like: rovr, count: 3, x: 1 m, y: 1 m}\n  r-2: {x: 4 m}",
         ["8:13: robots.r.like: unknown template, 'rovr', nearest is 'rover'"]),
        ("r: {like: rover, count: 3, x: 1 m, y: 1 m, spacing: {x: 20 m}}",
         ["8:33: robots.r-2.x: the rover starts outside of the hall: valid are x from -20 to 20 m, "
          "y from -12.5 to 12.5 m, '21 m, 1 m'",
          "8:33: robots.r-3.x: the rover starts outside of the hall: valid are x from -20 to 20 m, "
          "y from -12.5 to 12.5 m, '41 m, 1 m'"]),
        ("r: {like: rover, count: 3, x: 1 m, y: 1 m, spacing: {x: 2 m}}\n  r-3: {x: 1.1 m}",
         ["9:12: robots.r-3.x: the rover starts in the rover r-1, '1.1 m, 1 m'"]),
        ("r: {like: rover, count: 3, x: 1 m, y: 1 m, spacing: {x: 2 m}}\n  r-4: {x: 1.1 m}",
         ["9:8: robots.r-4: missing key, 'model'"]),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_fleet_is_said_where_it_is_written(robots: str, problems: list[str]) -> None:
    assert problems_of(hall(f"{ROVER}robots:\n  {robots}\n")) == problems


# --- selectors --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("selector", "name", "parts"),
    [
        ("rover-*", "rover-12", ("12",)),
        ("rover-*", "rover", None),
        ("*-*", "a-b-c", ("a", "b-c")),
        ("r?d.*", "red.goal", ("e", "goal")),
        ("r?d.*", "reed.goal", None),
        ("*a*b", "xayb", ("x", "y")),
        ("*a*b", "xayba", None),
        ("rover", "rover", ()),
        ("rover-1..12", "rover-12", ("12",)),
        ("rover-1..12", "rover-13", None),
        ("rover-1..12", "rover-012", None),
        ("rover-1..12", "rover-1b", None),
        ("rover01..12", "rover09", ("09",)),
        ("rover01..12", "rover9", None),
        ("r2d2-3..3", "r2d2-3", ("3",)),
    ],
)
def test_a_selector_takes_the_text_of_each_wildcard(selector: str, name: str, parts: tuple[str, ...] | None) -> None:
    assert Selector(selector).match(name) == parts


@given(st.text("ab*?", min_size=1, max_size=8), st.text("ab", max_size=8))
def test_a_glob_matches_as_elsewhere_and_the_parts_make_the_name(glob: str, name: str) -> None:
    parts = Selector(glob).match(name)
    assert (parts is not None) == fnmatchcase(name, glob)
    if parts is not None:
        rest = iter(parts)
        assert "".join(next(rest) if sign in "*?" else sign for sign in glob) == name


@pytest.mark.parametrize("text", ["Rover", "a..b", "rover-9..1", "a b", "", "x" * 65, "..", "1..2"])
def test_what_is_no_selector_is_refused(text: str) -> None:
    with pytest.raises(BadValue):
        Selector(text)


def test_a_selector_of_many_wildcards_takes_no_time() -> None:
    population = Population(["a" * 32] * 1000)
    assert population.chosen("*a" * 31 + "*b") == []


def test_comparisons_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "COMPARISONS_MAX", 1000)
    population = Population([f"r{n}" for n in range(100)])
    for number in (*range(10), 5):
        population.chosen(f"*{number}")
    with pytest.raises(TooManyComparisons):
        population.chosen("*10")


def owners(nodes: str, robots: str = FLEET) -> dict[str, str]:
    """The node of each robot of the fleet, by the number of the robot."""
    return load_deployment(hall(robots + nodes), "f").owners()


@pytest.mark.parametrize(
    "nodes",
    [
        "{west: {robots: [rover-1..6]}, east: {robots: [rest]}}",
        "{west: {robots: [rest]}, east: {robots: [rover-7, rover-8..9, 'rover-1?']}}",
        "{west: {robots: [rover-1, rover-1..6, rover-2..4]}, east: {robots: [rest]}}",
        "{west: {robots: [rover-6..6, rover-1..5]}, east: {robots: ['rover-1?', rover-7..9]}}",
    ],
)
def test_nodes_select_robots(nodes: str) -> None:
    found = owners(f"nodes: {nodes}\n")
    assert found == {f"rover-{n}": "west" if n <= 6 else "east" for n in range(1, 13)}


def test_a_robot_called_rest_is_that_robot() -> None:
    robots = ROVER + "robots: {rest: {like: rover, x: 1 m, y: 1 m}, b: {like: rover, x: 3 m, y: 1 m}}\n"
    assert owners("nodes: {one: {robots: [rest]}, two: {robots: [b]}}\n", robots) == {"rest": "one", "b": "two"}


@pytest.mark.parametrize(
    ("nodes", "problem"),
    [
        ("{a: {robots: ['*', 'rovr-*']}}",
         "9:27: nodes.a.robots[1]: a selector that matches no robot, 'rovr-*', nearest is 'rover-1'"),
        ("{a: {robots: ['*', rover-13..20]}}",
         "9:27: nodes.a.robots[1]: a selector that matches no robot, 'rover-13..20', nearest is 'rover-10'"),
        ("{a: {robots: [rover-20..13, rest]}}",
         "9:22: nodes.a.robots[0]: a range that ends before it begins, 'rover-20..13'"),
        ("{a: {robots: [rover-1..4]}, b: {robots: [rest, rover-4]}}",
         "9:55: nodes.b.robots[1]: a robot with two owners, also of node a, 'rover-4'"),
        ("{a: {robots: [rover-1..8]}, b: {robots: [rover-5..12]}}",
         "9:49: nodes.b.robots[0]: a robot with two owners, also of node a, 'rover-5'"),
        ("{a: {robots: [rover-1..8]}, b: {robots: [rover-10..12]}}",
         "8:3: robots: a robot that no node owns, 'rover-9'"),
        ("{a: {robots: ['*']}, b: {robots: [rest]}}",
         "9:42: nodes.b.robots: each robot is in another list, none is left, 'rest'"),
        ("{a: {robots: [rest]}, b: {robots: [rest]}}",
         "9:43: nodes.b.robots: each robot is in another list, none is left, 'rest'"),
        ("{a: {robots: [rovr-3, rest]}}",
         "9:22: nodes.a.robots[0]: unknown robot, 'rovr-3', nearest is 'rover-3'"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_nodes_robots_is_said_at_its_selector(nodes: str, problem: str) -> None:
    assert problems_of(hall(f"{FLEET}nodes: {nodes}\n")) == [problem]

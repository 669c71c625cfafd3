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
from tests.deployment.halls import FLEET, ROVER, hall
from tests.kinematic_yard import yard_text


@pytest.mark.parametrize("at", [None, {}, {"yaw": "90 deg"}])
def test_what_stands_at_a_pose_is_spaced_from_the_origin_where_none_is_given(at: dict[str, str] | None) -> None:
    robot = {"model": "differential_drive", "count": 3, "spacing": {"x": "2 m", "y": "-50 cm"}}
    own = {"scout-3": {"at": {"x": "7 m"}}}
    text = yard_text({"scout": robot | ({} if at is None else {"at": at}), **own})
    robots: Mapping[str, Any] = load_deployment(text, "yard.yaml").robots
    places = [robots[name].at.position[:2] for name in ("scout-1", "scout-2", "scout-3")]
    assert places == [(0.0, 0.0), (2.0, -0.5), (7.0, -1.0)]




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



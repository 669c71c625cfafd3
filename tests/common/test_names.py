"""Names that are valid, and the nearest valid one."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from foosim.common.names import is_name, is_robot_name, is_selector, nearest_name


@pytest.mark.parametrize("text", ["red", "player-red", "n1", "a_b", "a" * 32])
def test_names(text: str) -> None:
    assert is_name(text)
    assert is_robot_name(text)


@pytest.mark.parametrize("text", ["", "Red", "1n", "-a", "a b", "a\n", "a" * 33, "é", "a/b", "../a"])
def test_what_is_no_name(text: str) -> None:
    assert not is_name(text)
    assert not is_robot_name(text)


def test_a_robots_name_may_have_dots() -> None:
    assert is_robot_name("red.goal")
    assert not is_name("red.goal")
    assert not is_robot_name("red..goal")
    assert not is_robot_name("red.")
    assert not is_robot_name(".red")


def test_a_selector_is_a_name_with_wildcards() -> None:
    assert is_selector("*")
    assert is_selector("red.*")
    assert is_selector("player-???")
    assert not is_selector("red.[ab]")
    assert not is_selector("")


@pytest.mark.parametrize(
    ("value", "nearest"),
    [("red.gaol", "red.goal"), ("RED.GOAL", "red.goal"), ("blue.gol", "blue.goal"), ("camra", "camera"), ("xyz", None)],
)
def test_the_nearest_name_is_the_one_that_was_meant(value: str, nearest: str | None) -> None:
    assert nearest_name(value, ["red.goal", "blue.goal", "camera"]) == nearest


def test_among_equals_the_one_that_begins_alike_then_the_first_by_name_is_nearest() -> None:
    assert nearest_name("ax", ["az", "bx", "ay"], similar=0.5) == "ay"


@given(st.text(max_size=200), st.lists(st.text(max_size=20), max_size=10))
def test_the_nearest_name_is_a_choice_and_does_not_depend_on_order(value: str, choices: list[str]) -> None:
    nearest = nearest_name(value, choices)
    assert nearest is None or nearest in choices
    assert nearest_name(value, reversed(choices)) == nearest

"""The rules of the table: goals and score, kick-off, dead ball, ball off the table; all their memory in the frame."""

from __future__ import annotations

from math import sqrt
from pathlib import Path
from typing import Final

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.world.assembly.world import initial_numbers, rules_of
from foosim.world.components.view import WritableView
from foosim.world.layout import Entity, Layout, build_layout
from foosim.world.parameters.table import table_of
from foosim.world.rules.football import kickoff_ticks
from tests.placing import place_ball

TEXT: Final = (Path(__file__).parents[2] / "deploy" / "table.yaml").read_text()
DEPLOYMENT: Final = load_deployment(TEXT, "table.yaml")
TABLE: Final = table_of(DEPLOYMENT)
LAYOUT: Final = build_layout(DEPLOYMENT)
TWO: Final = build_layout(DEPLOYMENT, [("second", "ball")])
BALL: Final = LAYOUT["ball"]
RADIUS: Final = TABLE.ball.radius
LINE_X: Final = TABLE.field.length / 2 + RADIUS
"""From here on all of the ball is behind the goal line."""
SPOT: Final = [0.0, 0.0, RADIUS]
ROLLING: Final = (0.5, 0.0, 0.0)

Position = tuple[float, float, float]


def in_play(position: Position, velocity: Position = ROLLING, layout: Layout = LAYOUT) -> list[float]:
    numbers = initial_numbers(DEPLOYMENT, layout)
    for ball in layout.of("ball"):
        place_ball(numbers, ball, (0.3, 0.1, RADIUS), ROLLING)
    place_ball(numbers, layout["ball"], position, velocity)
    return numbers


def field(numbers: list[float], name: str, count: int = 1, entity: Entity = BALL) -> list[float]:
    start = entity.offsets[name]
    return numbers[start : start + count]


def score(numbers: list[float], layout: Layout = LAYOUT) -> list[float]:
    return field(numbers, "football.score", 2, layout["world"])


def apply(
    numbers: list[float], ticks: int = 1, layout: Layout = LAYOUT, deployment: Deployment = DEPLOYMENT
) -> list[float]:
    rules = rules_of(deployment, layout)
    assert list(rules) == ["football"]
    for tick in range(ticks):
        rules["football"].apply(WritableView(tick, numbers))
    return numbers


def is_reset(numbers: list[float], entity: Entity = BALL) -> bool:
    moves = field(numbers, "linear_velocity", 3, entity) + field(numbers, "angular_velocity", 3, entity)
    waits = field(numbers, "football.wait_ticks", 1, entity) == [kickoff_ticks(DEPLOYMENT)]
    return field(numbers, "position", 3, entity) == SPOT and not any(moves) and waits


# --- goals -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("side", "scored"), [(1.0, [1.0, 0.0]), (-1.0, [0.0, 1.0])])
def test_a_ball_in_a_goal_scores_for_the_other_side_once(side: float, scored: list[float]) -> None:
    numbers = apply(in_play((side * (LINE_X + 0.001), 0.05, RADIUS), (side * 3.0, 0.0, 0.0)))
    assert score(numbers) == scored, "red's own goal is at negative x"
    assert is_reset(numbers)
    assert score(apply(numbers, kickoff_ticks(DEPLOYMENT) + 1)) == scored


GOAL_Y: Final = TABLE.goal.width / 2
BACK_X: Final = TABLE.field.length / 2 + TABLE.walls.thickness + TABLE.goal.depth
NO_GOALS: Final[dict[str, Position]] = {
    "on the line": (LINE_X - 0.001, 0.0, RADIUS),
    "beside the post": (LINE_X + 0.01, GOAL_Y + 0.001, RADIUS),
    "above the bar": (LINE_X + 0.01, 0.0, TABLE.goal.height + RADIUS),
    "over the wall": (LINE_X + 0.01, 0.0, TABLE.walls.height + RADIUS),
    "behind the table": (BACK_X + 0.01, 0.0, RADIUS),
    "under the floor": (LINE_X + 0.01, 0.0, -0.01),
}


@pytest.mark.parametrize("where", NO_GOALS)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_what_is_no_goal_does_not_score(where: str, side: float) -> None:
    x, y, z = NO_GOALS[where]
    numbers = apply(in_play((side * x, y, z)))
    assert score(numbers) == [0.0, 0.0] and field(numbers, "position", 3) == [side * x, y, z]


@settings(max_examples=200)
@given(
    x=st.floats(-BACK_X, BACK_X),
    y=st.floats(-TABLE.field.width / 2, TABLE.field.width / 2),
    z=st.floats(0.001, 0.3),
)
def test_a_goal_is_where_the_pocket_is(x: float, y: float, z: float) -> None:
    scored = score(apply(in_play((x, y, z))))
    inside = abs(x) > LINE_X and abs(y) < GOAL_Y and z < TABLE.goal.height
    assert scored == [float(inside and x > 0), float(inside and x < 0)]


def test_any_ball_scores_and_the_others_play_on() -> None:
    numbers = in_play((LINE_X + 0.01, 0.0, RADIUS), layout=TWO)
    second = TWO["second"]
    before = field(numbers, "position", 3, second)
    apply(numbers, layout=TWO)
    assert score(numbers, TWO) == [1.0, 0.0]
    assert is_reset(numbers, TWO["ball"]) and field(numbers, "position", 3, second) == before
    place_ball(numbers, second, (-LINE_X - 0.01, 0.0, RADIUS))
    assert score(apply(numbers, layout=TWO), TWO) == [1.0, 1.0]
    assert is_reset(numbers, second)


# --- kick-off --------------------------------------------------------------------------------------------------------


def kicked_off(kickoffs: int, deployment: Deployment = DEPLOYMENT) -> list[float]:
    """The velocity of the ball after this many kick-offs before it."""
    numbers = in_play((0.0, 0.0, RADIUS))
    numbers[LAYOUT["world"].offsets["football.kickoffs"]] = float(kickoffs)
    numbers[BALL.offsets["football.wait_ticks"]] = 1.0
    apply(numbers, deployment=deployment)
    assert field(numbers, "football.kickoffs", 1, LAYOUT["world"]) == [kickoffs + 1.0]
    return field(numbers, "linear_velocity", 3)


def test_a_kick_off_follows_its_delay() -> None:
    numbers = initial_numbers(DEPLOYMENT, LAYOUT)
    ticks = kickoff_ticks(DEPLOYMENT)
    assert ticks == TABLE.rules.kickoff_delay_ns // DEPLOYMENT.tick_ns == 250
    apply(numbers, ticks - 1)
    assert field(numbers, "linear_velocity", 3) == [0.0, 0.0, 0.0]
    apply(numbers)
    vx, vy, vz = field(numbers, "linear_velocity", 3)
    assert abs(vx) == TABLE.rules.kickoff_speed and abs(vy) <= abs(vx) and vz == 0.0
    assert field(numbers, "position", 3) == SPOT and field(numbers, "football.wait_ticks") == [0.0]


def test_a_ball_that_was_touched_while_it_waited_is_kicked_off_from_the_spot() -> None:
    numbers = initial_numbers(DEPLOYMENT, LAYOUT)
    place_ball(numbers, BALL, (0.4, 0.1, RADIUS), (2.0, 0.0, 0.0))
    numbers[BALL.offsets["football.wait_ticks"]] = 1.0
    apply(numbers)
    assert field(numbers, "position", 3) == SPOT and abs(field(numbers, "linear_velocity")[0]) == 1.0


def test_kick_offs_are_drawn_by_their_number_and_the_seed() -> None:
    drawn = [tuple(kicked_off(number)) for number in range(400)]
    assert drawn == [tuple(kicked_off(number)) for number in range(400)]
    assert len(set(drawn)) == 400
    to_red = sum(vx < 0 for vx, _, _ in drawn)
    assert abs(to_red - 200) < 3.29 * sqrt(100), "neither side is favoured (99.9 %)"
    other = load_deployment(apply_sets(TEXT, "table.yaml", ["seed=2"]), "table.yaml")
    assert [tuple(kicked_off(number, other)) for number in range(9)] != drawn[:9]


# --- dead ball, ball off the table -----------------------------------------------------------------------------------


def test_a_dead_ball_comes_back_after_its_time() -> None:
    slow = (0.9 * TABLE.rules.dead_ball_speed, 0.0, 0.0)
    numbers = in_play((0.4, 0.2, RADIUS), slow)
    ticks = TABLE.rules.dead_ball_after_ns // DEPLOYMENT.tick_ns
    apply(numbers, ticks - 1)
    assert field(numbers, "position", 3) == [0.4, 0.2, RADIUS] and field(numbers, "football.still_ticks") == [ticks - 1]
    assert is_reset(apply(numbers)) and score(numbers) == [0.0, 0.0]


@pytest.mark.parametrize("axis", range(3))
def test_a_ball_that_moves_in_between_is_not_dead(axis: int) -> None:
    numbers = in_play((0.4, 0.2, RADIUS), (0.0, 0.0, 0.0))
    apply(numbers, 1000)
    numbers[BALL.offsets["linear_velocity"] + axis] = -1.1 * TABLE.rules.dead_ball_speed
    apply(numbers)
    assert field(numbers, "football.still_ticks") == [0.0]
    numbers[BALL.offsets["linear_velocity"] + axis] = 0.0
    apply(numbers, 1000)
    assert field(numbers, "football.still_ticks") == [1000.0] and not is_reset(numbers)


OUT: Final[dict[str, Position]] = {
    "over the side": (0.0, TABLE.field.width / 2 + 0.05, 0.1),
    "behind the end": (BACK_X + 0.02, 0.0, 0.1),
    "under the floor": (0.0, 0.0, -0.2),
}


@pytest.mark.parametrize("where", OUT)
def test_a_ball_off_the_table_comes_back_after_its_time(where: str) -> None:
    numbers = in_play(OUT[where])
    ticks = TABLE.rules.off_table_after_ns // DEPLOYMENT.tick_ns
    apply(numbers, ticks - 1)
    assert field(numbers, "position", 3) == list(OUT[where])
    assert is_reset(apply(numbers)) and score(numbers) == [0.0, 0.0]


def test_a_ball_that_falls_back_is_not_out() -> None:
    numbers = apply(in_play(OUT["over the side"]), 100)
    numbers[BALL.offsets["position"] + 1] = 0.0
    assert field(apply(numbers), "football.out_ticks") == [0.0]


def test_a_quarantined_ball_comes_back_and_is_free_again() -> None:
    numbers = in_play((0.2, 0.1, RADIUS), (400.0, 0.0, 0.0))
    numbers[BALL.offsets["quarantined"]] = 1.0
    ticks = TABLE.rules.off_table_after_ns // DEPLOYMENT.tick_ns
    apply(numbers, ticks - 1)
    assert field(numbers, "quarantined") == [1.0] and not is_reset(numbers)
    apply(numbers)
    assert field(numbers, "quarantined") == [0.0] and is_reset(numbers)


def test_a_reset_leaves_no_memory_behind() -> None:
    numbers = apply(in_play((0.4, 0.2, RADIUS), (0.0, 0.0, 0.0)), 700)
    numbers[BALL.offsets["contacts"]] = 3.0
    numbers[BALL.offsets["position"] : BALL.offsets["position"] + 3] = [LINE_X + 0.01, 0.0, RADIUS]
    apply(numbers)
    fresh = initial_numbers(DEPLOYMENT, LAYOUT)
    assert numbers[BALL.start : BALL.split] == fresh[BALL.start : BALL.split]


def test_rules_touch_nothing_but_balls_and_the_world() -> None:
    numbers = in_play((LINE_X + 0.01, 0.0, RADIUS))
    before = numbers.copy()
    apply(numbers, 300)
    changed = {e.name for e in LAYOUT.entities if numbers[e.start : e.stop] != before[e.start : e.stop]}
    assert changed == {"ball", "world"}


def test_times_shorter_than_a_tick_are_a_tick() -> None:
    sets = ["table.rules.kickoff_delay=1 ms", "table.rules.dead_ball_after=1 ms", "table.rules.off_table_after=1 ms"]
    short = load_deployment(apply_sets(TEXT, "table.yaml", sets), "table.yaml")
    assert kickoff_ticks(short) == 1
    for position, velocity in (((0.4, 0.2, RADIUS), (0.0, 0.0, 0.0)), ((0.0, 0.0, -0.1), ROLLING)):
        assert field(apply(in_play(position, velocity), deployment=short), "position", 3) == SPOT

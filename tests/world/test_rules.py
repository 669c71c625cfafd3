"""The rules of the table: goals and score, kick-off, dead ball, ball off the table; all their memory in the frame."""

from __future__ import annotations

from collections.abc import Mapping
from math import sqrt
from typing import Any, Final

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from foosim.common.errors import DeploymentError
from foosim.deployment.schema import Deployment
from foosim.library.table.football import kickoff_ticks
from foosim.library.table.settings import places_between_lines, table_of
from foosim.world.assembly.world import initial_numbers, rules_of
from foosim.world.components.view import WritableView
from foosim.world.frame import Frame
from foosim.world.layout import Entity, Layout, build_layout
from tests.deployed import DEPLOYMENT, LAYOUT, deployed
from tests.placing import place_ball

TABLE: Final = table_of(DEPLOYMENT)
SPARE: Final = deployed("table.spare_balls=1")
TWO: Final = build_layout(SPARE)
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


@settings(max_examples=200)
@given(
    x=st.floats(-BACK_X, BACK_X) | st.floats(LINE_X - 0.01, BACK_X + 0.05).flatmap(lambda x: st.sampled_from([x, -x])),
    y=st.floats(-TABLE.field.width / 2, TABLE.field.width / 2) | st.floats(-GOAL_Y, GOAL_Y),
    z=st.floats(-0.05, 0.3) | st.floats(0.001, TABLE.goal.height),
)
@example(LINE_X - 0.001, 0.0, RADIUS)
@example(-LINE_X - 0.01, GOAL_Y + 0.001, RADIUS)
@example(LINE_X + 0.01, 0.0, TABLE.goal.height + RADIUS)
@example(BACK_X + 0.01, 0.0, RADIUS)
@example(-LINE_X - 0.01, 0.0, -0.01)
def test_a_goal_is_where_the_pocket_is(x: float, y: float, z: float) -> None:
    """Not on the line, beside the post, above the bar, behind the table or under its floor; there a ball stays."""
    numbers = apply(in_play((x, y, z)))
    inside = LINE_X < abs(x) <= BACK_X and abs(y) < GOAL_Y and 0.0 < z < TABLE.goal.height
    assert score(numbers) == [float(inside and x > 0), float(inside and x < 0)]
    assert inside or field(numbers, "position", 3) == [x, y, z]


def test_any_ball_scores_and_the_others_play_on() -> None:
    numbers = in_play((LINE_X + 0.01, 0.0, RADIUS), layout=TWO)
    second = TWO["ball-2"]
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
    other = deployed("seed=2")
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


def test_a_reset_leaves_no_memory() -> None:
    numbers = apply(in_play((0.4, 0.2, RADIUS), (0.0, 0.0, 0.0)), 700)
    numbers[BALL.offsets["contacts"]] = 3.0
    numbers[BALL.offsets["position"] : BALL.offsets["position"] + 3] = [LINE_X + 0.01, 0.0, RADIUS]
    apply(numbers)
    fresh = initial_numbers(DEPLOYMENT, LAYOUT)
    numbers[BALL.offsets["football.serve"]] = 0.0  # the goal was blue's to serve after
    assert numbers[BALL.start : BALL.split] == fresh[BALL.start : BALL.split]


def test_rules_touch_nothing_but_balls_and_the_world() -> None:
    numbers = in_play((LINE_X + 0.01, 0.0, RADIUS))
    before = numbers.copy()
    apply(numbers, 300)
    changed = {e.name for e in LAYOUT.entities if numbers[e.start : e.stop] != before[e.start : e.stop]}
    assert changed == {"ball", "world"}


def test_times_shorter_than_a_tick_are_a_tick() -> None:
    sets = ["table.rules.kickoff_delay=1 ms", "table.rules.dead_ball_after=1 ms", "table.rules.off_table_after=1 ms"]
    short = deployed(*sets)
    assert kickoff_ticks(short) == 1
    for position, velocity in (((0.4, 0.2, RADIUS), (0.0, 0.0, 0.0)), ((0.0, 0.0, -0.1), ROLLING)):
        assert field(apply(in_play(position, velocity), deployment=short), "position", 3) == SPOT


# --- who touched the ball, own goals ---------------------------------------------------------------------------------


def with_rules(*sets: str) -> Deployment:
    return deployed(*(f"table.rules.{one}" for one in sets))


def touch(numbers: list[float], substeps: dict[str, float], layout: Layout = LAYOUT, ball: str = "ball") -> None:
    """Let rods, and a ball, have had a contact in the last tick, each last in a substep."""
    for entity in (*layout.of("rod"), layout[ball]):
        numbers[entity.offsets["contacts"] + 2] = -1.0
    for name, substep in {**substeps, ball: 3.0}.items():
        numbers[layout[name].offsets["contacts"] + 2] = substep


def shoot(numbers: list[float], side: float) -> None:
    """Let the ball be in the goal at this end."""
    numbers[BALL.offsets["position"]] = side * (LINE_X + 0.01)


def toucher(numbers: list[float], layout: Layout = LAYOUT, ball: str = "ball") -> str | None:
    (index,) = field(numbers, "football.touched_by", 1, layout[ball])
    return None if index < 0.0 else layout.entities[int(index)].name


def test_the_rod_that_touched_the_ball_last_is_remembered() -> None:
    numbers = in_play((0.3, 0.0, RADIUS))
    assert toucher(apply(numbers)) is None
    touch(numbers, {"blue.defence": 1.0})  # its axis is at 373 mm
    assert toucher(apply(numbers)) == "blue.defence"
    touch(numbers, {})  # a wall
    assert toucher(apply(numbers)) == "blue.defence"
    touch(numbers, {"red.attack": 0.0, "blue.defence": 2.0})
    assert toucher(apply(numbers)) == "blue.defence", "the last one to the substep"
    touch(numbers, {"red.attack": 2.0, "blue.defence": 2.0})
    assert toucher(apply(numbers)) == "blue.defence", "the nearest one: 73 mm to 76 mm"
    numbers[BALL.offsets["contacts"] + 2] = -1.0
    numbers[LAYOUT["red.attack"].offsets["contacts"] + 2] = 3.0
    assert toucher(apply(numbers)) == "blue.defence", "the ball was not touched"


def test_a_rod_out_of_reach_has_touched_another_ball() -> None:
    numbers = in_play((0.3, 0.0, RADIUS), layout=TWO)
    touch(numbers, {"red.goal": 3.0}, TWO)
    assert toucher(apply(numbers, layout=TWO), TWO) is None


@pytest.mark.parametrize(
    ("rod", "side", "scored", "owned"),
    [
        ("red.attack", 1.0, [1.0, 0.0], [0.0, 0.0]),
        ("blue.goal", 1.0, [1.0, 0.0], [0.0, 1.0]),
        ("red.goal", -1.0, [0.0, 1.0], [1.0, 0.0]),
        ("blue.attack", -1.0, [0.0, 1.0], [0.0, 0.0]),
        (None, 1.0, [1.0, 0.0], [0.0, 0.0]),
    ],
)
def test_a_goal_by_a_rod_of_the_team_that_concedes_it_is_its_own_goal(
    rod: str | None, side: float, scored: list[float], owned: list[float]
) -> None:
    numbers = in_play((side * 0.4, 0.0, RADIUS))
    if rod is not None:
        where = TABLE.lines[rod.partition(".")[2]].x * (1.0 if rod.startswith("red") else -1.0)  # type: ignore[index]
        place_ball(numbers, BALL, (where, 0.0, RADIUS), ROLLING)
        touch(numbers, {rod: 3.0})
        apply(numbers)
        touch(numbers, {})
    shoot(numbers, side)
    apply(numbers)
    assert score(numbers) == scored
    assert field(numbers, "football.own_goals", 2, LAYOUT["world"]) == owned
    assert toucher(numbers) is None, "the next ball was touched by nobody"


# --- whom a kick-off is for, and where a dead ball comes back --------------------------------------------------------


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_kick_off_after_a_goal_is_for_the_team_that_conceded_it(side: float) -> None:
    """Blue's goal and its midfield are at positive x."""
    for number in range(8):
        numbers = in_play((side * (LINE_X + 0.01), 0.0, RADIUS))
        numbers[LAYOUT["world"].offsets["football.kickoffs"]] = float(number)
        apply(numbers, kickoff_ticks(DEPLOYMENT) + 1)
        assert field(numbers, "linear_velocity")[0] == side * TABLE.rules.kickoff_speed
    drawn = with_rules("kickoff=drawn")
    speeds = set()
    for number in range(8):
        numbers = in_play((side * (LINE_X + 0.01), 0.0, RADIUS))
        numbers[LAYOUT["world"].offsets["football.kickoffs"]] = float(number)
        speeds.add(field(apply(numbers, kickoff_ticks(drawn) + 1, deployment=drawn), "linear_velocity")[0])
    assert len(speeds) == 2


MIDDLES: Final = [-0.4475, -0.2985, -0.1495, 0.0, 0.1495, 0.2985, 0.4475]
"""Midway between the lines of the table at 522, 373, 224 and 75 mm."""


@pytest.mark.parametrize(
    ("lay", "back"),
    [
        ((0.0, 0.1), (0.0, 0.1)),
        ((0.2, -0.3), (0.1495, -0.3)),
        ((-0.31, 0.02), (-0.2985, 0.02)),
        ((0.55, 0.3), (0.4475, 0.245)),  # off the ramp: (600 - 447.5) + (340 - y) mm is at least the ramp's 230 mm
        ((-0.58, -0.33), (-0.4475, -0.245)),
    ],
)
def test_a_dead_ball_comes_back_between_the_lines_where_it_lay(
    lay: tuple[float, float], back: tuple[float, float]
) -> None:
    lines = with_rules("dead_ball=lines")
    numbers = in_play((*lay, RADIUS), (0.0, 0.0, 0.0))
    ticks = TABLE.rules.dead_ball_after_ns // DEPLOYMENT.tick_ns
    apply(numbers, ticks, deployment=lines)
    assert field(numbers, "position", 3) == pytest.approx([*back, RADIUS], abs=1e-12)
    apply(numbers, kickoff_ticks(lines), deployment=lines)
    vx = field(numbers, "linear_velocity")[0]
    assert field(numbers, "position", 3) == pytest.approx([*back, RADIUS], abs=1e-12)
    assert abs(vx) == TABLE.rules.kickoff_speed and vx * back[0] <= 0.0, "away from the nearer goal"


def test_places_between_lines_are_out_of_reach_of_figures() -> None:
    assert [x for x, _ in places_between_lines(TABLE)] == pytest.approx(MIDDLES)
    close = table_of(deployed("table.ball.radius=30 mm"))
    assert len(places_between_lines(close)) == 0


# --- the match -------------------------------------------------------------------------------------------------------


def told(numbers: list[float], deployment: Deployment = DEPLOYMENT, layout: Layout = LAYOUT) -> dict[str, Any]:
    rule = rules_of(deployment, layout)["football"]
    status: Mapping[str, Any] = rule.status(WritableView(0, numbers))
    return {**status, "text": rule.text(status)}


def test_the_clock_counts_the_ticks_with_a_ball_in_play() -> None:
    numbers = initial_numbers(DEPLOYMENT, LAYOUT)
    ticks = kickoff_ticks(DEPLOYMENT)
    apply(numbers, ticks)
    assert told(numbers)["clock_s"] == 0.0
    place_ball(numbers, BALL, (0.3, 0.1, RADIUS), ROLLING)
    apply(numbers, 100)
    assert told(numbers)["clock_s"] == 100 * DEPLOYMENT.tick_ns / 1e9
    place_ball(numbers, BALL, (LINE_X + 0.01, 0.0, RADIUS), ROLLING)
    apply(numbers, 1 + ticks)
    assert told(numbers)["clock_s"] == 101 * DEPLOYMENT.tick_ns / 1e9


@pytest.mark.parametrize(
    ("scored", "winner", "text"),
    [
        ((2.0, 1.0), "red", "red 2 : 1 blue, red has won"),
        ((0.0, 1.0), "blue", "red 0 : 1 blue, blue has won"),
        ((1.0, 1.0), None, "red 1 : 1 blue, a draw"),
    ],
)
def test_a_match_ends_with_its_time(scored: tuple[float, float], winner: str | None, text: str) -> None:
    timed = with_rules("match={duration: 1 s}")
    numbers = in_play((0.3, 0.1, RADIUS))
    at = LAYOUT["world"].offsets["football.score"]
    numbers[at : at + 2] = scored
    ticks = 10**9 // timed.tick_ns
    apply(numbers, ticks - 1, deployment=timed)
    before = told(numbers, timed)
    assert not before["is_over"] and before["winner"] is None and " has won" not in before["text"]
    apply(numbers, 1, deployment=timed)
    after = told(numbers, timed)
    assert after == {
        "score": {"red": int(scored[0]), "blue": int(scored[1])},
        "own_goals": {"red": 0, "blue": 0},
        "clock_s": 1.0,
        "is_over": True,
        "winner": winner,
        "text": text,
    }
    assert field(numbers, "position", 3) == SPOT and not any(field(numbers, "linear_velocity", 3))
    rest = numbers.copy()
    assert apply(numbers, 2000, deployment=timed) == rest, "no clock, no kick-off, no dead ball"


def test_a_match_ends_with_its_goals() -> None:
    short = with_rules("match={goals: 2}")
    numbers = in_play((0.3, 0.1, RADIUS))
    for goals in (1, 2):
        place_ball(numbers, BALL, (-LINE_X - 0.01, 0.0, RADIUS), ROLLING)
        apply(numbers, deployment=short)
        assert (told(numbers, short)["is_over"], score(numbers)) == (goals == 2, [0.0, float(goals)])
        if goals == 1:
            apply(numbers, kickoff_ticks(short), deployment=short)
    assert told(numbers, short)["winner"] == "blue"


def test_balls_rest_apart_when_a_match_is_over() -> None:
    sets = ["table.rules.match={goals: 1}", "table.spare_balls=3"]
    short = deployed(*sets)
    layout = build_layout(short)
    numbers = initial_numbers(short, layout)
    *balls, absent = layout.of("ball")
    for ball in balls:
        place_ball(numbers, ball, (LINE_X + 0.01, 0.0, RADIUS), ROLLING)
    below = numbers[absent.start : absent.stop]
    apply(numbers, layout=layout, deployment=short)
    places = sorted(field(numbers, "position", 3, ball)[1] for ball in balls)
    assert places == pytest.approx([-4 * RADIUS, 0.0, 4 * RADIUS])
    assert numbers[absent.start : absent.stop] == below, "one that is absent is not laid down"


def test_without_a_match_play_has_no_end() -> None:
    endless = with_rules("match=null")
    numbers = in_play((0.3, 0.1, RADIUS))
    at = LAYOUT["world"].offsets["football.score"]
    numbers[at : at + 2] = [1000.0, 0.0]
    numbers[LAYOUT["world"].offsets["football.played_ticks"]] = 1e9
    assert not told(apply(numbers, deployment=endless), endless)["is_over"]


def test_marks_have_own_goals_and_the_end_to_the_tick() -> None:
    short = with_rules("match={goals: 1}")
    numbers = in_play((-TABLE.lines["goal"].x, 0.0, RADIUS))
    touch(numbers, {"blue.goal": 3.0})
    before = Frame(0, LAYOUT, np.array(numbers))
    rule = rules_of(short, LAYOUT)["football"]
    for tick in range(7):
        if tick == 4:
            shoot(numbers, 1.0)
        rule.apply(WritableView(tick, numbers))
    after = Frame(10, LAYOUT, np.array(numbers))
    assert list(rule.marks(before, after)) == [
        (4, "own_goal", "own goal of blue, 1 : 0"),
        (4, "end", "end of the match, 1 : 0"),
    ]


@pytest.mark.parametrize("match", ["{}", "{duration: null}", "{goals: null, duration: null}"])
def test_a_match_that_nothing_ends_is_refused(match: str) -> None:
    with pytest.raises(DeploymentError, match=r"table\.rules\.match: a match that nothing ends"):
        with_rules(f"match={match}")

"""Who computes what: islands from the frame alone, one solver each, and never more than three rods with the ball."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from math import dist, hypot
from pathlib import Path
from typing import Final

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.library.table.rod import RodRobot
from foosim.library.table.settings import table_of
from foosim.world.assembly.islands import Assignment, islands_of, table_reach_of, touching_of
from foosim.world.assembly.world import initial_numbers
from foosim.world.component_types.descriptions import ABSENT
from foosim.world.layout import Layout, build_layout

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
DEPLOYMENT: Final = load_deployment(TABLE.read_text(), TABLE.name)
LAYOUT: Final = build_layout(DEPLOYMENT)
SPARES: Final = load_deployment(apply_sets(TABLE.read_text(), TABLE.name, ["table.spare_balls=2"]), TABLE.name)
THREE: Final = build_layout(SPARES)
"""Three balls, of which two may be absent."""
AXES: Final = {
    name: table_of(DEPLOYMENT).lines[robot.line].x * (1.0 if robot.team == "red" else -1.0)
    for name, robot in DEPLOYMENT.robots.items()
    if isinstance(robot, RodRobot)
}
SPEED: Final = table_of(DEPLOYMENT).ball.speed_limit
RADIUS: Final = table_of(DEPLOYMENT).ball.radius
CORNER: Final = hypot(table_of(DEPLOYMENT).rod.foot_radius, table_of(DEPLOYMENT).rod.foot.length / 2)
"""How far a figure reaches from its rod's axis, whatever the rod's angle."""

Position = tuple[float, float, float]
xs = st.one_of(st.floats(-0.8, 0.8), st.sampled_from([0.0, 0.149, 0.2985, -0.2985, *AXES.values()]), st.floats(-50, 50))
positions = st.tuples(xs, st.floats(-0.4, 0.4), st.one_of(st.just(RADIUS), st.floats(-2.0, 2.0)))


def numbers_with(layout: Layout, balls: Mapping[str, Position], deployment: Deployment = DEPLOYMENT) -> list[float]:
    numbers = initial_numbers(deployment, layout)
    for name, position in balls.items():
        entity = layout[name]
        start = entity.offsets["position"]
        numbers[start : start + 3] = position
        if entity.can_leave:
            numbers[entity.offsets[ABSENT]] = 0.0
    return numbers


def islands(layout: Layout, balls: Mapping[str, Position], deployment: Deployment = DEPLOYMENT) -> list[set[str]]:
    numbers = numbers_with(layout, balls, deployment)
    absent = [entity.index for entity in layout.entities if entity.is_absent(numbers)]
    reach = table_reach_of(deployment, layout).without(absent)
    found = islands_of(numbers, reach, touching_of(numbers, reach))
    return [{layout.entities[index].name for index in island.entities} for island in found]


def with_ball(position: Position, layout: Layout = LAYOUT) -> set[str]:
    return next(island for island in islands(layout, {"ball": position}) if "ball" in island)


def assignment(layout: Layout, nodes: Sequence[str], owners: Mapping[str, str] | None = None) -> Assignment:
    owners = owners or {name: nodes[number % len(nodes)] for number, name in enumerate(sorted(DEPLOYMENT.robots))}
    return Assignment(layout, table_reach_of(DEPLOYMENT, layout), sorted(nodes), owners)


def solver_of_ball(position: Position, owners: Mapping[str, str]) -> str:
    shares = assignment(LAYOUT, sorted(set(owners.values())), owners).shares(numbers_with(LAYOUT, {"ball": position}))
    return next(node for node, share in shares.items() if LAYOUT["ball"].index in share.solved)


def by_hand(balls: Mapping[str, Position]) -> list[set[str]]:
    """Islands from their definition: whose grown volumes overlap belong together."""
    reach = table_reach_of(DEPLOYMENT, THREE)
    groups = [{name} for name in [*balls, *AXES]]

    def join(one: str, other: str) -> None:
        first, second = (next(group for group in groups if name in group) for name in (one, other))
        if first is not second:
            groups.remove(second)
            first |= second

    for one, other in combinations(balls, 2):
        if all(abs(a - b) <= 2 * reach.ball_m for a, b in zip(balls[one], balls[other], strict=True)):
            join(one, other)
    for ball, (x, _, z) in balls.items():
        for rod, axis in AXES.items():
            low, high = reach.z_low_m - reach.ball_m, reach.z_high_m + reach.ball_m
            limit = reach.ball_m + reach.half_width_m
            if axis - limit <= x <= axis + limit and low <= z <= high:
                join(ball, rod)
    return groups


@settings(max_examples=400)
@given(balls=st.fixed_dictionaries(dict.fromkeys(("ball", "ball-2", "ball-3"), positions)))
def test_islands_are_those_whose_volumes_overlap(balls: dict[str, Position]) -> None:
    assert sorted(map(sorted, islands(THREE, balls))) == sorted(map(sorted, by_hand(balls)))


@settings(max_examples=300)
@given(
    position=positions,
    direction=st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(any),
    time_s=st.floats(0.0, DEPLOYMENT.tick_ns / 1e9),
)
def test_nothing_outside_its_island_is_touched_within_the_tick(
    position: Position, direction: Position, time_s: float
) -> None:
    """Whatever its present speed: a resting ball leaves a kick faster than any that rolls."""
    length = dist(direction, (0.0, 0.0, 0.0))
    x, _, z = (at + way / length * SPEED * time_s for at, way in zip(position, direction, strict=True))
    island = with_ball(position)
    height = table_of(DEPLOYMENT).rod.axis_height
    touched = {rod for rod, axis in AXES.items() if hypot(x - axis, z - height) <= RADIUS + CORNER}
    assert touched <= island


@settings(max_examples=400)
@given(position=positions)
def test_the_balls_island_never_holds_more_than_three_rods(position: Position) -> None:
    assert len(with_ball(position) - {"ball"}) <= 3


def test_over_the_whole_table_it_holds_one_to_three() -> None:
    counts = {len(with_ball((x / 1000, 0.0, RADIUS))) - 1 for x in range(-690, 691)}
    assert counts == {1, 2, 3}


def test_the_tick_makes_the_island_not_the_speed() -> None:
    numbers = numbers_with(LAYOUT, {"ball": (0.1, 0.0, RADIUS)})
    reach = table_reach_of(DEPLOYMENT, LAYOUT)
    at_rest = islands_of(numbers, reach, touching_of(numbers, reach))
    start = LAYOUT["ball"].offsets["linear_velocity"]
    numbers[start : start + 3] = [-SPEED, SPEED, 0.0]
    for rod in LAYOUT.of("rod"):
        numbers[rod.offsets["joint_velocities"] + 1] = 200.0
    assert islands_of(numbers, reach, touching_of(numbers, reach)) == at_rest
    slower = load_deployment(apply_sets(TABLE.read_text(), TABLE.name, ["tick=10 ms", "substeps=20"]), TABLE.name)
    assert len(islands(LAYOUT, {"ball": (0.1, 0.0, RADIUS)}, slower)) < len(at_rest)


# --- solvers ---------------------------------------------------------------------------------------------------------


def test_ties_go_to_the_first_name() -> None:
    owners = dict.fromkeys(DEPLOYMENT.robots, "a")
    assert abs(AXES["red.midfield"]) == abs(AXES["blue.midfield"])
    assert solver_of_ball((0.0, 0.0, RADIUS), {**owners, "red.midfield": "b"}) == "a", "blue before red"
    assert solver_of_ball((0.0, 0.0, RADIUS), {**owners, "blue.midfield": "b"}) == "b"
    assert solver_of_ball((-1e-12, 0.0, RADIUS), {**owners, "red.midfield": "b"}) == "b", "nearer wins over names"


@pytest.mark.parametrize("position", [(5.0, 0.0, RADIUS), (0.0, 0.0, 0.9), (0.075, 0.0, -0.8), (-1e6, 1e6, 1e6)])
def test_a_ball_off_the_table_is_the_first_nodes(position: Position) -> None:
    assert with_ball(position) == {"ball"}
    assert solver_of_ball(position, dict.fromkeys(DEPLOYMENT.robots, "z") | {"red.attack": "b"}) == "b"


@settings(max_examples=150)
@given(
    balls=st.fixed_dictionaries(dict.fromkeys(("ball", "ball-2", "ball-3"), positions)),
    owned=st.lists(st.integers(0, 3), min_size=9, max_size=9),
)
def test_every_entity_has_one_solver_and_islands_are_never_split(balls: dict[str, Position], owned: list[int]) -> None:
    nodes = ["n1", "n2", "n3", "n4"]
    owners = {name: nodes[at] for name, at in zip(sorted(DEPLOYMENT.robots), owned, strict=True)}
    whole = assignment(THREE, nodes, owners)
    shares = whole.shares(numbers_with(THREE, balls))
    assert list(shares) == nodes, "every node has a share, if only an empty one"
    assert sorted(i for share in shares.values() for i in share.solved) == list(range(len(THREE.entities)))
    bodies = [island for share in shares.values() for island in share.islands]
    assert sorted(map(sorted, bodies)) == sorted(
        sorted(THREE[name].index for name in island) for island in islands(THREE, balls)
    ), "islands do not depend on who owns what"
    for share in shares.values():
        assert list(share.solved) == sorted(share.solved)
        assert {i for island in share.islands for i in island} <= set(share.solved)
    for node, share in shares.items():
        for island in share.islands:
            rods = [THREE.entities[i].name for i in island if THREE.entities[i].model == "rod"]
            near = [
                (abs(balls[THREE.entities[i].name][0] - AXES[rod]), rod)
                for i in island
                if THREE.entities[i].model == "ball"
                for rod in rods
            ]
            expected = owners[min(near)[1]] if near else (owners[rods[0]] if rods else "n1")
            assert node == expected, (balls, island)


def test_moving_the_ball_a_little_does_not_make_new_shares() -> None:
    """What is asked every tick is remembered by neighbourhood: the same objects, not only equal ones."""
    whole = assignment(LAYOUT, ["n1", "n2"])
    one = whole.shares(numbers_with(LAYOUT, {"ball": (0.1, 0.0, RADIUS)}))
    assert whole.shares(numbers_with(LAYOUT, {"ball": (0.1001, 0.2, RADIUS)})) is one
    assert whole.shares(numbers_with(LAYOUT, {"ball": (-0.4, 0.0, RADIUS)})) is not one

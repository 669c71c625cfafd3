"""From where a rover is to its wheels: towards its goal, aside from what is in the way, and where it thinks it is."""

from __future__ import annotations

from collections.abc import Callable
from math import pi

import pytest

from foosim.deployment.loader import load_deployment
from foosim.library.generic.pose import Pose
from foosim.library.mobile.hall_settings import hall_of
from foosim.library.mobile.odometry import WheelTravel
from foosim.library.mobile.players.roadmap import Roadmap, roadmap_of
from foosim.library.mobile.players.steering import Estimate, Steering, least
from foosim.library.mobile.wheel_speeds import Drive

FAR = (4.0,) * 16


@pytest.fixture
def steering(fleet_text: Callable[..., str]) -> Steering:
    return Steering(hall_of(load_deployment(fleet_text(2), "hall.yaml")).rover)


def at(x: float, y: float, heading: float) -> Estimate:
    estimate = Estimate(0.45)
    estimate.fix(1, Pose(x, y, heading))
    return estimate


def seen(**ways: float) -> tuple[float, ...]:
    """Free ways of 16 rays; `ahead`, `left`, `behind` and `right` may be nearer."""
    rays = {"ahead": 0, "left": 4, "behind": 8, "right": 12}
    near = {rays[name]: way for name, way in ways.items()}
    return tuple(near.get(ray, 4.0) for ray in range(16))


def test_it_goes_straight_to_a_goal_ahead_and_turns_to_one_aside(steering: Steering) -> None:
    assert steering.towards(at(0, 0, 0), (5, 0), FAR, 1.0) == Drive(1.0, 1.0)
    drive = steering.towards(at(0, 0, 0), (0, 5), FAR, 1.0)
    assert drive.right > 0 > drive.left and drive.left == pytest.approx(-drive.right)
    drive = steering.towards(at(0, 0, pi), (5, -0.1), FAR, 1.0)
    assert drive.right > 0 > drive.left, "the shorter way round"
    drive = steering.towards(at(0, 0, 0.3), (5, 0), FAR, 1.0)
    assert 0 < drive.right < drive.left <= 1.2


def test_it_slows_down_before_its_goal_and_stands_there(steering: Steering) -> None:
    speeds = [steering.towards(at(0, 0, 0), (way, 0), FAR, 1.0).left for way in (3.0, 0.5, 0.2, 0.06)]
    assert speeds == sorted(speeds, reverse=True) and speeds[-1] == pytest.approx(0.15)
    assert steering.towards(at(0, 0, 0), (0.04, 0), FAR, 1.0) == Drive(0.0, 0.0)


def test_it_turns_aside_to_the_right_of_what_is_ahead_or_to_where_room_is(steering: Steering) -> None:
    drive = steering.towards(at(0, 0, 0), (5, 0), seen(ahead=0.6), 1.0)
    assert drive.left > drive.right
    drive = steering.towards(at(0, 0, 0), (5, 0), seen(ahead=0.6, right=0.3), 1.0)
    assert drive.left < drive.right
    assert steering.towards(at(0, 0, 0), (0.5, 0), seen(ahead=0.6), 1.0).left == pytest.approx(0.48), "behind the goal"


def test_it_gets_away_from_what_nearly_touches_it(steering: Steering) -> None:
    drive = steering.towards(at(0, 0, 0), (5, 0), seen(ahead=0.1), 1.0)
    assert drive.left + drive.right < 0
    drive = steering.towards(at(0, 0, 0), (5, 0), seen(behind=0.1), 1.0)
    assert drive.left + drive.right > 0


def test_no_wheel_is_asked_for_more_than_it_can(steering: Steering) -> None:
    for heading in range(-6, 7):
        drive = steering.towards(at(0, 0, heading / 2), (5, 3), FAR, 3.0)
        assert max(abs(drive.left), abs(drive.right)) <= 1.2


def test_its_wheels_tell_it_where_it_is_between_two_poses() -> None:
    estimate = at(1.0, 2.0, pi / 2)
    estimate.roll(WheelTravel(10.0, 10.0))
    estimate.roll(WheelTravel(10.5, 10.5))
    assert (estimate.x, estimate.y, estimate.driven) == pytest.approx((1.0, 2.5, 0.5))
    estimate.roll(WheelTravel(10.5 - 0.45 * pi / 4, 10.5 + 0.45 * pi / 4))
    assert abs(estimate.heading) == pytest.approx(pi)
    estimate.fix(2, Pose(1.1, 2.5, -pi + 0.2))
    assert (estimate.x, estimate.heading) == pytest.approx((1.05, -pi + 0.1))
    estimate.fix(2, Pose(9.0, 9.0, 0.0))
    assert estimate.x == pytest.approx(1.05), "a pose counts once"
    estimate.fix(3, Pose(7.0, 8.0, 0.0))
    assert (estimate.x, estimate.y) == (7.0, 8.0), "too far away for wheels that slip"


def test_the_shortest_ray_of_a_sector() -> None:
    ranges = tuple(float(ray) for ray in range(16))
    assert least(ranges, 0.0, 0.5) == 0.0 and least(ranges, pi / 2, 0.5) == 3.0 and least(ranges, -pi / 2, 0.1) == 12.0
    assert least((), 0.0, 1.0) == float("inf")


def test_a_roadmap_goes_through_doors_and_round_shelves(fleet_text: Callable[..., str]) -> None:
    roadmap = roadmap_of(load_deployment(fleet_text(2), "hall.yaml"), 2.5)
    assert len(roadmap.spots) == 121 and all(roadmap.neighbours)
    west, east = roadmap.nearest(3.75, 6.25), roadmap.nearest(6.25, 6.25)
    assert east in roadmap.neighbours[west] and west in roadmap.neighbours[east], "through the northern door"
    above, below = roadmap.nearest(3.75, 1.25), roadmap.nearest(6.25, 1.25)
    assert below not in roadmap.neighbours[above], "not through concrete"
    assert roadmap.step_towards(above, {below}, ()) == roadmap.nearest(3.75, 3.75)
    assert roadmap.step_towards(above, {below}, {west}) == roadmap.nearest(3.75, -1.25), "by the other door"
    assert roadmap.step_towards(above, {below}, set(range(121)) - {below}) is None
    assert roadmap.step_towards(above, {above}, ()) == above
    assert reached(roadmap, above) == 121


def reached(roadmap: Roadmap, start: int) -> int:
    seen, todo = {start}, [start]
    while todo:
        fresh = set(roadmap.neighbours[todo.pop()]) - seen
        seen |= fresh
        todo += fresh
    return len(seen)

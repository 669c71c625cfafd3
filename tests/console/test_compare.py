"""Distances between two sources: what is known between samples, and what is not."""

from __future__ import annotations

from itertools import pairwise
from math import cos, pi, sin
from pathlib import Path

import numpy as np
import pytest

from foosim.console.clock.comparing import POINTS, Comparison, Course
from foosim.console.recorded.recording import Recording
from foosim.console.shown.tracks import Track

MS = 1_000_000
UPRIGHT = (0.0, 0.0, 0.0, 1.0)


def track(*samples: tuple[int, float]) -> Track:
    """Something that moves along x: (time in ms, x)."""
    poses = [(x, 0.0, 0.0, *UPRIGHT) for _, x in samples]
    return Track(np.array([at * MS for at, _ in samples]), np.array(poses))


def test_between_two_samples_a_place_lies_on_the_line_and_a_turn_on_the_arc() -> None:
    half = (0.0, 0.0, sin(pi / 2), cos(pi / 2))
    turning = Track(np.array([0, 100 * MS]), np.array([(0.0, 0.0, 0.0, *UPRIGHT), (0.4, 0.8, 0.0, *half)]))
    found = turning.at(25 * MS)
    assert found is not None
    assert found[0] == pytest.approx((0.1, 0.2, 0.0)) and found[1] == pytest.approx((0, 0, sin(pi / 8), cos(pi / 8)))
    assert turning.at(100 * MS) == ((0.4, 0.8, 0.0), half), "a sample itself is as it was read"


def test_before_behind_in_a_gap_and_in_a_jump_nothing_is_known() -> None:
    moved = track((0, 0.0), (20, 0.01), (40, 0.9), (60, 0.91), (2000, 1.0))
    assert [moved.at(at * MS) is None for at in (-1, 0, 10, 20, 30, 40, 50, 60, 61, 1999, 2000, 2001)] == [
        *(True, False, False, False, True, False, False, False, True, True, False, True)
    ]


def test_a_series_has_holes_where_one_side_is_not_known_and_grows_with_the_span() -> None:
    ours, theirs = track((0, 0.0), (1000, 1.0)), track((100, 0.3), (500, 0.3))

    comparison = Comparison(
        lambda at: {"ball": pose} if (pose := ours.at(at)) else {},
        lambda at: {"ball": pose} if (pose := theirs.at(at)) else {},
        MS,
    )
    comparison.over(0, 1000)
    while not comparison.is_complete:
        comparison.work(37)
    content = comparison.as_json(400)
    assert content["entities"] == [{"name": "ball", "distance_m": 0.1}]
    series = dict(map(tuple, content["series"]))
    assert len(series) <= POINTS + 1
    assert series[0] is None and series[600] is None and series[200] == 0.1 and series[500] == 0.2
    comparison.over(0, 1100)
    assert not comparison.is_complete, "the points of what came are still to be made"


def test_a_capture_is_nowhere_from_itself_and_interpolated_between_its_frames(run: Path) -> None:
    one, other = (Recording(run).poses_at for _ in range(2))
    for tick in (0, 10, 15, 123, 300):
        poses = one(tick * 2 * MS)
        assert poses == other(tick * 2 * MS) and "ball" in poses and "red.goal" in poses
    ball = [one(tick * 2 * MS)["ball"][0] for tick in (100, 105, 110)]
    assert ball[1] == pytest.approx([(a + b) / 2 for a, b in zip(ball[0], ball[2], strict=True)])
    assert one(301 * 2 * MS) == {} and one(-1) == {}
    assert "red.goal/slide" in one(0, links=True) and "red.goal/slide" not in one(0)


def test_a_course_has_the_newest_point_a_hole_where_nobody_looked_and_forgets_what_was_later() -> None:
    course = Course()
    for tick in (10, 20):
        told = course.take(tick, [("ball", tick / 10), ("rod", 0.5)])
    assert told["entities"] == [{"name": "ball", "distance_m": 2.0}, {"name": "rod", "distance_m": 0.5}]
    assert (told["at"], told["series"]) == (20, [[10, 1.0], [20, 2.0]])
    course.interrupt()
    assert course.take(50, [("ball", 5.0)])["series"] == [[10, 1.0], [20, 2.0], [21, None], [50, 5.0]]
    assert course.take(20, [("ball", 7.0)])["series"] == [[10, 1.0], [20, 7.0]], "time went back"
    for tick in (30, 40, 50, 60, 70):
        told = course.take(tick, [])
    known = [at for at, metres in told["series"] if metres is None]
    assert told["entities"] == [] and known == [30, 60, 70], "of a hole the ends are kept"


def test_a_long_course_is_thinned_and_keeps_its_beginning_and_its_holes() -> None:
    course = Course()
    for tick in range(10_000):
        if tick == 5000:
            course.interrupt()
        series = course.take(2 * tick, [("ball", tick)])["series"]
    ticks = [at for at, _ in series]
    assert len(ticks) <= POINTS + 1 and ticks == sorted(set(ticks)) and (ticks[0], ticks[-1]) == (0, 19_998)
    assert max(later - at for at, later in pairwise(ticks)) < 20_000 / POINTS * 4
    (hole,) = (at for at, metres in series if metres is None)
    assert 10_000 - 2 * 20_000 / POINTS < hole < 10_000

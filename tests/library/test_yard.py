"""The yard: scouts bring crates over the border of two nodes into the zone, by sensors and radio alone; the quadrotor
flies by satellites and an inertial unit; the arm gives way.
"""

from __future__ import annotations

from functools import cache
from math import hypot
from pathlib import Path
from typing import Final

import pytest

from foosim.client.player import Sample
from foosim.deployment.loader import load_deployment
from foosim.library.mobile.players.yard_quadrotor import Watch
from foosim.library.mobile.players.yard_reports import (
    REPORT,
    WATCH,
    Heard,
    Report,
    decode_report,
    decode_watch,
    encode_report,
    encode_watch,
)
from foosim.library.rigid.joint_position import JointPositions
from foosim.library.rigid.players.yard_arm import NEAR_M, UPRIGHT, Arm
from foosim.simulation.run import Rehearsed, rehearse
from foosim.simulation.system import Settings
from foosim.world.frame import Frame
from tests.components.worlds import DEPLOY

YARD: Final[Path] = DEPLOY / "yard.yaml"
SEEDS: Final = range(1, 6)
TICKS_MAX: Final = 12_000
"""Two minutes of the world."""
ONE_CRATE: Final = (
    *("objects.crate.count=1", "objects.crate.at.x=-0.6 m", "rules.goal.at.x=1.6 m"),
    *("robots.scout-west.at.x=-1.45 m", "robots.scout-west.at.y=0.9 m", "robots.scout-east.at.x=-0.9 m"),
    "players.pilot-west.parameters.crates=[crate-1]",
    *("players.pilot-west.parameters.goals=[-0.1]", "players.pilot-east.parameters.goals=[1.4]"),
)
"""One crate, near the border and the zone, with a scout on either side."""


@cache
def text() -> str:
    return YARD.read_text()


class Course:
    """A run, and what was seen of it."""

    def __init__(self, ticks: int, nodes: int, seed: int = 1, sets: tuple[str, ...] = ()) -> None:
        self.won_tick = 0
        self.frames: list[Frame] = []
        of_seed = (f"seed={seed}", *sets)
        source = text()
        if sets:  # an entry of its own for what is no longer there
            source = source.replace("  crate-3: {at: {x: -4.8 m, y: 0.9 m, z: 0.2 m}}\n", "")
        self.result: Rehearsed = rehearse(
            source, YARD.name, ticks, nodes, sets=of_seed, settings=Settings(on_commit=self._see), folder=DEPLOY
        )

    def _see(self, frame: Frame) -> None:
        self.frames = [*self.frames[-1:], frame] if frame.tick % 10 else [*self.frames, frame]
        if not self.won_tick and frame.at("world", "goal.all_in"):
            self.won_tick = frame.tick


@cache
def one_crate() -> Course:
    return Course(1_800, 2, sets=ONE_CRATE)


def test_a_crate_comes_over_the_border_into_the_zone() -> None:
    """Both nodes compute it in turn, and nobody comes into quarantine."""
    course = one_crate()
    print(f"won at {course.won_tick / 100:g} s, {course.result.json['handovers']} hand-overs")
    assert course.won_tick > 0
    assert course.result.json["handovers"] >= 1
    assert course.result.json["zone goal"] == {
        "in": 1,
        "of": 1,
        "all_in": True,
        "since_s": course.won_tick / 100 - 0.01,
    }
    assert course.result.json["summary"] == [f"1 of 1 in the zone goal since {course.won_tick / 100 - 0.01:g} s"]
    last = course.frames[-1]
    assert not any(last.at(name, "quarantined") for name in ("arm", "crate-1", "eagle", "scout-east", "scout-west"))


@pytest.mark.campaign
@pytest.mark.parametrize("seed", SEEDS)
def test_it_is_won_on_one_two_and_three_nodes(seed: int) -> None:
    """All three crates, within two minutes of the world, with equal bits."""
    courses = [Course(TICKS_MAX, nodes, seed) for nodes in (1, 2, 3)]
    for nodes, course in enumerate(courses, 1):
        rest = course.result.json
        print(f"seed {seed}, {nodes} nodes: {rest['summary'][0]}, {rest['handovers']} hand-overs, rtf {rest['rtf']}")
    one, two, three = (course.result.digests for course in courses)
    assert one == two == three
    assert all(course.won_tick for course in courses)


# --- the quadrotor ---------------------------------------------------------------------------------------------------


def test_the_quadrotor_circles_where_it_is_told() -> None:
    """Within 15 cm of its circle, whose phase it knows; 3 s after it has come there."""
    its = Watch(load_deployment(text(), YARD.name), {"quadrotor": "eagle"}).settings
    off = []
    for frame in one_crate().frames:
        if frame.tick < 900:
            continue
        x, y, z = frame.vector("eagle", "position", 3)
        off.append(hypot(hypot(x, y) - its.radius, z - its.height))
        _, _, z, w = frame.vector("eagle", "orientation", 4)
        assert abs(z) < 0.1 and w > 0.9, "it looks ahead, upright"
    print(f"{max(off):.3f} m off at most")
    assert max(off) < 0.15


# --- messages and parameters -----------------------------------------------------------------------------------------


def test_a_report_is_what_it_was() -> None:
    told = Report(3, 12.5, -1.25, 0.5, 2, ((0.5, -1.0), (0.25, 2.0)))
    assert decode_report(encode_report(told)) == told
    assert decode_watch(encode_watch([told, told._replace(number=1, crates=())])) == [
        told,
        told._replace(number=1, crates=()),
    ]


@pytest.mark.parametrize("payload", [b"", b"x", None, b"\xff" * 15, encode_report(Report(1, 0.0, 0.0, 0.0, 0)) + b"x"])
def test_a_damaged_report_is_none(payload: object) -> None:
    assert decode_report(payload) is None
    assert decode_watch(payload) == []


def heard(*reports: tuple[str, str, bytes]) -> dict[tuple[str, str], Sample]:
    return {(source, channel): Sample(source, channel, 0, 0, 0, value) for source, channel, value in reports}


def test_the_newest_report_counts_whoever_passes_it_on() -> None:
    old, new = Report(1, 1.0, 0.0, 0.0, 0), Report(1, 2.0, 5.0, 0.0, 1)
    one = Heard()
    one.take(heard(("pilot-west", REPORT, encode_report(old)), ("watch", WATCH, encode_watch([new]))))
    assert one.reports == {1: new}
    one.take(heard(("pilot-west", REPORT, encode_report(old))))
    assert one.reports == {1: new}


def test_the_arm_stays_away_from_a_side_where_a_scout_is_or_may_be() -> None:
    arm = Arm(load_deployment(text(), YARD.name), {"arm": "arm", "scouts": ["scout-east", "scout-west"]})
    assert arm.act(0, {}).commands["arm"] == JointPositions(UPRIGHT), "it has heard nobody"

    def side(east: tuple[float, float], west: tuple[float, float], tick: int) -> float:
        at = tick / 100
        told = [Report(2, at, *east, 0), Report(3, at, *west, 0)]
        command = arm.act(tick, heard(("watch", WATCH, encode_watch(told)))).commands["arm"]
        assert isinstance(command, JointPositions)
        return command.positions[0]

    far = (0.6 + NEAR_M + 0.5, 0.0)
    assert side((0.6, 1.0), far, 10) < 0.0
    assert side((0.6, -1.0), far, 20) > 0.0
    assert side((0.6, 1.0), (0.6, -1.0), 30) == 0.0
    assert side((0.6, 1.0), far, 40) < 0.0
    assert arm.act(400, {}).commands["arm"] == JointPositions(UPRIGHT), "silence"

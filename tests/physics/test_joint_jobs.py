"""Joints along positions at times, and heads that look at angles and places: where they are, and what is refused."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from functools import cache
from itertools import accumulate
from math import asin, cos, pi, sin
from typing import Any, Final

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import PchipInterpolator

from foosim.client.player import Packet
from foosim.common.errors import DeploymentError
from foosim.deployment.assets import pin_assets
from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import Deployment
from foosim.library.rigid.joint_trajectory import JointTrajectory, TrajectoryFailure
from foosim.library.rigid.spline import fastest, position_at
from foosim.simulation.simulation import Simulation
from foosim.world.component_types.jobs import JobState
from foosim.world.component_types.per_field import codec_of
from foosim.world.component_types.registry import find_component
from foosim.world.components.fitted import actuators_of
from foosim.world.layout import build_layout
from tests.components.worlds import DEPLOY
from tests.heads import EYE_M, TILT_M, folder, head
from tests.kinematic_yard import TICK_S, yard_text

NAME: Final = "heads.yaml"
ENGINE: Final = {"engine": "mujoco", "substeps": 4, "assets": "models"}
TIMES: Final = (0.4, 0.9, 1.5)
ROWS: Final = ((0.3, 0.2), (-0.4, 0.5), (-0.5, 0.6))
FOLLOWED_RAD: Final = 1e-3
"""How near joints are to their ways."""
rising = st.lists(st.floats(0.01, 2.0), min_size=1, max_size=8)


def deployment(robots: dict[str, Any], where: Any = None, **sections: Any) -> Deployment:
    text = yard_text(robots, clients={"ann": {}}, **ENGINE, **sections)
    pinned, files = pin_assets(text, NAME, where or folder())
    return load_deployment(pinned, NAME).with_assets(files)


@cache
def heads() -> Deployment:
    """A head for each kind of actuator; the last one is on its side, and its tilt the other way round."""
    at = {"link": "skull", "x": f"{EYE_M[0]} m", "z": f"{EYE_M[1]} m"}
    side = head("look_at", {"y": "15 m", "z": "2 m", "roll": "90 deg"}, at=at)
    return deployment(
        {
            "arm": head("joint_trajectory", {}, points=3, tolerance=1e-3),
            "eye": head("look_at", {"y": "5 m", "yaw": "70 deg"}, at={"link": "eye"}, patience="1 s"),
            "head": head("pan_tilt", {"y": "10 m"}, patience="1 s"),
            "side": {**side, "file": "upward.urdf"},
        }
    )


@pytest.fixture
def its() -> Any:
    with ExitStack() as stack:
        yield stack.enter_context(Simulation(heads(), agents=["ann"]))


def tell(its: Simulation, robot: str, command: Any, ticks: int) -> JobState:
    """Send a command and compute some ticks; return how the last job stands."""
    kind = its.declared.robots[robot].actuators["go"].kind
    its.advance({"ann": [Packet(robot, "go", codec_of(find_component("actuator", kind)).encode(command))]}, ticks)
    return JobState(int(its.frame.at(robot, "go.jobs_states")))


def value(kind: str, *values: Any) -> Any:
    return codec_of(find_component("actuator", kind)).kind(*values)


# --- the way ---------------------------------------------------------------------------------------------------------


@settings(max_examples=60)
@given(rising, st.data())
def test_a_way_passes_its_points_never_beyond_them_and_nowhere_faster_than_it_says(
    spans: list[float], data: st.DataObject
) -> None:
    times = [*accumulate(spans, initial=0.0)]
    rounded = st.floats(-3.0, 3.0).map(lambda place: round(place, 12))  # scipy divides by what is next to nothing
    places = data.draw(st.lists(rounded, min_size=len(times), max_size=len(times)))
    found = np.linspace(0.0, times[-1], 400)
    way = np.array([position_at(times, places, time) for time in found])
    assert [position_at(times, places, time) for time in times] == pytest.approx(places, abs=1e-12)
    left = np.minimum(np.searchsorted(times, found, side="right") - 1, len(spans) - 1)
    ends = np.sort(np.array([np.array(places)[left], np.array(places)[left + 1]]), axis=0)
    assert (way >= ends[0] - 1e-12).all() and (way <= ends[1] + 1e-12).all()
    speeds, most = np.abs(np.diff(way) / np.diff(found)), fastest(times, places)
    assert speeds.max() <= most * (1.0 + 1e-6) + 1e-9
    if len(spans) > 2:  # scipy has other speeds at both ends
        inside = (found >= times[1]) & (found <= times[-2])
        assert way[inside] == pytest.approx(PchipInterpolator(times, places)(found[inside]), abs=1e-9)


def test_between_two_points_it_is_half_as_fast_again_in_the_middle() -> None:
    assert fastest((0.0, 2.0), (1.0, 3.0)) == 1.5
    assert position_at((0.0, 2.0), (1.0, 3.0), 0.5) == 1.0 + 2.0 * (3.0 / 16.0 - 2.0 / 64.0)
    assert position_at((0.0, 2.0), (1.0, 3.0), 9.0) == 3.0


# --- along it --------------------------------------------------------------------------------------------------------


def ways(start: Sequence[float], time: float) -> list[float]:
    return [position_at((0.0, *TIMES), way, time) for way in zip(start, *ROWS, strict=True)]


def test_joints_follow_their_ways_and_the_job_is_done_at_the_end(its: Simulation) -> None:
    """From where they are, also when they are on another way; a world that begins in between is the same."""
    assert tell(its, "arm", value("joint_trajectory", (0.5,), ((-0.2, 0.1),), 1.0), 30) == JobState.RUNNING
    start = its.frame.vector("arm", "joint_positions", 2)
    assert tell(its, "arm", value("joint_trajectory", TIMES, ROWS, 2.0), 1) == JobState.RUNNING
    farthest, between = 0.0, its.frame
    for tick in range(1, 151):
        if tick == 60:
            between = its.frame
        if tick > 20:  # before it brakes from the first way
            at = its.frame.vector("arm", "joint_positions", 2)
            wanted = ways(start, tick * TICK_S)
            farthest = max(farthest, *[abs(here - there) for here, there in zip(at, wanted, strict=True)])
        state = JobState(int(its.frame.at("arm", "go.jobs_states")))
        assert state == (JobState.RUNNING if tick * TICK_S < TIMES[-1] else JobState.DONE), tick
        last = its.frame
        its.advance({}, 1)
    assert farthest < FOLLOWED_RAD
    with Simulation(heads(), agents=["ann"], start=between) as other:
        other.advance({}, last.tick - between.tick)
        assert other.frame.digest == last.digest
    its.advance({}, 50)
    assert its.frame.vector("arm", "joint_positions", 2) == pytest.approx(ROWS[-1], abs=1e-4)


def test_an_arm_follows_within_a_milliradian() -> None:
    """Its last joint, whose flange weighs nearly nothing, is another actuator's."""
    go = {
        "kind": "joint_trajectory",
        "joints": ["shoulder_*", "upper_arm_roll", "elbow_pitch", "forearm_roll", "wrist_pitch"],
    }
    arm = {"model": "urdf", "file": "arm.urdf", "fixed": True}
    arm["actuators"] = {"go": go, "rest": {"kind": "joint_position", "joints": ["wrist_roll"]}}
    times, rows = (1.0, 2.0), ((0.6, 0.4, -0.5, 0.9, 0.3, -0.4), (-0.2, 0.5, 0.5, -0.3, 0.0, 0.7))
    with Simulation(deployment({"arm": arm}, DEPLOY), agents=["ann"]) as its:
        assert tell(its, "arm", value("joint_trajectory", times, rows, 1.0), 1) == JobState.RUNNING
        for tick in range(1, 200):
            at = its.frame.vector("arm", "joint_positions", 7)[:6]
            wanted = [position_at((0.0, *times), (0.0, *way), tick * TICK_S) for way in zip(*rows, strict=True)]
            assert at == pytest.approx(wanted, abs=FOLLOWED_RAD)
            its.advance({}, 1)


@pytest.mark.parametrize(
    ("failure", "times", "rows", "why"),
    [
        (TrajectoryFailure.TIMES, (1.0, 1.0), ((0.1, 0.1), (0.2, 0.2)), "its times do not rise"),
        (TrajectoryFailure.TIMES, (1.0, 0.5), ((0.1, 0.1), (0.2, 0.2)), "its times do not rise"),
        (TrajectoryFailure.JOINTS, (1.0,), ((0.1,),), "1 positions at a time: one for each of 2 joints is valid"),
        (
            TrajectoryFailure.JOINTS,
            (1.0,),
            ((0.1, 0.1, 0.1),),
            "3 positions at a time: one for each of 2 joints is valid",
        ),
        (
            TrajectoryFailure.POINTS,
            (1.0,),
            ((0.1, 0.1), (0.2, 0.2)),
            "1 times and positions at 2: as many are valid, 1 to 3",
        ),
        (TrajectoryFailure.POINTS, (), (), "0 times and positions at 0: as many are valid, 1 to 3"),
        (
            TrajectoryFailure.POINTS,
            (1.0, 2.0, 3.0, 4.0),
            ((0.1, 0.1),) * 4,
            "4 times and positions at 4: as many are valid, 1 to 3",
        ),
        (TrajectoryFailure.LIMITS, (9.0,), ((0.1, 1.3),), "tilt to 1.3, beyond its limits -1.2 to 1.2"),
        (TrajectoryFailure.SPEED, (0.5,), ((1.5, 0.0),), ""),
        (TrajectoryFailure.SPEED, (1.0, 1.2), ((0.0, 0.0), (0.0, 0.6)), ""),
    ],
)
def test_what_no_joint_can_follow_is_refused_and_its_job_fails(
    its: Simulation, failure: TrajectoryFailure, times: Any, rows: Any, why: str
) -> None:
    """What went on does not, for another job has come."""
    assert tell(its, "arm", value("joint_trajectory", (0.5,), ((0.2, 0.1),), 1.0), 3) == JobState.RUNNING
    command, before = value("joint_trajectory", times, rows, 2.0), its.frame.vector("arm", "go.times", 3)
    assert tell(its, "arm", command, 2) == JobState.FAILED
    assert its.frame.at("arm", "refused") == 1.0
    assert its.frame.at("arm", "go.failure") == failure and JointTrajectory.FAILURES[failure]
    assert its.frame.vector("arm", "go.times", 3) == before
    (fitted,) = actuators_of(heads(), layout := build_layout(heads()), layout["arm"])
    assert fitted.examine(fitted.codec.encode(command)) == (why, ())
    assert fitted.examine(fitted.codec.encode(value("joint_trajectory", (), (), -2.0))) == ("", ())


def test_a_way_that_is_cancelled_ends_where_it_is(its: Simulation) -> None:
    tell(its, "arm", value("joint_trajectory", (1.0,), ((1.0, 0.5),), 1.0), 50)
    assert tell(its, "arm", value("joint_trajectory", (), (), -1.0), 1) == JobState.CANCELLED
    held = its.frame.vector("arm", "joint_positions", 2)
    its.advance({}, 50)
    assert its.frame.vector("arm", "joint_positions", 2) == pytest.approx(held, abs=0.01)


# --- heads -----------------------------------------------------------------------------------------------------------


def test_a_head_turns_to_its_angles(its: Simulation) -> None:
    assert tell(its, "head", value("pan_tilt", 1.0, -0.7, 1.0), 100) == JobState.DONE
    assert its.frame.vector("head", "joint_positions", 2) == pytest.approx((1.0, -0.7), abs=1e-3)
    assert tell(its, "head", value("pan_tilt", 0.0, 2.0, 2.0), 100) == JobState.DONE
    assert its.frame.vector("head", "joint_positions", 2) == pytest.approx((0.0, 1.2), abs=1e-3), "as its limits are"
    assert its.frame.at("head", "clamped") == 1.0


@pytest.mark.parametrize(
    ("kind", "command", "failed"),
    [("pan_tilt", (1.5, 0.0, 1.0), 70), ("joint_trajectory", ((1.0,), ((1.5, 0.0),), 1.0), 150)],
)
def test_what_is_in_the_way_of_a_head_fails_its_job(kind: str, command: Any, failed: int) -> None:
    """A wall beside it, half a second after it comes no nearer, or after the end."""
    wall = {"length": "1 m", "width": "20 cm", "height": "1 m", "at": {"y": "21 cm"}}
    scene = {"kind": "boxes", "boxes": {"wall": wall}}
    about = deployment({"head": head(kind, {}, patience="0.5 s")}, scene=scene)
    with Simulation(about, agents=["ann"]) as its:
        assert tell(its, "head", value(kind, *command), failed - 20) == JobState.RUNNING
        its.advance({}, 40)
        assert its.frame.at("head", "go.jobs_states") == JobState.FAILED
        if kind == "joint_trajectory":
            assert its.frame.at("head", "go.failure") == TrajectoryFailure.LATE
        held = its.frame.vector("head", "joint_positions", 2)
        assert 0.1 < held[0] < 1.4
        its.advance({}, 20)
        assert its.frame.vector("head", "joint_positions", 2) == pytest.approx(held, abs=0.01)


def looked(frame: Any, robot: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the place of an eye (m) and where it looks, from its joints."""
    pan, tilt = frame.vector(robot, "joint_positions", 2)
    tilt = -tilt if robot == "side" else tilt
    ahead = np.array([cos(pan) * cos(tilt), sin(pan) * cos(tilt), -sin(tilt)])
    above = np.array([cos(pan) * sin(tilt), sin(pan) * sin(tilt), cos(tilt)])
    place = np.array([0.05 * cos(pan), 0.05 * sin(pan), TILT_M]) + EYE_M[0] * ahead + EYE_M[1] * above
    if robot == "side":  # rolled by 90 degrees: its y is up, its z to the right
        turned = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
        return np.array([0.0, 15.0, 2.0]) + turned @ place, turned @ ahead
    yaw = np.array([[cos(s := 70.0 * pi / 180.0), -sin(s), 0.0], [sin(s), cos(s), 0.0], [0.0, 0.0, 1.0]])
    return np.array([0.0, 5.0, 0.0]) + yaw @ place, yaw @ ahead


@pytest.mark.parametrize(
    ("robot", "way"),
    [
        ("eye", (2.0, 1.0, 1.0)),
        ("eye", (-2.0, -3.0, 0.2)),
        ("eye", (0.6, 0.0, 0.2)),
        ("side", (2.0, 1.0, 0.5)),
        ("side", (-1.0, 1.5, 2.0)),
    ],
)
def test_an_eye_looks_at_a_place(its: Simulation, robot: str, way: tuple[float, float, float]) -> None:
    """From where it is: off the axes of both joints, and wherever its foot points."""
    base = np.array([0.0, {"eye": 5.0, "side": 15.0}[robot], {"eye": 0.0, "side": 2.0}[robot]])
    target = base + way
    assert tell(its, robot, value("look_at", *target, 1.0), 200) == JobState.DONE
    place, ahead = looked(its.frame, robot)
    to = (target - place) / np.linalg.norm(target - place)
    assert asin(min(1.0, float(np.linalg.norm(np.cross(ahead, to))))) < 1e-3
    assert ahead @ to > 0.0


def test_an_eye_turns_the_other_way_round_where_it_must(its: Simulation) -> None:
    """From a place behind it on one side to one on the other, across the limits of pan."""
    for job, side in enumerate((2.8, -2.8), 1):
        angle = 70.0 * pi / 180.0 + side
        sight = value("look_at", 3.0 * cos(angle), 5.0 + 3.0 * sin(angle), 0.6, float(job))
        assert tell(its, "eye", sight, 250) == JobState.DONE
        assert its.frame.vector("eye", "joint_positions", 2)[0] == pytest.approx(side, abs=0.01)


def test_what_an_eye_cannot_see_fails_its_job(its: Simulation) -> None:
    """Above it, beyond the limit of tilt."""
    assert tell(its, "eye", value("look_at", 0.0, 5.0, 9.0, 1.0), 90) == JobState.RUNNING
    its.advance({}, 120)
    assert its.frame.at("eye", "go.jobs_states") == JobState.FAILED
    assert its.frame.at("eye", "go.has_target") == 0.0


@pytest.mark.parametrize(
    ("kind", "about", "why"),
    [
        ("pan_tilt", {"joints": ["tilt", "pan"]}, "the second joint must be on the first: pan, then tilt"),
        ("pan_tilt", {"joints": "pan"}, "two joints that turn are valid, pan and tilt"),
        ("look_at", {"at": {"link": "neck"}}, "its joints do not turn this link"),
        ("look_at", {"at": {"link": "ear"}}, "head has no such link; there are foot, neck, skull, eye"),
        ("joint_trajectory", {"gain": "200 Hz"}, "a gain that overshoots"),
    ],
)
def test_a_deployment_says_what_does_not_fit(kind: str, about: dict[str, Any], why: str) -> None:
    with pytest.raises(DeploymentError, match=why):
        Simulation(deployment({"head": head(kind, {}, **about)}))

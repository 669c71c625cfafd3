"""Robots of the corpus run by the entries that are proposed for them: arms hold set-points under gravity, grippers are
coupled, legs stand still, and wheels roll.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import dist, hypot
from typing import Final

import pytest

from tests.corpus.running import Running
from tests.corpus.table import EXAMPLE, OWN, PYBULLET

HELD_RAD: Final = 2e-4
"""How far a held joint is from its set-point at most (rad; m)."""
FOLLOWED: Final = 2e-4
"""How far a joint is at most from the place that it has by the one that it follows (rad; m)."""
CREEP_M: Final = 2e-5
"""How far a robot that stands goes in two seconds."""
SLIP: Final = 0.01
"""The share by which a robot goes less far than its wheels roll: they sink into the floor by half a millimetre."""


@pytest.mark.parametrize(
    ("which", "path", "goal"),
    [
        (EXAMPLE, "ur_description/urdf/ur5_robot.urdf", (0.5, -0.8, 1.0, 0.3, 0.4, 0.2)),
        (EXAMPLE, "xarm_description/urdf/xarm7.urdf", (0.4, 0.5, 0.3, 0.8, 0.2, 0.6, 0.3)),
        (EXAMPLE, "panda_description/urdf/panda.urdf", (0.3, 0.5, -0.2, -1.8, 0.2, 2.0, 0.5, 0.02)),
        (PYBULLET, "kuka_iiwa/model_vr_limits.urdf", (0.4, 0.7, 0.3, 1.0, 0.2, 0.6, 0.3)),
        (PYBULLET, "xarm/xarm6_with_gripper.urdf", (0.4, -0.5, -0.8, 0.3, 0.6, 0.3, 0.4)),
        (OWN, "mimic_gripper.urdf", (0.5,)),
    ],
)
def test_arms_hold_their_set_points_under_gravity(which: str, path: str, goal: Sequence[float]) -> None:
    """Joints that follow others are where these have them."""
    with Running(which, path) as robot:
        robot.step(2.0, goal)
        for _ in range(5):
            robot.step(0.1)
            positions = dict(zip(robot.joints, robot["joint_positions"], strict=True))
            assert [positions[joint] for joint in robot.led] == pytest.approx(goal, rel=0.0, abs=HELD_RAD)
            for joint, (leader, ratio, offset) in robot.followers.items():
                assert positions[joint] == pytest.approx(ratio * positions[leader] + offset, rel=0.0, abs=FOLLOWED)
        assert max(map(abs, robot["joint_efforts"])) > 0.01, "nothing was to be held"


def folded(thigh: float, shin: float) -> Callable[[str], float]:
    """Return what the joints of a leg are at: its hip at 0."""
    places = {"thigh": thigh, "upper": thigh, "calf": shin, "lower": shin}
    return lambda joint: next((at for part, at in places.items() if part in joint), 0.0)


def anymal(joint: str) -> float:
    """Knees of the fore legs point to the back, those of the hind legs to the front."""
    at = {"HFE": 0.6, "KFE": -1.2}.get(joint[-3:], 0.0)
    return at if "F_" in joint else -at


@pytest.mark.parametrize(
    ("which", "path", "stance"),
    [
        (EXAMPLE, "anymal_c_simple_description/urdf/anymal.urdf", anymal),
        (EXAMPLE, "laikago_description/urdf/laikago.urdf", folded(0.9, -1.8)),
        (PYBULLET, "aliengo/aliengo.urdf", folded(0.9, -1.8)),
    ],
)
def test_legs_stand_still(which: str, path: str, stance: Callable[[str], float]) -> None:
    with Running(which, path) as robot:
        goal = [stance(joint) for joint in robot.joints]
        robot.stand(goal)
        robot.step(0.5, goal)
        position, orientation = robot["position"], robot["orientation"]
        robot.step(2.0)
        assert dist(position, robot["position"]) < CREEP_M
        assert robot["orientation"] == pytest.approx(orientation, abs=1e-4)
        assert robot["joint_positions"] == pytest.approx(goal, rel=0.0, abs=HELD_RAD)
        assert position[2] > 0.3


@pytest.mark.parametrize(
    ("which", "path", "speeds", "radius_m"),
    [
        (PYBULLET, "racecar/racecar.urdf", (20.0,) * 4, 0.05),
        (PYBULLET, "r2d2.urdf", (8.0,) * 4, 0.035),
        (OWN, "plugins.urdf", (5.0, 5.0), 0.08),
    ],
)
def test_wheels_roll_as_far_as_they_turn(which: str, path: str, speeds: Sequence[float], radius_m: float) -> None:
    """And straight ahead. They gain speed in a second: the tall one would fall."""
    with Running(which, path) as robot:
        for tenth in range(1, 11):
            robot.step(0.1, {"wheels": [speed * tenth / 10 for speed in speeds]})
        (x, y, _), before = robot["position"], robot.turned()
        robot.step(2.0)
        (to_x, to_y, _), after = robot["position"], robot.turned()
        ways = [abs(to - at) * radius_m for at, to in zip(before, after, strict=True)]
        assert min(ways) > 0.5 and max(ways) - min(ways) < 0.002 * max(ways)
        way = hypot(to_x - x, to_y - y)
        assert (1.0 - SLIP) * max(ways) < way <= max(ways)
        assert min(abs(to_x - x), abs(to_y - y)) < 0.005 * way

"""Sensors of what is around a robot, against closed forms: echoes, heights of the ground, entities by their tag."""

from __future__ import annotations

from collections.abc import Callable
from math import atan2, cos, hypot, pi, radians, sin, sqrt
from typing import Final

import numpy as np
import pytest

from foosim.common.errors import DeploymentError
from foosim.world.components.view import SensingView
from tests.world.test_beam_sensors import Robot

Text = Callable[..., str]
HIGH: Final = "at: {z: 150 cm}"


def test_an_echo_comes_from_what_faces_the_sonar(fleet_text: Text) -> None:
    """A wide block 3 m ahead, turned about z: its echo is lost beyond the angle at which the cone meets its normal."""
    for turned, cone, incidence in ((0.0, 30, 25), (38.0, 30, 25), (42.0, 30, 25), (20.0, 10, 14), (20.0, 10, 26)):
        block = f"shape: box, x: 5 m, y: -1 m, z: 1 m, yaw: {turned} deg, length: 2 cm, width: 8 m, height: 8 m"
        scenery = f"{{block: {{{block}}}}}"
        sonar = f"kind: sonar, range: 6 m, cone: {cone} deg, incidence: {incidence} deg, {HIGH}"
        (found,) = Robot(fleet_text, sonar, scenery=scenery).read()
        nearest = max(
            turned - cone / 2.0, 0.0
        )  # of a beam that meets the wall at this angle, on the side of its normal
        straight = 3.0 * cos(radians(turned)) - 0.01
        least = straight / cos(radians(nearest))
        if nearest <= incidence:
            assert found == pytest.approx(least, rel=1e-9 if nearest or not turned else 1e-3), (turned, cone, incidence)
        else:
            assert found == 6.0


def test_a_sonar_hears_a_pole_in_its_cone_and_nothing_in_its_dead_zone(fleet_text: Text) -> None:
    pole = "{pole: {shape: cylinder, x: 4 m, y: -80 cm, z: 2 m, radius: 10 cm, length: 4 m}}"
    way = hypot(2.0, 0.2) - 0.1
    (heard,) = Robot(fleet_text, f"kind: sonar, range: 9 m, {HIGH}", scenery=pole).read()
    assert way <= heard < way + 0.01, "a beam meets it nearly at its normal"
    (beyond,) = Robot(fleet_text, f"kind: sonar, range: 9 m, dead_zone: 2 m, {HIGH}", scenery=pole).read()
    assert beyond == 9.0
    drawn = Robot(fleet_text, f"kind: sonar, range: 9 m, {HIGH}", scenery=pole)
    one = drawn.sensor().sensor
    assert type(one).rays([one], drawn.numbers).shape == (61, 6)
    with pytest.raises(DeploymentError, match="the dead zone reaches as far as the range, 1 m"):
        Robot(fleet_text, f"kind: sonar, range: 1 m, dead_zone: 1 m, {HIGH}")


SLOPE: Final = "{slope: {shape: box, x: 2 m, y: -1 m, z: 1 m, pitch: -20 deg, length: 9 m, width: 9 m, height: 20 cm}}"


@pytest.mark.parametrize("turns", [True, False])
def test_a_map_of_a_slope_has_its_heights(fleet_text: Text, turns: bool) -> None:
    """Row by row from behind to ahead; it is level on a robot that leans."""
    grid = f"length: 2 m, width: 1 m, resolution: 50 cm, above: 2 m, below: 3 m, turns: {str(turns).lower()}"
    robot = Robot(fleet_text, f"kind: terrain_map, {grid}, at: {{z: 50 cm}}", "robots.rover01.x=9 m", scenery=SLOPE)
    heading = 0.7
    robot.set("rover01", (2.0, -1.0, 2.0), heading, pitch=0.1)
    mount = np.array([2.0 + 0.5 * sin(0.1) * cos(heading), -1.0 + 0.5 * sin(0.1) * sin(heading), 2.0 + 0.5 * cos(0.1)])
    turned = heading if turns else 0.0
    expected = []
    for ahead in (-1.0, -0.5, 0.0, 0.5, 1.0):
        for aside in (-0.5, 0.0, 0.5):
            x = mount[0] + ahead * cos(turned) - aside * sin(turned)
            expected.append(1.0 + (x - 2.0) * sin(pi / 9) / cos(pi / 9) + 0.1 / cos(pi / 9) - mount[2])
    assert robot.read() == pytest.approx(expected)


def test_a_map_ends_at_its_reach_and_has_a_greatest_size(fleet_text: Text) -> None:
    plate = "{plate: {shape: box, x: 2 m, y: -1 m, z: 1 m, length: 30 cm, width: 9 m, height: 20 cm}}"
    small = "kind: terrain_map, length: 1 m, width: 0 m, resolution: 50 cm, at: {z: 2 m}"
    assert Robot(fleet_text, f"{small}, below: 1 m", scenery=plate).read() == pytest.approx([-1.0, -0.9, -1.0])
    assert Robot(fleet_text, f"{small}, above: 0 m, below: 50 cm", scenery=plate).read() == [-0.5] * 3
    with pytest.raises(DeploymentError, match="101 by 41 places of the grid; a reading has at most 4096 heights"):
        Robot(fleet_text, "kind: terrain_map, length: 10 m, width: 4 m")


def test_entities_near_are_those_with_the_tag_by_distance(fleet_text: Text) -> None:
    """Distances are from the mount, directions in its frame; behind walls, too."""
    own = "robots.rover01.tags=[mine]", "robots.rover02.tags=[mine]", "robots.rover04.tags=[mine]"
    wall = "{wall: {shape: box, x: 3 m, y: 0 m, z: 1 m, length: 10 cm, width: 9 m, height: 2 m}}"
    robot = Robot(fleet_text, "kind: nearby, range: 5 m, tag: mine, at: {z: 1 m}", *own, robots=4, scenery=wall)
    robot.set("rover01", (1.0, 0.0, 0.0), heading=pi / 2)
    robot.set("rover02", (5.0, 0.0, 0.0))
    robot.set("rover03", (1.5, 0.0, 0.0))
    robot.set("rover04", (1.0, 2.0, 0.0))
    one = robot.sensor()
    seen = one.codec.decode(
        one.codec.encode(one.sample(SensingView(0, robot.numbers, np.array(robot.numbers))))
    ).entities
    assert [its.name for its in seen] == ["rover04", "rover02"]
    for its, (ahead, left) in zip(seen, ((2.0, 0.0), (0.0, -4.0)), strict=True):
        assert its.distance == pytest.approx(sqrt(ahead * ahead + left * left + 1.0))
        assert its.bearing == pytest.approx(atan2(left, ahead))
        assert its.elevation == pytest.approx(atan2(-1.0, hypot(ahead, left)))
    robot.set("rover02", (6.0, 0.0, 0.0))
    assert len(one.sample(SensingView(0, robot.numbers, np.array(robot.numbers))).entities) == 1
    every = Robot(fleet_text, "kind: nearby, range: 100 m", robots=4)
    assert len(every.sensor().sample(SensingView(0, every.numbers)).entities) == 4, "all but itself, the base too"

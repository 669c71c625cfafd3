"""Sensors that send rays, against closed forms: a robot between plain walls, a pillar and another robot."""

from __future__ import annotations

import struct
from collections.abc import Callable
from math import cos, inf, pi, radians, sin, sqrt, tan
from typing import Any, Final

import numpy as np
import pytest

from foosim.deployment.loader import load_deployment
from foosim.world.assembly.world import initial_numbers
from foosim.world.components.fitted import BoundSensor, sensors_of
from foosim.world.components.sensing import Sensing
from foosim.world.components.surroundings import Surroundings
from foosim.world.components.view import SensingView, View
from foosim.world.layout import Entity, build_layout
from foosim.world.scene import Vector, multiply, turn

Text = Callable[..., str]
PLACED: Final = ("robots.rover01.x=2 m", "robots.rover01.y=-1 m", "robots.base.x=-15 m")
AHEAD_M: Final = 18.0
"""From the rover's middle to the wall ahead of it."""


class Robot:
    """rover01 in a hall of 40 m by 25 m, with one sensor."""

    def __init__(self, text: Text, sensor: str, *settings: str, robots: int = 1, scenery: str = "{}") -> None:
        given = f"robots.rover01.sensors.eye={{rate: 10 Hz, {sensor}}}"
        deployment = load_deployment(text(robots, *PLACED, f"scenery={scenery}", given, *settings), "hall.yaml")
        self.deployment, self.layout = deployment, build_layout(deployment)
        self.numbers = initial_numbers(deployment, self.layout)
        self.rover = self.layout["rover01"]

    def set(self, robot: str, place: Vector, heading: float = 0.0, pitch: float = 0.0) -> None:
        entity: Entity = self.layout[robot]
        at, turned = entity.offsets["position"], entity.offsets["orientation"]
        self.numbers[at : at + 3] = place
        about_z = turn((0.0, 0.0, 1.0), heading)
        self.numbers[turned : turned + 4] = multiply(about_z, turn((0.0, 1.0, 0.0), pitch))

    def sensor(self) -> BoundSensor:
        its = sensors_of(self.deployment, self.layout, self.rover)
        return next(one for one in its if one.channel == "eye")

    def read(self) -> list[float]:
        one = self.sensor()
        return one.codec.numbers(one.sample(SensingView(0, self.numbers, np.array(self.numbers))))


def test_a_scan_of_a_wall_is_its_distance_over_the_cosine(fleet_text: Text) -> None:
    """From right to left, from the mount."""
    robot = Robot(fleet_text, "kind: laser_scanner, rays: 61, angle: 60 deg, range: 30 m, at: {x: 20 cm, z: 25 cm}")
    angles = [radians(ray - 30.0) for ray in range(61)]
    assert robot.read() == pytest.approx([(AHEAD_M - 0.2) / cos(angle) for angle in angles])
    robot.set("rover01", (2.0, -1.0, 0.0), heading=0.1)
    middle = 2.0 + 0.2 * cos(0.1)
    assert robot.read()[20] == pytest.approx((20.0 - middle) / cos(angles[20] + 0.1))
    assert robot.read()[40] == pytest.approx((20.0 - middle) / cos(angles[40] + 0.1))
    robot.set("rover01", (2.0, -1.0, 0.0), heading=pi / 2)
    assert robot.read()[30] == pytest.approx(12.5 + 1.0 - 0.2), "to the left is +y"


def test_a_mount_is_turned_and_its_beams_are_in_its_plane(fleet_text: Text) -> None:
    """One that looks down meets the floor, which is the top of a plate here."""
    plate = "{plate: {shape: box, x: 10 m, y: -1 m, z: -50 cm, length: 30 m, width: 9 m, height: 1 m}}"
    down = "at: {z: 1 m, pitch: 30 deg}"
    robot = Robot(fleet_text, f"kind: laser_scanner, rays: 3, angle: 40 deg, range: 9 m, {down}", scenery=plate)
    right, ahead, left = robot.read()
    assert ahead == pytest.approx(1.0 / sin(pi / 6))
    assert right == left == pytest.approx(1.0 / (sin(pi / 6) * cos(radians(20.0))))
    tilted = Robot(fleet_text, "kind: range, range: 9 m, at: {z: 1 m}", scenery=plate)
    assert tilted.read() == [9.0]
    tilted.set("rover01", (2.0, -1.0, 0.0), pitch=pi / 4)
    above = cos(pi / 4)
    assert tilted.read() == pytest.approx([above / sin(pi / 4)])


def test_a_scan_of_a_full_turn_begins_at_the_rear_and_repeats_no_ray(fleet_text: Text) -> None:
    robot = Robot(fleet_text, "kind: laser_scanner, rays: 4, angle: 360 deg, range: 100 m, at: {z: 20 cm}")
    behind, right, ahead, left = 22.0, 11.5, 18.0, 13.5
    assert robot.read() == pytest.approx([behind, right, ahead, left])
    assert Robot(fleet_text, "kind: laser_scanner, rays: 1, range: 100 m, at: {z: 20 cm}").read() == pytest.approx(
        [18.0]
    )


def test_beams_end_at_a_pillar_and_another_robot_and_pass_the_own_body(fleet_text: Text) -> None:
    pillar = "{pillar: {shape: cylinder, x: 6 m, y: -1 m, z: 1 m, radius: 50 cm, length: 2 m}}"
    mount = "at: {z: 20 cm}"
    robot = Robot(
        fleet_text, f"kind: laser_scanner, rays: 3, angle: 10 deg, range: 10 m, {mount}", robots=2, scenery=pillar
    )
    robot.set("rover02", (-5.0, 5.0, 0.0))
    aside = 4.0 * sin(radians(5.0))
    chord = 4.0 * cos(radians(5.0)) - sqrt(0.25 - aside * aside)
    assert robot.read() == pytest.approx([chord, 3.5, chord])
    robot.set("rover02", (4.0, -1.0, 0.0))
    assert robot.read()[1] == pytest.approx(2.0 - 0.3), "the other one's hull; its own is around the mount"
    robot.set("rover02", (2.0, -1.0, 0.0))
    assert robot.read() == [0.0, 0.0, 0.0], "inside of the other one"


def test_readings_are_held_between_the_least_and_the_range(fleet_text: Text) -> None:
    for kind in ("laser_scanner, rays: 3, angle: 2 deg", "range"):
        near = Robot(fleet_text, f"kind: {kind}, least: 50 cm, range: 4 m, at: {{z: 20 cm}}")
        assert set(near.read()) == {4.0}
        near.set("rover01", (19.7, -1.0, 0.0))
        assert set(near.read()) == {0.5}
        assert list(near.sensor().sensor.limits().values()) == [(0.5, 4.0)]


def test_a_cone_sees_what_a_beam_passes(fleet_text: Text) -> None:
    """A pole beside the axis, 2 m ahead: at the angle of beams of the cone's surface."""
    aside = 2.0 * tan(radians(15.0))
    pole = f"{{pole: {{shape: cylinder, x: 4 m, y: {-1 + aside} m, z: 1 m, radius: 5 cm, length: 2 m}}}}"
    beam = Robot(fleet_text, "kind: range, range: 10 m, at: {z: 150 cm}", scenery=pole)
    cone = Robot(fleet_text, "kind: range, range: 10 m, cone: 30 deg, at: {z: 150 cm}", scenery=pole)
    assert beam.read() == [10.0]
    assert cone.read() == pytest.approx([2.0 / cos(radians(15.0)) - 0.05])
    for ray in (True, False):
        one = (cone if ray else beam).sensor().sensor
        assert type(one).rays([one], cone.numbers).shape == (13 if ray else 1, 6)


def test_a_robot_of_any_kind_measures_from_its_own_hull(fleet_text: Text) -> None:
    """A station has no heading; the way counts from its round hull."""
    near = "near: {kind: proximity, rate: 10 Hz, rays: 4, range: 100 m}"
    station = f"robots.base={{model: station, x: -15 m, y: 2 m, sensors: {{{near}}}}}"
    robot = Robot(fleet_text, "kind: range, range: 1 m", station)
    (one,) = (its for its in sensors_of(robot.deployment, robot.layout, robot.layout["base"]) if its.channel == "near")
    ways = one.codec.numbers(one.sample(SensingView(0, robot.numbers)))
    assert ways == pytest.approx([35.0 - 0.2, 10.5 - 0.2, 5.0 - 0.2, 14.5 - 0.2])


@pytest.mark.parametrize("kind", ["laser_scanner, rays: 9, angle: 90 deg", "range", "proximity, rays: 6"])
def test_rays_to_be_drawn_end_where_readings_say(fleet_text: Text, kind: str) -> None:
    robot = Robot(fleet_text, f"kind: {kind}, range: 19 m")
    one: Any = robot.sensor().sensor
    drawn = type(one).rays([one], robot.numbers)
    x, y, z = (drawn[:, 3:] - drawn[:, :3]).T
    assert np.sqrt(x * x + y * y + z * z) == pytest.approx(np.array(robot.read()))


def test_many_sensors_together_have_the_bits_of_each_alone(fleet_text: Text) -> None:
    """With other ranges, cones and mounts among them."""
    kinds = ("laser_scanner, rays: 40, angle: 300 deg", "range, cone: 20 deg", "range", "proximity, rays: 16", "sonar")
    settings = [
        f"robots.rover0{robot}.sensors.s{number}={{kind: {kind}, rate: 10 Hz, range: {robot + 2} m}}"
        for robot in range(1, 6)
        for number, kind in enumerate(kinds)
    ]
    robot = Robot(fleet_text, "kind: range, range: 1 m", *settings, robots=5)
    rng = np.random.default_rng(5)
    for name in ("rover01", "rover02", "rover03", "rover04", "rover05"):
        x, y, heading = rng.uniform(-2.0, 2.0, 3).tolist()
        robot.set(name, (x, y, 0.0), heading)
    view = SensingView(0, robot.numbers, np.array(robot.numbers))
    every = [one for rover in robot.layout.of("rover") for one in sensors_of(robot.deployment, robot.layout, rover)]
    met = 0
    for kind in ("laser_scanner", "range", "proximity", "sonar"):
        its: list[Any] = [one.sensor for one in every if type(one.sensor).__module__.endswith(f".{kind}")]
        sizes = {len(one.beams.directions) for one in its} if kind != "range" else {0}
        for size in sizes:
            some = [one for one in its if not size or len(one.beams.directions) == size]
            alone = np.concatenate([type(one).together([one]).sample(view) for one in some])
            assert (type(some[0]).together(some).sample(view) == alone).all()
            assert (type(some[0]).together(some[::-1]).sample(view) == alone[::-1]).all()
            met += int((alone < 2.5).sum())
    assert met > 20


def test_surroundings_give_rays_and_clearance_at_the_start_of_the_tick(fleet_text: Text) -> None:
    """All of a layout share one caster."""
    robot = Robot(fleet_text, "kind: range, range: 1 m", robots=2)
    robot.set("rover02", (4.0, -1.0, 0.0))
    around, other = (Surroundings(robot.deployment, robot.layout) for _ in range(2))
    assert around.caster is other.caster
    start, end = list(robot.numbers), list(robot.numbers)
    end[robot.layout["rover02"].offsets["position"]] = 9.0
    view, place = View(0, end, start=start), np.array([[2.0, -1.0, 0.1]])
    hits = around.rays(view, place, np.array([[1.0, 0.0, 0.0]]), 5.0, robot.rover)
    assert hits.distances == pytest.approx([1.7]) and around.caster.things[hits.things[0]] == "rover02"
    assert around.rays(view, place, np.array([[1.0, 0.0, 0.0]]), 5.0).distances.tolist() == [0.0]
    beside = np.array([[3.6, -1.0, 0.15]])
    assert around.clearance(view, beside, 3.0, robot.rover) == pytest.approx([0.1])
    assert around.clearance(view, beside, 3.0, robot.layout["rover02"]) == pytest.approx([0.15]), "the floor"
    assert around.clearance(view, beside, 0.05).tolist() == [inf]


def test_beyond_its_range_a_ray_has_no_noise(fleet_text: Text) -> None:
    noise = "modifiers: [{kind: gaussian_noise, std: 0.2 m}]"
    robot = Robot(fleet_text, f"kind: proximity, rays: 16, range: 4 m, {noise}", "robots.rover01.x=18 m")
    one, numbers = robot.sensor(), robot.numbers
    drawn = [sample_of(one, SensingView(tick, numbers, np.array(numbers))) for tick in range(50)]
    assert {ways[8] for ways in drawn} == {4.0}, "behind it is nothing"
    ahead = [ways[0] for ways in drawn]
    assert len(set(ahead)) == 50 and sum(ahead) / 50 == pytest.approx(1.7, abs=0.1)
    assert all(0.0 <= way <= 4.0 for ways in drawn for way in ways)
    assert len({ways[0] - ways[1] for ways in drawn}) == 50, "each ray has noise of its own"


def sample_of(one: BoundSensor, view: SensingView) -> tuple[float, ...]:
    (raw,) = Sensing().sample([one], view)
    assert raw is not None
    return struct.unpack(f"<{len(raw) // 8}d", raw)

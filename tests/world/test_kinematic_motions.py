"""Motions against closed forms: arcs, velocities in any direction, flights to waypoints, paths in time."""

from __future__ import annotations

from math import cos, hypot, pi, sin, sqrt
from typing import Any, Final

import numpy as np
import pytest

from foosim.library.mobile.v_w import Motion
from foosim.library.mobile.waypoint import Waypoint
from foosim.library.mobile.wheel_speeds import Drive
from foosim.library.mobile.wheels import slips_of, wheels_of
from foosim.library.mobile.x_y_w import Velocity
from foosim.world.components.fitted import actuators_of, sensors_of
from foosim.world.components.view import View, WritableView, has_together
from tests.kinematic_yard import TICK_S, Yard, drawn, yard_text

QUICK: Final = {"acceleration": "100 m/s2"}
"""What has the speed that it is told at once."""


def actuator(yard: Yard, robot: str) -> Any:
    (one,) = yard.stepper.world.actuators[yard.layout[robot].index]
    return one.actuator


@pytest.mark.parametrize("draw", range(4))
def test_a_circle_closes_and_is_as_wide_as_speed_over_turn_rate(draw: int) -> None:
    yard = Yard(yard_text({"r": {"model": "differential_drive", **QUICK, "at": {"x": "3 m", "yaw": "40 deg"}}}))
    v, w = drawn("circle", draw, (0.9, 0.0))[0], 2.0 * pi / (TICK_S * (220 + 60 * draw))
    start, yaw, track = yard.vector("r", "position"), yard.vector("r", "heading")[0], 0.4
    v = v if abs(v) > 0.1 else 0.5
    v *= 1.0 - abs(w) * track / 2.0
    actuator(yard, "r").accept(Motion(v, w), WritableView(0, yard.numbers))
    yard.put("r", "wheel_speeds", v - w * track / 2.0, v + w * track / 2.0)
    for tick in range(1, 220 + 60 * draw + 1):
        yard.step()
        turned = w * tick * TICK_S
        x = start[0] + v / w * (sin(yaw + turned) - sin(yaw))
        y = start[1] - v / w * (cos(yaw + turned) - cos(yaw))
        assert yard.vector("r", "position") == pytest.approx([x, y, 0.0], abs=1e-9)
    assert yard.vector("r", "position") == pytest.approx(start, abs=1e-9)
    heading = yard.vector("r", "heading")[0]
    assert yard.vector("r", "linear_velocity") == pytest.approx([v * cos(heading), v * sin(heading), 0.0], abs=1e-9)
    assert yard.vector("r", "angular_velocity") == pytest.approx([0.0, 0.0, w])


@pytest.mark.parametrize("draw", range(4))
def test_a_base_goes_in_any_direction_while_it_turns(draw: int) -> None:
    yard = Yard(yard_text({"r": {"model": "holonomic", **QUICK}}))
    vx, vy, w = drawn("base", draw, (0.7, 0.7, 2.0))
    actuator(yard, "r").accept(Velocity(vx, vy, w), WritableView(0, yard.numbers))
    yard.put("r", "base_velocity", vx, vy, w)
    yard.step(123)
    turned = w * 123 * TICK_S
    s, c = sin(turned), cos(turned)
    place = [(vx * s - vy * (1.0 - c)) / w, (vx * (1.0 - c) + vy * s) / w, 0.0]
    assert yard.vector("r", "position") == pytest.approx(place, abs=1e-9)
    assert yard.vector("r", "linear_velocity") == pytest.approx([vx * c - vy * s, vx * s + vy * c, 0.0], abs=1e-9)


def test_a_base_reaches_its_velocity_with_its_acceleration() -> None:
    yard = Yard(yard_text({"r": {"model": "holonomic", "acceleration": "2 m/s2"}}))
    actuator(yard, "r").accept(Velocity(0.6, -0.8, 0.0), WritableView(0, yard.numbers))
    for tick in range(1, 60):
        yard.step()
        vx, vy, _ = yard.vector("r", "base_velocity")
        speed = min(2.0 * tick * TICK_S, 1.0)
        assert (vx, vy) == pytest.approx((0.6 * speed, -0.8 * speed), abs=1e-12)


def test_both_wheels_are_slower_where_one_would_be_too_fast_and_the_arc_stays() -> None:
    yard = Yard(yard_text({"r": {"model": "differential_drive"}}))
    drive = actuator(yard, "r")
    assert drive.limits() == {"linear": (-1.0, 1.0), "angular": (-pi, pi)}
    assert drive.accept(Motion(1.0, 2.0), WritableView(0, yard.numbers))
    (left, _), (right, _) = drive.command(View(0, yard.numbers))
    assert right == pytest.approx(1.0) and (right - left) / 0.4 / ((right + left) / 2) == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("robot", "bad", "within"),
    [
        ("drive", Motion(1.1, 0.0), (1.0, 0.0)),
        ("drive", Motion(0.0, -3.2), (0.0, -pi)),
        ("base", Velocity(0.9, 1.2, 0.0), (0.6, 0.8, 0.0)),
        ("base", Velocity(0.9, -0.9, 1.0), (0.5**0.5, -(0.5**0.5), 1.0)),
        ("base", Velocity(0.0, 0.0, 3.2), (0.0, 0.0, pi)),
        ("craft", Waypoint(0.0, 0.0, 121.0, 0.0), (0.0, 0.0, 120.0, 0.0)),
        ("craft", Waypoint(0.0, 0.0, -1.0, 0.0), (0.0, 0.0, 0.0, 0.0)),
        ("craft", Waypoint(1e6, 0.0, 1.0, 0.0), (1e5, 0.0, 1.0, 0.0)),
        ("craft", Waypoint(0.0, 0.0, 1.0, 7.0), (0.0, 0.0, 1.0, 2.0 * pi)),
    ],
)
def test_commands_out_of_bounds_are_clamped_and_counted(robot: str, bad: Any, within: tuple[float, ...]) -> None:
    models = {"drive": "differential_drive", "base": "holonomic", "craft": "rotorcraft"}
    yard = Yard(yard_text({robot: {"model": models[robot]}}))
    entity = yard.layout[robot]
    (fitted,) = actuators_of(yard.deployment, yard.layout, entity)
    assert fitted.accept(fitted.codec.encode(bad), WritableView(0, yard.numbers))
    slot = "target" if robot == "craft" else "set_point"
    assert yard.vector(robot, f"{fitted.channel}.{slot}") == pytest.approx(within)
    assert yard.vector(robot, "clamped") == [1.0] and yard.vector(robot, "refused") == [0.0]


def test_wheel_speeds_drive_any_robot_on_two_wheels() -> None:
    wheels = {"motion": {"kind": "wheel_speeds"}}
    yard = Yard(yard_text({"r": {"model": "differential_drive", **QUICK, "actuators": wheels}}))
    actuator(yard, "r").accept(Drive(0.4, 1.0), WritableView(0, yard.numbers))
    yard.step(50)
    assert yard.vector("r", "wheel_travel") == pytest.approx([0.2, 0.5])
    assert yard.vector("r", "heading")[0] == pytest.approx(0.6 / 0.4 * 0.5)


def test_a_wheel_that_slips_rolls_less_far_than_it_turns() -> None:
    wheels = {"model": "differential_drive", **QUICK, "slip": "20 %"}
    yard = Yard(yard_text({"r": wheels, "s": {**wheels, "at": {"y": "2 m"}}}))
    slips = wheels_of(yard.deployment, yard.layout, yard.layout["r"]).slips
    assert 0.0 < min(slips) < max(slips) < 0.2
    assert slips != slips_of(yard.deployment, "s", 0.2), "each robot has its own"
    actuator(yard, "r").accept(Motion(0.5, 0.0), WritableView(0, yard.numbers))
    yard.step()
    assert yard.vector("r", "wheel_travel")[0] == pytest.approx(0.005)
    x, y, _ = yard.vector("r", "position")
    assert hypot(x, y) == pytest.approx(0.005 * (1 - sum(slips) / 2), rel=1e-6)
    assert yard.vector("r", "heading")[0] == pytest.approx(0.005 * (slips[0] - slips[1]) / 0.4), "the right is slower"
    drawn_slips = np.array([slips_of(yard.deployment, f"r{number}", 0.2) for number in range(1000)])
    for wheel in drawn_slips.T:
        assert wheel.mean() == pytest.approx(0.1, abs=3.29 * 0.2 / sqrt(12 * 1000)) and 0.198 < wheel.max() < 0.2
    assert abs(np.mean((drawn_slips[:, 0] - 0.1) * (drawn_slips[:, 1] - 0.1)) * 300) < 3.29 / sqrt(1000), "of its own"


@pytest.mark.parametrize("draw", range(6))
def test_a_rotorcraft_comes_to_its_waypoint_within_its_limits(draw: int) -> None:
    yard = Yard(yard_text({"r": {"model": "rotorcraft", "at": {"z": "4 m"}}}))
    x, y, z, yaw = drawn("flight", draw, (9.0, 9.0, 3.0, 6.0))
    assert actuator(yard, "r").accept(Waypoint(x, y, z + 4.0, yaw), WritableView(0, yard.numbers))
    yard.put("r", "linear_velocity", 2.0, -1.0, 1.0)
    before, heading = yard.vector("r", "linear_velocity"), 0.0
    for _ in range(900):
        yard.step()
        now = yard.vector("r", "linear_velocity")
        assert hypot(now[0], now[1]) <= 5.0 + 1e-9 and abs(now[2]) <= 2.0 + 1e-9
        change = sqrt(sum((a - b) * (a - b) for a, b in zip(now, before, strict=True)))
        assert change <= 3.0 * TICK_S + 1e-9
        turned = (yard.vector("r", "heading")[0] - heading + pi) % (2.0 * pi) - pi
        assert abs(turned) <= pi / 2.0 * TICK_S + 1e-9
        before, heading = now, yard.vector("r", "heading")[0]
    assert yard.vector("r", "position") == pytest.approx([x, y, z + 4.0], abs=1e-6)
    assert cos(heading - yaw) == pytest.approx(1.0) and yard.vector("r", "arrived") == [1.0]
    yard.step(50)
    assert yard.vector("r", "linear_velocity") == pytest.approx([0.0] * 3, abs=1e-9)


def test_a_rotorcraft_from_rest_does_not_fly_past_its_waypoint() -> None:
    yard = Yard(yard_text({"r": {"model": "rotorcraft", "at": {"z": "4 m"}}}))
    actuator(yard, "r").accept(Waypoint(3.0, 0.0, 2.5, 0.0), WritableView(0, yard.numbers))
    for _ in range(600):
        yard.step()
        x, y, z = yard.vector("r", "position")
        assert x <= 3.0 + 1e-9 and y == 0.0 and z >= 2.5 - 1e-9
    assert (x, z) == pytest.approx((3.0, 2.5), abs=1e-9)


def test_a_rotorcraft_without_a_waypoint_brakes_and_hovers() -> None:
    yard = Yard(yard_text({"r": {"model": "rotorcraft", "at": {"z": "4 m"}}}))
    yard.put("r", "linear_velocity", 3.0, 0.0, 0.0)
    yard.step(150)
    x, y, z = yard.vector("r", "position")
    assert x == pytest.approx(3.0 * 3.0 / (3.0 / sqrt(2.0)) / 2.0, abs=0.02) and (y, z) == (0.0, 4.0)
    assert yard.vector("r", "linear_velocity") == [0.0] * 3


TIMED: Final = [
    {"x": "1 m", "time": "500 ms"},
    {"x": "1 m", "y": "2 m", "yaw": "90 deg", "time": "1500 ms"},
    {"x": "1 m", "yaw": "360 deg", "time": "2 s"},
]
BALL: Final = {"model": "mover", "shape": "sphere", "radius": "20 cm"}


def test_a_path_with_times_is_replayed_and_begins_again() -> None:
    yard = Yard(yard_text({"m": {**BALL, "path": TIMED, "loop": True}}))
    for turn in range(2):
        for tick, y, yaw in ((50, 0.0, 0.0), (100, 1.0, 45.0), (150, 2.0, 90.0), (175, 1.0, 225.0), (200, 0.0, 0.0)):
            yard.step(tick + 200 * turn - yard.tick)
            assert yard.vector("m", "position") == pytest.approx([1.0, y, 0.0], abs=1e-6)
            assert cos(yard.vector("m", "heading")[0] - yaw * pi / 180) == pytest.approx(1.0)


def test_a_path_at_a_speed_ends_or_goes_back() -> None:
    path = [{"x": "0 m"}, {"x": "3 m"}, {"x": "3 m", "y": "4 m"}]
    once = Yard(yard_text({"m": {**BALL, "path": path, "speed": "2 m/s"}}))
    loop = Yard(yard_text({"m": {**BALL, "path": path, "speed": "2 m/s", "loop": True}}))
    for ticks, there, back in (
        (100, (2.0, 0.0), (2.0, 0.0)),
        (500, (3.0, 4.0), (1.2, 1.6)),
        (700, (3.0, 4.0), (2.0, 0.0)),
    ):
        for yard, place in ((once, there), (loop, back)):
            yard.step(ticks - yard.tick)
            assert yard.vector("m", "position")[:2] == pytest.approx(place, abs=1e-6)


def test_velocity_is_measured_where_the_sensor_is_mounted() -> None:
    sensors = {
        name: {"kind": "velocity", "rate": "100 Hz", "frame": name, "at": {"x": "20 cm", "yaw": "90 deg"}}
        for name in ("own", "world")
    }
    yard = Yard(yard_text({"r": {"model": "differential_drive", **QUICK, "at": {"yaw": "90 deg"}, "sensors": sensors}}))
    actuator(yard, "r").accept(Motion(0.5, 1.0), WritableView(0, yard.numbers))
    yard.step()
    sensors_there = sensors_of(yard.deployment, yard.layout, yard.layout["r"])
    own, world = (one.sensor.sample(WritableView(1, yard.numbers)) for one in sensors_there)
    heading = yard.vector("r", "heading")[0]
    s, c = sin(heading), cos(heading)
    assert (world.x, world.y, world.angular_z) == pytest.approx((0.5 * c - 0.2 * s, 0.5 * s + 0.2 * c, 1.0))
    assert (own.x, own.y, own.angular_z) == pytest.approx((0.2, -0.5, 1.0)), "its x is to the robot's left"


@pytest.mark.parametrize("shape", [{"length": "2 m", "width": "1 m"}, {"shape": "circle", "radius": "70 cm"}])
def test_a_zone_counts_who_is_in_it(shape: dict[str, Any]) -> None:
    places = {"a": (1.0, 1.0), "b": (1.6, 1.3), "c": (1.0, 0.2)}
    robots = {n: {"model": "holonomic", "at": {"x": f"{x} m", "y": f"{y} m"}} for n, (x, y) in places.items()}
    zone = {"kind": "zone", "at": {"x": "1 m", "y": "1 m", "yaw": "30 deg"}, "tag": "vehicle", **shape}
    yard = Yard(yard_text(robots, rules={"goal": zone}))
    rules = yard.stepper.world
    rules.apply_rules(yard.numbers, 0)
    assert (yard.vector("world", "goal.count"), yard.vector("world", "goal.all_in")) == ([2.0], [0.0])
    yard.put("c", "position", 1.0, 1.1)
    rules.apply_rules(yard.numbers, 1)
    assert (yard.vector("world", "goal.count"), yard.vector("world", "goal.all_in")) == ([3.0], [1.0])


def test_a_class_with_a_command_of_its_own_is_not_computed_by_its_base() -> None:
    """`together` computes what `command` of its own class does."""

    class Base:
        @staticmethod
        def together(members: object) -> None: ...

        def command(self) -> None: ...

    class Same(Base):
        pass

    class Other(Base):
        def command(self) -> None: ...

    class Both(Other):
        @staticmethod
        def together(members: object) -> None: ...

    asked = [has_together(kind, "command") for kind in (Base, Same, Other, Both, int)]
    assert asked == [True, True, False, True, False]

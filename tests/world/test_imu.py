"""An inertial unit against closed forms: at rest, in free fall, on a circle with a lever arm, on a pendulum."""

from __future__ import annotations

from math import cos, pi, sin
from typing import Final

import pytest

from tests.world.free_body import Reader, about_y, about_z, cross, text_with

G: Final = 9.80665
TURNED: Final = "at: {roll: 90 deg}"


def imu(rate: str = "100 Hz", tick: str = "10 ms", more: str = "") -> Reader:
    return Reader(text_with(f"{{kind: imu, rate: {rate}{more and ', '}{more}}}", tick))


def test_at_rest_it_feels_what_carries_it_in_its_own_axes() -> None:
    assert imu().read(0) == (0.0, 0.0, G, 0.0, 0.0, 0.0)
    assert imu(more=TURNED).read(0) == pytest.approx((0.0, G, 0.0, 0.0, 0.0, 0.0), abs=1e-12)
    tilted = imu()
    tilted.put("orientation", *about_y(pi / 6))
    assert tilted.read(0)[:3] == pytest.approx((-G / 2, 0.0, G * cos(pi / 6)))


def test_in_free_fall_it_feels_nothing() -> None:
    falling = imu()
    for tick in range(5):
        falling.put("linear_velocity", 3.0, 0.0, -G * tick * 0.01)
        reading = falling.read(tick)
        assert reading[:3] == pytest.approx((0.0, 0.0, 0.0 if tick else G), abs=1e-9)


@pytest.mark.parametrize("rate", ["100 Hz", "30 Hz"])
def test_on_a_circle_it_feels_the_mean_of_what_draws_it_inwards(rate: str) -> None:
    """The chord of the velocities over a time t: w^2 r sin(wt/2) / (wt/2), half of the turn behind the reading's axes.

    The lever arm is half of the radius.
    """
    speed, radius, arm = 2.0, 1.0, 0.5
    reader = imu(rate, more="at: {x: 50 cm}")
    before = None
    for tick in range(100):
        if not reader.sensor.is_due(tick, reader.numbers):
            continue
        angle = speed * tick * 0.01
        reader.put("position", radius * cos(angle), radius * sin(angle), 0.0)
        reader.put("orientation", *about_z(angle))
        reader.put("linear_velocity", -speed * radius * sin(angle), speed * radius * cos(angle), 0.0)
        reader.put("angular_velocity", 0.0, 0.0, speed)
        found = reader.read(tick)
        if before is not None:
            half = speed * (tick - before) * 0.01 / 2
            inwards = speed * speed * (radius + arm) * sin(half) / half
            assert found == pytest.approx((-inwards * cos(half), inwards * sin(half), G, 0.0, 0.0, speed), abs=1e-9)
        before = tick


def test_the_bob_of_a_pendulum_feels_its_rod_alone() -> None:
    """Of the equation l q'' = -g sin q, tangentially nothing is left; along the rod l q'^2 + g cos q."""
    length, tick_s = 0.8, 0.0001
    reader = imu("10 kHz", "0.1 ms", f"at: {{z: {-length} m}}")
    angle, turning = 1.0, 0.0
    for tick in range(6000):
        middle = turning - 0.5 * tick_s * G / length * sin(angle)
        angle += tick_s * middle
        turning = middle - 0.5 * tick_s * G / length * sin(angle)
        if tick % 500 < 2:  # two in a row: the acceleration is that of one tick
            reader.put("orientation", *about_y(-angle))
            reader.put("angular_velocity", 0.0, -turning, 0.0)
            fx, fy, fz, wx, wy, wz = reader.read(tick)
            if tick % 500 == 1:
                assert fz == pytest.approx(length * turning * turning + G * cos(angle), abs=0.01)
                assert fx == pytest.approx(0.0, abs=0.01) and fy == 0.0
                assert wy == pytest.approx(-turning) and wx == wz == 0.0


def test_a_lever_arm_feels_how_its_body_turns_faster() -> None:
    reader = imu(more="at: {link: hand}")
    arm, faster = (0.0, 0.0, 1.0), (3.0, -2.0, 1.0)
    reader.read(0)
    reader.put("angular_velocity", *(0.01 * part for part in faster))
    tangential = cross(faster, arm)
    assert reader.read(1)[:3] == pytest.approx((tangential[0], tangential[1], tangential[2] + G))


def test_the_first_reading_has_no_acceleration_and_says_so_in_no_other() -> None:
    reader = imu()
    reader.put("linear_velocity", 5.0, 0.0, 0.0)
    assert reader.read(7)[:3] == (0.0, 0.0, G)
    reader.put("linear_velocity", 5.5, 0.0, 0.0)
    assert reader.read(12)[:3] == pytest.approx((10.0, 0.0, G)), "over five ticks"

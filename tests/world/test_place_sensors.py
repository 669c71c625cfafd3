"""Sensors of places, joints and touches against closed forms; what their robots or worlds do not have is refused."""

from __future__ import annotations

from decimal import Decimal
from math import cos, pi, sin
from typing import Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from foosim.deployment.loader import apply_sets, load_deployment
from foosim.world.earth import SEMI_MAJOR_M, EarthOrigin, Geodesy, to_ecef, to_geodetic
from foosim.world.scene import Vector, multiply
from tests.deployed import TABLE, TEXT
from tests.own_components import problems
from tests.world.free_body import Reader, about_y, about_z, text_with

DEGREE: Final = pi / 180
OWN: Final = "robots.red.goal.sensors.own="


def on_rod(sensor: str) -> Reader:
    """Return the reader of a sensor of the table's red goalkeeper."""
    return Reader(apply_sets(TEXT, TABLE.name, [OWN + sensor]), "red.goal")


# --- poses -----------------------------------------------------------------------------------------------------------


def test_a_pose_is_that_of_the_mount() -> None:
    reader = Reader(text_with("{kind: pose_3d, rate: 100 Hz, at: {link: hand, x: 2 m, pitch: 90 deg}}"))
    reader.put("position", 1.0, 2.0, 3.0)
    reader.put("orientation", *about_z(pi / 2))
    *place, qx, qy, qz, qw = reader.read(0)
    assert place == pytest.approx([1.0, 4.0, 4.0])
    assert (qx, qy, qz, qw) == pytest.approx(multiply(about_z(pi / 2), about_y(pi / 2)))


def test_a_pose_follows_joints() -> None:
    reader = on_rod("{kind: pose_3d, rate: 100 Hz, at: {link: spin, x: 10 cm}}")
    still = reader.read(0)
    reader.put("joint_positions", 0.05, 0.3)
    moved = reader.read(1)
    change = [after - before for after, before in zip(moved[:3], still[:3], strict=True)]
    assert change == pytest.approx([0.1 * cos(0.3) - 0.1, 0.05, -0.1 * sin(0.3)])
    assert moved[3:] == pytest.approx(multiply(about_y(0.3), still[3:]))  # type: ignore[arg-type]


def test_another_frame_turns_the_orientation_with_the_position() -> None:
    pose = "{kind: pose_3d, rate: 100 Hz, modifiers: [{kind: frame_change, x: 1 m, yaw: 30 deg}]}"
    reader = Reader(text_with(pose))
    reader.put("position", 2.0, 0.0, 0.5)
    turned = multiply(about_z(1.0), about_y(0.4))
    reader.put("orientation", *turned)
    x, y, z, *quaternion = reader.read(0)
    assert (x, y, z) == pytest.approx((cos(pi / 6), -sin(pi / 6), 0.5))
    assert quaternion == pytest.approx(multiply(about_z(-pi / 6), turned))


# --- Earth -----------------------------------------------------------------------------------------------------------

EPSG_PLACE: Final = (53.80939444 * DEGREE, 2.12955 * DEGREE, 73.0)
EPSG_ORIGIN: Final = EarthOrigin(latitude="55 deg", longitude="5 deg", altitude="200 m")  # type: ignore[arg-type]


def test_the_published_example_of_geocentric_conversion() -> None:
    """IOGP 373-7-2 (EPSG guidance note 7, part 2), method 9602: 53 48 33.820 N, 2 07 46.380 E, 73.0 m."""
    place = to_ecef(EPSG_PLACE)
    assert place == pytest.approx((3771793.968, 140253.342, 5124304.349), abs=2e-3)
    assert to_geodetic(place) == pytest.approx(EPSG_PLACE, rel=1e-12, abs=1e-8)


def test_the_published_example_of_topocentric_conversion() -> None:
    """IOGP 373-7-2, method 9837, about 55 N, 5 E, 200 m: the same place is at these U, V, W."""
    found = Geodesy(EPSG_ORIGIN).place(EPSG_PLACE)
    assert found == pytest.approx((-189013.869, -128642.040, -4220.171), abs=2e-3)


@pytest.mark.parametrize(
    ("geodetic", "ecef"),
    [
        ((0.0, 0.0, 0.0), (SEMI_MAJOR_M, 0.0, 0.0)),
        ((0.0, pi / 2, 100.0), (0.0, SEMI_MAJOR_M + 100.0, 0.0)),
        ((pi / 2, 0.0, 0.0), (0.0, 0.0, 6356752.314245)),
        ((-pi / 2, 0.0, -50.0), (0.0, 0.0, -6356702.314245)),
    ],
)
def test_the_axes_of_the_ellipsoid(geodetic: Vector, ecef: Vector) -> None:
    assert to_ecef(geodetic) == pytest.approx(ecef, abs=1e-6)
    latitude, longitude, altitude = to_geodetic(ecef)
    assert (latitude, altitude) == pytest.approx((geodetic[0], geodetic[2]), abs=1e-6)
    assert abs(geodetic[0]) > 1.5 or longitude == pytest.approx(geodetic[1])


@given(st.floats(-pi / 2, pi / 2), st.floats(-3.1, 3.1), st.floats(-11e3, 1e6))
def test_a_place_of_the_earth_comes_back_to_the_last_digits(latitude: float, longitude: float, altitude: float) -> None:
    place = to_ecef((latitude, longitude, altitude))
    assert to_ecef(to_geodetic(place)) == pytest.approx(place, rel=0, abs=1e-8)


@given(
    st.decimals(-90, 90, places=6),
    st.decimals(-180, 180, places=6),
    st.integers(0, 360),
    st.tuples(*[st.floats(-1e5, 1e5)] * 3),
)
def test_a_place_within_100_km_comes_back_to_a_millimetre(
    latitude: Decimal, longitude: Decimal, heading: int, place: Vector
) -> None:
    origin = {"latitude": f"{latitude:f} deg", "longitude": f"{longitude:f} deg", "heading": f"{heading} deg"}
    earth = Geodesy(EarthOrigin.model_validate(origin))
    assert earth.place(earth.geodetic(place)) == pytest.approx(place, abs=1e-3)


def test_a_receiver_goes_north_and_east_as_the_radii_of_curvature_say() -> None:
    """A degree of latitude at 45 deg is 111131.745 m, one of longitude 78846.835 m (WGS 84)."""
    more = "origin: {latitude: 45 deg, longitude: 10 deg, altitude: 100 m, heading: 0 deg}"
    reader = Reader(text_with("{kind: gps, rate: 10 Hz, at: {z: 2 m}}", more=more))
    assert reader.read(0) == pytest.approx((45.0, 10.0, 102.0), abs=1e-9)
    reader.put("position", 10.0, -20.0, 0.0)  # ahead is north, so the left is west
    latitude, longitude, altitude = reader.read(10)
    assert (latitude - 45.0) * 111131.745 == pytest.approx(10.0, abs=1e-3)
    assert (longitude - 10.0) * 78846.835 == pytest.approx(20.0, abs=1e-3)
    assert altitude == pytest.approx(102.0 + 500 / (2 * 6.37e6), abs=1e-6)


# --- joints and touches ----------------------------------------------------------------------------------------------


def test_joints_are_all_or_the_named_ones() -> None:
    every, spin = (on_rod(f"{{kind: joint_state, rate: 100 Hz{more}}}") for more in ("", ", joints: [spin]"))
    swapped = on_rod("{kind: joint_state, rate: 100 Hz, joints: [spin, slide]}")
    for reader in (every, spin, swapped):
        reader.put("joint_positions", 0.1, 2.0)
        reader.put("joint_velocities", -0.5, 30.0)
        reader.put("joint_efforts", 40.0, 0.25)
    assert every.read(0) == (0.1, 2.0, -0.5, 30.0, 40.0, 0.25)
    assert spin.read(0) == (2.0, 30.0, 0.25)
    assert swapped.read(0) == (2.0, 0.1, 30.0, -0.5, 0.25, 40.0)


def test_modifiers_know_how_many_joints_there_are() -> None:
    noise = "modifiers: [{kind: clip, high: {efforts: 1}}]"
    reader = on_rod(f"{{kind: joint_state, rate: 100 Hz, {noise}}}")
    reader.put("joint_positions", 5.0, 6.0)
    reader.put("joint_efforts", 7.0, 0.5)
    assert reader.read(0) == (5.0, 6.0, 0.0, 0.0, 1.0, 0.5)


def test_a_touch_sends_between_the_times_of_the_rate() -> None:
    reader = on_rod("{kind: contact, rate: 10 Hz}")
    assert reader.sensor.is_due(50, reader.numbers) and not reader.sensor.is_due(51, reader.numbers)
    assert reader.read(0) == (0.0, 0.0, -1.0)
    reader.put("contacts", 2.0, 0.125, 3.0)
    assert reader.sensor.is_due(51, reader.numbers)
    assert reader.read(51) == (2.0, 0.125, 3.0)


# --- what is not there -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("sensor", "problem"),
    [
        ("{kind: pose_3d, rate: 10 Hz, at: {link: spn}}",
         "at.link: red.goal has no such link; there are slide, spin, 'spn', nearest is 'spin'"),
        ("{kind: imu, rate: 10 Hz, at: {link: wheel}}",
         "at.link: red.goal has no such link; there are slide, spin, 'wheel'"),
        ("{kind: laser_scanner, rate: 10 Hz, range: 1 m, rays: 5, at: {link: slid}}",
         "at.link: red.goal has no such link; there are slide, spin, 'slid', nearest is 'slide'"),
        ("{kind: joint_state, rate: 10 Hz, joints: [spin, slid]}",
         "joints[1]: red.goal has no such joint; there are slide, spin, 'slid', nearest is 'slide'"),
        ("{kind: joint_state, rate: 10 Hz, joints: [spin, spin]}", "joints[1]: named twice, 'spin'"),
        ("{kind: gps, rate: 10 Hz}",
         "kind: in a world that is nowhere on Earth: the deployment needs origin: {latitude: ..., longitude: ...}, "
         "'gps'"),
    ],
)  # fmt: skip
def test_what_robot_or_world_does_not_have_is_refused_at_its_place(sensor: str, problem: str) -> None:
    assert problems(OWN + sensor) == [f"robots.red.goal.sensors.own.{problem}"]


def test_a_rover_carries_an_inertial_unit_since_its_state_has_velocities() -> None:
    hall = (TABLE.parent / "warehouse.yaml").read_text()
    text = apply_sets(hall, "hall.yaml", ["robots.rover01.sensors.own={kind: imu, rate: 10 Hz}"])
    assert "own" in load_deployment(text, "hall.yaml").robots["rover01"].sensors

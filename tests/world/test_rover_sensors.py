"""What rovers measure and how they are commanded: exact without noise, Gaussian with it, and from the frame alone."""

from __future__ import annotations

import struct
from collections.abc import Callable
from math import inf, nan, pi, sqrt
from typing import Final

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foosim.common.errors import Malformed
from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import Deployment
from foosim.node.tick import Stepper
from foosim.world.assembly.world import initial_numbers
from foosim.world.components.fitted import BoundSensor, actuators_of, sensors_of
from foosim.world.components.sensing import Sensing
from foosim.world.components.view import SensingView, View, WritableView
from foosim.world.layout import Entity, Layout, build_layout
from foosim.world.robot_packets import Delivered
from foosim.world.scene import turn

PLACED: Final = (
    "robots.rover01.x=2 m",
    "robots.rover01.y=-1 m",
    "robots.rover01.heading=0 deg",
    "robots.base.x=-15 m",
    "scenery={}",
)
SENSORS: Final = "robots.rover01.sensors."


def turn_to(numbers: list[float], rover: Entity, heading: float) -> None:
    """Turn a rover as its motion does: its heading and its orientation."""
    numbers[rover.offsets["heading"]], at = heading, rover.offsets["orientation"]
    numbers[at : at + 4] = turn((0.0, 0.0, 1.0), heading)


class Fitted:
    """The sensors of rover01 in a hall of one's own."""

    def __init__(self, text: str) -> None:
        self.deployment: Deployment = load_deployment(text, "hall.yaml")
        self.layout: Layout = build_layout(self.deployment)
        self.numbers = initial_numbers(self.deployment, self.layout)
        self.rover = self.layout["rover01"]

    def sensor(self, channel: str) -> BoundSensor:
        fitted = sensors_of(self.deployment, self.layout, self.rover)
        return next(one for one in fitted if one.channel == channel)

    def payload(self, one: BoundSensor, tick: int) -> bytes:
        (payload,) = Sensing().sample([one], SensingView(tick, self.numbers))
        assert payload is not None
        return payload

    def sample(self, channel: str, tick: int = 0) -> tuple[float, ...]:
        raw = self.payload(self.sensor(channel), tick)
        return struct.unpack(f"<{len(raw) // 8}d", raw)

    def turn(self, heading: float) -> None:
        turn_to(self.numbers, self.rover, heading)


def test_without_noise_pose_odometry_and_battery_are_the_frame(fleet_text: Callable[..., str]) -> None:
    quiet = [f"{channel}.modifiers=[]" for channel in ("pose", "odometry", "battery")]
    fitted = Fitted(fleet_text(1, *PLACED, *(SENSORS + one for one in quiet)))
    fitted.turn(0.5)
    travel = fitted.rover.offsets["wheel_travel"]
    fitted.numbers[travel : travel + 2] = 3.0, 4.0
    assert fitted.sample("pose") == (2.0, -1.0, 0.5)
    assert fitted.sample("odometry") == (3.0, 4.0)
    share, voltage = fitted.sample("battery")
    assert share == pytest.approx(0.9) and voltage == pytest.approx(21.0 + 0.9 * 8.4)


def test_noise_has_the_spread_that_is_declared_and_is_each_tick_s_own(fleet_text: Callable[..., str]) -> None:
    fitted = Fitted(fleet_text(1, *PLACED))
    for channel, truth, sds in (
        ("pose", (2.0, -1.0, 0.0), (0.02, 0.02, pi / 180)),
        ("odometry", (0.0, 0.0), (0.001, 0.001)),
        ("battery", (0.9, 28.56), (0.0, 0.05)),
    ):
        sensor = fitted.sensor(channel)
        drawn = [struct.unpack(f"<{len(truth)}d", fitted.payload(sensor, tick)) for tick in range(2000)]
        for column, mean, sd in zip(zip(*drawn, strict=True), truth, sds, strict=True):
            errors = [value - mean for value in column]
            assert abs(sum(errors) / 2000) <= 3.29 * sd / sqrt(2000) + 1e-12
            assert sqrt(sum(error * error for error in errors) / 2000) == pytest.approx(sd, rel=0.06, abs=1e-12)
        assert drawn[7] == fitted.sample(channel, 7)


RAYS: Final = (SENSORS + "proximity.rays=4", SENSORS + "proximity.modifiers=[]", SENSORS + "proximity.range=100 m")


def test_rays_reach_the_walls_from_the_hull_and_turn_with_the_rover(fleet_text: Callable[..., str]) -> None:
    fitted = Fitted(fleet_text(1, *PLACED, *RAYS))
    ahead, left, behind, right = 20 - 2 - 0.3, 12.5 + 1 - 0.3, 20 + 2 - 0.3, 12.5 - 1 - 0.3
    assert fitted.sample("proximity") == pytest.approx((ahead, left, behind, right))
    fitted.turn(pi / 2)
    assert fitted.sample("proximity") == pytest.approx((left, behind, right, ahead))


@pytest.mark.parametrize(
    ("thing", "free"),
    [
        ("{shape: box, x: 5 m, y: -1 m, z: 1 m, length: 2 m, width: 1 m, height: 2 m}", 1.7),
        ("{shape: box, x: 5 m, y: -1 m, z: 1 m, length: 2 m, width: 2 m, height: 2 m, yaw: 45 deg}", 2.7 - sqrt(2)),
        ("{shape: box, x: 5 m, y: -1 m, z: 1 m, length: 2 m, width: 1 m, height: 2 m, yaw: 90 deg}", 2.2),
        ("{shape: box, x: 5 m, y: -1.6 m, z: 1 m, length: 2 m, width: 1 m, height: 2 m}", 17.7),
        ("{shape: box, x: 5 m, y: -1 m, z: 3 m, length: 2 m, width: 1 m, height: 2 m}", 17.7),
    ],
)
def test_a_ray_ends_at_what_it_hits_first(fleet_text: Callable[..., str], thing: str, free: float) -> None:
    fitted = Fitted(fleet_text(1, *PLACED, *RAYS, f"scenery={{thing: {thing}}}"))
    assert fitted.sample("proximity")[0] == pytest.approx(free)


def test_rays_end_at_other_rovers_and_stations(fleet_text: Callable[..., str]) -> None:
    others = ("robots.rover02.x=4 m", "robots.rover02.y=-0.82 m", "robots.base.x=2 m", "robots.base.y=2 m")
    fitted = Fitted(fleet_text(2, *PLACED, *RAYS, *others))
    ways = fitted.sample("proximity")
    assert ways[0] == pytest.approx(2.0 - sqrt(0.3**2 - 0.18**2) - 0.3), "a chord off the middle"
    assert ways[1] == pytest.approx(3.0 - 0.2 - 0.3)


def test_what_is_sampled_together_has_the_bits_of_each_alone(fleet_text: Callable[..., str]) -> None:
    """Whoever computes which rovers: with other ranges and numbers of rays among them, near each other or far."""
    other = ("robots.rover02.sensors.proximity.rays=5", "robots.rover03.sensors.proximity.range=30 m")
    fitted = Fitted(fleet_text(5, *other))
    sensors = tuple(
        [one for rover in fitted.layout.of("rover") for one in sensors_of(fitted.deployment, fitted.layout, rover)]
    )
    assert [one.channel for one in sensors] == ["battery", "odometry", "pose", "proximity"] * 5
    place = st.tuples(st.floats(-19.0, 19.0), st.floats(-12.0, 12.0), st.floats(-3.0, 3.0))
    drawn = st.lists(st.integers(0, len(sensors) - 1), unique=True)

    @settings(max_examples=30)
    @given(places=st.lists(place, min_size=5, max_size=5), tick=st.integers(0, 100), chosen=drawn)
    def hold(places: list[tuple[float, float, float]], tick: int, chosen: list[int]) -> None:
        for rover, (x, y, heading) in zip(fitted.layout.of("rover"), places, strict=True):
            at = rover.offsets["position"]
            fitted.numbers[at : at + 2] = x, y
            turn_to(fitted.numbers, rover, heading)
        alone, view = [fitted.payload(one, tick) for one in sensors], SensingView(tick, fitted.numbers)
        assert sensing.sample(sensors, view) == alone
        some, rows = [sensors[one] for one in chosen], np.array(chosen, np.intp)
        assert sensing.sample(some, view, sensors, rows) == [alone[one] for one in chosen]

    sensing = Sensing()
    hold()
    assert sensing.sample([], SensingView(0, fitted.numbers)) == []


def test_beyond_its_range_a_ray_sees_nothing_and_has_no_noise(fleet_text: Callable[..., str]) -> None:
    fitted = Fitted(
        fleet_text(
            1, *PLACED, "robots.rover01.x=18 m", SENSORS + "proximity.modifiers=[{kind: gaussian_noise, std: 0.2 m}]"
        )
    )
    drawn = [fitted.sample("proximity", tick) for tick in range(50)]
    assert {ways[8] for ways in drawn} == {4.0}, "behind it is nothing"
    ahead = [ways[0] for ways in drawn]
    assert len(set(ahead)) == 50 and sum(ahead) / 50 == pytest.approx(1.7, abs=0.1)
    assert all(0.0 <= way <= 4.0 for ways in drawn for way in ways)
    assert len({ways[0] - ways[1] for ways in drawn}) == 50, "each ray has noise of its own"


@pytest.mark.parametrize(
    ("payload", "expected"),
    [
        (struct.pack("<2d", 0.5, -0.25), [0.5, -0.25]),
        (struct.pack("<2d", 7.0, -7.0), [1.2, -1.2]),
        (struct.pack("<2d", nan, 0.0), None),
        (struct.pack("<2d", 0.0, -inf), None),
        (bytes(15), None),
        (bytes(24), None),
        (b"", None),
    ],
)
def test_the_drive_holds_speeds_within_its_own_and_refuses_the_rest(
    fleet_text: Callable[..., str], payload: bytes, expected: list[float] | None
) -> None:
    fitted = Fitted(fleet_text(1, *PLACED))
    (drive,) = actuators_of(fitted.deployment, fitted.layout, fitted.rover)
    at = fitted.rover.offsets["drive.set_point"]
    fitted.numbers[at : at + 2] = [0.1, 0.2]
    before = fitted.numbers.copy()
    if expected is None:
        with pytest.raises(Malformed):
            drive.codec.decode(payload)
    else:
        assert drive.accept(payload, WritableView(0, fitted.numbers))
        assert fitted.numbers[fitted.rover.offsets["clamped"]] == float(payload != struct.pack("<2d", *expected))
        assert fitted.numbers[at : at + 2] == expected
        assert [speed for speed, _ in drive.actuator.command(View(0, fitted.numbers))] == expected
    after, fitted.numbers = fitted.numbers, before.copy()
    packet = Delivered(0, "pilot01", 1, 0, "rover01", "drive", payload)
    Stepper(fitted.deployment, fitted.layout).deliver([packet], [fitted.rover.index], fitted.numbers, 0)
    assert fitted.numbers[fitted.rover.offsets["refused"]] == float(expected is None)
    fitted.numbers[fitted.rover.offsets["refused"]] = 0.0
    assert fitted.numbers == after, "and nothing else changes"


def test_a_drive_that_holds_stands_still(fleet_text: Callable[..., str]) -> None:
    fitted = Fitted(fleet_text(1, *PLACED))
    (drive,) = actuators_of(fitted.deployment, fitted.layout, fitted.rover)
    before = fitted.numbers.copy()
    at = fitted.rover.offsets["drive.set_point"]
    fitted.numbers[at : at + 2] = [0.1, 0.2]
    drive.actuator.hold(WritableView(0, fitted.numbers))
    assert fitted.numbers == before and before[at : at + 2] == [0.0, 0.0]

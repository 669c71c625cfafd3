"""The engine of a hall: where rovers go, what stops them, what they live on."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, hypot, pi, sin, sqrt
from typing import Final

import numpy as np
import pytest

from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import Deployment
from foosim.node.physics.making import make_engine
from foosim.node.tick import Stepper, Work
from foosim.world.assembly.world import initial_numbers
from foosim.world.frame import Frame
from foosim.world.layout import Entity, Layout, build_layout
from foosim.world.moving.wheels import slips_of, wheels_of
from foosim.world.parameters.hall import hall_of
from tests.swarm.world_bounds import strays

EMPTY: Final = (
    "scenery={}",
    "hall.rover.drive.slip=0 %",
    "hall.rover.drive.acceleration=100 m/s2",
    "robots.rover01.x=0 m",
    "robots.rover01.y=0 m",
    "robots.base.x=-15 m",
)
"""One rover in the middle of an empty hall, with wheels that do what they are told at once."""
TICK_S: Final = 0.02


class Hall:
    """A hall stepped by hand."""

    def __init__(self, text: str) -> None:
        self.deployment: Deployment = load_deployment(text, "hall.yaml")
        self.layout: Layout = build_layout(self.deployment)
        self.numbers = initial_numbers(self.deployment, self.layout)
        self.stepper = Stepper(self.deployment, self.layout)
        self.engine = make_engine(self.deployment, self.layout)
        self.rovers = self.layout.of("rover")

    def at(self, rover: Entity, field: str, offset: int = 0) -> float:
        return self.numbers[rover.offsets[field] + offset]

    def put(self, rover: Entity, x: float, y: float, heading: float = 0.0) -> None:
        at = rover.offsets["position"]
        self.numbers[at : at + 2] = x, y
        self.numbers[rover.offsets["heading"]] = heading

    def want(self, rover: Entity, left: float, right: float) -> None:
        at = rover.offsets["drive.set_point"]
        self.numbers[at : at + 2] = left, right

    def step(self, ticks: int = 1) -> None:
        for tick in range(ticks):
            islands = tuple((rover,) for rover in self.rovers)
            work = Work(tick, self.layout, islands, tuple(rover.index for rover in self.rovers), self.numbers, {})
            self.stepper.solve(self.engine, work)

    def strays(self) -> list[str]:
        return strays(self.deployment, Frame(0, self.layout, np.array(self.numbers)))


@pytest.fixture
def alone(fleet_text: Callable[..., str]) -> Hall:
    return Hall(fleet_text(1, *EMPTY))


def test_straight_on_it_goes_as_far_as_its_wheels_roll(alone: Hall) -> None:
    (rover,) = alone.rovers
    heading = 0.7
    alone.put(rover, 1.0, -2.0, heading)
    alone.want(rover, 0.8, 0.8)
    alone.step(250)
    way = 0.8 * 250 * TICK_S
    assert alone.at(rover, "position") == pytest.approx(1.0 + way * cos(heading), abs=1e-9)
    assert alone.at(rover, "position", 1) == pytest.approx(-2.0 + way * sin(heading), abs=1e-9)
    assert alone.at(rover, "heading") == heading
    assert alone.at(rover, "wheel_travel") == alone.at(rover, "wheel_travel", 1) == pytest.approx(way, abs=1e-9)


@pytest.mark.parametrize("substeps", [1, 4])
def test_with_unequal_wheels_it_goes_along_a_circle(fleet_text: Callable[..., str], substeps: int) -> None:
    hall = Hall(fleet_text(1, *EMPTY, f"substeps={substeps}"))
    (rover,) = hall.rovers
    left, right, track = 0.5, 0.8, hall_of(hall.deployment).rover.drive.track
    spin, radius = (right - left) / track, (right + left) / 2 / ((right - left) / track)
    hall.want(rover, left, right)
    speeds = rover.offsets["wheel_speeds"]
    hall.numbers[speeds : speeds + 2] = left, right
    for ticks in (1, 99, 300):
        hall.step(ticks)
    turned = spin * 400 * TICK_S
    assert hall.at(rover, "position") == pytest.approx(radius * sin(turned), abs=1e-9)
    assert hall.at(rover, "position", 1) == pytest.approx(radius * (1 - cos(turned)), abs=1e-9)
    assert hall.at(rover, "heading") == pytest.approx((turned + pi) % (2 * pi) - pi, abs=1e-9)
    half = 0.5 * hall.at(rover, "heading")
    at = rover.offsets["orientation"]
    assert hall.numbers[at : at + 4] == [0.0, 0.0, sin(half), cos(half)]


def test_against_each_other_its_wheels_turn_it_on_the_spot(alone: Hall) -> None:
    (rover,) = alone.rovers
    alone.want(rover, -0.3, 0.3)
    alone.step(50)
    assert (alone.at(rover, "position"), alone.at(rover, "position", 1)) == (0.0, 0.0)
    assert alone.at(rover, "heading") == pytest.approx(0.6 / 0.45 * 50 * TICK_S, abs=1e-9)


def test_wheels_approach_their_speed_as_fast_as_the_motor_can(fleet_text: Callable[..., str]) -> None:
    hall = Hall(fleet_text(1, *EMPTY, "hall.rover.drive.acceleration=0.5 m/s2"))
    (rover,) = hall.rovers
    hall.want(rover, 1.0, -0.2)
    speeds = []
    for _ in range(120):
        hall.step()
        speeds.append((hall.at(rover, "wheel_speeds"), hall.at(rover, "wheel_speeds", 1)))
    wanted = [(min(0.01 * tick, 1.0), max(-0.01 * tick, -0.2)) for tick in range(1, 121)]
    assert np.array(speeds) == pytest.approx(np.array(wanted))


def test_a_wheel_that_slips_rolls_less_far_than_it_turns(fleet_text: Callable[..., str]) -> None:
    hall = Hall(fleet_text(1, *EMPTY, "hall.rover.drive.slip=20 %"))
    (rover,) = hall.rovers
    slips = wheels_of(hall.deployment, hall.layout, rover).slips
    assert 0.0 < min(slips) < max(slips) < 0.2
    assert slips != slips_of(hall.deployment, "rover02", 0.2), "each rover has its own"
    hall.want(rover, 0.5, 0.5)
    hall.step()
    assert hall.at(rover, "wheel_travel") == pytest.approx(0.01)
    assert hypot(hall.at(rover, "position"), hall.at(rover, "position", 1)) == pytest.approx(
        0.01 * (1 - sum(slips) / 2), rel=1e-6
    )


@pytest.mark.parametrize(
    ("thing", "gap"),
    [
        ("{shape: box, x: 2 m, z: 1 m, length: 1 m, width: 4 m, height: 2 m, yaw: 90 deg}", 0.0),
        ("{shape: box, x: 3 m, z: 1 m, length: 2 m, width: 2 m, height: 2 m, yaw: 45 deg}", 3 - sqrt(2)),
        ("{shape: box, x: 2 m, z: 40 cm, length: 1 m, width: 1 m, height: 10 cm, pitch: 30 deg}", 1.975 - sqrt(0.1875)),
    ],
)
def test_it_stops_at_what_stands_in_its_way_and_its_wheels_slip(
    fleet_text: Callable[..., str], thing: str, gap: float
) -> None:
    hall = Hall(fleet_text(1, *EMPTY, f"scenery={{thing: {thing}}}", "robots.rover01.x=-2.5 m"))
    (rover,) = hall.rovers
    hall.want(rover, 0.5, 0.5)
    hall.step(500)
    x = hall.at(rover, "position")
    radius = hall_of(hall.deployment).rover.radius
    assert gap - 0.06 < x + radius <= gap + 1e-12, "at the thing, and not in it"
    assert hall.at(rover, "blocked") == 1.0 and hall.at(rover, "wheel_travel") == pytest.approx(5.0)
    assert hall.strays() == []
    hall.want(rover, -0.5, -0.5)
    hall.step(10)
    assert hall.at(rover, "position") == pytest.approx(x - 0.1) and hall.at(rover, "blocked") == 0.0


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_what_is_beyond_the_edge_of_its_square_metre_stops_it_too(fleet_text: Callable[..., str], side: float) -> None:
    """Obstacles are looked up by the square that the rover's middle is in."""
    middle = 0.5 + side * 0.45
    box = f"{{shape: box, x: {middle + side * 1.31} m, z: 1 m, length: 2 m, width: 4 m, height: 2 m}}"
    hall = Hall(fleet_text(1, *EMPTY, f"robots.rover01.x={middle} m", f"scenery={{box: {box}}}"))
    (rover,) = hall.rovers
    hall.put(rover, middle, 0.05, 0.0 if side > 0.0 else pi)
    hall.want(rover, 0.1, 0.1)
    for _ in range(100):
        hall.step()
        assert hall.strays() == []
    assert hall.at(rover, "blocked") == 1.0


def test_it_passes_under_what_is_higher_than_its_antenna(fleet_text: Callable[..., str]) -> None:
    beam = "scenery={beam: {shape: box, x: 2 m, z: 70 cm, length: 1 m, width: 4 m, height: 30 cm}}"
    hall = Hall(fleet_text(1, *EMPTY, beam))
    hall.want(hall.rovers[0], 1.0, 1.0)
    hall.step(250)
    assert hall.at(hall.rovers[0], "position") == pytest.approx(5.0)


def test_two_that_meet_stop_before_they_touch_and_pass_on_when_they_can(fleet_text: Callable[..., str]) -> None:
    hall = Hall(fleet_text(2, *EMPTY, "robots.rover02.x=4 m", "robots.rover02.y=0 m"))
    one, other = hall.rovers
    hall.put(other, 4.0, 0.0, pi)
    for rover in (one, other):
        hall.want(rover, 1.2, 1.2)
    hall.step(300)
    gap = hall.at(other, "position") - hall.at(one, "position") - 2 * hall_of(hall.deployment).rover.radius
    assert 0.0 < gap < 0.01 and hall.at(one, "blocked") == hall.at(other, "blocked") == 1.0
    hall.want(one, -0.5, -0.5)
    hall.step(50)
    assert hall.at(one, "position") == pytest.approx(2.0 - 0.3 - 0.5, abs=0.01), "it can go back"
    assert hall.at(other, "position") < 2.2, "and the other one follows"


# --- batteries -------------------------------------------------------------------------------------------------------


def test_standing_and_driving_cost_what_the_deployment_says(alone: Hall) -> None:
    (rover,) = alone.rovers
    battery = hall_of(alone.deployment).rover.battery
    full = alone.at(rover, "charge")
    assert full == pytest.approx(0.9 * 250 * 3600)
    alone.step(100)
    assert full - alone.at(rover, "charge") == pytest.approx(battery.idle * 2.0)
    alone.want(rover, 1.0, -1.0)
    alone.step(100)
    assert full - alone.at(rover, "charge") == pytest.approx(battery.idle * 4.0 + battery.drag * 2.0)


def test_an_empty_rover_stands_still(fleet_text: Callable[..., str]) -> None:
    hall = Hall(fleet_text(1, *EMPTY, "robots.rover01.charge=0 %", "hall.rover.drive.acceleration=1 m/s2"))
    (rover,) = hall.rovers
    hall.numbers[rover.offsets["charge"]] = 100.0
    hall.want(rover, 1.0, 1.0)
    hall.step(500)
    assert hall.at(rover, "charge") == 0.0
    assert hall.numbers[rover.offsets["wheel_speeds"] : rover.offsets["wheel_speeds"] + 2] == [0.0, 0.0]
    there = hall.at(rover, "position")
    assert 0.5 < there < 3.0
    hall.step(100)
    assert hall.at(rover, "position") == there


def test_a_station_charges_who_is_near_and_no_more_than_full(alone: Hall) -> None:
    (rover,) = alone.rovers
    station, capacity = hall_of(alone.deployment).station, hall_of(alone.deployment).rover.battery.capacity
    gain = station.charge_power - hall_of(alone.deployment).rover.battery.idle
    alone.put(rover, -15.0 + station.charge_radius - 0.01, 0.0)
    before = alone.at(rover, "charge")
    alone.step(50)
    assert alone.at(rover, "charge") - before == pytest.approx(gain * 1.0)
    alone.numbers[rover.offsets["charge"]] = capacity - 1.0
    alone.step()
    assert alone.at(rover, "charge") == capacity
    alone.put(rover, -15.0 + station.charge_radius + 0.01, 0.0)
    alone.step()
    assert alone.at(rover, "charge") < capacity

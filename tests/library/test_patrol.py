"""Rovers that patrol: they get about, hear each other and keep apart; and what they do when nobody is heard."""

from __future__ import annotations

from collections.abc import Callable
from math import hypot
from typing import Any, Final

import pytest

from foosim.client.player import Sample
from foosim.deployment.loader import load_deployment
from foosim.library.generic.pose import Pose
from foosim.library.mobile.hall_settings import hall_of
from foosim.library.mobile.players.beacons import Beacon, decode_beacon, encode_beacon
from foosim.library.mobile.players.roadmap import roadmap_of
from foosim.library.mobile.players.warehouse_rover import Patrol
from foosim.library.mobile.station import StationRobot
from foosim.simulation.run import rehearse
from foosim.simulation.system import Settings, System
from foosim.world.frame import Frame

ROVERS: Final = 6
TICKS: Final = 1000
WIRED: Final = "{id: on-board, from: ['rover*', 'pilot*'], to: 'rover*'}, {id: sensors, from: 'rover*', to: 'pilot*'}"
CUT: Final = f"network.links=[{WIRED}, {{id: air, from: '*', to: '*', loss: 100 %}}]"
TOGETHER: Final = (  # four of them in the same aisle, one with little charge beside the charger
    *("robots.rover01.x=-18.75 m", "robots.rover01.y=6.25 m", "robots.rover02.x=-16.25 m", "robots.rover02.y=6.25 m"),
    *("robots.rover03.x=-13.75 m", "robots.rover03.y=6.25 m", "robots.rover04.x=-11.25 m", "robots.rover04.y=6.25 m"),
    *("robots.rover05.x=-8.75 m", "robots.rover05.y=6.25 m", "robots.rover06.x=-13.75 m", "robots.rover06.y=1.25 m"),
)


class Patrolled:
    """What a rehearsal showed."""

    def __init__(self, text: str) -> None:
        self.deployment = load_deployment(text, "hall.yaml")
        self.frames: list[Frame] = []
        systems: list[System] = []
        self.result = rehearse(
            text, "hall.yaml", TICKS, 2, settings=Settings(on_commit=self.frames.append), prepare=systems.append
        ).json
        players = systems[0].players
        self.pilots: dict[str, Any] = {f"rover{name[5:]}": players[name].player for name in players if "pilot" in name}
        self.dispatch: Any = players["dispatch"].player
        self.names = [rover.name for rover in self.frames[0].layout.of("rover")]
        self.paths = {name: [frame.vector(name, "position", 2) for frame in self.frames] for name in self.names}

    def way(self, name: str) -> float:
        return sum(hypot(x - u, y - v) for (x, y), (u, v) in zip(self.paths[name], self.paths[name][1:], strict=False))

    def visited(self, name: str) -> set[int]:
        roadmap = roadmap_of(self.deployment, 2.5)
        places = [(x, y) for x, y in self.paths[name][::10]]
        return {spot for x, y in places if roadmap.distance(spot := roadmap.nearest(x, y), x, y) < 0.4}

    def nearest_m(self) -> float:
        paths = list(self.paths.values())
        return min(
            hypot(x - u, y - v)
            for number, one in enumerate(paths)
            for other in paths[:number]
            for (x, y), (u, v) in zip(one, other, strict=True)
        )

    def speed_max(self, since: int) -> float:
        speeds = [frame.vector(name, "wheel_speeds", 2) for frame in self.frames[since:] for name in self.names]
        return max((left + right) / 2 for left, right in speeds)


@pytest.fixture(scope="module")
def together(fleet_text: Callable[..., str]) -> Patrolled:
    return Patrolled(fleet_text(ROVERS, *TOGETHER))


@pytest.fixture(scope="module")
def apart(fleet_text: Callable[..., str]) -> Patrolled:
    """The same without a radio."""
    return Patrolled(fleet_text(ROVERS, *TOGETHER, CUT))


def test_they_get_about_and_share_the_hall(together: Patrolled) -> None:
    patrolling = together.names[:5]
    assert all(together.way(name) > 5.0 for name in patrolling), {name: together.way(name) for name in patrolling}
    visits = [together.visited(name) for name in patrolling]
    assert all(len(spots) >= 2 for spots in visits) and len(set.union(*visits)) >= 18
    assert len(set.union(*visits)) >= 0.7 * sum(map(len, visits)), "each goes where others were not"


def test_who_has_little_charge_goes_to_the_charger_and_is_charged(together: Patrolled) -> None:
    charges = [frame.at("rover06", "charge") for frame in together.frames]
    station = together.deployment.robots["base"]
    x, y = together.paths["rover06"][-1]
    reach = hall_of(together.deployment).station.charge_radius
    assert isinstance(station, StationRobot) and hypot(x - station.x, y - station.y) <= reach
    assert together.pilots["rover06"].charging and charges[-1] > min(charges) + 1000
    assert not together.pilots["rover01"].charging


def test_they_hear_each_other_and_keep_apart(together: Patrolled) -> None:
    for pilot in together.pilots.values():
        assert not pilot.is_alone and len(pilot.heard) == ROVERS - 1
    assert together.nearest_m() > 1.2
    assert not any(frame.at(name, "blocked") for frame in together.frames for name in together.names)
    assert together.speed_max(0) > 0.9


def test_the_base_knows_where_they_are(together: Patrolled) -> None:
    assert len(together.dispatch.fleet) == ROVERS
    for number, name in enumerate(together.names):
        said_s, told = together.dispatch.fleet[number]
        x, y = together.paths[name][round(said_s / 0.02)]
        assert hypot(told.x - x, told.y - y) < 0.3 and told.hears > 0


def test_alone_they_are_slow_and_still_patrol_and_touch_nothing_for_long(apart: Patrolled) -> None:
    assert all(pilot.is_alone and pilot.heard == {} for pilot in apart.pilots.values())
    assert apart.dispatch.fleet == {}
    alone_ticks = 200
    assert 0.4 < apart.speed_max(alone_ticks) < 0.55
    visits = {name: apart.visited(name) for name in apart.names}
    assert all(len(spots) >= 2 for spots in visits.values()), visits
    blocked = sum(frame.at(name, "blocked") for frame in apart.frames for name in apart.names)
    assert blocked < 0.02 * len(apart.frames) * len(apart.names)
    assert 0.6 < apart.nearest_m() < 1.2, "nobody tells them to keep out of each other's way"


# --- one of them, told by hand what others say ------------------------------------------------------------------------


class Told:
    """The patrol of rover02 at a spot with four ways, at a quarter of a second a turn."""

    def __init__(self, text: str) -> None:
        self.deployment = load_deployment(text, "hall.yaml")
        self.patrol = Patrol(self.deployment, {"rover": "rover02"})
        self.map = roadmap_of(self.deployment, 2.5)
        self.here = self.map.nearest(-6.25, 1.25)
        self.samples: dict[tuple[str, str], Sample] = {}
        self.tick = 0

    def say(self, number: int, here: int, goal: int, ago_s: float = 0.0, payload: bytes | None = None) -> None:
        """What rover number + 1 broadcasts."""
        raw = encode_beacon(Beacon(number, 0.0, 0.0, 0.0, here, goal, 1.0, None, ())) if payload is None else payload
        sent_ns = int((self.tick * 0.02 - ago_s) * 1e9)
        name = f"pilot{number + 1:02d}"
        self.samples[name, "beacon"] = Sample(name, "beacon", self.tick, sent_ns, sent_ns, raw)

    def turn(self, spot: int) -> int:
        """Be at a spot; return where it heads for, as its beacon says."""
        self.tick += 20
        x, y = self.map.spots[spot]
        pose = ("rover02", "pose")
        self.samples[pose] = Sample(*pose, self.tick, self.tick, self.tick, Pose(x, y, 0.0))
        (packet,) = self.patrol.act(self.tick, self.samples).packets
        beacon = decode_beacon(packet.payload, 6, len(self.map.spots))
        assert beacon is not None and beacon.number == 1
        return beacon.goal


@pytest.fixture
def told(fleet_text: Callable[..., str]) -> Told:
    return Told(fleet_text(6))


def test_it_keeps_out_of_where_others_are_or_go(told: Told) -> None:
    ways = told.map.neighbours[told.here]
    assert len(ways) == 4
    for free in ways:
        first, second, third = (spot for spot in ways if spot != free)
        told.tick += 200
        told.say(0, first, second)
        told.say(4, third, third)
        assert told.turn(told.here) == free
        told.say(0, first, second)
        told.say(4, third, third)
        assert told.turn(free) in told.map.neighbours[free], "and on from there"


def test_what_was_said_long_ago_or_is_no_beacon_counts_no_more(told: Told) -> None:
    ways = told.map.neighbours[told.here]
    told.tick += 300
    told.say(0, ways[0], ways[1], ago_s=3.0)
    told.say(4, ways[2], ways[3], ago_s=3.0)
    assert told.turn(told.here) in ways
    told.say(0, ways[0], ways[1])
    told.say(4, ways[2], ways[3])
    assert told.turn(told.here) == told.here, "there is nowhere to go"
    told.say(3, ways[0], ways[1], payload=b"\xff" * 19)
    told.turn(told.here)
    assert told.patrol.heard.keys() == {0, 4}


@pytest.mark.parametrize("number", [0, 4])
def test_of_two_that_head_for_the_same_spot_the_smaller_number_goes(told: Told, number: int) -> None:
    goal = told.turn(told.here)
    told.tick += 20
    told.say(number, told.map.nearest(3.75, 1.25), goal)
    (x, y), (to_x, to_y) = told.map.spots[told.here], told.map.spots[goal]
    way = ("rover02", "pose")
    told.samples[way] = Sample(*way, told.tick, 0, 0, Pose(0.6 * x + 0.4 * to_x, 0.6 * y + 0.4 * to_y, 0.0))
    (packet,) = told.patrol.act(told.tick, told.samples).packets
    beacon = decode_beacon(packet.payload, 6, len(told.map.spots))
    assert beacon is not None and beacon.goal == (told.here if number == 0 else goal)

"""Patrol: the on-board software of a rover that patrols a hall with others, and shares its knowledge by radio.

It moves from spot to spot of the roadmap, always to the neighbouring one with the oldest visit, by itself or by rovers
in reach (conscientious reactive patrolling with shared idleness: Machado, Ramalho, Zucker, Drogoul, MABS 2002). It
keeps out of the spots that others are at or head for, and gives way to rovers with a smaller number. With little charge
it goes to the charger. Without a message for a while it slows down and relies on its proximity sensor alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from math import atan2, cos, hypot, pi, sin
from typing import Any, Final, NamedTuple

from mypy_extensions import mypyc_attr

from foosim.client.player import Packet, Player, Samples, Turn
from foosim.common.errors import BadValue, UnknownName
from foosim.common.keyed_random import draw_key, draw_words, unit_interval
from foosim.deployment.schema import Deployment
from foosim.library.generic.pose import Pose
from foosim.library.generic.proximity import Ranges
from foosim.library.mobile.battery import Battery
from foosim.library.mobile.hall_obstacles import obstacles_of
from foosim.library.mobile.hall_settings import hall_of
from foosim.library.mobile.odometry import WheelTravel
from foosim.library.mobile.players.beacons import (
    BEACON,
    FLEET,
    TELEMETRY,
    VISITS_MAX,
    Beacon,
    Telemetry,
    decode_beacon,
    decode_fleet,
    encode_beacon,
    encode_telemetry,
)
from foosim.library.mobile.players.roadmap import roadmap_of
from foosim.library.mobile.players.steering import Estimate, Steering, wrapped
from foosim.library.mobile.rover import RoverRobot
from foosim.library.mobile.station import StationRobot
from foosim.library.mobile.wheel_speeds import Drive

ARRIVED_M: Final = 0.35
"""So near to a spot it counts as visited."""
CLAIM_S: Final = 2.0
"""Time for which another rover's reported goal is valid."""
SIGHT_S: Final = 3.0
"""Time for which an unknown obstacle is remembered."""
OFF_MAP_M: Final = 0.3
"""An echo nearer to one of the map's obstacles belongs to it."""
STUCK_S: Final = 4.0
"""A spot is given up after this time without approach,"""
GIVEN_UP_S: Final = 10.0
"""for so long."""
NEAR_M: Final = 1.2
"""It turns away from things outside of the map that are nearer than this on its course,"""
AVOIDED_S: Final = 3.0
"""and keeps to that for so long."""
SIDE_RAD: Final = 1.2
TELEMETRY_S: Final = 5.0
ROVERS_MAX: Final = 255
"""A rover's number is a byte."""


@dataclass(frozen=True, slots=True)
class Settings:
    """The parameters of a patrol in the deployment."""

    rover: str
    base: str = ""
    """The player that gets telemetry; none if it is empty."""
    cell_m: float = 2.5
    speed: float = 1.0
    """m/s, of a rover in contact with others."""
    alone_speed: float = 0.5
    alone_s: float = 3.0
    """A rover is alone after this time without a message."""
    beacon_s: float = 0.3
    low: float = 0.25
    """Shares of the capacity: when it goes to the charger,"""
    high: float = 0.9
    """and when it leaves it."""


def read_settings(parameters: Mapping[str, Any], deployment: Deployment) -> Settings:
    """Return a patrol's parameters, checked; raises BadValue."""
    known = {field.name: field.type for field in fields(Settings)}
    for name, value in parameters.items():
        if name not in known:
            raise UnknownName("no parameter of a patrol", name, known)
        is_text = name in ("rover", "base")
        number = isinstance(value, int | float) and not isinstance(value, bool) and 0.0 < value < 1000.0
        if not (isinstance(value, str) if is_text else number):
            raise BadValue(f"parameter {name} is not {'a text' if is_text else 'a number above 0'}", value)
    settings = Settings(**{"rover": "", **parameters})
    rovers = [name for name, robot in deployment.robots.items() if isinstance(robot, RoverRobot)]
    if settings.rover not in rovers:
        raise UnknownName("parameter rover is not a rover", settings.rover, rovers)
    if settings.base and settings.base not in deployment.players:
        raise UnknownName("parameter base is not a player", settings.base, deployment.players)
    if len(rovers) > ROVERS_MAX:
        raise BadValue(f"a patrol has at most {ROVERS_MAX} rovers", len(rovers))
    if not settings.low < settings.high <= 1.0:
        raise BadValue("parameter high is not above low, at most 1", settings.high)
    return settings


class Heard(NamedTuple):
    """The last report of another rover, and its time (s)."""

    at_s: float
    here: int
    goal: int


@mypyc_attr(allow_interpreted_subclasses=True)
class Patrol(Player):
    """The player: one rover's controller. Its knowledge of others comes by radio only."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        self.settings = settings = read_settings(parameters, deployment)
        rovers = sorted(name for name, robot in deployment.robots.items() if isinstance(robot, RoverRobot))
        self.number = rovers.index(settings.rover)
        self.heard: dict[int, Heard] = {}
        """The other rovers, by number."""
        self.is_alone = True
        self.charging = False
        """Whether it is on its way to the charger, or there."""
        self._count = len(rovers)
        self._tick_s = deployment.tick_ns / 1e9
        self._map = roadmap_of(deployment, settings.cell_m)
        stations = [robot for _, robot in sorted(deployment.robots.items()) if isinstance(robot, StationRobot)]
        reach = hall_of(deployment).station.charge_radius - ARRIVED_M
        self._chargers = frozenset(spot for robot in stations for spot in self._map.around(robot.x, robot.y, reach))
        self._obstacles = obstacles_of(deployment)
        self._steering = Steering(hall_of(deployment).rover)
        self._estimate = Estimate(hall_of(deployment).rover.drive.track)
        self._rays_from = hall_of(deployment).rover.radius
        key = draw_key(deployment.seed, "patrol", settings.rover)
        spots = range(len(self._map.spots))
        self._visited_s = [-100.0 * unit_interval(draw_words(key, spot)[0]) for spot in spots]
        """The time of the last visit to each spot, by any rover: none at the start, and each rover begins elsewhere."""
        self._visits: dict[int, float] = {}
        self._blocked_s: dict[int, float] = {}
        """Until when a spot is taken for blocked."""
        self._sequences: dict[str, int] = {}
        self._heard_s = -settings.alone_s
        self._here = self._goal = -1
        self._avoided_s = 0.0
        self._least_m, self._least_s = 0.0, 0.0
        """How near the goal has been, and since when it comes no nearer."""
        self._seen: tuple[float, float] | None = None
        self._share = 1.0
        self._beacon_due_s = settings.beacon_s * self.number / self._count
        self._telemetry_due_s = TELEMETRY_S * self.number / self._count

    def act(self, tick: int, samples: Samples) -> Turn:
        """Take new samples, choose the goal, and send telemetry and beacons."""
        now_s = tick * self._tick_s
        self._listen(samples, now_s)
        ranges = self._sense(samples)
        if not self._estimate.is_known:
            return Turn({})
        self._look(ranges, now_s)
        self._choose(now_s)
        return Turn({self.settings.rover: self._drive(ranges)}, self._say(now_s))

    # --- knowing -----------------------------------------------------------------------------------------------------

    def _sense(self, samples: Samples) -> tuple[float, ...]:
        """Take the own robot's sensor samples; return its proximity ranges."""
        rover = self.settings.rover
        travel, pose = samples.get((rover, "odometry")), samples.get((rover, "pose"))
        if travel is not None and isinstance(travel.value, WheelTravel):
            self._estimate.roll(travel.value)
        if pose is not None and isinstance(pose.value, Pose):
            self._estimate.fix(pose.sequence, pose.value)
        battery, proximity = samples.get((rover, "battery")), samples.get((rover, "proximity"))
        if battery is not None and isinstance(battery.value, Battery):
            self._share = battery.value.share
        return proximity.value.ways if proximity is not None and isinstance(proximity.value, Ranges) else ()

    def _listen(self, samples: Samples, now_s: float) -> None:
        """Take messages of others since the last turn."""
        for (source, channel), sample in samples.items():
            if channel not in (BEACON, FLEET) or self._sequences.get(source) == sample.sequence:
                continue
            self._sequences[source] = sample.sequence
            sent_s = sample.sent_ns / 1e9
            if channel == BEACON:
                beacon = decode_beacon(sample.value, self._count, len(self._map.spots))
                if beacon is not None and beacon.number != self.number:
                    self._take_beacon(beacon, sent_s)
            else:
                for entry in decode_fleet(sample.value, self._count, len(self._map.spots)) or ():
                    self._hear(entry.number, Heard(sent_s - entry.age, entry.here, entry.goal))
        self.is_alone = now_s - self._heard_s >= self.settings.alone_s

    def _take_beacon(self, beacon: Beacon, sent_s: float) -> None:
        self._heard_s = max(self._heard_s, sent_s)
        self._hear(beacon.number, Heard(sent_s, beacon.here, beacon.goal))
        self._visited_s[beacon.here] = max(self._visited_s[beacon.here], sent_s)
        for spot, age in beacon.visits:
            self._visited_s[spot] = max(self._visited_s[spot], sent_s - age)
        if beacon.seen is not None and not self.is_at(*beacon.seen):
            self._block(self._map.nearest(*beacon.seen), sent_s + SIGHT_S)

    def _hear(self, number: int, heard: Heard) -> None:
        """Keep the newer report."""
        known = self.heard.get(number)
        if number != self.number and (known is None or heard.at_s > known.at_s):
            self.heard[number] = heard

    def is_at(self, x: float, y: float) -> bool:
        """Whether an obstacle that another rover reports is this rover."""
        return hypot(x - self._estimate.x, y - self._estimate.y) <= 2.0 * self._rays_from

    def _look(self, ranges: tuple[float, ...], now_s: float) -> None:
        """Find the nearest thing outside of the map."""
        self._seen = None
        if not ranges:
            return
        ray = min(range(len(ranges)), key=ranges.__getitem__)
        way, angle = ranges[ray] + self._rays_from, self._estimate.heading + 2.0 * pi * ray / len(ranges)
        x, y = self._estimate.x + way * cos(angle), self._estimate.y + way * sin(angle)
        if all(obstacle.is_clear(x, y, OFF_MAP_M) for obstacle in self._obstacles):
            self._seen = x, y

    def _block(self, spot: int, until_s: float) -> None:
        self._blocked_s[spot] = max(self._blocked_s.get(spot, 0.0), until_s)

    def _claimed(self, now_s: float) -> set[int]:
        """Return the spots that are others', as far as it is known, or blocked."""
        self._blocked_s = {spot: until_s for spot, until_s in self._blocked_s.items() if until_s > now_s}
        claims = [known for known in self.heard.values() if now_s - known.at_s <= CLAIM_S]
        return {*self._blocked_s, *(known.here for known in claims), *(known.goal for known in claims)}

    # --- deciding ----------------------------------------------------------------------------------------------------

    def _choose(self, now_s: float) -> None:
        """Decide where to go: ahead, back where another rover has the right of way, or around an obstacle."""
        x, y = self._estimate.x, self._estimate.y
        if self._here < 0:
            self._here = self._goal = self._map.nearest(x, y)
            self._least_m = self._map.distance(self._goal, x, y)
        self.charging = self._share < (self.settings.high if self.charging else self.settings.low)
        way_m = self._map.distance(self._goal, x, y)
        if way_m <= ARRIVED_M:
            self._here = self._goal
            self._visited_s[self._here] = self._visits[self._here] = now_s
            self._head_for(self._next(now_s), now_s)
        elif self._must_give_way(now_s):
            self._head_for(self._here, now_s)
        elif self._meets_obstacle() and now_s >= self._avoided_s:
            self._avoided_s = now_s + AVOIDED_S
            self._here = self._map.nearest(x, y)
            self._head_for(self._away(now_s), now_s)
        elif way_m < self._least_m - 0.05:
            self._least_m, self._least_s = way_m, now_s
        elif now_s - self._least_s > STUCK_S:
            self._block(self._goal, now_s + GIVEN_UP_S)
            self._here = self._map.nearest(x, y)
            self._head_for(self._next(now_s), now_s)

    def _head_for(self, spot: int, now_s: float) -> None:
        if spot != self._goal:
            self._goal, self._least_s = spot, now_s
            self._least_m = self._map.distance(spot, self._estimate.x, self._estimate.y)

    def _must_give_way(self, now_s: float) -> bool:
        """Whether a rover with a smaller number heads for the same spot, or any is there already."""
        if self._goal == self._here:
            return False
        claims = [(number, known) for number, known in self.heard.items() if now_s - known.at_s <= CLAIM_S]
        return any(
            known.here == self._goal or (known.goal == self._goal and number < self.number) for number, known in claims
        )

    def _meets_obstacle(self) -> bool:
        """Whether a thing outside of the map is near, and about where it is going."""
        if self._seen is None:
            return False
        at, goal = self._estimate, self._map.spots[self._goal]
        seen_x, seen_y = self._seen[0] - at.x, self._seen[1] - at.y
        aside = wrapped(atan2(seen_y, seen_x) - atan2(goal[1] - at.y, goal[0] - at.x))
        return hypot(seen_x, seen_y) < NEAR_M and abs(aside) < SIDE_RAD

    def _away(self, now_s: float) -> int:
        """Return the spot near here that is farthest from the oncoming rover."""
        assert self._seen is not None
        seen, claimed = self._seen, self._claimed(now_s)
        free = [spot for spot in (self._here, *self._map.neighbours[self._here]) if spot not in claimed]
        return max(free, key=lambda spot: (self._map.distance(spot, *seen), -spot), default=self._here)

    def _next(self, now_s: float) -> int:
        """Return the spot to go to from here; this one if no other is free."""
        here, claimed = self._here, self._claimed(now_s)
        if self.charging:
            if here in self._chargers:
                return here
            step = self._map.step_towards(here, self._chargers - claimed, claimed)
            if step is not None:
                return step
        free = [spot for spot in self._map.neighbours[here] if spot not in claimed]
        return min(free, key=lambda spot: (self._visited_s[spot], spot), default=here)

    # --- doing -------------------------------------------------------------------------------------------------------

    def _drive(self, ranges: tuple[float, ...]) -> Drive:
        """Return the wheels' speeds towards the goal, limited by obstacles."""
        speed = self.settings.alone_speed if self.is_alone else self.settings.speed
        return self._steering.towards(self._estimate, self._map.spots[self._goal], ranges, speed)

    def _say(self, now_s: float) -> list[Packet]:
        """Return the beacon, and the telemetry, when they are due."""
        packets = []
        estimate = self._estimate
        if now_s >= self._beacon_due_s:
            self._beacon_due_s = now_s + self.settings.beacon_s
            newest = sorted(self._visits, key=lambda spot: (-self._visits[spot], spot))[:VISITS_MAX]
            self._visits = {spot: self._visits[spot] for spot in newest}
            visits = tuple((spot, now_s - visited_s) for spot, visited_s in self._visits.items())
            where = estimate.x, estimate.y, estimate.heading, self._here, self._goal
            beacon = Beacon(self.number, *where, self._share, self._seen, visits)
            packets.append(Packet("", BEACON, encode_beacon(beacon)))
        if self.settings.base and now_s >= self._telemetry_due_s:
            self._telemetry_due_s = now_s + TELEMETRY_S
            hears = sum(now_s - known.at_s <= CLAIM_S for known in self.heard.values())
            spots = self._here, self._goal
            telemetry = Telemetry(self.number, estimate.x, estimate.y, self._share, estimate.driven, hears, *spots)
            packets.append(Packet(self.settings.base, TELEMETRY, encode_telemetry(telemetry)))
        return packets

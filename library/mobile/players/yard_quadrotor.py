"""The controller of a quadrotor that watches a yard: it takes off, circles, and forwards the scouts' reports by radio.

From above it has a line of sight to both sides of a wall, so that a scout hears of another one behind it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from math import cos, pi, sin
from typing import Any, Final

from foosim.client.player import Packet, Player, Samples, Turn
from foosim.common.errors import BadValue, UnknownName
from foosim.deployment.schema import Deployment
from foosim.library.generic.gps import GlobalPosition
from foosim.library.generic.imu import Inertial
from foosim.library.mobile.players.flight import Flight, Navigation
from foosim.library.mobile.players.yard_reports import WATCH, Heard, encode_watch
from foosim.library.mobile.rotor_speeds import RotorSpeeds
from foosim.library.mobile.rotors import QuadrotorRobot
from foosim.world.assembly.sections import gravity_of
from foosim.world.earth import Geodesy
from foosim.world.scene import Vector

RAD: Final = pi / 180.0
WATCH_S: Final = 0.4
FRESH_S: Final = 2.0
"""What is older is not passed on."""


@dataclass(frozen=True, slots=True)
class Settings:
    """The parameters of a watch in the deployment: it circles about the origin of the world."""

    quadrotor: str
    height: float = 3.0
    """m"""
    radius: float = 1.2
    """m"""
    period: float = 20.0
    """s, of a circle."""
    climb: float = 0.6
    """m/s"""


def read_settings(parameters: Mapping[str, Any], deployment: Deployment) -> Settings:
    """Return a watch's parameters, checked; raises BadValue."""
    known = {field.name: field.type for field in fields(Settings)}
    for name, value in parameters.items():
        if name not in known:
            raise UnknownName("no parameter of a watch", name, known)
        number = isinstance(value, int | float) and not isinstance(value, bool) and 0.0 < value < 1000.0
        if not (isinstance(value, str) if name == "quadrotor" else number):
            raise BadValue(f"parameter {name} is not {'a text' if name == 'quadrotor' else 'a number above 0'}", value)
    settings = Settings(**{"quadrotor": "", **parameters})
    flyers = sorted(name for name, its in deployment.robots.items() if isinstance(its, QuadrotorRobot))
    if settings.quadrotor not in flyers:
        raise UnknownName("parameter quadrotor is not a quadrotor", settings.quadrotor, flyers)
    if deployment.origin is None:
        raise BadValue("a quadrotor with satellite navigation needs the deployment's origin on Earth")
    return settings


class Watch(Player):
    """The player: a quadrotor's controller. It knows where it is from its sensors `imu` and `gps` alone."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        self.settings = settings = read_settings(parameters, deployment)
        robot = deployment.robots[settings.quadrotor]
        assert isinstance(robot, QuadrotorRobot)
        assert deployment.origin is not None
        gravity = gravity_of(deployment)
        self.navigation = Navigation(robot.at.yaw, gravity)
        self.heard = Heard()
        self._flight = Flight(robot, gravity)
        self._earth = Geodesy(deployment.origin)
        self._tick_s = deployment.tick_ns / 1e9
        self._start: tuple[float, Vector] | None = None
        """When it took off (s), and from where (m)."""
        self._last = {"imu": (-1, 0.0), "gps": (-1, 0.0)}
        """Sequence number and time (s) of the last reading of each sensor."""
        self._watch_s = 0.0

    def act(self, tick: int, samples: Samples) -> Turn:
        """Continue the flight, and forward reports."""
        now_s, name = tick * self._tick_s, self.settings.quadrotor
        self._sense(samples)
        self.heard.take(samples)
        at = self.navigation
        if not at.is_known:
            return Turn({})
        if self._start is None:
            self._start = now_s, at.position
        place, velocity = self._goal(now_s - self._start[0], self._start[1])
        commands = {name: RotorSpeeds(self._flight.rotors(at, place, velocity, 0.0))}
        if now_s < self._watch_s:
            return Turn(commands)
        self._watch_s = now_s + WATCH_S
        fresh = [report for _, report in sorted(self.heard.reports.items()) if now_s - report.time < FRESH_S]
        return Turn(commands, [Packet("", WATCH, encode_watch(fresh))] if fresh else [])

    def _sense(self, samples: Samples) -> None:
        for channel in ("imu", "gps"):
            sample = samples.get((self.settings.quadrotor, channel))
            sequence, before_s = self._last[channel]
            if sample is None or sample.sequence == sequence:
                continue
            sent_s = sample.sent_ns / 1e9
            self._last[channel] = sample.sequence, sent_s
            if isinstance(sample.value, Inertial) and self.navigation.is_known:
                self.navigation.move(sample.value, sent_s - before_s)
            elif isinstance(sample.value, GlobalPosition):
                fix = sample.value
                place = self._earth.place((fix.latitude * RAD, fix.longitude * RAD, fix.altitude))
                self.navigation.fix(place, sent_s - before_s)

    def _goal(self, time_s: float, start: Vector) -> tuple[Vector, Vector]:
        """Return where it is to be (m), and how fast that moves (m/s): up, then out to the circle, then along it."""
        its = self.settings
        rise_s = max(0.0, its.height - start[2]) / its.climb
        if time_s < rise_s:
            return (start[0], start[1], start[2] + its.climb * time_s), (0.0, 0.0, its.climb)
        rate = 2.0 * pi / its.period
        angle = rate * (time_s - rise_s)
        c, s = cos(angle), sin(angle)
        place = its.radius * c, its.radius * s, its.height
        return place, (-its.radius * rate * s, its.radius * rate * c, 0.0)

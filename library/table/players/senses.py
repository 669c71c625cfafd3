"""The state of a team's player: its rods, the ball's track, and the ages of readings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil
from typing import TYPE_CHECKING, Any, Final

from foosim.common.errors import BadValue, UnknownName
from foosim.deployment.schema import Deployment
from foosim.library.generic.delay import delay_ns
from foosim.library.table.ball import BallPosition, BallSettings
from foosim.library.table.encoder import EncoderSettings, RodPosition
from foosim.library.table.players.ball_filter import Ball, BallTrack
from foosim.library.table.players.rod import Rod, Sight, View
from foosim.library.table.rod import RodRobot
from foosim.library.table.settings import TEAMS, LineName
from foosim.world.layout import build_layout

if TYPE_CHECKING:
    from foosim.client.player import Samples

SMOOTHING: Final = 0.05
"""Share of a new delay in the mean delay of the link."""


def team_of(parameters: Mapping[str, Any], others: Sequence[str] = ()) -> str:
    """Return the parameter `team`; raises UnknownName for parameters but `others`, BadValue for another team."""
    known = ["team", *others]
    for key in parameters:
        if key not in known:
            raise UnknownName("unknown parameter", key, known)
    team = parameters.get("team")
    if team not in TEAMS:
        raise BadValue(f"parameter team is not one of {', '.join(TEAMS)}", team)
    return str(team)


def side_of(team: str) -> float:
    """Return the sign of x in a team's view."""
    return 1.0 if team == "red" else -1.0


def rods_of(deployment: Deployment, team: str, lines: Sequence[LineName]) -> list[Rod]:
    """Return the rods of some lines of a team, in the order of the lines."""
    layout = build_layout(deployment)
    rods = {
        robot.line: Rod(deployment, layout, robot, name, side_of(team))
        for name, robot in sorted(deployment.robots.items())
        if isinstance(robot, RodRobot) and robot.team == team
    }
    return [rods[line] for line in lines if line in rods]


class Senses:
    """Rods and ball from the samples that have come."""

    def __init__(self, deployment: Deployment, team: str, rods: Sequence[Rod]) -> None:
        self._side = side_of(team)
        self._tick_ns = deployment.tick_ns
        self._track = BallTrack(deployment)
        self._encoders = {
            (rod.name, channel): rod
            for rod in rods
            for channel, sensor in deployment.robots[rod.name].sensors.items()
            if isinstance(sensor, EncoderSettings)
        }
        self._cameras = {
            (name, channel): delay_ns(sensor.modifiers)
            for name, robot in sorted(deployment.robots.items())
            for channel, sensor in sorted(robot.sensors.items())
            if isinstance(sensor, BallSettings)
        }
        """Each channel with a ball, and how old what it sends is: the camera's own delay (ns)."""
        self._link_ns = 0.0
        self._newest_ns = -1

    def see(self, tick: int, samples: Samples) -> Sight | None:
        """Return the ball, as it will be when a command that is sent now reaches a rod; None before it was seen.

        Rods with a reading are set to that tick, too. A command is taken to be on its way for as long as pictures
        are.
        """
        for pair, latency_ns in self._cameras.items():
            sample = samples.get(pair)
            if sample is not None and isinstance(sample.value, BallPosition):
                if sample.sent_ns > self._newest_ns:
                    late_ns = sample.due_ns - sample.sent_ns
                    share = SMOOTHING if self._newest_ns >= 0 else 1.0
                    self._newest_ns = sample.sent_ns
                    self._link_ns += share * (late_ns - self._link_ns)
                self._track.take(sample.sent_ns - latency_ns, sample.value)
        self._see_rods(tick, samples)
        if not self._track.known:
            return None
        track = self._track
        ball = self._view(track.at((tick + self.reach_ticks) * self._tick_ns))
        return Sight(ball, self._view(track.ball), track.is_steady, track.height)

    def _see_rods(self, tick: int, samples: Samples) -> None:
        for pair, rod in self._encoders.items():
            sample = samples.get(pair)
            if sample is not None and isinstance(sample.value, RodPosition):
                rod.see(sample.value, sample.sent_ns // self._tick_ns)
                rod.foresee(tick + self.reach_ticks)

    def _view(self, ball: Ball) -> View:
        x, y, vx, vy, z = ball
        return View(self._side * x, y, self._side * vx, vy, z)

    @property
    def reach_ticks(self) -> int:
        """After how many ticks a command moves a rod: in the first one that begins when it is there."""
        return max(ceil(self._link_ns / self._tick_ns), 1)

"""A team that plays: a keeper that guards with the goal and defence rods, a striker that shoots with the others.

Both see packets only, noisy, late and some lost, and command rods by packets. A team thinks in its own view: `u` along
the field towards the goal it attacks, y across as in the world, swing positive when the feet go towards `u`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import atan2, sin, sqrt
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from mypy_extensions import mypyc_attr

from foosim.common.errors import BadValue, UnknownName
from foosim.common.keyed_random import draw_key, draw_words
from foosim.deployment.schema import Deployment
from foosim.players.ball_filter import Ball, BallTrack, moved
from foosim.world.actuators.rod_position import Command
from foosim.world.models.rod import RodRobot
from foosim.world.modifiers.delay import delay_ns
from foosim.world.parameters.table import TEAMS, table_of
from foosim.world.sensors.ball import BallPosition, BallSettings
from foosim.world.sensors.encoder import EncoderSettings, RodPosition

if TYPE_CHECKING:
    from foosim.client.player import Commands, Samples

LATENCY_S: Final = 0.003
"""Delay from a decision to the rod's motion: the command's link and the next tick."""
SLIDE_LAG_S: Final = 0.033
"""How far a rod's slide follows behind a moving target: 1 / gain of its loop."""
SPIN_UP: Final = 1e4
"""rad/s2 with which a rod begins to turn: 2 N m on 2e-4 kg m2."""
DOWN_RAD: Final = 0.0
LIFTED_RAD: Final = -2.2
"""Feet behind the rod and above the ball: it passes."""
BACK_RAD: Final = -0.8
"""Feet drawn back for a kick."""
HIGH_M: Final = 0.03
"""A ball whose centre is higher than this is above the feet."""
SLOW: Final = 0.6
FAST: Final = 3.0
"""m/s: a ball that is slower waits for feet drawn back; one that comes faster is blocked, not struck."""
FAR_M: Final = 0.036
TAP_RAD: Final = 1.0
"""Where a kick of a ball that is FAR_M in front aims: struck late, it would fly."""
KICKED_RAD: Final = 1.6
"""Where a kick aims; it is over before, at THROUGH_RAD."""
THROUGH_RAD: Final = 0.6
KICK_S: Final = 0.06
REACH_M: Final[tuple[float, ...]] = (-0.012, 0.06)
"""A ball this far in front of a rod's axis can be struck."""
UNDER_M: Final = 0.035
"""A ball nearer to the axis than this stands between the figures' feet: sliding would push it aside."""
ALIGNED_M: Final = 0.008
AIM_RAD_MAX: Final = 0.6
RESTS_M: Final = 0.06
BEHIND_M: Final = 0.02
"""A ball that lies lower and this far behind the axis is let through under lifted feet."""
POST_M: Final = 0.08
"""The defence guards this far from the goal's middle, on the ball's side; the goalkeeper guards the middle."""
COMING_SPEED: Final = 0.2
COMING_S: Final = 0.5
"""A ball that comes at this speed and is here within this time is awaited where it will pass."""
AIM_INSIDE: Final = 1.6
"""Shots aim this many radii of the ball inside a post."""
AIM_NS: Final = 250_000_000
FLAT_RAD: Final = 0.03
"""Below this a shot is straight enough with the flat of the foot."""


class View(NamedTuple):
    """The ball as a team sees it: `u` (m) towards the goal that it attacks, y as in the world, and their speeds."""

    u: float
    y: float
    vu: float
    vy: float
    z: float


class Rod:
    """One rod of a player: its state, and its possible movements."""

    def __init__(self, deployment: Deployment, name: str, robot: RodRobot, side: float) -> None:
        table = table_of(deployment)
        line = table.lines[robot.line]
        self.name = name
        self.u = line.x
        """x of its axis, in the team's view."""
        self.slide = 0.0
        self.swing = 0.0
        self.seen = False
        self._side = side
        self._half_stroke = line.half_stroke
        self._figures = [(index - (line.figures - 1) / 2) * line.pitch for index in range(line.figures)]
        self._foot_y = table.rod.foot.width / 2
        self._ball_radius = table.ball.radius
        self._ball_y_max = table.field.width / 2 - table.ball.radius
        self._kick_end_s = -1.0
        self._kick_slide = self._kick_swing = 0.0

    def see(self, position: RodPosition) -> None:
        self.seen = True
        self.slide = position.slide
        self.swing = -self._side * position.spin

    def command(self, slide: float, swing: float) -> Command:
        """Return the command for a slide and a swing in the team's view."""
        return Command(min(max(slide, -self._half_stroke), self._half_stroke), -self._side * swing)

    def slide_to(self, y: float) -> float:
        """Return the slide that brings a figure to `y`, or as near as the stroke lets it, with the shortest way."""
        best, best_cost = 0.0, 1e9
        for figure in self._figures:
            slide = min(max(y - figure, -self._half_stroke), self._half_stroke)
            # Getting there counts for more than a short way.
            cost = 100.0 * abs(slide + figure - y) + abs(slide - self.slide)
            if cost < best_cost:
                best, best_cost = slide, cost
        return best

    def strike(self, ball: View, now_s: float, goal: tuple[float, float]) -> Command | None:
        """Return the next move of a shot at `goal` (u, y), or None when the ball is out of reach."""
        if self._kick_end_s > now_s and self.swing < THROUGH_RAD:
            return self.command(self._kick_slide, self._kick_swing)
        self._kick_end_s = -1.0
        ahead = LATENCY_S + sqrt(max(0.0, 2.0 * (0.1 - self.swing) / SPIN_UP))
        u, y = ball.u + ball.vu * ahead - self.u, ball.y + ball.vy * ahead
        if not REACH_M[0] < u < REACH_M[1] or ball.z > HIGH_M or ball.vu < -FAST:
            return None
        slide = self.slide_to(y - self._offset(u, y, goal))
        ready = abs(slide - self.slide) < ALIGNED_M
        slow = abs(ball.vu) < SLOW
        if ready and (self.swing < BACK_RAD + 0.2 or not slow or u < UNDER_M):
            self._kick_end_s = now_s + KICK_S
            self._kick_slide = slide
            self._kick_swing = KICKED_RAD if u < FAR_M else TAP_RAD
            return self.command(slide, self._kick_swing)
        lead = ball.vy * SLIDE_LAG_S
        if u < UNDER_M and not ready:
            return self.command(slide + lead, LIFTED_RAD)
        return self.command(slide + lead, BACK_RAD if slow else DOWN_RAD)

    def y_after(self, ball: View, time_s: float) -> float:
        """Return the ball's y a time later, side walls minded."""
        return moved(Ball(ball.u, ball.y, ball.vu, ball.vy, ball.z), time_s, self._ball_y_max).y

    def _offset(self, u: float, y: float, goal: tuple[float, float]) -> float:
        """Return how far beside the ball a foot must strike so that its edge sends the ball towards the goal."""
        angle = atan2(goal[1] - y, goal[0] - self.u - u)
        angle = min(max(angle, -AIM_RAD_MAX), AIM_RAD_MAX)
        if abs(angle) < FLAT_RAD:
            return 0.0
        beside = self._foot_y + self._ball_radius * sin(abs(angle))
        return beside if angle > 0.0 else -beside


class Keeper:
    """Guards with the goal and defence rods: figures block the ball's path, or else the line from ball to goal."""

    def __init__(self, rods: Sequence[Rod], own_goal: tuple[float, float]) -> None:
        self.rods = rods
        self._goal_u, self._goal_y = own_goal

    def move(self, rod: Rod, ball: View) -> Command:
        """Return where a rod waits for a ball that it cannot strike now."""
        if ball.u < rod.u - BEHIND_M and ball.z < RESTS_M:
            return rod.command(rod.slide_to(ball.y), LIFTED_RAD)
        return rod.command(rod.slide_to(self._guarded_y(rod, ball)), DOWN_RAD)

    def _guarded_y(self, rod: Rod, ball: View) -> float:
        if ball.vu < -COMING_SPEED:
            time_s = (rod.u - ball.u) / ball.vu
            if time_s < COMING_S:
                return rod.y_after(ball, time_s)
        share = (rod.u - self._goal_u) / max(ball.u - self._goal_u, rod.u - self._goal_u)
        point = 0.0 if rod is self.rods[0] else (POST_M if ball.y > 0.0 else -POST_M)
        return point + (ball.y - point) * share


class Striker:
    """Shoots with the midfield and attack rods: moves behind the ball, and lifts its feet when the ball is behind."""

    def __init__(self, rods: Sequence[Rod]) -> None:
        self.rods = rods

    def move(self, rod: Rod, ball: View) -> Command:
        """Return where a rod waits for a ball that it cannot strike now."""
        y = rod.y_after(ball, SLIDE_LAG_S)
        if ball.u < rod.u - BEHIND_M and ball.z < RESTS_M:
            return rod.command(rod.slide_to(y), LIFTED_RAD)
        if ball.vu < -COMING_SPEED:
            y = rod.y_after(ball, min((rod.u - ball.u) / ball.vu, COMING_S))
        return rod.command(rod.slide_to(y), DOWN_RAD)


@mypyc_attr(allow_interpreted_subclasses=True)
class Team:
    """A keeper and a striker for one team. Parameters: `team`, red or blue. It commands the rods that it hears."""

    def __init__(self, deployment: Deployment, parameters: Mapping[str, Any]) -> None:
        for key in parameters:
            if key != "team":
                raise UnknownName("unknown parameter", key, ["team"])
        team = parameters.get("team")
        if team not in TEAMS:
            raise BadValue(f"parameter team is not one of {', '.join(TEAMS)}", team)
        table = table_of(deployment)
        side = 1.0 if team == "red" else -1.0
        self._side = side
        self._tick_ns = deployment.tick_ns
        self._track = BallTrack(deployment)
        self._goal_u = table.field.length / 2
        self._aim_y = table.goal.width / 2 - AIM_INSIDE * table.ball.radius
        self._aim_key = draw_key(deployment.seed, "aim", str(team))
        rods = {
            robot.line: Rod(deployment, name, robot, side)
            for name, robot in sorted(deployment.robots.items())
            if isinstance(robot, RodRobot) and robot.team == team
        }
        self.keeper = Keeper([rods[line] for line in ("goal", "defence") if line in rods], (-self._goal_u, 0.0))
        self.striker = Striker([rods[line] for line in ("midfield", "attack") if line in rods])
        self._encoders = {
            (rod.name, channel): rod
            for rod in rods.values()
            for channel, sensor in deployment.robots[rod.name].sensors.items()
            if isinstance(sensor, EncoderSettings)
        }
        self._cameras = {
            (name, channel): delay_ns(sensor.modifiers)
            for name, robot in sorted(deployment.robots.items())
            for channel, sensor in sorted(robot.sensors.items())
            if isinstance(sensor, BallSettings)
        }
        """The latency of each camera (ns): its ball is where it was so long before the reading was sent."""

    def act(self, tick: int, samples: Samples) -> Commands:
        """Return the command of each rod."""
        self._see(samples)
        if not self._track.known:
            return {}
        now_ns = tick * self._tick_ns
        now_s = now_ns * 1e-9
        x, y, vx, vy, z = self._track.at(now_ns)
        ball = View(self._side * x, y, self._side * vx, vy, z)
        goal = (self._goal_u, self._aim(tick))
        commands: dict[str, Command] = {}
        for hand in (self.keeper, self.striker):
            for rod in hand.rods:
                if rod.seen:
                    commands[rod.name] = rod.strike(ball, now_s, goal) or hand.move(rod, ball)
        return commands

    def _see(self, samples: Samples) -> None:
        for pair, rod in self._encoders.items():
            sample = samples.get(pair)
            if sample is not None and isinstance(sample.value, RodPosition):
                rod.see(sample.value)
        for pair, latency_ns in self._cameras.items():
            sample = samples.get(pair)
            if sample is not None and isinstance(sample.value, BallPosition):
                self._track.take(sample.sent_ns - latency_ns, sample.value)

    def _aim(self, tick: int) -> float:
        """Return the y at which shots aim in this quarter of a second: a keyed draw, so that nobody can tell."""
        word = draw_words(self._aim_key, tick * self._tick_ns // AIM_NS)[0]
        return self._aim_y if word & 1 else -self._aim_y

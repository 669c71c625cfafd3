"""One rod as its player sees it: where it is, where its feet meet the ball, how it turns clear of it.

A team thinks in its own view: `u` along the field towards the goal it attacks, y across as in the world, swing positive
when the feet go towards `u`, 0 with the feet down.
"""

from __future__ import annotations

from math import acos, asin, atan2, cos, hypot, pi
from typing import Final, NamedTuple

from foosim.deployment.schema import Deployment
from foosim.library.table.encoder import RodPosition
from foosim.library.table.players.ball_filter import Ball, Room, moved, room_of
from foosim.library.table.players.motors import Motion, Motors
from foosim.library.table.rod import RodRobot, figure_ys
from foosim.library.table.rod_drives import RodLimits
from foosim.library.table.rod_position import Command
from foosim.library.table.settings import table_of
from foosim.world.components.entities import mounting_of
from foosim.world.layout import Layout

TURN: Final = 2.0 * pi
SWING_S_MAX: Final = 0.1
CLEAR_M: Final = 0.004
"""Beyond this distance beside or behind a ball a foot does not touch it: a margin for noise and delay."""
NEAR_M: Final = 0.15
"""A rod whose ball is farther away turns back to the turn that it started in."""


PAST_M: Final = 0.005
"""A ball seen at most this far behind the front of the feet may have been stopped by them."""
LOW_RAD: Final = 0.5
"""Feet within this of straight down stop a ball."""
FLIES_M: Final = 0.045
"""A foot that turns over its rod would hit a ball whose centre is higher than this."""


TURNS_MAX: Final = 100
"""Whole turns away from feet down: an actuator takes angles of up to 1,000 rad."""


class View(NamedTuple):
    """The ball as a team sees it: `u` (m) towards the goal that it attacks, y as in the world, their speeds, height."""

    u: float
    y: float
    vu: float
    vy: float
    z: float

    def later(self, time_s: float, room: Room) -> View:
        """Return it a time later, walls minded."""
        return View(*moved(Ball(*self), time_s, room))


class Sight(NamedTuple):
    """What a team knows of the ball: as it will be when a command arrives, and as it was seen last.

    Without `is_steady` it has just been kicked or blocked: its course is a guess. `height` (m) is the greater
    one of the last two pictures.
    """

    ball: View
    seen: View
    is_steady: bool
    height: float


class Rod:
    """One rod of a player: its state, its geometry, and its possible movements.

    `slide` (m), `swing` (rad) and `turning` (rad/s) are those of its newest reading, or of the tick that was foreseen
    since.
    """

    def __init__(self, deployment: Deployment, layout: Layout, robot: RodRobot, name: str, side: float) -> None:
        table = table_of(deployment)
        line = table.lines[robot.line]
        self.name = name
        self.line = robot.line
        self.u = line.x
        """x of its axis, in the team's view."""
        self.slide = 0.0
        self.swing = 0.0
        self.turning = 0.0
        self.seen = False
        self.foot_y = table.rod.foot.width / 2
        self.ball_radius = table.ball.radius
        self.room = room_of(table)
        self.spin_gain = table.drive.spin.gain
        self.slide_lag_s = 1.0 / table.drive.slide.gain
        self._side = side
        self.half_stroke = line.half_stroke
        self._figures = figure_ys(line)
        self._depth = table.rod.axis_height - table.ball.radius
        """How far a lying ball's centre is below the axis."""
        self._foot_radius = table.rod.foot_radius
        self._foot_x = table.rod.foot.length / 2
        self._motors = Motors(table.drive, RodLimits(mounting_of(deployment, layout, layout[name])), deployment.tick_ns)
        self.reach = hypot(self._foot_radius, self._foot_x) + table.ball.radius
        """From the axis to the centre of a ball that a turning foot just touches."""

    def see(self, position: RodPosition, tick: int) -> None:
        """Take a reading of its encoder, of a tick."""
        self.seen = True
        self._motors.see(tick, position.slide, position.spin)
        self.foresee(tick)

    def foresee(self, tick: int) -> None:
        """Set its state to that of a tick to come, by its commands."""
        slide, spin = self._motors.at(tick)
        self.slide = slide.at
        self.swing, self.turning = -self._side * spin.at, -self._side * spin.speed

    def note(self, command: Command, tick: int) -> None:
        """Note a sent command that moves it from a tick on."""
        self._motors.note(tick, command.slide, command.spin)

    def command(self, slide: float, swing: float) -> Command:
        """Return the command for a slide and a swing in the team's view."""
        return Command(min(max(slide, -self.half_stroke), self.half_stroke), -self._side * swing)

    def slide_to(self, y: float) -> float:
        """Return the slide that brings a figure to `y`, or as near as the stroke lets it, with the shortest way."""
        best, best_cost = 0.0, 1e9
        for figure in self._figures:
            slide = min(max(y - figure, -self.half_stroke), self.half_stroke)
            # Getting there counts for more than a short way.
            cost = 100.0 * abs(slide + figure - y) + abs(slide - self.slide)
            if cost < best_cost:
                best, best_cost = slide, cost
        return best

    def reaches(self, y: float) -> bool:
        """Whether its stroke brings a figure to `y`."""
        return any(abs(y - figure) <= self.half_stroke for figure in self._figures)

    def contact(self, ahead: float) -> float | None:
        """Return the swing at which the front of a foot meets a ball that lies `ahead` of the axis (m).

        With its face, or below that with its lower edge; None for a ball that it does not reach.
        """
        distance, angle = hypot(ahead, self._depth), atan2(ahead, self._depth)
        gap = self._foot_x + self.ball_radius
        if distance >= self.reach or distance <= gap:
            return None
        face = angle - asin(gap / distance)
        if distance * cos(angle - face) <= self._foot_radius:
            return face
        edge = self.reach - self.ball_radius
        between = (edge * edge + distance * distance - self.ball_radius * self.ball_radius) / (2.0 * edge * distance)
        return angle - acos(min(between, 1.0)) - atan2(self._foot_x, self._foot_radius)

    def swing_s(self, start: Motion, contact: float, speed: float) -> float:
        """Return how long a foot takes from `start` to `contact` (rad), which it passes at `speed` (rad/s)."""
        return self._motors.spin.reaches_s(start, contact, contact + speed / self.spin_gain, SWING_S_MAX)

    def within_turn(self) -> float:
        """Return its swing within half a turn of feet down."""
        return self.swing - TURN * round(self.swing / TURN)

    def sweeps(self, ball: View) -> bool:
        """Whether a foot that turns would touch the ball: one is beside the axis, where a figure stands."""
        ahead = ball.u - self.u
        height = self._depth + self.ball_radius - ball.z
        if ahead * ahead + height * height > (self.reach + CLEAR_M) ** 2:
            return False
        return self.beside(ball.y) < self.foot_y + self.ball_radius + CLEAR_M

    def stopped(self, sight: Sight) -> View:
        """Return the ball, at this rod's feet where these have stopped it since it was seen last."""
        ball, seen = sight.ball, sight.seen
        touch = self._foot_x + self.ball_radius
        if seen.u - self.u < touch - PAST_M or ball.u - self.u > touch or abs(self.within_turn()) > LOW_RAD:
            return ball
        if self.beside(ball.y) > self.foot_y + self.ball_radius:
            return ball
        return ball._replace(u=self.u + touch, vu=0.0)

    def beside(self, y: float) -> float:
        """Return how far `y` is from the nearest figure."""
        return min(abs(y - self.slide - figure) for figure in self._figures)

    def turned(self, wanted: float, ball: View) -> float:
        """Return the swing to command for feet at `wanted`, or whole turns from it, by a way clear of the ball."""
        ahead = ball.u - self.u
        if abs(ahead) > NEAR_M or abs(self.swing) > TURNS_MAX * TURN:
            return wanted
        nearest = wanted + TURN * round((self.swing - wanted) / TURN)
        if not self.sweeps(ball):
            return nearest
        at = atan2(ahead, self._depth)
        start = self.swing - TURN * round((self.swing - at) / TURN)
        end = start + nearest - self.swing
        if (start - at) * (end - at) >= 0.0:
            return nearest
        if ball.z > FLIES_M:
            return self.swing
        return nearest - TURN if nearest > self.swing else nearest + TURN

    def y_after(self, ball: View, time_s: float) -> float:
        """Return the ball's y a time later, walls minded."""
        return ball.later(time_s, self.room).y

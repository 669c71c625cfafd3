"""A rod's shots: when a foot strikes the ball, how fast, and how far beside it, so that it stays low and hits the goal.

A foot that meets the ball while it hangs straight down sends it along the floor. One that is behind its rod presses the
ball down, one in front lifts it: then the foot is slower. A shot that is faster than FULL climbs the wall at the end:
of a ball's speed at a wall, friction turns up to (1 + e) x mu into speed upwards.
"""

from __future__ import annotations

from math import atan2, sin
from typing import Final

from foosim.library.table.players.motors import Motion
from foosim.library.table.players.rod import TURN, Rod, Sight, View
from foosim.library.table.rod_position import Command

LIFTED: Final = -1.7
"""rad: feet behind the rod and above the ball, which passes."""
DOWN: Final = -0.1
"""Feet down, a little behind: a ball that comes up to them is sent down."""
HIGH_M: Final = 0.026
"""A ball whose centre is higher than this would be hit below it."""
COMES_FAST: Final = 2.5
LEAVES_FAST: Final = 1.5
"""m/s: a ball that comes faster is blocked, one that leaves faster is let go."""
COMES_BEHIND: Final = 0.8
"""m/s: a ball that comes faster is not struck behind the best place, where a foot would press it down as well."""
FULL: Final = 75.0
TAP: Final = 18.0
"""rad/s at which a foot passes a ball at the best place, and one that lies badly."""
BEST_M: Final[tuple[float, ...]] = (0.012, 0.033)
"""How far in front of the axis the best place is."""
REACH_M: Final[tuple[float, ...]] = (-0.035, 0.056)
"""How far in front of the axis a ball can be struck at all."""
SLOW: Final = 0.04
"""m/s: a ball that is slower does not come to a better place by itself."""
WAIT_S: Final = 0.15
DRAWN: Final = 0.7
"""rad by which feet are drawn back from where they meet the ball."""
LEAST: Final = 0.3
"""rad that a swing needs."""
THROUGH: Final = 0.3
"""rad behind the contact at which a shot is over."""
KICK_S: Final = 0.08
ALIGNED_M: Final = 0.007
AIM_RAD_MAX: Final = 0.6
FLAT_RAD: Final = 0.03
"""Below this a shot is straight enough with the flat of the foot."""


class Shots:
    """Strikes with one rod."""

    def __init__(self, rod: Rod) -> None:
        self._rod = rod
        self._end_s = -1.0
        self._through = 0.0
        self._command = rod.command(0.0, 0.0)

    def strike(self, ball: View, sight: Sight, arrives_s: float, goal: tuple[float, float]) -> Command | None:
        """Return the next move of a shot at `goal` (u, y), or None when there is nothing to strike.

        `ball` and the rod are as they are when the command is there, at `arrives_s`.
        """
        rod = self._rod
        if self._end_s > arrives_s and rod.swing < self._through:
            return self._command
        self._end_s = -1.0
        if sight.height > HIGH_M or not -COMES_FAST < ball.vu < LEAVES_FAST:
            return None
        swing = rod.within_turn()
        met = ball
        contact, speed = 0.0, FULL
        for _ in range(2):
            ahead = met.u - rod.u
            found = rod.contact(ahead)
            if found is None or not REACH_M[0] < ahead < REACH_M[1]:
                return self._await(ball)
            contact, speed = found, _speed(ahead)
            start = Motion(swing, rod.turning) if swing < contact - LEAST else Motion(contact - LEAST, 0.0)
            met = ball.later(rod.swing_s(start, contact, speed), rod.room)
        if ball.vu < -COMES_BEHIND and met.u - rod.u < BEST_M[0]:
            return None
        y = met.y - self._offset(met, goal)
        if not rod.reaches(y):
            y = met.y
            if not rod.reaches(y):
                return None
        slide = rod.slide_to(y)
        is_ready = -2.6 < swing < contact - LEAST
        is_aligned = abs(slide - rod.slide) < ALIGNED_M
        if is_ready and is_aligned and sight.is_steady and not _gets_better(ball.u - rod.u, ball.vu):
            self._end_s = arrives_s + KICK_S
            lap = rod.swing - swing
            self._through = lap + contact + THROUGH
            self._command = rod.command(slide, lap + contact + speed / rod.spin_gain)
            return self._command
        return self._drawn(ball, slide, contact)

    def _await(self, ball: View) -> Command | None:
        """Draw the feet back for a ball that comes slowly into reach."""
        rod = self._rod
        ahead = ball.u - rod.u
        if ball.vu > SLOW:
            time_s = (BEST_M[0] - ahead) / ball.vu
        elif ball.vu < -SLOW:
            time_s = (BEST_M[1] - ahead) / ball.vu
        else:
            return None
        if not 0.0 < time_s < WAIT_S:
            return None
        return self._drawn(ball, rod.slide_to(rod.y_after(ball, time_s)), 0.0)

    def _drawn(self, ball: View, slide: float, contact: float) -> Command:
        """Return the command for feet drawn back and a figure at the ball; feet beside it are lifted first."""
        rod = self._rod
        swing = rod.turned(min(contact, 0.0) - DRAWN, ball)
        if abs(ball.u - rod.u) < rod.reach and abs(slide - rod.slide) > ALIGNED_M and _is_low(rod):
            swing = rod.turned(LIFTED, ball)
            if _between(rod, ball):
                return rod.command(rod.slide, swing)
        return rod.command(slide + ball.vy * rod.slide_lag_s, swing)

    def _offset(self, ball: View, goal: tuple[float, float]) -> float:
        """Return how far beside the ball a foot must strike so that its edge sends the ball towards the goal."""
        angle = atan2(goal[1] - ball.y, goal[0] - ball.u)
        angle = min(max(angle, -AIM_RAD_MAX), AIM_RAD_MAX)
        if abs(angle) < FLAT_RAD:
            return 0.0
        beside = self._rod.foot_y + self._rod.ball_radius * sin(abs(angle))
        return beside if angle > 0.0 else -beside


def _speed(ahead: float) -> float:
    """Return the foot's speed (rad/s) for a ball `ahead` of the axis: full at the best place, less beside it."""
    first, last = BEST_M
    if ahead < first:
        share = (ahead - REACH_M[0]) / (first - REACH_M[0])
    elif ahead > last:
        share = (REACH_M[1] - ahead) / (REACH_M[1] - last)
    else:
        return FULL
    return TAP + (FULL - TAP) * max(share, 0.0)


def _gets_better(ahead: float, speed: float) -> bool:
    """Whether a ball comes to a better place soon by itself."""
    first, last = BEST_M
    if ahead < first:
        return speed > SLOW and (first - ahead) / speed < WAIT_S
    if ahead > last:
        return speed < -SLOW and (last - ahead) / speed < WAIT_S
    return False


def _is_low(rod: Rod) -> bool:
    """Whether the feet are where they would push a ball aside."""
    return abs(rod.swing - TURN * round(rod.swing / TURN)) < 1.0


def _between(rod: Rod, ball: View) -> bool:
    """Whether a foot stands so near that it would take the ball along."""
    return rod.beside(ball.y) < 2.0 * (rod.foot_y + rod.ball_radius)

"""Steering of a rover: wheel speeds towards a goal, and pose estimation from odometry and pose samples."""

from __future__ import annotations

from math import atan2, cos, hypot, pi, sin
from typing import Final

from foosim.library.generic.pose import Pose
from foosim.library.mobile.hall_settings import Rover
from foosim.library.mobile.odometry import WheelTravel
from foosim.library.mobile.wheel_speeds import Drive

TRUST: Final = 0.5
"""The share of the difference that a new pose corrects: 20 mm of noise become 12, slip does not add up."""
LOST_M: Final = 1.0
"""Beyond this distance between odometry and the measured pose, the measured pose alone counts."""
TURN_GAIN: Final = 2.5
"""rad/s of turning per rad of error."""
TURN_MAX: Final = 2.0
AHEAD_RAD: Final = 0.7
"""Half of the sector that has to be free."""
SIDE_RAD: Final = 1.6
STOP_M: Final = 0.2
"""It stops at this distance to an obstacle ahead."""
SWERVE_M: Final = 0.9
"""It turns aside from an obstacle ahead within this distance,"""
SWERVE_RAD: Final = 0.8
"""by this angle: to the right, if there is room, as oncoming rovers do."""
ROOM_M: Final = 0.5
CLOSE_M: Final = 0.12
"""Nearer than this to anything it gets away from it,"""
AWAY: Final = 0.2
"""m/s, first of all."""
APPROACH: Final = 1.2
"""Greatest speed per distance to an obstacle ahead, and to the goal, in 1/s."""
SPEED_MIN: Final = 0.15
"""m/s, on the last way to the goal."""


class Estimate:
    """Where a rover is: its wheels' way since the last pose, put right by every new pose."""

    def __init__(self, track: float) -> None:
        self.is_known = False
        self.x = self.y = self.heading = 0.0
        self.driven = 0.0
        """m, of the rover's middle."""
        self._track = track
        self._travel: WheelTravel | None = None
        self._sequence = -1

    def roll(self, travel: WheelTravel) -> None:
        """Integrate the wheels' rotation since the last call."""
        last, self._travel = self._travel, travel
        if last is None:
            return
        left, right = travel.left - last.left, travel.right - last.right
        way, turned = (left + right) / 2.0, (right - left) / self._track
        direction = self.heading + turned / 2.0
        self.x += way * cos(direction)
        self.y += way * sin(direction)
        self.heading = wrapped(self.heading + turned)
        self.driven += abs(way)

    def fix(self, sequence: int, pose: Pose) -> None:
        """Take a pose, once."""
        if sequence == self._sequence:
            return
        self._sequence = sequence
        share = TRUST if self.is_known and hypot(pose.x - self.x, pose.y - self.y) < LOST_M else 1.0
        self.is_known = True
        self.x += share * (pose.x - self.x)
        self.y += share * (pose.y - self.y)
        self.heading = wrapped(self.heading + share * wrapped(pose.heading - self.heading))


class Steering:
    """Turns towards a goal, slower where something is ahead, and aside from it."""

    def __init__(self, rover: Rover) -> None:
        self._track, self._speed_max = rover.drive.track, rover.drive.speed

    def towards(self, at: Estimate, goal: tuple[float, float], ranges: tuple[float, ...], speed: float) -> Drive:
        """Return the wheels' speeds; `ranges` are the free ways of rays evenly around, the first one ahead."""
        dx, dy = goal[0] - at.x, goal[1] - at.y
        way = hypot(dx, dy)
        if way < 0.05:
            return Drive(0.0, 0.0)
        error = wrapped(atan2(dy, dx) - at.heading)
        ahead = least(ranges, 0.0, AHEAD_RAD)
        if ahead < SWERVE_M and ahead < way and abs(error) < AHEAD_RAD:
            right, left = least(ranges, -SIDE_RAD / 2, SIDE_RAD / 2), least(ranges, SIDE_RAD / 2, SIDE_RAD / 2)
            error += -SWERVE_RAD if right > ROOM_M or right >= left else SWERVE_RAD
        if ranges and min(ranges) < CLOSE_M:
            return self._away(ranges)
        forward = min(speed, max(APPROACH * way, SPEED_MIN), APPROACH * max(ahead - STOP_M, 0.0)) * max(cos(error), 0.0)
        turning = min(max(TURN_GAIN * error, -TURN_MAX), TURN_MAX) * self._track / 2.0
        # Turning has priority: the excess over the wheels' speed is taken from the way ahead.
        forward = min(forward, max(self._speed_max - abs(turning), 0.0))
        limit = self._speed_max
        return Drive(max(-limit, min(limit, forward - turning)), max(-limit, min(limit, forward + turning)))

    def _away(self, ranges: tuple[float, ...]) -> Drive:
        """Return the speeds that move it slowly away from an obstacle that nearly touches it, turning sideways."""
        ray = min(range(len(ranges)), key=ranges.__getitem__)
        angle = 2.0 * pi * ray / len(ranges)
        forward = -AWAY if cos(angle) > 0.0 else AWAY
        turning = (-AWAY if sin(angle) > 0.0 else AWAY) / 2.0
        return Drive(forward - turning, forward + turning)


def least(ranges: tuple[float, ...], middle: float, half: float) -> float:
    """Return the shortest of the rays within `half` (rad) of a direction, from ahead to the left; inf without rays."""
    count = len(ranges)
    within = [way for ray, way in enumerate(ranges) if abs(wrapped(2.0 * pi * ray / count - middle)) <= half]
    return min(within, default=float("inf"))


def wrapped(angle: float) -> float:
    """Return the same direction within (-pi, pi]."""
    while angle > pi:
        angle -= 2.0 * pi
    while angle <= -pi:
        angle += 2.0 * pi
    return angle

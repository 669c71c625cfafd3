"""Where the ball is, from noisy, late and sometimes missing samples: an alpha-beta filter that notices kicks.

Between samples the ball is taken to roll straight on and to come back from the walls.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from foosim.deployment.schema import Deployment
from foosim.library.table.ball import BallPosition
from foosim.library.table.settings import Table, table_of

ALPHA: Final = 0.6
BETA: Final = 0.3
"""Gains of position and velocity: 1.5 mm of noise at 100 Hz leaves 0.05 m/s in the velocity."""
JUMP_M: Final = 0.02
"""A sample this far from the prediction means that the ball was kicked, or has bounced."""
SPEED_MAX: Final = 20.0
"""m/s; a faster displacement is a reset of the ball to the kick-off spot."""
NEVER_NS: Final = -1_000_000_000_000
"""When a ball was measured that never was: long before tick 0."""
REBOUND: Final = 0.7
"""Coefficient of restitution at a wall."""


class Room(NamedTuple):
    """Where the ball's centre can be (m): |x| and |y| at most, but for |y| within the goals' mouths."""

    x_max: float
    y_max: float
    goal_y: float


def room_of(table: Table) -> Room:
    """Return the room of a table's ball."""
    radius = table.ball.radius
    return Room(table.field.length / 2 - radius, table.field.width / 2 - radius, table.goal.width / 2 - radius)


class Ball(NamedTuple):
    """An estimate: position (m) and velocity (m/s) in the world's x and y, and the newest height `z` (m)."""

    x: float
    y: float
    vx: float
    vy: float
    z: float


class BallTrack:
    """The estimate after the newest sample."""

    def __init__(self, deployment: Deployment) -> None:
        self._room = room_of(table_of(deployment))
        self.is_steady = False
        """Whether the newest sample is where the ball was expected: it was neither kicked nor blocked meanwhile."""
        self.height = 0.0
        """The greater height of the newest two samples (m)."""
        self._measured_ns = NEVER_NS
        self._measured = (0.0, 0.0)
        self._z = 0.0
        self._ball = Ball(0.0, 0.0, 0.0, 0.0, 0.0)

    @property
    def known(self) -> bool:
        return self._measured_ns != NEVER_NS

    def take(self, measured_ns: int, seen: BallPosition) -> None:
        """Take a measurement at a time (ns); a sample older than the last, or equally old, changes nothing."""
        if measured_ns <= self._measured_ns:
            return
        x, y = seen.x, seen.y
        if not self.known:
            self._ball = Ball(x, y, 0.0, 0.0, seen.z)
        else:
            self._ball = self._corrected((measured_ns - self._measured_ns) * 1e-9, seen)
        self.height = max(seen.z, self._z)
        self._z = seen.z
        self._measured_ns = measured_ns
        self._measured = (x, y)

    def _corrected(self, dt: float, seen: BallPosition) -> Ball:
        x, y, z = seen.x, seen.y, seen.z
        expected = self._moved(dt)
        dx, dy = x - expected.x, y - expected.y
        self.is_steady = dx * dx + dy * dy < JUMP_M * JUMP_M
        if self.is_steady:
            return Ball(
                expected.x + ALPHA * dx,
                expected.y + ALPHA * dy,
                expected.vx + BETA * dx / dt,
                expected.vy + BETA * dy / dt,
                z,
            )
        vx, vy = (x - self._measured[0]) / dt, (y - self._measured[1]) / dt
        if vx * vx + vy * vy > SPEED_MAX * SPEED_MAX:
            vx = vy = 0.0
        return Ball(x, y, vx, vy, z)

    @property
    def ball(self) -> Ball:
        """The estimate at the time of the newest sample."""
        return self._ball

    def at(self, time_ns: int) -> Ball:
        """Return the estimate at a time (simulated ns), carried on from the newest sample."""
        return self._moved((time_ns - self._measured_ns) * 1e-9)

    def _moved(self, dt: float) -> Ball:
        return moved(self._ball, dt, self._room)


def moved(ball: Ball, dt: float, room: Room) -> Ball:
    """Return a ball `dt` s later, rolling straight on and back from at most one side wall and one end wall."""
    x, y, vx, vy, z = ball
    y, vy = _within(y + vy * dt, vy, room.y_max)
    x += vx * dt
    if abs(y) > room.goal_y:
        x, vx = _within(x, vx, room.x_max)
    return Ball(x, y, vx, vy, z)


def _within(at: float, speed: float, most: float) -> tuple[float, float]:
    """Return place and speed between two walls."""
    if at > most:
        return max(most - REBOUND * (at - most), -most), -REBOUND * speed
    if at < -most:
        return min(-most - REBOUND * (at + most), most), -REBOUND * speed
    return at, speed

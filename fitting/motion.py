"""Motion of a ball over a level floor between straight walls: flights, slides and rolls, each in closed form.

A sphere, I = 2/5 m r^2, with Coulomb's friction at floor and walls and Newton's restitution. Frame of reference: that
of the table, x along, y across, z up; the ball's height is that of its lowest point over the floor. SI units. The
formulas are those of tests/physics/test_bullet_truths.py:

* a slide lasts until the contact point is at rest, 2 u / (7 mu g), and brakes by mu g against the contact point's u;
* a roll brakes by 5/7 rho g / r;
* a rebound takes the tangential velocity u of the contact point by min(mu (1 + e) v_n, 2/7 u), also upwards: a ball
  that rolls against a wall hops.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, sqrt
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

RESTS: Final = 0.05
"""m/s: a ball that lands more slowly does not bounce, as in the engine (`restitutionVelocityThreshold`)."""
PHASES_MAX: Final = 1000
SLIDE_S: Final = 0.01
"""A slide is gone through in pieces: rolling friction is against a turning that changes its direction."""
EPSILON: Final = 1e-9

Array = NDArray[np.float64]


class Pairs(NamedTuple):
    """What is fitted: the ball's rolling friction (m) and friction on the floor, restitution and friction at walls."""

    rolling: float
    floor: float
    bounce: float
    walls: float


@dataclass(frozen=True, slots=True)
class Field:
    """Where the middle of a ball can be, |x| <= `x` and |y| <= `y` (m); the ball's radius (m); gravity (m/s2); and the
    fixed restitution of floor and ball."""

    x: float
    y: float
    radius: float
    gravity: float
    floor_bounce: float


class Start(NamedTuple):
    """Where a track begins (m, m/s), on the floor, and how much of its way the ball rolls there: 1 all, 0 it slides."""

    x: float
    y: float
    vx: float
    vy: float
    rolls: float


@dataclass(slots=True)
class Motion:
    """The phases of a way: from which time on (s), and position, velocity and acceleration (x, y) then.

    `rebounds` are the times of those at walls.
    """

    times: list[float]
    states: list[tuple[float, float, float, float, float, float]]
    rebounds: list[float]

    def at(self, times: Array) -> Array:
        """Return x and y at times, ascending or not, of shape (times, 2)."""
        phase = np.maximum(np.searchsorted(self.times, times, side="right") - 1, 0)
        states = np.array(self.states)[phase]
        after = (times - np.array(self.times)[phase])[:, None]
        found: Array = states[:, 0:2] + states[:, 2:4] * after + 0.5 * states[:, 4:6] * after * after
        return found


def motion(start: Start, pairs: Pairs, field: Field, seconds: float) -> Motion:
    """Return the way of a ball for so long."""
    ball = _Ball(start, pairs, field)
    made = Motion([], [], [])
    now = 0.0
    for _ in range(PHASES_MAX):
        ax, ay, ends = ball.phase()
        made.times.append(now)
        made.states.append((ball.x, ball.y, ball.vx, ball.vy, ax, ay))
        wall, normal = ball.next_wall(ax, ay)
        lasts = min(ends, wall)
        if now + lasts >= seconds or lasts == inf:
            break
        ball.go(lasts, ax, ay)
        now += lasts
        if wall <= ends:
            ball.rebound(normal)
            made.rebounds.append(now)
        else:
            ball.end_phase()
    return made


class _Ball:
    """A ball in the course of its way."""

    def __init__(self, start: Start, pairs: Pairs, field: Field) -> None:
        self.x, self.y, self.vx, self.vy, rolls = start
        self._z = self._vz = 0.0
        self._wx, self._wy, self._wz = -rolls * self.vy / field.radius, rolls * self.vx / field.radius, 0.0
        self._pairs, self._field = pairs, field
        self._is_rolling = self._slides_on = False

    def phase(self) -> tuple[float, float, float]:
        """Return the acceleration of the phase that begins, and how long it lasts where no wall ends it."""
        gravity, radius = self._field.gravity, self._field.radius
        if self._z > 0.0 or self._vz > 0.0:
            height, rise = self._z, self._vz
            return 0.0, 0.0, (rise + sqrt(rise * rise + 2.0 * gravity * height)) / gravity
        ux, uy = self.vx - self._wy * radius, self.vy + self._wx * radius
        slip = sqrt(ux * ux + uy * uy)
        friction = self._pairs.floor * gravity
        if not self._is_rolling and slip > EPSILON:
            slower = 3.5 * friction + 2.5 * self._pairs.rolling * gravity / radius * self._against(ux / slip, uy / slip)
            lasts = slip / slower if slower > EPSILON else inf
            self._slides_on = lasts > SLIDE_S
            return -friction * ux / slip, -friction * uy / slip, min(lasts, SLIDE_S)
        self._is_rolling = True
        speed = sqrt(self.vx * self.vx + self.vy * self.vy)
        brake = 5.0 / 7.0 * self._pairs.rolling * gravity / radius
        if speed <= EPSILON:
            self.vx = self.vy = 0.0
            return 0.0, 0.0, inf
        if brake <= 0.0:
            return 0.0, 0.0, inf
        return -brake * self.vx / speed, -brake * self.vy / speed, speed / brake

    def _against(self, ux: float, uy: float) -> float:
        """Return how much of the ball's turning moves its contact point along this direction: -1, against it, of one
        that does not turn yet, since friction will turn it so."""
        turning = sqrt(self._wx * self._wx + self._wy * self._wy)
        return (self._wx * uy - self._wy * ux) / turning if turning > EPSILON else -1.0

    def next_wall(self, ax: float, ay: float) -> tuple[float, tuple[float, float]]:
        """Return when the next wall is hit, inf for none, and its normal, inwards."""
        found: tuple[float, tuple[float, float]] = (inf, (0.0, 0.0))
        field = self._field
        for place, speed, brake, most, axis in (
            (self.x, self.vx, ax, field.x, (1.0, 0.0)),
            (self.y, self.vy, ay, field.y, (0.0, 1.0)),
        ):
            for side in (1.0, -1.0):
                when = _reaches(most - side * place, side * speed, side * brake)
                if when < found[0]:
                    found = when, (-side * axis[0], -side * axis[1])
        return found

    def go(self, time: float, ax: float, ay: float) -> None:
        """Continue for a time."""
        field, radius = self._field, self._field.radius
        self.x += self.vx * time + 0.5 * ax * time * time
        self.y += self.vy * time + 0.5 * ay * time * time
        self.vx += ax * time
        self.vy += ay * time
        if self._z > 0.0 or self._vz > 0.0:
            self._z += self._vz * time - 0.5 * field.gravity * time * time
            self._vz -= field.gravity * time
        elif self._is_rolling:
            self._wx, self._wy = -self.vy / radius, self.vx / radius
        else:  # friction turns the ball as it brakes it, 5/2 of the change over r, and rolling friction stops that
            self._wx += 2.5 * ay * time / radius
            self._wy -= 2.5 * ax * time / radius
            self._turn_less(field.gravity * time)

    def _turn_less(self, pressed: float) -> None:
        """Let rolling friction, while the ball is pressed to the floor by so much (N s/kg), stop its turning."""
        radius = self._field.radius
        turning = sqrt(self._wx * self._wx + self._wy * self._wy)
        slower = 2.5 * self._pairs.rolling * pressed / (radius * radius)
        if turning > slower:
            self._wx -= slower * self._wx / turning
            self._wy -= slower * self._wy / turning

    def end_phase(self) -> None:
        """Land, bounce, slide on, begin to roll, or rest."""
        if self._vz < 0.0:
            self._land()
        elif self._is_rolling:
            self.vx = self.vy = 0.0
        elif not self._slides_on:
            self._is_rolling = True
            radius = self._field.radius
            self._wx, self._wy = -self.vy / radius, self.vx / radius

    def _land(self) -> None:
        onto, radius = -self._vz, self._field.radius
        bounce = self._field.floor_bounce if onto > RESTS else 0.0
        ux, uy = self.vx - self._wy * radius, self.vy + self._wx * radius
        slip = sqrt(ux * ux + uy * uy)
        change = min(self._pairs.floor * (1.0 + bounce) * onto, 2.0 / 7.0 * slip)
        if slip > EPSILON:
            dx, dy = -change * ux / slip, -change * uy / slip
            self.vx, self.vy = self.vx + dx, self.vy + dy
            self._wx += 2.5 * dy / radius
            self._wy -= 2.5 * dx / radius
        self._turn_less((1.0 + bounce) * onto)
        self._z, self._vz = 0.0, bounce * onto
        self._is_rolling = False

    def rebound(self, normal: tuple[float, float]) -> None:
        """Come back from a wall with this normal: by e, and what friction takes of the contact point's velocity."""
        nx, ny = normal
        radius, bounce = self._field.radius, self._pairs.bounce
        onto = -(self.vx * nx + self.vy * ny)
        if onto <= RESTS:
            bounce = 0.0
        tx, ty = -ny, nx
        # The contact point is at -r n: its velocity along the wall, and upwards.
        along = self.vx * tx + self.vy * ty - radius * self._wz
        up = self._vz + radius * (self._wx * -ny + self._wy * nx)
        slip = sqrt(along * along + up * up)
        change = min(self._pairs.walls * (1.0 + bounce) * onto, 2.0 / 7.0 * slip)
        d_along, d_up = (-change * along / slip, -change * up / slip) if slip > EPSILON else (0.0, 0.0)
        self.vx += (1.0 + bounce) * onto * nx + d_along * tx
        self.vy += (1.0 + bounce) * onto * ny + d_along * ty
        self._vz = max(self._vz + d_up, 0.0) if self._z <= 0.0 else self._vz + d_up
        self._wz -= 2.5 * d_along / radius
        self._wx += 2.5 * d_up / radius * -ny
        self._wy += 2.5 * d_up / radius * nx
        self._is_rolling = False


def _reaches(way: float, speed: float, brake: float) -> float:
    """Return when `way` is gone at a speed that changes by `brake`; inf if it never is. A wall that is touched is hit
    by what moves on towards it."""
    if way <= EPSILON:
        return 0.0 if speed > EPSILON else inf
    if abs(brake) < 1e-12:
        return way / speed if speed > 0.0 else inf
    root = speed * speed + 2.0 * brake * way
    if root < 0.0:
        return inf
    if speed > 0.0:
        return 2.0 * way / (speed + sqrt(root))
    return (-speed + sqrt(root)) / brake if brake > 0.0 else inf

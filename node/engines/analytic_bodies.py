"""Balls and rods of the pure engine: what they are, how they move freely, how a contact changes them.

Within a substep a ball flies the exact parabola and a rod follows its motors; what then overlaps is put right as if the
contact had happened at its time within the substep. For one contact with a plane that is exact: the rebound has the
pair's restitution and energy never grows. Sources: textbook impulse dynamics with Coulomb friction; rolling friction as
a length rho gives a = 5/7 rho g / r. Plain floats and one spelling of sin, cos and sqrt: this is the hot path.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sin, sqrt
from typing import Final

from foosim.world.kits.table import BallSurface, Surface
from foosim.world.scene import Body
from foosim.world.scenes.football_table import spin_inertia

BOUNCE_SPEED_MIN: Final = 0.05
"""Slower contacts do not bounce (m/s): a ball comes to rest."""
REST_SPEED: Final = 1e-9
"""A ball that rolling friction has slowed to this (m/s) stands still."""


@dataclass(frozen=True)
class Pair:
    """What a ball feels of a surface: restitution, friction, rolling friction (m); `silent` ones are not logged."""

    restitution: float
    friction: float
    rolling: float
    silent: bool = False

    @classmethod
    def of(cls, surface: Surface | BallSurface, silent: bool = False) -> Pair:
        rolling = surface.rolling_friction if isinstance(surface, Surface) else 0.0
        return cls(surface.restitution, surface.friction, rolling, silent)


class Log:
    """The contact log of a body for one tick: touches that began, impulse (N s), last substep."""

    __slots__ = ("count", "impulse", "last", "touching")

    def __init__(self, touching: bool) -> None:
        self.count, self.impulse, self.last, self.touching = 0.0, 0.0, -1.0, touching

    def add(self, impulse: float, substep: int) -> None:
        """Note a contact in this substep: a touch begins if there was none in the substep before."""
        if self.last != substep:
            if not (self.touching if substep == 0 else self.last == substep - 1):
                self.count += 1.0
            self.last = float(substep)
        self.impulse += impulse


class Ball:
    """A ball: position, velocity and spin in the world frame."""

    __slots__ = ("gravity", "inertia", "log", "mass", "radius", "vx", "vy", "vz", "wx", "wy", "wz", "x", "y", "z")

    def __init__(self, radius: float, mass: float, inertia: float, gravity: float) -> None:
        self.radius, self.mass, self.inertia, self.gravity = radius, mass, inertia, gravity
        self.x = self.y = self.z = self.vx = self.vy = self.vz = self.wx = self.wy = self.wz = 0.0
        self.log = Log(False)

    def fly(self, dt: float) -> None:
        """Move for `dt` seconds under gravity alone."""
        drop = self.gravity * dt
        self.x += self.vx * dt
        self.y += self.vy * dt
        self.z += (self.vz - 0.5 * drop) * dt
        self.vz -= drop

    def slip(self, nx: float, ny: float, nz: float) -> tuple[float, float, float]:
        """Return the velocity, along the surface, of the ball's material where the normal `n` points away from it."""
        r = self.radius
        x = self.vx - r * (self.wy * nz - self.wz * ny)
        y = self.vy - r * (self.wz * nx - self.wx * nz)
        z = self.vz - r * (self.wx * ny - self.wy * nx)
        along = x * nx + y * ny + z * nz
        return x - along * nx, y - along * ny, z - along * nz

    def push(self, nx: float, ny: float, nz: float, tx: float, ty: float, tz: float) -> None:
        """Take the tangential impulse `t` at the contact whose normal towards the ball is `n`."""
        m, lever = self.mass, self.radius / self.inertia
        self.vx += tx / m
        self.vy += ty / m
        self.vz += tz / m
        self.wx -= lever * (ny * tz - nz * ty)
        self.wy -= lever * (nz * tx - nx * tz)
        self.wz -= lever * (nx * ty - ny * tx)

    def roll(self, nx: float, ny: float, nz: float, limit: float) -> None:
        """Take away at most the angular impulse `limit` (N m s) of rolling on a surface with normal `n`."""
        about = self.wx * nx + self.wy * ny + self.wz * nz
        tx, ty, tz = self.wx - about * nx, self.wy - about * ny, self.wz - about * nz
        turning = sqrt(tx * tx + ty * ty + tz * tz)
        if turning * self.radius <= REST_SPEED:
            if self.vx * self.vx + self.vy * self.vy + self.vz * self.vz <= REST_SPEED * REST_SPEED:
                self.vx = self.vy = self.vz = 0.0
                self.wx, self.wy, self.wz = about * nx, about * ny, about * nz
            return
        share = min(1.0, limit / (self.inertia * turning))
        self.wx -= share * tx
        self.wy -= share * ty
        self.wz -= share * tz


class Rod:
    """A rod: slide along y, turn about y, each with a motor of limited force; the slide stops dead at its stroke."""

    __slots__ = (
        "angle", "angle_speed", "dt", "inertia", "log", "mass", "name", "slide", "slide_kick", "slide_motor",
        "slide_speed", "spin_kick", "spin_motor", "stroke", "swing", "x", "z",
    )  # fmt: skip

    def __init__(self, body: Body, gravity: float, dt: float) -> None:
        carriage, turning = body.links
        self.name, self.dt = body.name, dt
        self.x, _, self.z = body.position
        self.mass = carriage.mass + turning.mass
        self.inertia = spin_inertia(turning)
        self.swing = turning.mass * gravity * turning.centre_of_mass[2] * dt / self.inertia
        self.stroke = carriage.limits[1]
        self.slide = self.slide_speed = self.angle = self.angle_speed = 0.0
        self.slide_motor = self.spin_motor = self.slide_kick = self.spin_kick = 0.0
        self.log = Log(False)

    def drive(self, slide: tuple[float, float], spin: tuple[float, float]) -> None:
        """Set the target speed and greatest force of both motors for this tick."""
        self.slide_motor, self.slide_kick = slide[0], slide[1] * self.dt / self.mass
        self.spin_motor, self.spin_kick = spin[0], spin[1] * self.dt / self.inertia

    def advance(self, substeps: int) -> None:
        """Move for some substeps. Several at once give the same bits as one by one."""
        dt, swing, stroke = self.dt, self.swing, self.stroke
        slide, speed, wanted, kick = self.slide, self.slide_speed, self.slide_motor, self.slide_kick
        angle, turning, wanted_turning, twist = self.angle, self.angle_speed, self.spin_motor, self.spin_kick
        for _ in range(substeps):
            change = wanted - speed
            speed += kick if change > kick else -kick if change < -kick else change
            slide += speed * dt
            if slide > stroke:
                slide, speed = stroke, 0.0
            elif slide < -stroke:
                slide, speed = -stroke, 0.0
            turning += swing * sin(angle)
            change = wanted_turning - turning
            turning += twist if change > twist else -twist if change < -twist else change
            angle += turning * dt
        self.slide, self.slide_speed, self.angle, self.angle_speed = slide, speed, angle, turning

    def move(self, along: float, about: float) -> None:
        """Shift by `along` (m) and turn by `about` (rad), within the stroke."""
        self.angle += about
        self.slide = min(max(self.slide + along, -self.stroke), self.stroke)


def rebound(u: float, depth: float, pull: float, restitution: float, dt: float) -> tuple[float, float]:
    """Return (gap, speed) at the end of the substep of a contact along its normal.

    At the end of the substep the body is `depth` too deep and moves with `u` < 0; `pull` is the acceleration into the
    surface. So it met the surface with less speed than u, earlier, and has been leaving since.
    """
    square = u * u - 2.0 * pull * depth
    impact = sqrt(square) if square > 0.0 else 0.0
    since = min(2.0 * depth / (impact - u), dt)
    leaving = restitution * impact if impact > BOUNCE_SPEED_MIN else 0.0
    gap = (leaving - 0.5 * pull * since) * since
    if gap < 0.0:
        return 0.0, 0.0
    return gap, leaving - pull * since


def meet_scenery(
    ball: Ball, nx: float, ny: float, nz: float, depth: float, pair: Pair, restitution: float, dt: float
) -> float:
    """Let a ball that is `depth` inside something immovable rebound; return the normal impulse."""
    u = ball.vx * nx + ball.vy * ny + ball.vz * nz
    if u >= 0.0:
        ball.x += depth * nx
        ball.y += depth * ny
        ball.z += depth * nz
        return 0.0
    gap, end = rebound(u, depth, ball.gravity * nz, restitution, dt)
    way, change = depth + gap, end - u
    ball.x += way * nx
    ball.y += way * ny
    ball.z += way * nz
    ball.vx += change * nx
    ball.vy += change * ny
    ball.vz += change * nz
    impulse = ball.mass * change
    sx, sy, sz = ball.slip(nx, ny, nz)
    slipping = sqrt(sx * sx + sy * sy + sz * sz)
    if slipping > 0.0:
        # 2/7 m stops the slip of a solid sphere: 1 / (1/m + r^2 / I).
        stop = slipping * ball.mass * ball.inertia / (ball.inertia + ball.mass * ball.radius * ball.radius)
        share = -min(pair.friction * impulse, stop) / slipping
        ball.push(nx, ny, nz, share * sx, share * sy, share * sz)
    if pair.rolling > 0.0:
        ball.roll(nx, ny, nz, pair.rolling * impulse)
    return impulse


def meet_rod(ball: Ball, rod: Rod, normal: tuple[float, float, float], depth: float, pair: Pair) -> float:
    """Let a ball and a rod that overlap by `depth` part, both recoiling; return the normal impulse.

    `normal` points from the rod to the ball. Both change by what the impulse would have moved them since the contact.
    """
    nx, ny, nz = normal
    # From the axis to the contact, and how fast the normal there moves per turning speed of the rod.
    rx, rz = ball.x - ball.radius * nx - rod.x, ball.z - ball.radius * nz - rod.z
    arm = rz * nx - rx * nz
    u = ball.vx * nx + (ball.vy - rod.slide_speed) * ny + ball.vz * nz - rod.angle_speed * arm
    give = 1.0 / ball.mass + ny * ny / rod.mass + arm * arm / rod.inertia
    if u >= 0.0:
        _part(ball, rod, normal, arm, depth / give)
        return 0.0
    gap, end = rebound(u, depth, ball.gravity * nz, pair.restitution, rod.dt)
    impulse = (end - u) / give
    _part(ball, rod, normal, arm, (depth + gap) / give)
    change = impulse / ball.mass
    ball.vx += change * nx
    ball.vy += change * ny
    ball.vz += change * nz
    rod.slide_speed -= impulse * ny / rod.mass
    rod.angle_speed -= impulse * arm / rod.inertia
    _rub(ball, rod, normal, (rx, rz), pair.friction * impulse)
    return impulse


def _part(ball: Ball, rod: Rod, normal: tuple[float, float, float], arm: float, shift: float) -> None:
    """Move ball and rod apart by what an impulse moves them: `shift` is a length times a mass."""
    nx, ny, nz = normal
    ball.x += shift / ball.mass * nx
    ball.y += shift / ball.mass * ny
    ball.z += shift / ball.mass * nz
    rod.move(-shift * ny / rod.mass, -shift * arm / rod.inertia)


def _rub(ball: Ball, rod: Rod, normal: tuple[float, float, float], lever: tuple[float, float], limit: float) -> None:
    """Let friction of at most `limit` (N s) act against the slip between a ball and a rod."""
    nx, ny, nz = normal
    rx, rz = lever
    sx, sy, sz = ball.slip(nx, ny, nz)
    gx, gy, gz = rod.angle_speed * rz, rod.slide_speed, -rod.angle_speed * rx
    along = gx * nx + gy * ny + gz * nz
    sx, sy, sz = sx - gx + along * nx, sy - gy + along * ny, sz - gz + along * nz
    slipping = sqrt(sx * sx + sy * sy + sz * sz)
    if slipping == 0.0:
        return
    tx, ty, tz = sx / slipping, sy / slipping, sz / slipping
    arm = rz * tx - rx * tz
    give = 1.0 / ball.mass + ball.radius * ball.radius / ball.inertia + ty * ty / rod.mass + arm * arm / rod.inertia
    impulse = min(limit, slipping / give)
    ball.push(nx, ny, nz, -impulse * tx, -impulse * ty, -impulse * tz)
    rod.slide_speed += impulse * ty / rod.mass
    rod.angle_speed += impulse * arm / rod.inertia


def yield_rod(ball: Ball, rod: Rod, normal: tuple[float, float, float], depth: float) -> None:
    """Move a rod out of a ball that cannot move, because it is pinned against the scenery."""
    nx, ny, nz = normal
    rx, rz = ball.x - ball.radius * nx - rod.x, ball.z - ball.radius * nz - rod.z
    arm = rz * nx - rx * nz
    give = ny * ny / rod.mass + arm * arm / rod.inertia
    if give * ball.mass < 1e-3:  # it presses along a direction in which a rod does not give
        return
    rod.move(-depth / give * ny / rod.mass, -depth / give * arm / rod.inertia)
    u = ball.vx * nx + (ball.vy - rod.slide_speed) * ny + ball.vz * nz - rod.angle_speed * arm
    if u < 0.0:
        rod.slide_speed += u / give * ny / rod.mass
        rod.angle_speed += u / give * arm / rod.inertia


def meet_ball(one: Ball, other: Ball, pair: Pair, dt: float) -> float:
    """Let two balls that overlap part; return the normal impulse, 0 when they do not touch."""
    dx, dy, dz = one.x - other.x, one.y - other.y, one.z - other.z
    square = dx * dx + dy * dy + dz * dz
    reach = one.radius + other.radius
    if square >= reach * reach or square == 0.0:
        return 0.0
    distance = sqrt(square)
    nx, ny, nz = dx / distance, dy / distance, dz / distance
    u = (one.vx - other.vx) * nx + (one.vy - other.vy) * ny + (one.vz - other.vz) * nz
    depth = reach - distance
    gap, end = rebound(u, depth, 0.0, pair.restitution, dt) if u < 0.0 else (0.0, u)
    give = 1.0 / one.mass + 1.0 / other.mass
    impulse, shift = (end - u) / give, (depth + gap) / give
    for ball, sign in ((one, 1.0), (other, -1.0)):
        change, way = sign * impulse / ball.mass, sign * shift / ball.mass
        ball.x += way * nx
        ball.y += way * ny
        ball.z += way * nz
        ball.vx += change * nx
        ball.vy += change * ny
        ball.vz += change * nz
    ax, ay, az = one.slip(nx, ny, nz)
    bx, by, bz = other.slip(-nx, -ny, -nz)
    sx, sy, sz = ax - bx, ay - by, az - bz
    slipping = sqrt(sx * sx + sy * sy + sz * sz)
    if slipping > 0.0:
        turns = one.radius * one.radius / one.inertia + other.radius * other.radius / other.inertia
        share = -min(pair.friction * impulse, slipping / (give + turns)) / slipping
        one.push(nx, ny, nz, share * sx, share * sy, share * sz)
        other.push(-nx, -ny, -nz, -share * sx, -share * sy, -share * sz)
    return impulse

"""Spheres and shafts of the pure engine: their data, their free motion, their contacts.

Within a substep a sphere flies the exact parabola and a shaft follows its motors; an overlap is then resolved as if the
contact had happened at its time within the substep. For one contact with a plane that is exact: the rebound has the
pair's restitution and energy never grows. Sources: textbook impulse dynamics with Coulomb friction; rolling friction as
a length rho gives a = 5/7 rho g / r. Plain floats and one spelling of sin, cos and sqrt: this is the hot path.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, sin, sqrt
from typing import Final

from foosim.node.physics.touch_log import TouchLog
from foosim.world.components.drives import share_of
from foosim.world.matter.physics import Contact
from foosim.world.scene import Body, Sphere, Vector, inertia_about_axis

# Not Final: compiled by mypyc 2.4, a Final tuple of this many floats counts as not set.
ALONG_Y: Vector = (0.0, 1.0, 0.0)
BOUNCE_SPEED_MIN: Final = 0.05
"""Slower contacts do not bounce (m/s): a sphere comes to rest."""
REST_SPEED: Final = 1e-9
"""A sphere that rolling friction has slowed to this (m/s) is at rest."""


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


class FreeSphere:
    """A free body: position, velocity and spin in the world frame. `travel` is its reach within a tick (m)."""

    __slots__ = (
        "gravity", "inertia", "log", "mass", "name", "radius", "travel", "vx", "vy", "vz", "wx", "wy", "wz", "x", "y",
        "z",
    )  # fmt: skip

    def __init__(self, body: Body, gravity: float, tick_s: float) -> None:
        (link,) = body.links
        (shape,) = link.shapes
        assert isinstance(shape.geometry, Sphere), f"the free body {body.name} is no sphere"
        self.name = body.name
        self.radius, self.mass, self.inertia, self.gravity = shape.geometry.radius, link.mass, link.inertia[0], gravity
        self.travel = self.radius + body.speed_limit * tick_s
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
        """Return the velocity, along the surface, of the sphere's material where the normal `n` points away from it."""
        r = self.radius
        x = self.vx - r * (self.wy * nz - self.wz * ny)
        y = self.vy - r * (self.wz * nx - self.wx * nz)
        z = self.vz - r * (self.wx * ny - self.wy * nx)
        along = x * nx + y * ny + z * nz
        return x - along * nx, y - along * ny, z - along * nz

    def push(self, nx: float, ny: float, nz: float, tx: float, ty: float, tz: float) -> None:
        """Take the tangential impulse `t` at the contact whose normal towards the sphere is `n`."""
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


class Shaft:
    """A jointed body of two links, of which one slides along y, and the other, on it, turns about y.

    Each has a motor of limited force; the slide stops dead at its stroke. The last substep of a motor is its `push`
    (a change of speed), which the `scale` turns into a force.
    """

    __slots__ = (
        "angle",
        "angle_speed",
        "dt",
        "inertia",
        "log",
        "mass",
        "name",
        "slide",
        "slide_force",
        "slide_kick",
        "slide_motor",
        "slide_push",
        "slide_scale",
        "slide_share",
        "slide_speed",
        "slide_stall",
        "spin_force",
        "spin_kick",
        "spin_motor",
        "spin_push",
        "spin_scale",
        "spin_share",
        "stroke",
        "swing",
        "touches",
        "x",
        "z",
    )  # fmt: skip

    def __init__(self, body: Body, gravity: float, dt: float) -> None:
        assert is_shaft(body), f"the pure engine has no bodies with the joints of {body.name}"
        carriage, turning = body.links
        self.name, self.dt = body.name, dt
        self.x, _, self.z = body.position
        self.mass = carriage.mass + turning.mass
        self.inertia = inertia_about_axis(turning)
        self.slide_scale, self.spin_scale = self.mass / dt, self.inertia / dt
        self.swing = turning.mass * gravity * turning.centre_of_mass[2] * dt / self.inertia
        self.stroke = carriage.limits[1]
        self.slide = self.slide_speed = self.angle = self.angle_speed = 0.0
        self.slide_motor = self.spin_motor = self.slide_kick = self.spin_kick = 0.0
        self.slide_force = self.spin_force = self.slide_push = self.spin_push = 0.0
        self.slide_share = self.slide_stall = self.spin_share = 1.0
        self.log = Log(False)
        self.touches: TouchLog | None = None
        """The log of touches of a shaft that has one; None without."""

    def drive(self, slide: Sequence[float], spin: Sequence[float]) -> None:
        """Set the set-points of both motors for this tick (`drives.Motor`).

        Of a force that falls with the speed `slide_share` is the mean share of the difference that it takes away in a
        substep, `slide_stall` the share at a constant speed.
        """
        self.slide_motor, self.slide_force = slide[0], slide[1]
        self.spin_motor, self.spin_force = spin[0], spin[1]
        self.slide_share = self.slide_stall = self.spin_share = 1.0
        if len(slide) > 2:
            self.slide_share = share_of(slide[2], self.mass, self.dt)
            self.slide_stall = slide[2] * self.dt / self.mass if slide[2] != inf else 1.0
        if len(spin) > 2:
            self.spin_share = share_of(spin[2], self.inertia, self.dt)
        self.slide_kick = self.slide_force * self.dt / self.mass
        self.spin_kick = self.spin_force * self.dt / self.inertia

    def efforts(self) -> tuple[float, float]:
        """Return the force (N) and the torque (N m) of the motors in the last substep."""
        push, kick, force = self.slide_push, self.slide_kick, self.slide_force
        along = force if push == kick else -force if push == -kick else push * self.slide_scale
        push, kick, force = self.spin_push, self.spin_kick, self.spin_force
        return along, force if push == kick else -force if push == -kick else push * self.spin_scale

    def advance(self, substeps: int) -> None:
        """Move for some substeps. Several at once give the same bits as one by one."""
        dt, swing, stroke = self.dt, self.swing, self.stroke
        slide, speed, wanted, kick = self.slide, self.slide_speed, self.slide_motor, self.slide_kick
        angle, turning, wanted_turning, twist = self.angle, self.angle_speed, self.spin_motor, self.spin_kick
        push, turn, spin_share = self.slide_push, self.spin_push, self.spin_share
        share, stall = self.slide_share, self.slide_stall
        for _ in range(substeps):
            change = wanted - speed
            is_pressed = (slide >= stroke and change > 0.0) or (slide <= -stroke and change < 0.0)
            change *= stall if is_pressed else share
            push = kick if change > kick else -kick if change < -kick else change
            speed += push
            slide += speed * dt
            if slide > stroke:
                slide, speed = stroke, 0.0
            elif slide < -stroke:
                slide, speed = -stroke, 0.0
            turning += swing * sin(angle)
            change = spin_share * (wanted_turning - turning)
            turn = twist if change > twist else -twist if change < -twist else change
            turning += turn
            angle += turning * dt
        self.slide_push, self.spin_push = push, turn
        self.slide, self.slide_speed, self.angle, self.angle_speed = slide, speed, angle, turning

    def move(self, along: float, about: float) -> None:
        """Shift by `along` (m) and turn by `about` (rad), within the stroke."""
        self.angle += about
        self.slide = min(max(self.slide + along, -self.stroke), self.stroke)


def is_shaft(body: Body) -> bool:
    """Whether a body slides along y and turns about y, in this order."""
    return [(link.joint, link.axis) for link in body.links] == [("prismatic", ALONG_Y), ("continuous", ALONG_Y)]


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
    sphere: FreeSphere, nx: float, ny: float, nz: float, depth: float, pair: Contact, restitution: float, dt: float
) -> float:
    """Let a sphere that is `depth` inside an immovable shape rebound; return the normal impulse."""
    u = sphere.vx * nx + sphere.vy * ny + sphere.vz * nz
    if u >= 0.0:
        sphere.x += depth * nx
        sphere.y += depth * ny
        sphere.z += depth * nz
        return 0.0
    gap, end = rebound(u, depth, sphere.gravity * nz, restitution, dt)
    way, change = depth + gap, end - u
    sphere.x += way * nx
    sphere.y += way * ny
    sphere.z += way * nz
    sphere.vx += change * nx
    sphere.vy += change * ny
    sphere.vz += change * nz
    impulse = sphere.mass * change
    sx, sy, sz = sphere.slip(nx, ny, nz)
    slipping = sqrt(sx * sx + sy * sy + sz * sz)
    if slipping > 0.0:
        # 2/7 m stops the slip of a solid sphere: 1 / (1/m + r^2 / I).
        stop = slipping * sphere.mass * sphere.inertia / (sphere.inertia + sphere.mass * sphere.radius * sphere.radius)
        share = -min(pair.friction * impulse, stop) / slipping
        sphere.push(nx, ny, nz, share * sx, share * sy, share * sz)
    if pair.rolling_friction > 0.0:
        sphere.roll(nx, ny, nz, pair.rolling_friction * impulse)
    return impulse


def meet_shaft(sphere: FreeSphere, shaft: Shaft, normal: Vector, depth: float, pair: Contact) -> float:
    """Let a sphere and a shaft that overlap by `depth` part, both recoiling; return the normal impulse.

    `normal` points from the shaft to the sphere. Both move by the effect of the impulse since they met.
    """
    nx, ny, nz = normal
    # From the axis to the contact, and the speed of the normal there per turning speed of the shaft.
    rx, rz = sphere.x - sphere.radius * nx - shaft.x, sphere.z - sphere.radius * nz - shaft.z
    arm = rz * nx - rx * nz
    u = sphere.vx * nx + (sphere.vy - shaft.slide_speed) * ny + sphere.vz * nz - shaft.angle_speed * arm
    give = 1.0 / sphere.mass + ny * ny / shaft.mass + arm * arm / shaft.inertia
    if u >= 0.0:
        _part(sphere, shaft, normal, arm, depth / give)
        return 0.0
    gap, end = rebound(u, depth, sphere.gravity * nz, pair.restitution, shaft.dt)
    impulse = (end - u) / give
    _part(sphere, shaft, normal, arm, (depth + gap) / give)
    change = impulse / sphere.mass
    sphere.vx += change * nx
    sphere.vy += change * ny
    sphere.vz += change * nz
    shaft.slide_speed -= impulse * ny / shaft.mass
    shaft.angle_speed -= impulse * arm / shaft.inertia
    _rub(sphere, shaft, normal, (rx, rz), pair.friction * impulse)
    return impulse


def _part(sphere: FreeSphere, shaft: Shaft, normal: Vector, arm: float, shift: float) -> None:
    """Move sphere and shaft apart by the effect of an impulse: `shift` is a length times a mass."""
    nx, ny, nz = normal
    sphere.x += shift / sphere.mass * nx
    sphere.y += shift / sphere.mass * ny
    sphere.z += shift / sphere.mass * nz
    shaft.move(-shift * ny / shaft.mass, -shift * arm / shaft.inertia)


def _rub(sphere: FreeSphere, shaft: Shaft, normal: Vector, lever: tuple[float, float], limit: float) -> None:
    """Let friction of at most `limit` (N s) act against the slip between a sphere and a shaft."""
    nx, ny, nz = normal
    rx, rz = lever
    sx, sy, sz = sphere.slip(nx, ny, nz)
    gx, gy, gz = shaft.angle_speed * rz, shaft.slide_speed, -shaft.angle_speed * rx
    along = gx * nx + gy * ny + gz * nz
    sx, sy, sz = sx - gx + along * nx, sy - gy + along * ny, sz - gz + along * nz
    slipping = sqrt(sx * sx + sy * sy + sz * sz)
    if slipping == 0.0:
        return
    tx, ty, tz = sx / slipping, sy / slipping, sz / slipping
    arm = rz * tx - rx * tz
    give = (
        1.0 / sphere.mass
        + sphere.radius * sphere.radius / sphere.inertia
        + ty * ty / shaft.mass
        + arm * arm / shaft.inertia
    )
    impulse = min(limit, slipping / give)
    sphere.push(nx, ny, nz, -impulse * tx, -impulse * ty, -impulse * tz)
    shaft.slide_speed += impulse * ty / shaft.mass
    shaft.angle_speed += impulse * arm / shaft.inertia


def yield_shaft(sphere: FreeSphere, shaft: Shaft, normal: Vector, depth: float) -> None:
    """Move a shaft out of a sphere that cannot move, because it is pinned against the scenery."""
    nx, ny, nz = normal
    rx, rz = sphere.x - sphere.radius * nx - shaft.x, sphere.z - sphere.radius * nz - shaft.z
    arm = rz * nx - rx * nz
    give = ny * ny / shaft.mass + arm * arm / shaft.inertia
    if give * sphere.mass < 1e-3:  # it presses along a direction in which a shaft is fixed
        return
    shaft.move(-depth / give * ny / shaft.mass, -depth / give * arm / shaft.inertia)
    u = sphere.vx * nx + (sphere.vy - shaft.slide_speed) * ny + sphere.vz * nz - shaft.angle_speed * arm
    if u < 0.0:
        shaft.slide_speed += u / give * ny / shaft.mass
        shaft.angle_speed += u / give * arm / shaft.inertia


def meet_sphere(one: FreeSphere, other: FreeSphere, pair: Contact, dt: float) -> float:
    """Let two spheres that overlap part; return the normal impulse, 0 when they do not touch."""
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
    for sphere, sign in ((one, 1.0), (other, -1.0)):
        change, way = sign * impulse / sphere.mass, sign * shift / sphere.mass
        sphere.x += way * nx
        sphere.y += way * ny
        sphere.z += way * nz
        sphere.vx += change * nx
        sphere.vy += change * ny
        sphere.vz += change * nz
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

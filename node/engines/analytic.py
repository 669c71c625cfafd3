"""The pure engine: the football table in plain Python, for tests and fault simulations by the thousand.

Exact where a test asserts something (rebound, energy, no tunnelling), simple elsewhere: one contact after the other,
the deepest first. It keeps nothing between ticks but what it was built from, so law 1 holds by construction; the same
test watches over it as over Bullet.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin, sqrt
from typing import Final

from mypy_extensions import mypyc_attr

from foosim.deployment.schema import Deployment
from foosim.node.engines.analytic_bodies import Ball, Log, Pair, Rod, meet_ball, meet_rod, meet_scenery, yield_rod
from foosim.node.engines.analytic_shapes import Contact, Figures, Scenery
from foosim.world.layout import Entity, Layout
from foosim.world.scene import Vector, multiply
from foosim.world.scenes.build import build_scene
from foosim.world.scenes.football_table import ball_body

SILENT: Final = frozenset({"floor", "ramps"})
"""What a ball rolls on: its contacts are not logged."""
CONTACTS_MAX: Final = 6
"""Contacts with the scenery that are put right in one substep: a corner has three, and once more."""
DEPTH_MIN: Final = 1e-12
"""Overlaps below this (m) are rounding."""


@mypyc_attr(allow_interpreted_subclasses=True)
class PureEngine:
    """The bodies of one layout."""

    def __init__(self, deployment: Deployment, layout: Layout) -> None:
        table = deployment.table
        self._substeps = deployment.substeps
        self._dt = deployment.tick_ns / 1e9 / deployment.substeps
        self._tick = deployment.tick_ns / 1e9
        scene = build_scene(deployment, layout)
        surfaces = table.surfaces
        pairs = {name: Pair.of(getattr(surfaces, name), name in SILENT) for name in type(surfaces).model_fields}
        self._among_balls = pairs.pop("balls")
        ball = ball_body(table, "ball").links[0]
        self._ball = (table.ball.radius, ball.mass, ball.inertia[0], table.gravity)
        self._scenery = Scenery(scene.scenery, pairs, table.ball.radius)
        self._all_rods = {
            entity.name: Rod(scene.bodies[entity.name], table.gravity, self._dt) for entity in layout.rods
        }
        self._figures = {name: Figures(scene.bodies[name], pairs) for name in self._all_rods}
        self._travel = table.ball.radius + table.ball.speed_limit * self._tick
        self._balls: dict[str, Ball] = {}
        self._rods: dict[str, Rod] = {}
        self._quaternions: dict[str, tuple[float, float, float, float]] = {}

    def load(self, entities: Sequence[Entity], state: Sequence[float]) -> None:
        """Set these bodies to their state; all others take no part."""
        self._balls, self._rods, self._quaternions = {}, {}, {}
        last = self._substeps - 1.0
        for entity in entities:
            offsets = entity.offsets
            log = Log(state[offsets["contacts"] + 2] == last)
            if entity.model == "rod":
                rod = self._rods[entity.name] = self._all_rods[entity.name]
                at, speed = offsets["joint_positions"], offsets["joint_velocities"]
                rod.slide, rod.angle = state[at], state[at + 1]
                rod.slide_speed, rod.angle_speed = state[speed], state[speed + 1]
                rod.drive((0.0, 0.0), (0.0, 0.0))
                rod.log = log
            elif entity.model == "ball":
                ball = self._balls[entity.name] = Ball(*self._ball)
                at, speed, spin = offsets["position"], offsets["linear_velocity"], offsets["angular_velocity"]
                ball.x, ball.y, ball.z = state[at : at + 3]
                ball.vx, ball.vy, ball.vz = state[speed : speed + 3]
                ball.wx, ball.wy, ball.wz = state[spin : spin + 3]
                ball.log = log
                at = offsets["orientation"]
                self._quaternions[entity.name] = (state[at], state[at + 1], state[at + 2], state[at + 3])

    def command(self, entities: Sequence[Entity], commands: Sequence[Sequence[tuple[float, float]]]) -> None:
        """Set the motors of these robots: for each joint the target speed and the greatest force (SI units)."""
        for entity, (slide, spin) in zip(entities, commands, strict=True):
            self._rods[entity.name].drive(slide, spin)

    def step(self, substeps: int) -> None:
        """Advance the loaded bodies by `substeps` substeps and log their contacts."""
        assert substeps == self._substeps, (substeps, self._substeps)
        balls = list(self._balls.values())
        near: list[tuple[Rod, Figures]] = []
        for name, rod in self._rods.items():
            figures = self._figures[name]
            if any(abs(ball.x - rod.x) <= figures.reach + self._travel for ball in balls):
                near.append((rod, figures))
            else:
                rod.advance(substeps)
        if not balls:
            return
        dt = self._dt
        for substep in range(substeps):
            for rod, _ in near:
                rod.advance(1)
            for ball in balls:
                ball.fly(dt)
            for index, ball in enumerate(balls):
                pushes: list[Vector] = []
                for rod, figures in near:
                    self._strike(ball, rod, figures, pushes, substep)
                for other in balls[index + 1 :]:
                    self._clash(ball, other, substep)
                self._land(ball, pushes, substep)
                if pushes:
                    self._yield(ball, near)

    def _strike(self, ball: Ball, rod: Rod, figures: Figures, pushes: list[Vector], substep: int) -> None:
        """Let a ball and a rod part if they overlap; add the normal to `pushes`."""
        contact = figures.contact(ball, rod)
        if contact is None:
            return
        depth, normal, pair = contact
        pushes.append(normal)
        impulse = meet_rod(ball, rod, normal, depth, pair)
        if impulse > 0.0:
            ball.log.add(impulse, substep)
            rod.log.add(impulse, substep)

    def _yield(self, ball: Ball, near: Sequence[tuple[Rod, Figures]]) -> None:
        """Rods that still overlap a ball after it met the scenery have pinned it: they stop."""
        for rod, figures in near:
            contact = figures.contact(ball, rod)
            if contact:
                yield_rod(ball, rod, contact[1], contact[0])

    def _clash(self, ball: Ball, other: Ball, substep: int) -> None:
        impulse = meet_ball(ball, other, self._among_balls, self._dt)
        if impulse > 0.0:
            ball.log.add(impulse, substep)
            other.log.add(impulse, substep)

    def _land(self, ball: Ball, pushes: Sequence[Vector], substep: int) -> None:
        """Put a ball out of the scenery, the deepest contact first: the next is found from where that left it.

        What a rod pushes against the scenery does not bounce off it, else a pinned ball would hammer on both.
        """
        things = self._scenery.near(ball.x, ball.y)
        rounds = 1 if len(things) == 1 else CONTACTS_MAX
        for _ in range(rounds):
            deepest: Contact | None = None
            for thing in things:
                contact = thing.contact(ball)
                if contact[0] > (deepest[0] if deepest else DEPTH_MIN):
                    deepest = contact
            if deepest is None:
                return
            depth, (nx, ny, nz), pair = deepest
            pinned = any(nx * px + ny * py + nz * pz < 0.0 for px, py, pz in pushes)
            impulse = meet_scenery(ball, nx, ny, nz, depth, pair, 0.0 if pinned else pair.restitution, self._dt)
            if impulse > 0.0 and not pair.silent:
                ball.log.add(impulse, substep)

    def read(self, entities: Sequence[Entity], state: list[float]) -> None:
        """Write position, velocity and the tick's contact log of these bodies into `state`."""
        for entity in entities:
            offsets = entity.offsets
            if entity.model == "rod":
                rod = self._rods[entity.name]
                at, speed, log = offsets["joint_positions"], offsets["joint_velocities"], rod.log
                state[at], state[at + 1] = rod.slide, rod.angle
                state[speed], state[speed + 1] = rod.slide_speed, rod.angle_speed
            else:
                ball = self._balls[entity.name]
                log = ball.log
                at, speed, spin = offsets["position"], offsets["linear_velocity"], offsets["angular_velocity"]
                state[at : at + 3] = ball.x, ball.y, ball.z
                state[speed : speed + 3] = ball.vx, ball.vy, ball.vz
                state[spin : spin + 3] = ball.wx, ball.wy, ball.wz
                at = offsets["orientation"]
                state[at : at + 4] = self._turned(ball, self._quaternions[entity.name])
            at = offsets["contacts"]
            state[at : at + 3] = log.count, log.impulse, log.last

    def _turned(self, ball: Ball, orientation: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
        """Return a ball's orientation after the tick: nothing depends on it, so one turn with the last spin will do."""
        spin = sqrt(ball.wx * ball.wx + ball.wy * ball.wy + ball.wz * ball.wz)
        if spin == 0.0:
            return orientation
        share = sin(0.5 * spin * self._tick) / spin
        turn = (share * ball.wx, share * ball.wy, share * ball.wz, cos(0.5 * spin * self._tick))
        x, y, z, w = multiply(turn, orientation)
        size = sqrt(x * x + y * y + z * z + w * w)
        return x / size, y / size, z / size, w / size

    def close(self) -> None:
        """Free what the engine holds: nothing outside of Python."""

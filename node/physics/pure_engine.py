"""The pure engine: spheres and shafts in plain Python, for tests and fault simulations by the thousand.

Exact where a test asserts something (rebound, energy, no tunnelling), simple elsewhere: one contact after the other,
the deepest first. It keeps only its built data between ticks, so law 1 holds by construction; the same test
checks it as Bullet.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin, sqrt
from typing import Final

from mypy_extensions import mypyc_attr

from foosim.deployment.schema import Deployment
from foosim.node.physics.pure_bodies import FreeSphere, Log, Shaft, meet_scenery, meet_shaft, meet_sphere, yield_shaft
from foosim.node.physics.pure_shapes import Scenery, ShaftShapes, Still, Touch
from foosim.node.physics.touch_log import TouchLog
from foosim.world.assembly.sections import physics_of
from foosim.world.assembly.world import build_scene
from foosim.world.layout import Entity, Layout
from foosim.world.scene import Quaternion, Vector, multiply

CONTACTS_MAX: Final = 6
"""Contacts with the scenery that are resolved in one substep: a corner has three, and once more."""
DEPTH_MIN: Final = 1e-12
"""Overlaps below this (m) are rounding."""


@mypyc_attr(allow_interpreted_subclasses=True)
class PureEngine:
    """The bodies of one layout."""

    def __init__(self, deployment: Deployment, layout: Layout) -> None:
        self._substeps = deployment.substeps
        self._dt = deployment.tick_ns / 1e9 / deployment.substeps
        self._tick = deployment.tick_ns / 1e9
        scene, physics = build_scene(deployment, layout), physics_of(deployment)
        self._between_free, surfaces, gravity = physics.between_free, physics.surfaces, physics.gravity
        bodies = [scene.bodies[entity.name] for entity in layout.entities if entity.is_rigid]
        self._all_spheres = {body.name: FreeSphere(body, gravity, self._tick) for body in bodies if body.is_free}
        self._all_shafts = {body.name: Shaft(body, gravity, self._dt) for body in bodies if not body.is_free}
        self._shapes = {name: ShaftShapes(scene.bodies[name], surfaces) for name in self._all_shafts}
        things = [Still(shape, surfaces) for shape in scene.scenery if shape.surface in surfaces]
        radii = {sphere.radius for sphere in self._all_spheres.values()}
        self._indices = {entity.name: entity.index for entity in layout.entities}
        self._scenery = {radius: Scenery(things, radius) for radius in radii}
        self._spheres: dict[str, FreeSphere] = {}
        self._shafts: dict[str, Shaft] = {}
        self._quaternions: dict[str, Quaternion] = {}

    def load(self, entities: Sequence[Entity], state: Sequence[float]) -> None:
        """Set these bodies to their state; all others take no part."""
        self._spheres, self._shafts, self._quaternions = {}, {}, {}
        last = self._substeps - 1.0
        for entity in entities:
            name, offsets = entity.name, entity.offsets
            shaft = self._all_shafts.get(name)
            if shaft is not None:
                self._shafts[name] = shaft
                at, speed = offsets["joint_positions"], offsets["joint_velocities"]
                shaft.slide, shaft.angle = state[at], state[at + 1]
                shaft.slide_speed, shaft.angle_speed = state[speed], state[speed + 1]
                shaft.drive((0.0, 0.0), (0.0, 0.0))
                shaft.log = Log(state[offsets["contacts"] + 2] == last)
                shaft.touches = TouchLog() if "touches" in offsets else None
                continue
            sphere = self._all_spheres.get(name)
            if sphere is not None:
                self._spheres[name] = sphere
                at, speed, spin = offsets["position"], offsets["linear_velocity"], offsets["angular_velocity"]
                sphere.x, sphere.y, sphere.z = state[at : at + 3]
                sphere.vx, sphere.vy, sphere.vz = state[speed : speed + 3]
                sphere.wx, sphere.wy, sphere.wz = state[spin : spin + 3]
                sphere.log = Log(state[offsets["contacts"] + 2] == last)
                at = offsets["orientation"]
                self._quaternions[name] = (state[at], state[at + 1], state[at + 2], state[at + 3])

    def command(self, entities: Sequence[Entity], commands: Sequence[Sequence[tuple[float, ...]]]) -> None:
        """Set the motors of these robots: for each joint the numbers of a `drives.Motor`."""
        for entity, (slide, spin) in zip(entities, commands, strict=True):
            shaft = self._shafts.get(entity.name)
            if shaft is not None:
                shaft.drive(slide, spin)

    def step(self, substeps: int) -> None:
        """Advance the loaded bodies by `substeps` substeps and log their contacts."""
        assert substeps == self._substeps, (substeps, self._substeps)
        spheres = list(self._spheres.values())
        near: list[tuple[Shaft, ShaftShapes]] = []
        for name, shaft in self._shafts.items():
            shapes = self._shapes[name]
            if any(abs(sphere.x - shaft.x) <= shapes.reach + sphere.travel for sphere in spheres):
                near.append((shaft, shapes))
            else:
                shaft.advance(substeps)
        if not spheres:
            return
        dt = self._dt
        for substep in range(substeps):
            for shaft, _ in near:
                shaft.advance(1)
            for sphere in spheres:
                sphere.fly(dt)
            for index, sphere in enumerate(spheres):
                pushes: list[Vector] = []
                for shaft, shapes in near:
                    self._strike(sphere, shaft, shapes, pushes, substep)
                for other in spheres[index + 1 :]:
                    impulse = meet_sphere(sphere, other, self._between_free, dt)
                    if impulse > 0.0:
                        sphere.log.add(impulse, substep)
                        other.log.add(impulse, substep)
                self._land(sphere, pushes, substep)
                if pushes:
                    self._yield(sphere, near)

    def _strike(
        self, sphere: FreeSphere, shaft: Shaft, shapes: ShaftShapes, pushes: list[Vector], substep: int
    ) -> None:
        """Separate a sphere and a shaft if they overlap; add the normal to `pushes`."""
        contact = shapes.contact(sphere, shaft)
        if contact is None:
            return
        depth, normal, pair = contact
        pushes.append(normal)
        impulse = meet_shaft(sphere, shaft, normal, depth, pair)
        if impulse > 0.0:
            sphere.log.add(impulse, substep)
            shaft.log.add(impulse, substep)
            if shaft.touches is not None:
                place = sphere.y - sphere.radius * normal[1] - shaft.slide
                shaft.touches.add(self._indices[sphere.name], shapes.link_of(pair), place, impulse, substep)

    def _yield(self, sphere: FreeSphere, near: Sequence[tuple[Shaft, ShaftShapes]]) -> None:
        """Shafts that still overlap a sphere after it met the scenery have pinned it: they stop."""
        for shaft, shapes in near:
            contact = shapes.contact(sphere, shaft)
            if contact:
                yield_shaft(sphere, shaft, contact[1], contact[0])

    def _land(self, sphere: FreeSphere, pushes: Sequence[Vector], substep: int) -> None:
        """Move a sphere out of the scenery, the deepest contact first: the next is found after that.

        A sphere that a shaft pushes against the scenery does not bounce, else a pinned sphere would hammer on both.
        """
        things = self._scenery[sphere.radius].near(sphere.x, sphere.y)
        rounds = 1 if len(things) == 1 else CONTACTS_MAX
        for _ in range(rounds):
            deepest: Touch | None = None
            for thing in things:
                contact = thing.contact(sphere)
                if contact[0] > (deepest[0] if deepest else DEPTH_MIN):
                    deepest = contact
            if deepest is None:
                return
            depth, (nx, ny, nz), pair = deepest
            pinned = any(nx * px + ny * py + nz * pz < 0.0 for px, py, pz in pushes)
            impulse = meet_scenery(sphere, nx, ny, nz, depth, pair, 0.0 if pinned else pair.restitution, self._dt)
            if impulse > 0.0 and not pair.silent:
                sphere.log.add(impulse, substep)

    def read(self, entities: Sequence[Entity], state: list[float]) -> None:
        """Write position, velocity and the tick's contact log of these bodies into `state`."""
        for entity in entities:
            name, offsets = entity.name, entity.offsets
            shaft = self._shafts.get(name)
            if shaft is not None:
                at, speed, effort = offsets["joint_positions"], offsets["joint_velocities"], offsets["joint_efforts"]
                state[at], state[at + 1] = shaft.slide, shaft.angle
                state[speed], state[speed + 1] = shaft.slide_speed, shaft.angle_speed
                state[effort], state[effort + 1] = shaft.efforts()
                log = shaft.log
                if shaft.touches is not None:
                    shaft.touches.write(entity, state, self._substeps)
            else:
                sphere = self._spheres.get(name)
                if sphere is None:
                    continue
                at, speed, spin = offsets["position"], offsets["linear_velocity"], offsets["angular_velocity"]
                state[at : at + 3] = sphere.x, sphere.y, sphere.z
                state[speed : speed + 3] = sphere.vx, sphere.vy, sphere.vz
                state[spin : spin + 3] = sphere.wx, sphere.wy, sphere.wz
                at = offsets["orientation"]
                state[at : at + 4] = self._turned(sphere, self._quaternions[name])
                log = sphere.log
            at = offsets["contacts"]
            state[at : at + 3] = log.count, log.impulse, log.last

    def _turned(self, sphere: FreeSphere, orientation: Quaternion) -> Quaternion:
        """Return an orientation after the tick: nothing depends on it, so one turn with the last spin will do."""
        spin = sqrt(sphere.wx * sphere.wx + sphere.wy * sphere.wy + sphere.wz * sphere.wz)
        if spin == 0.0:
            return orientation
        share = sin(0.5 * spin * self._tick) / spin
        turn = (share * sphere.wx, share * sphere.wy, share * sphere.wz, cos(0.5 * spin * self._tick))
        x, y, z, w = multiply(turn, orientation)
        size = sqrt(x * x + y * y + z * z + w * w)
        return x / size, y / size, z / size, w / size

    def close(self) -> None:
        """Free the engine: it holds nothing outside of Python."""

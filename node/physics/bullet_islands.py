"""Rigid bodies of any kind in Bullet: one island at a time, in an engine that holds that island's bodies and no others.

Bullet sorts the constraints of all islands of a solve by island, unstably, so that what couples inside of a body (the
motors of an arm) would depend on who else is solved beside it. Therefore an island has a solve of its own. An engine is
made for a *composition*: the bodies of an island without their names, in name order, and the movers that stand in
their way. It serves each island of that composition in turn. Before each load all that is in it is parked far apart,
which ends Bullet's memory of contacts. What it remembers beyond that, the order in which it finds pairs, sorts nothing:
all bodies are tied into one of Bullet's own islands. tests/laws/test_island_engines.py compares these engines with
engines that hold everything, and breaks each rule in turn.

A *mover* has no rigid-body dynamics: it is a multibody without a mass, at the pose and with the velocity that it has at
the start of the tick, so that others are pushed by it. (Nothing is pushed by a rigid static with a velocity.)
"""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import fsum, inf, isfinite, sqrt
from typing import Any, Final

from mypy_extensions import mypyc_attr

from foosim.deployment.schema import Deployment
from foosim.node.physics.bullet_client import (
    JOINT_TYPES,
    MESH_PIECE,
    bullet_indices,
    give_client,
    make_dynamics,
    make_scenery,
    make_shape,
    make_surface,
    p,
    settings_of,
    start_client,
)
from foosim.node.physics.interface import ISLAND_ENGINES_MAX, Island
from foosim.node.physics.joint_forces import MotorForces, Stops, ends_of, may_stop, without_sloping
from foosim.node.physics.touch_log import TouchLog
from foosim.world.assembly.sections import physics_of
from foosim.world.assembly.volumes import Volumes, is_felt
from foosim.world.assembly.world import build_scene, initial_numbers
from foosim.world.bodies.limits import split_shapes
from foosim.world.components.drives import Motor
from foosim.world.forms.forms import NO_ENTITY, PARTNERS_MAX
from foosim.world.kinematics import twist
from foosim.world.layout import Entity, Layout
from foosim.world.matter.physics import Physics
from foosim.world.scene import (
    MOVING,
    ORIGIN,
    UPRIGHT,
    Body,
    Link,
    Shape,
    Vector,
    in_pieces,
    inertia_about,
    load_of,
    moved,
    rotate,
    swept_box,
)

BODIES: Final = 1
SCENERY: Final = 2
"""Collision groups: bodies meet everything, what stands meets bodies alone."""
SINGLE_MAX: Final = ISLAND_ENGINES_MAX // 2
"""Engines of single bodies that stay while others come and go."""
PARKING_Z_M: Final = 1000.0
PARKING_GAP_M: Final = 10.0
"""Between parked bodies, beyond what they reach."""
RESIDUAL: Final = 1e-12
"""The solver stops when an iteration changes no speed by more than 1 um/s or 1 urad/s: this is the square of it."""
EVERYWHERE: Final[tuple[int, ...]] = (-1, -1, -2, -2)
"""The contacts of any two bodies and links."""
DONE: Final = "done"
NO_CONTACT: Final[tuple[float, ...]] = (0.0, 0.0, -1.0)
NOBODY: Final[tuple[float, ...]] = (NO_ENTITY,) * PARTNERS_MAX
NO_IMPULSES: Final[tuple[float, ...]] = (0.0,) * PARTNERS_MAX

Composition = tuple[tuple[int, ...], tuple[int, ...]]
"""The kinds of an island's bodies, in name order, and those of the movers in their way."""


@dataclass(frozen=True, slots=True)
class _Made:
    """A body in an engine: its id, its joints that move, and where it is parked.

    `joints` are indices of Bullet; `is_free` says that the base moves; `end` is the link that a tie holds, if any can;
    `shaped` are the links that have a shape, -1 being the base, and the groups that each meets. `own` are the indices
    of the body's links by those of Bullet.
    """

    id: int
    body: Body
    joints: tuple[int, ...]
    zeros: tuple[float, ...]
    is_free: bool
    end: int | None
    shaped: tuple[tuple[int, int], ...]
    own: Mapping[int, int]
    parking: Vector


class _Touch:
    """The contacts of two bodies within a tick: their normal forces (N), and a bit for each substep with one."""

    __slots__ = ("forces", "substeps")

    def __init__(self) -> None:
        self.forces: list[float] = []
        self.substeps = 0


class _Slots:
    """Where the numbers of an entity are in a frame; -1 for those that it does not have."""

    def __init__(self, entity: Entity) -> None:
        self.position, self.orientation = _at(entity, "position"), _at(entity, "orientation")
        self.velocity, self.spin = _at(entity, "linear_velocity"), _at(entity, "angular_velocity")
        self.joint_positions, self.joint_velocities = _at(entity, "joint_positions"), _at(entity, "joint_velocities")
        self.joint_efforts = _at(entity, "joint_efforts")
        self.contacts = _at(entity, "contacts")
        self.partners, self.partner_impulses = _at(entity, "partners"), _at(entity, "partner_impulses")


def _at(entity: Entity, field: str) -> int:
    return entity.offsets.get(field, -1)


class BulletIslands:
    """The rigid bodies of one layout, island by island."""

    def __init__(self, deployment: Deployment, layout: Layout) -> None:
        self._physics = physics_of(deployment)
        self._substeps = deployment.substeps
        self._dt = deployment.tick_ns / 1e9 / deployment.substeps
        scene = build_scene(deployment, layout)
        felt = [shape for shape in scene.scenery if shape.surface in self._physics.sides]
        self._scenery = tuple(in_pieces(felt, MESH_PIECE))
        self._bodies: dict[int, Body] = {}
        self._kinds: dict[int, int] = {}
        """Of each entity with a body: the number of its kind. Entities of one kind differ in name and place alone."""
        self._unnamed: list[Body] = []
        known: dict[Body, int] = {}
        for entity in layout.entities:
            body = scene.bodies.get(entity.name)
            if body is not None and is_felt(body, self._physics):
                unnamed = _without_names(body, is_mover=not entity.is_rigid)
                self._bodies[entity.index] = body
                self._kinds[entity.index] = known.setdefault(unnamed, len(known))
        self._unnamed = list(known)
        self._engines: dict[Composition, CompositionEngine] = {}
        """The one that was used last at the end."""
        self._used: set[Composition] = set()
        """Those that were used, or expected, since the last look ahead."""
        self._expected: list[Composition] = []
        self._begun: tuple[Composition, CompositionEngine] | None = None
        """The engine that is built between ticks, and of what."""
        self.missed = ""

    @classmethod
    def in_steps(cls, deployment: Deployment, layout: Layout) -> Generator[None, None, BulletIslands]:
        """Make one with the engines of the islands at the start and of single bodies, a body at a time."""
        made = cls(deployment, layout)
        yield
        entities = layout.entities
        islands = Volumes(deployment, layout).islands(initial_numbers(deployment, layout))
        first = [
            made._composition(
                [entities[index] for index in island.entities], [entities[index] for index in island.movers]
            )
            for island in islands
            if entities[island.entities[0]].is_rigid
        ]
        alone: list[Composition] = [((kind,), ()) for kind, body in enumerate(made._unnamed) if not _is_mover(body)]
        made._expected = list(dict.fromkeys([*first, *alone]))[:ISLAND_ENGINES_MAX]
        while made.build_some():
            yield
        return made

    def _composition(self, bodies: Iterable[Entity], movers: Iterable[Entity]) -> Composition:
        kinds = self._kinds
        return tuple([kinds[entity.index] for entity in bodies]), tuple([kinds[entity.index] for entity in movers])

    def expect(self, islands: Sequence[tuple[tuple[Entity, ...], tuple[Entity, ...]]]) -> None:
        """Have the engines of islands built by `build_some`, as far as no other one that is in use has to go."""
        coming = list(dict.fromkeys([self._composition(*island) for island in islands]))
        in_use = self._used.intersection(self._engines).union(self._kept())
        ready = [composition for composition in coming if composition in self._engines]
        wanted = [composition for composition in coming if composition not in self._engines]
        self._expected = wanted[: max(0, ISLAND_ENGINES_MAX - len(in_use.union(ready)) - (self._begun is not None))]
        self._used = set()
        for composition in ready:
            self._engines[composition] = self._engines.pop(composition)

    def _kept(self) -> list[Composition]:
        """Return the single bodies whose engines stay: islands end in these. That is half of all engines at most."""
        alone = [composition for composition in self._engines if len(composition[0]) == 1 and not composition[1]]
        return alone[-SINGLE_MAX:]

    def build_some(self) -> bool:
        """Build a body of an engine that is expected; False when there is none."""
        if self._begun is None:
            while self._expected and self._expected[0] in self._engines:
                del self._expected[0]
            if not self._expected:
                return False
            composition = self._expected.pop(0)
            self._begun = composition, self._begin(composition)
        composition, engine = self._begun
        if not engine.build_some():
            self._engines[composition], self._begun = engine, None
        return True

    def _begin(self, composition: Composition) -> CompositionEngine:
        """Return the engine of a composition, of which nothing is built. One not used for long goes for it."""
        while len(self._engines) + (self._begun is not None) >= ISLAND_ENGINES_MAX:
            kept = self._kept()
            self._engines.pop(next(known for known in self._engines if known not in kept)).close()
        bodies = [self._unnamed[kind] for kind in composition[0]]
        movers = [self._unnamed[kind] for kind in composition[1]]
        physics, step_s, substeps = self._physics, self._dt, self._substeps
        return CompositionEngine(physics, step_s, substeps, self._scenery, bodies, movers, at_once=False)

    def _build_now(self, composition: Composition) -> CompositionEngine:
        """Return an engine that was not expected, or is not complete."""
        if self._begun is not None and self._begun[0] == composition:
            engine, self._begun = self._begun[1], None
        else:
            engine = self._begin(composition)
        while engine.build_some():
            continue
        return engine

    def solve(self, island: Island, numbers: list[float], start: Sequence[float]) -> None:
        """Write the next state of an island's bodies into the numbers, which have its present one.

        `start` are the numbers of the tick's start, at which movers are.
        """
        composition = self._composition(island.bodies, island.movers)
        engine = self._engines.pop(composition, None)
        if engine is None:
            engine = self._build_now(composition)
            self.missed = ", ".join([entity.name for entity in (*island.bodies, *island.movers)])
        self._engines[composition] = engine
        self._used.add(composition)
        engine.load(island, [self._bodies[entity.index] for entity in (*island.bodies, *island.movers)], numbers, start)
        engine.step(island)
        engine.read(island, numbers)

    def close(self) -> None:
        """Free all engines."""
        for engine in (*self._engines.values(), *([] if self._begun is None else [self._begun[1]])):
            engine.close()
        self._engines.clear()
        self._begun = None


def _without_names(body: Body, *, is_mover: bool) -> Body:
    """Return what an engine builds of a body: links without names and looks; a mover has no masses."""
    links = []
    for link in body.links:
        shapes = tuple([_felt(shape) for shape in link.shapes])
        own = replace(link, mass=0.0, inertia=ORIGIN, centre_of_mass=ORIGIN, principal=UPRIGHT) if is_mover else link
        links.append(replace(own, name="", shapes=shapes))
    return Body("", "", ORIGIN, tuple(links))


def _felt(shape: Shape) -> Shape:
    return Shape(shape.geometry, shape.surface, (0.0, 0.0, 0.0, 1.0), shape.position, shape.orientation)


def _is_mover(body: Body) -> bool:
    return all(link.mass == 0.0 for link in body.links)


def _as_built(body: Body) -> tuple[Link | None, list[Link]]:
    """Return a body as Bullet is given it: the base of a free body, and links whose parents are places among these.

    Bullet has no compound of convex hulls: all but one shape of a link with hulls hang on it as links without a mass.
    """
    base = body.links[0] if body.is_free else None
    shift = 0 if base is None else 1
    links, more = [], []
    for index, link in enumerate(body.links):
        first, others = split_shapes(link.shapes)
        own = index - shift
        if own >= 0:
            links.append(replace(link, shapes=first, parent=link.parent - shift))
        else:
            base = replace(link, shapes=first)
        more += [Link("", "fixed", (shape,), 0.0, ORIGIN, parent=own) for shape in others]
    return base, [*links, *more]


def _owners(body: Body, links: Sequence[Link], indices: Sequence[int]) -> dict[int, int]:
    """Return the indices of a body's links by those of Bullet; a further hull is the link that it hangs on.

    `links` are those that were given to Bullet, `indices` its own of each.
    """
    shift = 1 if body.is_free else 0
    count = len(body.links) - shift
    owners = [place if place < count else link.parent for place, link in enumerate(links)]
    return {-1: 0, **{index: owner + shift for index, owner in zip(indices, owners, strict=True)}}


def _shaped(base: Link | None, links: Sequence[Link]) -> tuple[tuple[int, int], ...]:
    """Return the links that have a shape, by their places, -1 being the base, and the groups that each meets.

    Links of a body on a fixed base that no joint moves meet no scenery: nothing can happen between the two.
    """
    found = [(-1, BODIES | SCENERY)] if base is not None and base.shapes else []
    standing: set[int] = set()
    for index, link in enumerate(links):
        if base is None and link.joint == "fixed" and (link.parent < 0 or link.parent in standing):
            standing.add(index)
        if link.shapes:
            found.append((index, BODIES if index in standing else BODIES | SCENERY))
    return tuple(found)


def _reach(body: Body) -> float:
    """Return how far a body reaches from its base over all its joints' positions (m)."""
    low, high = swept_box(body)
    sides = [max(abs(a), abs(b)) for a, b in zip(low, high, strict=True)]
    return sqrt(sum(side * side for side in sides))


def stable_damping(link: Link, parent: Link | None, substep_s: float) -> float:
    """Return what Bullet is to damp a joint with, so that it takes d / (1 + d h / I) of its speed in a substep h.

    That is what the implicit rule of Euler takes of a speed that is damped by d. Bullet takes d h / I, more than
    the whole speed where d is large. I is that of both links about the joint, one against the other.
    """
    inertia = _inertia_about(link, link.axis, link.centre_of_mass, link.joint)
    if parent is not None and parent.mass > 0.0:
        axis = rotate(link.orientation, link.axis)
        other = _inertia_about(parent, axis, moved(parent.centre_of_mass, link.position, -1.0), link.joint)
        inertia = inertia * other / (inertia + other)
    return link.damping / (1.0 + link.damping * substep_s / inertia) if inertia > 0.0 else 0.0


def _inertia_about(link: Link, axis: Vector, centre: Vector, joint: str) -> float:
    """Return the inertia (kg m2) of a link about an axis from which its centre of mass is so far away; of a joint that
    slides its mass (kg)."""
    return link.mass if joint == "prismatic" else inertia_about(link, axis, centre)


@mypyc_attr(allow_interpreted_subclasses=True)  # tests break its rules
class CompositionEngine:
    """A physics client with scenery and the bodies of one composition, all of them parked between two loads."""

    def __init__(
        self,
        physics: Physics,
        substep_s: float,
        substeps: int,
        scenery: Sequence[Shape],
        bodies: Sequence[Body],
        movers: Sequence[Body],
        *,
        at_once: bool = True,
    ) -> None:
        """Without `at_once` nothing is built but by `build_some`."""
        self._physics, self._dt, self._substeps = physics, substep_s, substeps
        self._client = -1
        self._silent: set[int] = set()
        self._made: list[_Made] = []
        self._count = len(bodies)
        self._place: dict[int, int] = {}
        """Of the bodies by their ids: the place in the island, movers behind."""
        self._known_slots: dict[int, _Slots] = {}
        """By the index of the entity."""
        self._slots: list[_Slots] = []
        """Of the bodies of the island that was loaded last."""
        self._touches: dict[tuple[int, int], _Touch] = {}
        """Of the tick, by the ids of both bodies."""
        self._governed: dict[int, MotorForces] = {}
        """Motors whose forces are set at each substep, by the places of their bodies."""
        self._details: dict[int, TouchLog] = {}
        """What bodies of the island log of their touches, by their places."""
        self._bases: list[Vector] = []
        """Where the bodies of the island stand."""
        self._stops: list[Stops] = []
        """Joints that may come to an end within the tick."""
        self._steps: Iterator[None] | None = self._build(tuple(scenery), (*bodies, *movers))
        while at_once and self.build_some():
            continue

    def _settings(self) -> dict[str, Any]:
        """Return the parameters of the world. A solve has one island, so that it may stop on what is left of that."""
        return {**settings_of(self._physics, self._dt), "solverResidualThreshold": RESIDUAL}

    # --- building ----------------------------------------------------------------------------------------------------

    def build_some(self) -> bool:
        """Build a body, or a piece of scenery; False when all is built, at the last step at the latest."""
        if self._steps is not None and next(self._steps, DONE) is DONE:
            self._steps = None
        return self._steps is not None

    def _build(self, scenery: Sequence[Shape], bodies: Sequence[Body]) -> Iterator[None]:
        self._client = start_client(self._settings(), self._physics.gravity)
        for shape in scenery:
            yield
            side = self._physics.sides[shape.surface]
            made = make_scenery(self._client, shape, (SCENERY, BODIES), side)
            if side.silent:
                self._silent.add(made)
        at = PARKING_Z_M
        for body in bodies:
            yield
            reach = _reach(body)
            at += reach
            self._add(self._make(body, (0.0, 0.0, at)))
            at += reach + PARKING_GAP_M
        self._tie()

    def _add(self, made: _Made) -> None:
        self._place[made.id] = len(self._made)
        self._made.append(made)
        self._park(made)

    def _make(self, body: Body, parking: Vector) -> _Made:
        """Make a body as a multibody: a rigid body's world inertia tensor is not reloaded with its pose."""
        client, (base, links) = self._client, _as_built(body)
        mass = 0.0 if base is None else base.mass
        made: int = p.createMultiBody(
            baseMass=mass,
            baseCollisionShapeIndex=-1 if base is None else make_shape(client, base.shapes, placed=True),
            baseInertialFramePosition=ORIGIN if base is None else base.centre_of_mass,
            baseInertialFrameOrientation=UPRIGHT if base is None else base.principal,
            linkMasses=[link.mass for link in links],
            linkCollisionShapeIndices=[make_shape(client, link.shapes, placed=True) for link in links],
            linkVisualShapeIndices=[-1] * len(links),
            linkPositions=[link.position for link in links],
            linkOrientations=[link.orientation for link in links],
            linkInertialFramePositions=[link.centre_of_mass for link in links],
            linkInertialFrameOrientations=[link.principal for link in links],
            linkParentIndices=[link.parent + 1 for link in links],
            linkJointTypes=[JOINT_TYPES[link.joint] for link in links],
            linkJointAxis=[link.axis for link in links],
            useMaximalCoordinates=False,
            physicsClientId=client,
        )
        indices = bullet_indices(client, made, len(links))
        if base is not None:
            self._finish(made, -1, base, None)
        for index, link in zip(indices, links, strict=True):
            self._finish(made, index, link, links[link.parent] if link.parent >= 0 else base)
        shaped = tuple([(indices[place] if place >= 0 else -1, mask) for place, mask in _shaped(base, links)])
        for index, mask in shaped:
            p.setCollisionFilterGroupMask(made, index, BODIES, mask, client)
        p.changeDynamics(made, -1, activationState=p.ACTIVATION_STATE_DISABLE_SLEEPING, physicsClientId=client)
        joints = tuple([index for index, link in zip(indices, links, strict=True) if link.joint in MOVING])
        zeros = (0.0,) * len(joints)
        if joints:
            p.setJointMotorControlArray(
                made, joints, p.VELOCITY_CONTROL, targetVelocities=zeros, forces=zeros, physicsClientId=client
            )
        end = -1 if mass > 0.0 else (joints[0] if joints else None)
        owners = _owners(body, links, indices)
        return _Made(made, body, joints, zeros, base is not None, end, shaped, owners, parking)

    def _tie(self) -> None:
        """Tie all that moves into one of Bullet's islands, by gears without a force, which have no row in a solve.

        Bullet unites bodies whose bounding boxes overlap into islands, numbers each by the link that comes out as the
        root of the union, and sorts the constraints of all joints by that number, unstably. The root depends on the
        order in which overlaps are found, thus on the tree of the broad phase. The shape of that tree is its past, and
        parking keeps it. Untied, the motors of two arms in one engine changed places at 10 of 20,000 ticks, the
        first by 0.12 in a joint. Tied, all constraints have one number: their order depends on their count alone.
        """
        client = self._client
        ends = [(made.id, made.end) for made in self._made if made.end is not None]
        for (one, of_one), (other, of_other) in pairwise(ends):
            tie = p.createConstraint(
                one, of_one, other, of_other, p.JOINT_GEAR, ORIGIN, ORIGIN, ORIGIN, physicsClientId=client
            )
            # Bullet leaves a gear out of the solve if its force is exactly 0; it is 500 N by default.
            p.changeConstraint(tie, maxForce=0.0, physicsClientId=client)

    def _finish(self, made: int, index: int, link: Link, parent: Link | None) -> None:
        """Set what a link that was made weighs, and what others feel of it."""
        client = self._client
        if link.mass > 0.0:
            make_dynamics(client, made, index, link.mass, link.inertia)
        if link.shapes:
            make_surface(client, made, index, self._physics.sides[link.shapes[0].surface])
        if link.damping > 0.0:
            damping = stable_damping(link, parent, self._dt)
            p.changeDynamics(made, index, jointDamping=damping, physicsClientId=client)
        if link.joint in ("prismatic", "revolute"):
            low, high = link.limits
            p.changeDynamics(made, index, jointLowerLimit=low, jointUpperLimit=high, physicsClientId=client)

    # --- the tick ----------------------------------------------------------------------------------------------------

    def _park(self, made: _Made) -> None:
        """Put a body out of the way of all others."""
        p.resetBasePositionAndOrientation(made.id, made.parking, UPRIGHT, self._client)

    def _wipe(self) -> None:
        """Forget all pairs and contacts: parked, no body is near another or the scenery, and each is known anew.

        Bullet ends few pairs at a time of those whose boxes are apart: the others would keep their places in the list
        of contacts, which is solved in its order. To set a filter makes another box for a link in the broad phase, and
        ends its pairs at once.
        """
        client, renew = self._client, p.setCollisionFilterGroupMask
        for made in self._made:
            self._park(made)
        for made in self._made:
            for index, mask in made.shaped:
                renew(made.id, index, BODIES, mask, client)
        p.performCollisionDetection(client)

    def load(self, island: Island, bodies: Sequence[Body], numbers: Sequence[float], start: Sequence[float]) -> None:
        """Set the bodies of an island to their state, and movers to where they are at the start of the tick."""
        self._wipe()
        client, place = self._client, p.resetBasePositionAndOrientation
        self._slots = [self._slots_of(entity) for entity in island.bodies]
        for index, slots in enumerate(self._slots):
            made = self._made[index]
            if made.joints:  # before the base: a link's box in the broad phase is that of the last long way
                at, speed, count = slots.joint_positions, slots.joint_velocities, len(made.joints)
                positions = [(value,) for value in numbers[at : at + count]]
                speeds = [(value,) for value in numbers[speed : speed + count]]
                p.resetJointStatesMultiDof(made.id, made.joints, positions, speeds, client)
            if made.is_free:
                at, turned, speed, spin = slots.position, slots.orientation, slots.velocity, slots.spin
                place(made.id, numbers[at : at + 3], numbers[turned : turned + 4], client)
                p.resetBaseVelocity(made.id, numbers[speed : speed + 3], numbers[spin : spin + 3], client)
            else:
                place(made.id, bodies[index].position, bodies[index].orientation, client)
        for number, mover in enumerate(island.movers, self._count):
            self._load_mover(mover, self._made[number], bodies[number], start)
        found = [
            self._stops_of(entity, self._made[place], self._slots[place], numbers)
            for place, entity in enumerate(island.bodies)
        ]
        self._stops = [ends for ends in found if ends is not None]
        self._details = {place: TouchLog() for place, entity in enumerate(island.bodies) if "touches" in entity.offsets}
        self._bases = [body.position for body in bodies] if self._details else []
        self._command(island)

    def _slots_of(self, entity: Entity) -> _Slots:
        """Return where the numbers of an entity are; all entities that an engine meets are of one layout."""
        slots = self._known_slots.get(entity.index)
        if slots is None:
            slots = self._known_slots[entity.index] = _Slots(entity)
        return slots

    def _load_mover(self, entity: Entity, made: _Made, body: Body, start: Sequence[float]) -> None:
        at, turned = entity.offsets["position"], entity.offsets["orientation"]
        p.resetBasePositionAndOrientation(made.id, start[at : at + 3], start[turned : turned + 4], self._client)
        linear, angular = twist(body, entity, start, 0)
        p.resetBaseVelocity(made.id, linear, angular, self._client)

    def _command(self, island: Island) -> None:
        """Set the motors of joints: speeds, and the greatest forces with which they are reached."""
        client, mode, drive = self._client, p.VELOCITY_CONTROL, p.setJointMotorControlArray
        self._governed = {}
        for place, (made, drives) in enumerate(zip(self._made, island.drives, strict=False)):
            if made.joints:
                motors = drives.motors
                speeds = [motor.speed for motor in motors] if motors else made.zeros
                forces = [motor.force for motor in motors] if motors else made.zeros
                if any(motor.slope != inf for motor in motors):
                    self._governed[place] = self._motor_forces(made, motors)
                    forces = without_sloping(motors)
                drive(made.id, made.joints, mode, targetVelocities=speeds, forces=forces, physicsClientId=client)

    def _motor_forces(self, made: _Made, motors: Sequence[Motor]) -> MotorForces:
        loads = [load_of(made.body, index) for index, link in enumerate(made.body.links) if link.joint in MOVING]
        return MotorForces(self._client, made.id, made.joints, motors, loads, ends_of(made.body), self._dt)

    def _stops_of(self, entity: Entity, made: _Made, slots: _Slots, numbers: Sequence[float]) -> Stops | None:
        """Return the ends of a body's joints where one may come to its own, of a body whose joints do not couple.

        In one whose joints do, a joint that stops changes the speeds of others, which is for the solver.
        """
        if entity.kind.couples or not made.joints:
            return None
        ends = ends_of(made.body)
        at, speed, tick_s = slots.joint_positions, slots.joint_velocities, self._dt * self._substeps
        for number, its in enumerate(ends):
            if may_stop(its, numbers[at + number], numbers[speed + number], tick_s):
                limited = [(made.joints[n], *its) for n, its in enumerate(ends) if isfinite(sum(its))]
                return Stops(self._client, made.id, limited)
        return None

    def _push(self, island: Island) -> None:
        """Apply the forces on bases, which Bullet forgets after each substep."""
        for made, drives in zip(self._made, island.drives, strict=False):
            if drives.wrench is not None:
                force, torque = drives.wrench
                p.applyExternalForce(made.id, -1, force, ORIGIN, p.LINK_FRAME, physicsClientId=self._client)
                p.applyExternalTorque(made.id, -1, torque, p.LINK_FRAME, physicsClientId=self._client)

    def step(self, island: Island) -> None:
        """Advance by the substeps of a tick and note what touches."""
        touches: dict[tuple[int, int], _Touch] = {}
        self._touches = touches
        pushed = any(drives.wrench is not None for drives in island.drives)
        client, step, contacts = self._client, p.stepSimulation, p.getContactPoints
        governed = list(self._governed.values())
        for substep in range(self._substeps):
            if pushed:
                self._push(island)
            for driven in governed:
                driven.apply()
            step(client)
            for ends in self._stops:
                ends.apply()
            for point in contacts(*EVERYWHERE, client):
                force = point[9]
                if force > 0.0:
                    if self._details:
                        self._note(island, point, substep)
                    pair = point[1:3]
                    touch = touches.get(pair)
                    if touch is None:
                        touches[pair] = touch = _Touch()
                    touch.forces.append(force)
                    touch.substeps |= 1 << substep

    def _note(self, island: Island, point: Sequence[Any], substep: int) -> None:
        """Note which link of a body that logs its touches meets another one, and where along its first joint's axis."""
        everybody = (*island.bodies, *island.movers)
        for own, other, link, at in ((1, 2, 3, 5), (2, 1, 4, 6)):
            place, partner = self._place.get(point[own], -1), self._place.get(point[other], -1)
            log = self._details.get(place)
            if log is None or partner < 0:
                continue
            made = self._made[place]
            first = made.body.links[0]
            base = self._bases[place]
            along = sum([(a - b) * c for a, b, c in zip(point[at], base, first.axis, strict=True)])
            slid = p.getJointState(made.id, made.joints[0], self._client)[0] if first.joint == "prismatic" else 0.0
            log.add(everybody[partner].index, made.own[point[link]], along - slid, point[9] * self._dt, substep)

    def read(self, island: Island, numbers: list[float]) -> None:
        """Write the state of the island's bodies, and what they touched, into the numbers."""
        client, met = self._client, self._met()
        for place, slots in enumerate(self._slots):
            made = self._made[place]
            if made.is_free:
                at, turned, speed, spin = slots.position, slots.orientation, slots.velocity, slots.spin
                numbers[at : at + 3], numbers[turned : turned + 4] = p.getBasePositionAndOrientation(made.id, client)
                numbers[speed : speed + 3], numbers[spin : spin + 3] = p.getBaseVelocity(made.id, client)
            if made.joints:
                self._read_joints(made, slots, numbers, island.drives[place].motors)
                if place in self._governed:
                    driven = self._governed[place]
                    for number, effort in zip(driven.numbers, driven.efforts, strict=True):
                        numbers[slots.joint_efforts + number] = effort
            self._read_log(place, slots, island, met.get(place, ()), numbers)
            if place in self._details:
                self._details[place].write(island.bodies[place], numbers, self._substeps)

    def _read_joints(self, made: _Made, slots: _Slots, numbers: list[float], motors: Sequence[Motor]) -> None:
        states = p.getJointStates(made.id, made.joints, self._client)
        at, speed, effort = slots.joint_positions, slots.joint_velocities, slots.joint_efforts
        for number, (position, velocity, _, applied) in enumerate(states):
            numbers[at + number], numbers[speed + number] = position, velocity
            # Without a force Bullet keeps what a motor applied last.
            numbers[effort + number] = applied if motors and motors[number].force > 0.0 else 0.0

    def _met(self) -> dict[int, list[tuple[int, _Touch]]]:
        """Return what each body touched in the tick, by its place: the partner's place, -1 for scenery, and how."""
        found: dict[int, list[tuple[int, _Touch]]] = {}
        silent, places, count = self._silent, self._place, self._count
        for (one_id, other_id), touch in self._touches.items():
            if one_id in silent or other_id in silent:
                continue
            one, other = places.get(one_id, -1), places.get(other_id, -1)
            if 0 <= one < count:
                found.setdefault(one, []).append((other, touch))
            if 0 <= other < count:
                found.setdefault(other, []).append((one, touch))
        return found

    def _read_log(
        self, place: int, slots: _Slots, island: Island, met: Sequence[tuple[int, _Touch]], numbers: list[float]
    ) -> None:
        """Write what a body touched: how many touches began, the impulse (N s), and the last substep with a contact.

        Bullet lists contacts in an order that depends on its past; `fsum` gives the same bits in any order.
        """
        at, dt = slots.contacts, self._dt
        by_partner: dict[int, float] = {}
        if not met:
            numbers[at : at + 3] = NO_CONTACT
        else:
            substeps = 0
            parts: dict[int, list[float]] = {}
            for partner, touch in met:
                substeps |= touch.substeps
                parts.setdefault(partner, []).extend([force * dt for force in touch.forces])
            by_partner = {partner: fsum(impulses) for partner, impulses in parts.items()}
            before = substeps << 1 | (numbers[at + 2] == self._substeps - 1.0)
            began = (substeps & ~before).bit_count()
            numbers[at : at + 3] = float(began), fsum(by_partner.values()), substeps.bit_length() - 1.0
        if slots.partners >= 0:
            self._read_partners(slots, island, by_partner, numbers)

    def _read_partners(self, slots: _Slots, island: Island, by_partner: dict[int, float], numbers: list[float]) -> None:
        """Write the partners with the greatest impulses, by their indices."""
        met = sorted([(-impulse, partner) for partner, impulse in by_partner.items() if partner >= 0])[:PARTNERS_MAX]
        at, impulses = slots.partners, slots.partner_impulses
        if not met:
            numbers[at : at + PARTNERS_MAX], numbers[impulses : impulses + PARTNERS_MAX] = NOBODY, NO_IMPULSES
            return
        everybody = (*island.bodies, *island.movers)
        found = sorted([(float(everybody[partner].index), -impulse) for impulse, partner in met])
        missing = PARTNERS_MAX - len(found)
        numbers[at : at + PARTNERS_MAX] = [index for index, _ in found] + [NO_ENTITY] * missing
        numbers[impulses : impulses + PARTNERS_MAX] = [impulse for _, impulse in found] + [0.0] * missing

    def close(self) -> None:
        """Empty the physics client and keep it for the next engine."""
        if self._client >= 0:
            give_client(self._client)
            self._client = -1

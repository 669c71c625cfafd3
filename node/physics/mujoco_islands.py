"""Rigid bodies of any kind in MuJoCo: one island at a time, in a model of its composition (`mujoco_model`).

The state of a model is `qpos` and `qvel`. All else that a step reads is set at each load: the warm start and the time
are 0, motors and applied forces those of the tick. So a tick is a function of the frame, whichever model computes it
and whatever that has computed before.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain
from math import fsum, inf
from typing import Any, Final

from mypy_extensions import mypyc_attr

from foosim.deployment.schema import Deployment
from foosim.node.physics.interface import Island
from foosim.node.physics.mesh_pieces import MeshPieces
from foosim.node.physics.mujoco_model import SCENERY, VERSION, ModelBuilder, Placed, step, warnings, without_names
from foosim.world.assembly.sections import physics_of
from foosim.world.assembly.volumes import Volumes, is_felt
from foosim.world.assembly.world import build_scene
from foosim.world.components.drives import Motor, share_of
from foosim.world.forms.forms import NO_ENTITY, PARTNERS_MAX
from foosim.world.kinematics import twist
from foosim.world.layout import Entity, Layout
from foosim.world.matter.mesh import AssetError, Mesh
from foosim.world.matter.physics import Physics
from foosim.world.scene import MOVING, Body, Shape, load_of, rotate

MODELS_MAX: Final = 128
"""Models that an engine keeps: those that were used last."""
NO_CONTACT: tuple[float, ...] = (0.0, 0.0, -1.0)
NOBODY: tuple[float, ...] = (NO_ENTITY,) * PARTNERS_MAX
NO_IMPULSES: tuple[float, ...] = (0.0,) * PARTNERS_MAX

Composition = tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]
"""The kinds of an island's bodies, in name order, those of movers in their way, and the pieces of meshes in reach."""


class MujocoIslands:
    """The rigid bodies of one layout, island by island."""

    version = VERSION
    """Another one may compute other bits, in worlds that the small run of the fingerprint has not."""

    def __init__(self, deployment: Deployment, layout: Layout) -> None:
        self._physics = physics_of(deployment)
        self._substeps = deployment.substeps
        self._dt = deployment.tick_ns / 1e9 / deployment.substeps
        scene = build_scene(deployment, layout)
        felt = [shape for shape in scene.scenery if shape.surface in self._physics.sides]
        self._scenery = tuple([shape for shape in felt if not isinstance(shape.geometry, Mesh)])
        self._meshes = MeshPieces(felt)
        self._volumes = Volumes(deployment, layout) if self._meshes.pieces else None
        self._bodies: dict[int, Body] = {}
        self._kinds: dict[int, int] = {}
        """Of each entity with a body the number of its kind. Entities of one kind differ in name and place alone."""
        known: dict[Body, int] = {}
        for entity in layout.entities:
            body = scene.bodies.get(entity.name)
            if body is not None and is_felt(body, self._physics):
                self._bodies[entity.index] = body
                self._kinds[entity.index] = known.setdefault(without_names(body), len(known))
        self._unnamed = list(known)
        self._models: dict[Composition, CompositionEngine] = {}
        """The one that was used last at the end."""
        self._check({self._kinds[index]: layout.entities[index] for index in reversed(self._bodies)})

    def _check(self, first: Mapping[int, Entity]) -> None:
        """Build each kind of body alone; raise AssetError for the first entity of a kind that MuJoCo refuses."""
        for kind, entity in first.items():
            try:
                self._build(((kind,), (), ()) if entity.is_rigid else ((), (kind,), ()))
            except ValueError as error:
                raise AssetError(f"{entity.name}: MuJoCo refuses its body: {error}") from error

    def solve(self, island: Island, numbers: list[float], start: Sequence[float]) -> None:
        """Write the next state of an island's bodies into the numbers, which have its present one.

        `start` are the numbers of the tick's start, at which movers are.
        """
        kinds = self._kinds
        bodies, movers = ([kinds[one.index] for one in its] for its in (island.bodies, island.movers))
        key = tuple(bodies), tuple(movers), self._pieces_near(island, numbers)
        engine = self._models.pop(key, None)
        if engine is None:
            engine = self._build(key)
        self._models[key] = engine
        engine.load(island, [self._bodies[one.index] for one in (*island.bodies, *island.movers)], numbers, start)
        engine.step(island)
        engine.read(island, numbers)

    def _pieces_near(self, island: Island, numbers: Sequence[float]) -> tuple[int, ...]:
        """Return the pieces of meshes that the bodies of an island may touch within the tick."""
        if self._volumes is None:
            return ()
        rows = [self._volumes.rows[entity.index] for entity in island.bodies]
        return self._meshes.near(self._volumes.boxes_at(numbers)[rows])

    def _build(self, key: Composition) -> CompositionEngine:
        while len(self._models) >= MODELS_MAX:
            del self._models[next(iter(self._models))]
        bodies, movers = ([self._unnamed[kind] for kind in kinds] for kinds in key[:2])
        scenery = [*self._scenery, *chain.from_iterable([self._meshes.pieces[piece] for piece in key[2]])]
        return CompositionEngine(self._physics, self._dt, self._substeps, scenery, bodies, movers)

    def close(self) -> None:
        """Free all models."""
        self._models.clear()


class _Slots:
    """Where the numbers of an entity are in a frame; -1 for those that it does not have."""

    __slots__ = (
        "contacts", "joint_efforts", "joint_positions", "joint_velocities", "orientation", "partner_impulses",
        "partners", "position", "spin", "velocity",
    )  # fmt: skip

    def __init__(self, entity: Entity) -> None:
        at = entity.offsets.get
        self.position, self.orientation = at("position", -1), at("orientation", -1)
        self.velocity, self.spin = at("linear_velocity", -1), at("angular_velocity", -1)
        self.joint_positions, self.joint_velocities = at("joint_positions", -1), at("joint_velocities", -1)
        self.joint_efforts, self.contacts = at("joint_efforts", -1), at("contacts", -1)
        self.partners, self.partner_impulses = at("partners", -1), at("partner_impulses", -1)


class _Touch:
    """The contacts of two bodies within a tick: their normal forces (N), and a bit for each substep with one."""

    __slots__ = ("forces", "substeps")

    def __init__(self) -> None:
        self.forces: list[float] = []
        self.substeps = 0


@mypyc_attr(allow_interpreted_subclasses=True)
class CompositionEngine:
    """A model with scenery and the bodies of one composition, and its data."""

    def __init__(
        self,
        physics: Physics,
        substep_s: float,
        substeps: int,
        scenery: Sequence[Shape],
        bodies: Sequence[Body],
        movers: Sequence[Body],
    ) -> None:
        self._dt, self._substeps, self._count = substep_s, substeps, len(bodies)
        built = ModelBuilder(physics, substep_s, scenery, bodies, movers)
        self.m, self._placed, self._owners = built.m, built.placed, built.owners
        self._silent, self._motors, clock = built.silent, built.motors, built.clock
        self.d = d = built.d
        self._q, self._v = d.qpos.tolist(), d.qvel.tolist()
        self._qpos, self._qvel, self._warm, self._applied = d.qpos, d.qvel, d.qacc_warmstart, d.qfrc_applied
        self._contact = d.contact
        self._touches: dict[tuple[int, int], _Touch] = {}
        self._forces: list[float] = []
        self._governed: list[tuple[Placed, int, Motor, float]] = []
        """Motors whose force falls with the speed: their body, joint, and the slope as its mean over a substep."""
        self._is_applied = False
        self._slots: dict[int, _Slots] = {}
        """By the index of an entity: all that a model meets are of one layout."""
        if self._motors:
            self._clock = clock, int(self.m.jnt_qposadr[self.m.dof_jntid[clock]])
            self._friction, self._speeds = self.m.tendon_frictionloss, self.m.wrap_prm[1::2]

    def load(self, island: Island, bodies: Sequence[Body], numbers: Sequence[float], start: Sequence[float]) -> None:
        """Set the bodies of an island to their state, and movers to where they are at the start of the tick."""
        qpos, qvel = self._q, self._v
        for placed, entity, body in zip(self._placed, (*island.bodies, *island.movers), bodies, strict=True):
            if placed.is_mover:
                self._load_mover(placed, entity, body, start)
                continue
            slots = self._slots_of(entity)
            if placed.is_free:
                q, v, at, spin = placed.q, placed.v, slots.position, slots.spin
                x, y, z, w = numbers[slots.orientation : slots.orientation + 4]
                qpos[q : q + 7] = *numbers[at : at + 3], w, x, y, z
                a, b, c = numbers[spin : spin + 3]
                qvel[v : v + 6] = *numbers[slots.velocity : slots.velocity + 3], *rotate((-x, -y, -z, w), (a, b, c))
            elif placed.stands is not body:
                self._stand(placed, body)
            if placed.qs:
                at, speed = slots.joint_positions, slots.joint_velocities
                for number, (i, j) in enumerate(zip(placed.qs, placed.vs, strict=True)):
                    qpos[i], qvel[j] = numbers[at + number], numbers[speed + number]
        if self._motors:
            self._command(island)
        self._qpos[:], self._qvel[:] = qpos, qvel
        self._warm[:] = 0.0
        self.d.time = 0.0

    def _slots_of(self, entity: Entity) -> _Slots:
        slots = self._slots.get(entity.index)
        if slots is None:
            slots = self._slots[entity.index] = _Slots(entity)
        return slots

    def _load_mover(self, placed: Placed, entity: Entity, body: Body, start: Sequence[float]) -> None:
        q, v = placed.q, placed.v
        at, turned = entity.offsets["position"], entity.offsets["orientation"]
        x, y, z, w = start[turned : turned + 4]
        linear, spin = twist(body, entity, start, 0)
        self._q[q : q + 3] = start[at : at + 3]
        self._q[q + 3 : q + 7] = w, x, y, z
        self._v[v : v + 3], self._v[v + 3 : v + 6] = linear, rotate((-x, -y, -z, w), spin)

    def _stand(self, placed: Placed, body: Body) -> None:
        """Put the fixed base of a body of the same kind where this one has it."""
        x, y, z, w = body.orientation
        placed.stands = body
        self.m.body_pos[placed.base], self.m.body_quat[placed.base] = body.position, (w, x, y, z)

    def _command(self, island: Island) -> None:
        """Set the target speeds of motors, and the greatest forces with which they are reached."""
        speeds, forces = [0.0] * self._motors, [0.0] * self._motors
        self._governed.clear()
        for placed, drives in zip(self._placed, island.drives, strict=False):
            for number, motor in enumerate(drives.motors, placed.motor):
                if motor.slope != inf:
                    self._govern(placed, number - placed.motor, motor)
                else:
                    speeds[number], forces[number] = -motor.speed, motor.force
        if forces != self._forces:
            self._friction[:] = self._forces = forces
        self._speeds[:] = speeds
        v, q = self._clock
        self._q[q], self._v[v] = 0.0, 1.0

    def _govern(self, placed: Placed, number: int, motor: Motor) -> None:
        link = [index for index, one in enumerate(placed.body.links) if one.joint in MOVING][number]
        load = load_of(placed.body, link)
        self._governed.append((placed, number, motor, share_of(motor.slope, load, self._dt) * load / self._dt))

    def step(self, island: Island) -> None:
        """Advance by the substeps of a tick and note what touches."""
        m, d, touches = self.m, self.d, self._touches
        touches.clear()
        pushed = [
            (placed, drives.wrench)
            for placed, drives in zip(self._placed, island.drives, strict=False)
            if drives.wrench is not None
        ]
        if self._is_applied:
            self._applied[:] = 0.0
        self._is_applied = bool(pushed or self._governed)
        for substep in range(self._substeps):
            if self._is_applied:
                self._apply(pushed)
            step(m, d)
            if d.ncon:
                self._note(1 << substep)
        assert not warnings, f"MuJoCo has warned: {'; '.join(warnings)}"

    def _apply(self, pushed: Sequence[tuple[Placed, tuple[Any, Any]]]) -> None:
        """Set the forces on bases, which turn with them, and those of motors whose force falls with the speed."""
        qpos, qvel, applied = self._qpos, self._qvel, self._applied
        for placed, (force, torque) in pushed:
            w, x, y, z = qpos[placed.q + 3 : placed.q + 7].tolist()
            applied[placed.v : placed.v + 6] = (*rotate((x, y, z, w), force), *torque)
        for placed, number, motor, factor in self._governed:
            v = placed.vs[number]
            applied[v] = min(max(factor * (motor.speed - float(qvel[v])), -motor.force), motor.force)

    def _note(self, bit: int) -> None:
        """Note the contacts of a substep that push."""
        contact, owners, touches = self._contact, self._owners, self._touches
        forces = self.d.efc_force.tolist()
        for (one, other), row in zip(contact.geom.tolist(), contact.efc_address.tolist(), strict=True):
            force = forces[row] if row >= 0 else 0.0
            if force > 0.0 and not (one in self._silent or other in self._silent):
                pair = owners[one], owners[other]
                touch = touches.get(pair)
                if touch is None:
                    touches[pair] = touch = _Touch()
                touch.forces.append(force)
                touch.substeps |= bit

    def read(self, island: Island, numbers: list[float]) -> None:
        """Write the state of the island's bodies, and what they touched, into the numbers."""
        qpos, qvel = self._qpos.tolist(), self._qvel.tolist()
        efforts = self._efforts() if self._motors else []
        met = self._met()
        for number, entity in enumerate(island.bodies):
            placed, slots = self._placed[number], self._slots_of(entity)
            if placed.is_free:
                q, v, at, turned = placed.q, placed.v, slots.position, slots.orientation
                w, x, y, z = qpos[q + 3 : q + 7]
                numbers[at : at + 3], numbers[turned : turned + 4] = qpos[q : q + 3], (x, y, z, w)
                at, spin = slots.velocity, slots.spin
                a, b, c = qvel[v + 3 : v + 6]
                numbers[at : at + 3], numbers[spin : spin + 3] = qvel[v : v + 3], rotate((x, y, z, w), (a, b, c))
            if placed.qs:
                count, at = len(placed.qs), slots.joint_positions
                speed, effort = slots.joint_velocities, slots.joint_efforts
                numbers[at : at + count] = [qpos[i] for i in placed.qs]
                numbers[speed : speed + count] = [qvel[i] for i in placed.vs]
                numbers[effort : effort + count] = efforts[placed.motor : placed.motor + count]
            self._write_log(slots, island, met.get(number), numbers)

    def _efforts(self) -> list[float]:
        """Return what each motor applied in the last substep (N or N m)."""
        m, d = self.m, self.d
        found = [0.0] * m.ntendon
        rows = slice(d.ne, d.ne + d.nf)
        for number, force in zip(d.efc_id[rows].tolist(), d.efc_force[rows].tolist(), strict=True):
            found[number] = force
        for placed, number, _, _ in self._governed:
            found[placed.motor + number] = float(self._applied[placed.vs[number]])
        return found

    def _met(self) -> dict[int, list[tuple[int, _Touch]]]:
        """Return what each body touched in the tick, by its place: the partner's place, and how."""
        found: dict[int, list[tuple[int, _Touch]]] = {}
        for (one, other), touch in self._touches.items():
            if 0 <= one < self._count:
                found.setdefault(one, []).append((other, touch))
            if 0 <= other < self._count:
                found.setdefault(other, []).append((one, touch))
        return found

    def _write_log(
        self, slots: _Slots, island: Island, met: Sequence[tuple[int, _Touch]] | None, numbers: list[float]
    ) -> None:
        """Write what a body touched: how many touches began, the impulse (N s), and the last substep with a contact."""
        at, dt = slots.contacts, self._dt
        impulses: dict[int, float] = {}
        if met is None:
            numbers[at : at + 3] = NO_CONTACT
        else:
            substeps = 0
            parts: dict[int, list[float]] = {}
            for partner, touch in met:
                substeps |= touch.substeps
                parts.setdefault(partner, []).extend([force * dt for force in touch.forces])
            impulses = {partner: fsum(its) for partner, its in parts.items()}
            before = substeps << 1 | (numbers[at + 2] == self._substeps - 1.0)
            began = (substeps & ~before).bit_count()
            numbers[at : at + 3] = float(began), fsum(impulses.values()), substeps.bit_length() - 1.0
        if slots.partners < 0:
            return
        at, to = slots.partners, slots.partner_impulses
        if not impulses:
            numbers[at : at + PARTNERS_MAX], numbers[to : to + PARTNERS_MAX] = NOBODY, NO_IMPULSES
            return
        kept = sorted([(-impulse, one) for one, impulse in impulses.items() if one != SCENERY])[:PARTNERS_MAX]
        everybody = (*island.bodies, *island.movers)
        found = sorted([(float(everybody[one].index), -impulse) for impulse, one in kept])
        missing = PARTNERS_MAX - len(found)
        numbers[at : at + PARTNERS_MAX] = [index for index, _ in found] + [NO_ENTITY] * missing
        numbers[to : to + PARTNERS_MAX] = [impulse for _, impulse in found] + [0.0] * missing

    def close(self) -> None:
        """Nothing is held beyond memory."""

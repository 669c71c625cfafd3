"""Rigid bodies of any kind in MuJoCo: one island at a time, in a model of its composition (`mujoco_model`).

The state of a model is `qpos` and `qvel`. All else that a step reads is set at each load: the warm start and the time
are 0, motors, applied forces and the wind those of the tick. So a tick is a function of the frame, independent of
the model and its past.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import chain
from math import inf
from typing import Any, Final

from mypy_extensions import mypyc_attr

from foosim.deployment.schema import Deployment
from foosim.node.physics.floors import Floors, as_plane
from foosim.node.physics.interface import Island, Weld
from foosim.node.physics.mesh_pieces import MeshPieces
from foosim.node.physics.mujoco_model import (
    SCENERY,
    SILENT,
    VERSION,
    ModelBuilder,
    Placed,
    step,
    warnings,
    without_names,
)
from foosim.world.air import air_of
from foosim.world.assembly.sections import physics_of
from foosim.world.assembly.volumes import Volumes, is_felt
from foosim.world.assembly.world import build_scene
from foosim.world.component_types.descriptions import NO_ENTITY, PARTNERS_MAX
from foosim.world.components.drives import Drives, Motor, share_of
from foosim.world.kinematics import twist
from foosim.world.layout import Entity, Layout
from foosim.world.matter.mesh import AssetError, Mesh
from foosim.world.matter.physics import Physics
from foosim.world.scene import (
    MOVING,
    ORIGIN,
    Body,
    Quaternion,
    Shape,
    Vector,
    load_of,
    moved,
    multiply,
    rotate,
)

MODELS_MAX: Final = 128
"""The count of models, the latest ones, that an engine keeps."""
SEATED_MAX: Final = 1024
"""The count of islands with kept places in a model: there are more of them than compositions."""
NO_CONTACT: tuple[float, ...] = (0.0, 0.0, -1.0)

Composition = tuple[
    tuple[int, ...], tuple[int, ...], tuple[int, ...], tuple[int, ...], tuple[tuple[int, int, int], ...]
]
"""The kinds of an island's bodies, in name order, those of movers in their way, the pieces of meshes in reach, the
floors that all bodies are above, and of each weld the place of the body that holds, its link, and the place of the body
that is held. `Key` has the entities themselves, how many of them are no movers, and the welds."""
Key = tuple[tuple[int, ...], int, tuple[int, ...], tuple[int, ...], tuple[Weld, ...]]


class MujocoIslands:
    """The rigid bodies of one layout, island by island."""

    version = VERSION
    """Another one may compute other bits, in worlds that the small run of the fingerprint has not."""

    def __init__(self, deployment: Deployment, layout: Layout) -> None:
        self._physics, self._air = physics_of(deployment), air_of(deployment, layout)
        if self._air is not None:
            self._physics = replace(self._physics, density=self._air.density, viscosity=self._air.viscosity)
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
        self._floors = Floors(self._scenery, [(layout.entities[index], body) for index, body in self._bodies.items()])
        self._models: dict[Composition, CompositionEngine] = {}
        self._seated: dict[Key, tuple[CompositionEngine, Seats]] = {}
        self._check({self._kinds[index]: layout.entities[index] for index in reversed(self._bodies)})

    def _check(self, first: Mapping[int, Entity]) -> None:
        """Build each kind of body alone; raise AssetError for the first entity of a kind that MuJoCo refuses."""
        for kind, entity in first.items():
            try:
                self._build(((kind,), (), (), (), ()) if entity.is_rigid else ((), (kind,), (), (), ()))
            except ValueError as error:
                raise AssetError(f"{entity.name}: MuJoCo refuses its body: {error}") from error

    def solve(self, island: Island, numbers: list[float], start: Sequence[float]) -> None:
        """Write the next state of an island's bodies into the numbers, which have its present one.

        `start` are the numbers of the tick's start, at which movers are.
        """
        indices = tuple([one.index for one in (*island.bodies, *island.movers)])
        floors = self._floors.below(island.bodies, numbers)
        key = indices, len(island.bodies), self._pieces_near(island, numbers), floors, island.welds
        seated = self._seated.get(key)
        if seated is None:
            if len(self._seated) == SEATED_MAX:
                self._seated.clear()
            seated = self._seated[key] = self._seat(key, island)
        engine, seats = seated
        if self._air is not None:
            engine.blow([numbers[at] for at in self._air.velocity])
        engine.solve(seats, island.drives, numbers, start)

    def _seat(self, key: Key, island: Island) -> tuple[CompositionEngine, Seats]:
        """Return a model of an island's composition and its entities' seats in that."""
        indices, count, pieces, floors, welds = key
        kinds = tuple([self._kinds[index] for index in indices])
        composition = kinds[:count], kinds[count:], pieces, floors, tuple([weld[:3] for weld in welds])
        engine = self._models.get(composition)
        if engine is None:
            if len(self._models) == MODELS_MAX:
                del self._models[next(iter(self._models))]
                self._seated.clear()
            engine = self._models[composition] = self._build(composition)
        return engine, engine.seats_of(island, [self._bodies[index] for index in indices])

    def _pieces_near(self, island: Island, numbers: Sequence[float]) -> tuple[int, ...]:
        """Return the pieces of meshes that the bodies of an island may touch within the tick."""
        if self._volumes is None:
            return ()
        rows = [self._volumes.rows[entity.index] for entity in island.bodies]
        return self._meshes.near(self._volumes.boxes_at(numbers)[rows])

    def _build(self, key: Composition) -> CompositionEngine:
        bodies, movers = ([self._unnamed[kind] for kind in kinds] for kinds in key[:2])
        fixed = [as_plane(shape) if place in key[3] else shape for place, shape in enumerate(self._scenery)]
        scenery = [*fixed, *chain.from_iterable([self._meshes.pieces[piece] for piece in key[2]])]
        return CompositionEngine(self._physics, self._dt, self._substeps, scenery, bodies, movers, key[4])

    def close(self) -> None:
        """Free all models."""
        self._models.clear()
        self._seated.clear()


class _Seat:
    """A body of a model, and the places of its present entity's numbers in a frame (-1: none)."""

    __slots__ = (
        "contacts", "index", "joint_efforts", "joint_positions", "joint_velocities", "orientation", "partner_impulses",
        "partners", "placed", "position", "spin", "velocity",
    )  # fmt: skip

    def __init__(self, placed: Placed, entity: Entity) -> None:
        at = entity.offsets.get
        self.placed, self.index = placed, float(entity.index)
        self.position, self.orientation = at("position", -1), at("orientation", -1)
        self.velocity, self.spin = at("linear_velocity", -1), at("angular_velocity", -1)
        self.joint_positions, self.joint_velocities = at("joint_positions", -1), at("joint_velocities", -1)
        self.joint_efforts, self.contacts = at("joint_efforts", -1), at("contacts", -1)
        self.partners, self.partner_impulses = at("partners", -1), at("partner_impulses", -1)


class Seats:
    """The entities of an island in a model, in the order of its bodies, movers last."""

    __slots__ = ("bodies", "fixed", "grasps", "movers", "q", "seats", "turned", "v")

    def __init__(self, m: Any, places: Sequence[Placed], island: Island, bodies: Sequence[Body]) -> None:
        self.seats = [_Seat(*its) for its in zip(places, (*island.bodies, *island.movers), strict=True)]
        self.bodies = self.seats[: len(island.bodies)]
        everything = list(zip(self.seats, (*island.bodies, *island.movers), bodies, strict=True))
        self.movers = [its for its in everything if its[0].placed.is_mover]
        self.fixed = [(seat.placed, body) for seat, _, body in everything if not body.is_free]
        self.grasps = [one.grasp for one in island.welds]
        """Of each weld the first place of its grasp in the frame."""
        self.turned: list[tuple[int, int]] = []
        """Of each free body the first places of its angular velocity in `qvel` and of its orientation in the frame."""
        self.q, self.v = [0] * m.nq, [0] * m.nv
        """The places of `qpos` and `qvel` in the frame; 0 of movers and the clock, which are set separately."""
        for seat in self.bodies:
            placed = seat.placed
            if placed.is_free:
                q, v, x = placed.q, placed.v, seat.orientation
                self.q[q : q + 3], self.q[q + 3 : q + 7] = (
                    range(seat.position, seat.position + 3),
                    (x + 3, x, x + 1, x + 2),
                )
                self.v[v : v + 3], self.v[v + 3 : v + 6] = (
                    range(seat.velocity, seat.velocity + 3),
                    range(seat.spin, seat.spin + 3),
                )
                self.turned.append((v + 3, x))
            for number, (i, j) in enumerate(zip(placed.qs, placed.vs, strict=True)):
                self.q[i], self.v[j] = seat.joint_positions + number, seat.joint_velocities + number


class _Touch:
    """The contacts of two bodies within a tick: the sum of their normal forces in its substeps (N), and a bit for each
    substep with one."""

    __slots__ = ("force", "substeps")

    def __init__(self) -> None:
        self.force, self.substeps = 0.0, 0


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
        welds: Sequence[tuple[int, int, int]] = (),
    ) -> None:
        self._dt, self._substeps, self._count = substep_s, substeps, len(bodies)
        built = ModelBuilder(physics, substep_s, scenery, bodies, movers, welds)
        self._welds = built.welds
        self.m, self._placed, self._owners = built.m, built.placed, built.owners
        self._motors, clock = built.motors, built.clock
        self.d = d = built.d
        self._qpos, self._qvel, self._warm, self._applied = d.qpos, d.qvel, d.qacc_warmstart, d.qfrc_applied
        self._contact, self._wind = d.contact, self.m.opt.wind
        self._touches: dict[tuple[int, int], _Touch] = {}
        self._forces: list[float] = []
        self._governed: list[tuple[Placed, int, Motor, float]] = []
        """Motors whose force falls with the speed: their body, joint, and the slope as its mean over a substep."""
        self._is_applied = False
        if self._motors:
            self._clock_v, self._clock_q = clock, int(self.m.jnt_qposadr[self.m.dof_jntid[clock]])
            self._friction, self._speeds = self.m.tendon_frictionloss, self.m.wrap_prm[1::2]

    def seats_of(self, island: Island, bodies: Sequence[Body]) -> Seats:
        """Return the seats of an island's entities, movers last, with their bodies, in the model."""
        return Seats(self.m, self._placed, island, bodies)

    def blow(self, velocity: Sequence[float]) -> None:
        """Set the velocity of the air (m/s), until it is set anew."""
        self._wind[:] = velocity

    def solve(self, seats: Seats, drives: Sequence[Drives], numbers: list[float], start: Sequence[float]) -> None:
        """Write the next state of the bodies into the numbers, as `MujocoIslands.solve` does."""
        self.load(seats, drives, numbers, start)
        self.step(drives)
        self.read(numbers)

    def load(self, seats: Seats, drives: Sequence[Drives], numbers: Sequence[float], start: Sequence[float]) -> None:
        """Set the bodies of an island to their state, and movers to their poses at the start of the tick."""
        self._seated = seats
        qpos, qvel = [numbers[at] for at in seats.q], [numbers[at] for at in seats.v]
        for v, at in seats.turned:
            x, y, z, w = numbers[at : at + 4]
            qvel[v : v + 3] = rotate((-x, -y, -z, w), (qvel[v], qvel[v + 1], qvel[v + 2]))
        for seat, entity, body in seats.movers:
            q, v, at, turned = seat.placed.q, seat.placed.v, seat.position, seat.orientation
            x, y, z, w = start[turned : turned + 4]
            linear, spin = twist(body, entity, start, 0)
            qpos[q : q + 7] = *start[at : at + 3], w, x, y, z
            qvel[v : v + 6] = *linear, *rotate((-x, -y, -z, w), spin)
        for placed, body in seats.fixed:
            if placed.fixed_at is not body:  # the base of another body of its kind
                x, y, z, w = body.orientation
                placed.fixed_at = body
                self.m.body_pos[placed.base], self.m.body_quat[placed.base] = body.position, (w, x, y, z)
        for (number, origin, axes), grasp in zip(self._welds, seats.grasps, strict=True):
            self._weld(number, origin, axes, numbers[grasp : grasp + 7])
        if self._motors:
            self._command(drives)
            qpos[self._clock_q], qvel[self._clock_v] = 0.0, 1.0
        self._qpos[:], self._qvel[:] = qpos, qvel
        self._warm.fill(0.0)
        self.d.time = 0.0

    def _weld(self, number: int, origin: Vector, axes: Quaternion, grasp: Sequence[float]) -> None:
        """Set how a body is held by a link whose frame has the pose (`origin`, `axes`) in MuJoCo's body."""
        px, py, pz, qx, qy, qz, qw = grasp
        x, y, z, w = multiply(axes, (qx, qy, qz, qw))
        place = moved(origin, rotate(axes, (px, py, pz)), 1.0)
        self.m.eq_data[number, :10] = *ORIGIN, *place, w, x, y, z

    def _command(self, all_drives: Sequence[Drives]) -> None:
        """Set the target speeds of motors, and the greatest forces with which they are reached."""
        speeds, forces = [0.0] * self._motors, [0.0] * self._motors
        self._governed.clear()
        for placed, drives in zip(self._placed, all_drives, strict=False):
            for number, motor in enumerate(drives.motors, placed.motor):
                if motor.slope != inf:
                    self._govern(placed, number - placed.motor, motor)
                else:
                    speeds[number], forces[number] = -motor.speed, motor.force
        if forces != self._forces:
            self._friction[:] = self._forces = forces
        self._speeds[:] = speeds

    def _govern(self, placed: Placed, number: int, motor: Motor) -> None:
        link = [index for index, one in enumerate(placed.body.links) if one.joint in MOVING][number]
        load = load_of(placed.body, link)
        self._governed.append((placed, number, motor, share_of(motor.slope, load, self._dt) * load / self._dt))

    def step(self, all_drives: Sequence[Drives]) -> None:
        """Advance by the substeps of a tick and note contacts."""
        m, d, touches = self.m, self.d, self._touches
        touches.clear()
        pushed = [
            (placed, drives.wrench)
            for placed, drives in zip(self._placed, all_drives, strict=False)
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
        forces.append(0.0)  # of contacts without a force, whose row is -1
        for (one, other), row in zip(contact.geom.tolist(), contact.efc_address.tolist(), strict=True):
            force = forces[row]
            if force > 0.0:
                first, second = owners[one], owners[other]  # MuJoCo puts them in the order of their shapes' types
                pair = (first, second) if first < second else (second, first)
                touch = touches.get(pair)
                if touch is None:
                    touches[pair] = touch = _Touch()
                touch.force += force
                touch.substeps |= bit

    def read(self, numbers: list[float]) -> None:
        """Write the state of the island's bodies, and their contacts, into the numbers."""
        qpos, qvel = self._qpos.tolist(), self._qvel.tolist()
        efforts = self._efforts() if self._motors else []
        met = self._met()
        for number, seat in enumerate(self._seated.bodies):
            placed = seat.placed
            if placed.is_free:
                q, v, at, turned = placed.q, placed.v, seat.position, seat.orientation
                w, x, y, z = qpos[q + 3 : q + 7]
                numbers[at : at + 3], numbers[turned : turned + 4] = qpos[q : q + 3], (x, y, z, w)
                at, spin = seat.velocity, seat.spin
                a, b, c = qvel[v + 3 : v + 6]
                numbers[at : at + 3], numbers[spin : spin + 3] = qvel[v : v + 3], rotate((x, y, z, w), (a, b, c))
            if placed.qs:
                count, at = len(placed.qs), seat.joint_positions
                speed, effort = seat.joint_velocities, seat.joint_efforts
                numbers[at : at + count] = [qpos[i] for i in placed.qs]
                numbers[speed : speed + count] = [qvel[i] for i in placed.vs]
                numbers[effort : effort + count] = efforts[placed.motor : placed.motor + count]
            self._write_log(seat, met.get(number, ()), numbers)

    def _efforts(self) -> list[float]:
        """Return the force of each motor in the last substep (N or N m)."""
        m, d = self.m, self.d
        rows = slice(d.ne, d.ne + d.nf)
        found: list[float] = d.efc_force[rows].tolist()
        if len(found) < m.ntendon:  # there is no row for a motor without a force
            forces = dict(zip(d.efc_id[rows].tolist(), found, strict=True))
            found = [forces.get(number, 0.0) for number in range(m.ntendon)]
        for placed, number, _, _ in self._governed:
            found[placed.motor + number] = float(self._applied[placed.vs[number]])
        return found

    def _met(self) -> dict[int, list[tuple[int, _Touch]]]:
        """Return the contacts of each body in the tick, by its place: the partner's place, and the contact."""
        found: dict[int, list[tuple[int, _Touch]]] = {}
        for (one, other), touch in self._touches.items():
            if one != SILENT:
                found.setdefault(one, []).append((other, touch))
                found.setdefault(other, []).append((one, touch))
        return found

    def _write_log(self, seat: _Seat, met: Sequence[tuple[int, _Touch]], numbers: list[float]) -> None:
        """Write the contact log of a body: count of touches that began, impulse (N s), last substep with a contact."""
        at, dt, force, substeps = seat.contacts, self._dt, 0.0, 0
        if met:
            for _, touch in met:
                force += touch.force
                substeps |= touch.substeps
            began = substeps & ~(substeps << 1 | (numbers[at + 2] == self._substeps - 1.0))
            numbers[at : at + 3] = float(began.bit_count()), force * dt, substeps.bit_length() - 1.0
        else:
            numbers[at : at + 3] = NO_CONTACT
        if seat.partners < 0:
            return
        seats, at, to = self._seated.seats, seat.partners, seat.partner_impulses
        found = [(seats[one].index, touch.force * dt) for one, touch in met if one != SCENERY]
        if len(found) > PARTNERS_MAX:
            found = sorted(found, key=lambda its: (-its[1], its[0]))[:PARTNERS_MAX]
        found.sort()
        missing = PARTNERS_MAX - len(found)
        numbers[at : at + PARTNERS_MAX] = [index for index, _ in found] + [NO_ENTITY] * missing
        numbers[to : to + PARTNERS_MAX] = [impulse for _, impulse in found] + [0.0] * missing

    def close(self) -> None:
        """Nothing but memory is held."""

"""The Bullet engine: rules under which each tick starts from the frame completely, independent of the engine's past.

Bullet keeps more than positions and velocities: contact points of pairs, search axes, orders of pairs and islands. The
rules below each undo one of these memories; tests/laws/test_engine_partition.py breaks each in turn and sees law 1
fail, for which the small methods (`_settings`, `_build_order`, `_make_free`, `_make_scenery`, `_end_pairs`) are there.
It is for bodies whose joints do not couple: all that a node solves in a tick share one solve of Bullet. Neighbour:
`bullet_islands`, for all others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import fsum, isfinite
from struct import Struct
from typing import Any, Final

from foosim.deployment.schema import Deployment
from foosim.node.physics.bullet_client import (
    JOINT_TYPES,
    MESH_PIECE,
    REST,
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
from foosim.node.physics.joint_forces import MotorForces, Stops, ends_of, may_stop, without_sloping
from foosim.node.physics.touch_log import TouchLog
from foosim.world.assembly.sections import physics_of
from foosim.world.assembly.world import build_scene
from foosim.world.components.drives import Motor, share_of
from foosim.world.layout import Entity, Layout
from foosim.world.scene import UPRIGHT, Body, Shape, Vector, in_pieces, load_of, swept_box

# Pairs that can touch: free bodies with everything, nothing else. Jointed bodies may pass through the scenery, and
# without a filter a step costs five times as much.
FREE_GROUP: Final = 1
JOINTED_GROUP: Final = 2
SCENERY_GROUP: Final = 4

PARKING_Z_M: Final = 100.0
PARKING_STEP_M: Final = 10.0
"""Parked bodies stand this far apart, far above the scenery: no pair of theirs can touch."""
FREE_FIELDS: Final = ("position", "orientation", "linear_velocity", "angular_velocity")
NO_CONTACT: Final = (0.0, 0.0, -1.0)
NO_TOUCHES: Final = TouchLog()
BREAKING_THRESHOLD: Final = 0.02
"""The way that a sphere may roll in a substep, as a share of its radius: more than the way after which it has lifted
its last point of contact by as much as it falls, sqrt(2 g r) substeps."""
_of_two_joints: Final = Struct("<4d").pack


@dataclass(frozen=True, slots=True)
class Chain:
    """A jointed body: its id in Bullet, its joints, as many zeros, and the places of its numbers in the frame.

    Of each joint `places` are its index and those of position, velocity and effort; `log` is that of the contacts.
    `loads` are those of the motors of its joints, `ends` the limits of these, `stops` the limited joints, each
    with its limits and the places of its position and velocity. `low` and `high` are the ends of the box around the
    reach of its shapes, `axis` is that of its first joint, which may be one that `slides`.
    """

    body: int
    joints: tuple[int, ...]
    zeros: tuple[float, ...]
    places: tuple[tuple[int, int, int, int], ...]
    log: int
    loads: tuple[float, ...]
    ends: tuple[tuple[float, float], ...]
    stops: tuple[tuple[int, tuple[float, float], int, int], ...]
    low: Vector
    high: Vector
    axis: Vector
    slides: bool


def _chain(made: int, body: Body, entity: Entity) -> Chain:
    """Return the description of a built jointed body."""
    count = len(body.links)
    assert entity.counts["joint_positions"] == count, f"{body.name} has {count} joints"
    at, speed, effort = (entity.offsets[field] for field in ("joint_positions", "joint_velocities", "joint_efforts"))
    joints = tuple(range(count))
    ends = tuple(ends_of(body))
    return Chain(
        made,
        joints,
        (0.0,) * count,
        tuple((joint, at + joint, speed + joint, effort + joint) for joint in joints),
        entity.offsets["contacts"],
        tuple(load_of(body, joint) for joint in joints),
        ends,
        tuple((joint, ends[joint], at + joint, speed + joint) for joint in joints if isfinite(sum(ends[joint]))),
        *swept_box(body),
        body.links[0].axis,
        body.links[0].joint == "prismatic",
    )


def _reach(body: Body, tick_s: float) -> float:
    """Return the reach of a free body from its position within a tick (m)."""
    low, high = swept_box(body)
    return max(*(abs(value) for value in (*low, *high))) + body.speed_limit * tick_s


class BulletEngine:
    """The bodies of one layout in a physics client of their own."""

    def __init__(self, deployment: Deployment, layout: Layout) -> None:
        """Build scenery and bodies, all parked. Takes about 20 ms for ten bodies, holding the interpreter."""
        self._physics = physics_of(deployment)
        self._substeps = deployment.substeps
        self._dt = deployment.tick_ns / 1e9 / deployment.substeps
        self._client: int = start_client(self._settings(), self._physics.gravity)
        scene = build_scene(deployment, layout)
        self._silent: set[int] = set()
        felt = [shape for shape in scene.scenery if shape.surface in self._physics.surfaces]
        for shape in in_pieces(felt, MESH_PIECE):
            made = self._make_scenery(shape)
            if self._physics.surfaces[shape.surface].silent:
                self._silent.add(made)
        bodies = {entity.name: scene.bodies[entity.name] for entity in layout.entities if entity.is_rigid}
        self._free: dict[str, int] = {}
        self._chains: dict[str, Chain] = {}
        for name in self._build_order(list(bodies)):
            if bodies[name].is_free:
                self._free[name] = self._make_free(bodies[name])
            else:
                self._chains[name] = _chain(self._make_jointed(bodies[name]), bodies[name], layout[name])
        self._tick_s = deployment.tick_ns / 1e9
        self._comers = [(layout[name].offsets["position"], _reach(bodies[name], self._tick_s)) for name in self._free]
        """Of free bodies: the place of their position in the frame, and their reach from it within a tick (m)."""
        self._free, self._chains = dict(sorted(self._free.items())), dict(sorted(self._chains.items()))
        self._bases = {name: body.position for name, body in bodies.items()}
        self._jointed_of_id = {chain.body: name for name, chain in self._chains.items()}
        spots = enumerate(sorted(bodies))
        self._parking = {name: (0.0, 0.0, PARKING_Z_M + PARKING_STEP_M * index) for index, name in spots}
        self._begin(layout)
        for name in self._chains:
            self._park_jointed(name)
        self._wipe()

    def _begin(self, layout: Layout) -> None:
        """Clear the results of a tick."""
        self._loaded_jointed: set[str] = set()
        self._loaded_free: list[str] = []
        self._idle: set[str] = set()
        self._slack: dict[str, list[int]] = {}
        """Jointed bodies with motors without force: the places of these motors' efforts."""
        self._state: Sequence[float] = ()
        """The frame's numbers, as they were loaded."""
        self._governed: dict[str, MotorForces] = {}
        """Jointed bodies with motors whose forces are set at each substep."""
        self._stops: dict[str, Stops] = {}
        """Bodies whose joints may reach an end within the tick."""
        self._detailed = {name: layout[name] for name in self._chains if "touches" in layout[name].offsets}
        """Jointed bodies that log the partners of their links' contacts."""
        self._indices = {name: layout[name].index for name in self._free}
        self._details: dict[str, TouchLog] = {}
        """The logs of bodies that were touched in the tick."""
        self._logs: dict[str, tuple[float, float, float]] = {}
        self._touching: set[str] = set()
        self._last_commands: dict[str, bytes] = {}
        """The last commands of the motors of each body with two joints, to the bit: they hold until the next ones."""

    # --- building ----------------------------------------------------------------------------------------------------

    def _settings(self) -> dict[str, Any]:
        """Return the parameters of the world.

        A sphere that rolls has its contact point in another place of its surface at each substep. Within this threshold
        times its radius Bullet takes it for the earlier point; else that one stays, as a further one, until it is
        lifted, and its braking in the first iterations is not taken back: a sphere of 35 mm at 0.2 m/s would brake by
        23 % more than by its rolling friction. Contacts ahead of the touch are not processed at all.
        """
        return {**settings_of(self._physics, self._dt), "contactBreakingThreshold": BREAKING_THRESHOLD}

    def _build_order(self, names: list[str]) -> list[str]:
        """Return the order in which bodies are made: by name, since it sorts pairs and islands."""
        return sorted(names)

    def _make_scenery(self, shape: Shape, rigid: bool = True) -> int:
        side = self._physics.sides[shape.surface]
        return make_scenery(self._client, shape, (SCENERY_GROUP, FREE_GROUP), side, rigid=rigid)

    def _make_free(self, body: Body, rigid: bool = False) -> int:
        """Make a free body as a multibody: a rigid body's world inertia tensor is not reloaded with its pose."""
        (link,) = body.links
        made: int = p.createMultiBody(
            baseMass=link.mass,
            baseCollisionShapeIndex=make_shape(self._client, link.shapes, placed=False),
            useMaximalCoordinates=rigid,
            physicsClientId=self._client,
        )
        p.setCollisionFilterGroupMask(
            made, -1, FREE_GROUP, FREE_GROUP | JOINTED_GROUP | SCENERY_GROUP, physicsClientId=self._client
        )
        make_dynamics(self._client, made, -1, link.mass, link.inertia)
        self._make_surface(made, -1, link.shapes[0].surface)
        p.changeDynamics(made, -1, activationState=p.ACTIVATION_STATE_DISABLE_SLEEPING, physicsClientId=self._client)
        return made

    def _make_jointed(self, body: Body) -> int:
        """Make a jointed body as a multibody on a fixed base, with limits on the link that slides."""
        links = body.links
        count = len(links)
        made: int = p.createMultiBody(
            baseMass=0.0,
            basePosition=body.position,
            linkMasses=[link.mass for link in links],
            linkCollisionShapeIndices=[make_shape(self._client, link.shapes, placed=True) for link in links],
            linkVisualShapeIndices=[-1] * count,
            linkPositions=[REST] * count,
            linkOrientations=[UPRIGHT] * count,
            linkInertialFramePositions=[link.centre_of_mass for link in links],
            linkInertialFrameOrientations=[UPRIGHT] * count,
            linkParentIndices=list(range(count)),
            linkJointTypes=[JOINT_TYPES[link.joint] for link in links],
            linkJointAxis=[link.axis for link in links],
            useMaximalCoordinates=False,
            physicsClientId=self._client,
        )
        assert bullet_indices(self._client, made, count) == tuple(range(count)), f"{body.name} is a chain"
        for index, link in enumerate(links):
            p.setCollisionFilterGroupMask(made, index, JOINTED_GROUP, FREE_GROUP, physicsClientId=self._client)
            make_dynamics(self._client, made, index, link.mass, link.inertia)
            if link.shapes:
                self._make_surface(made, index, link.shapes[0].surface)
            if link.joint == "prismatic":
                p.changeDynamics(
                    made,
                    index,
                    jointLowerLimit=link.limits[0],
                    jointUpperLimit=link.limits[1],
                    physicsClientId=self._client,
                )
        return made

    def _make_surface(self, body: int, link: int, surface: str) -> None:
        make_surface(self._client, body, link, self._physics.sides[surface])

    # --- parking -----------------------------------------------------------------------------------------------------

    def _park_jointed(self, name: str) -> None:
        """Take a jointed body out of the way, at rest, and let it sleep: awake, it costs 2 us a substep."""
        chain, client = self._chains[name], self._client
        p.resetBasePositionAndOrientation(chain.body, self._parking[name], UPRIGHT, physicsClientId=client)
        for joint in chain.joints:
            p.resetJointState(chain.body, joint, 0.0, 0.0, physicsClientId=client)
        self._motors_off(name)
        p.changeDynamics(
            chain.body,
            -1,
            activationState=p.ACTIVATION_STATE_ENABLE_SLEEPING | p.ACTIVATION_STATE_SLEEP,
            physicsClientId=client,
        )

    def _fetch_jointed(self, name: str) -> None:
        """Put a parked body's base back to its place and wake it."""
        body, client = self._chains[name].body, self._client
        p.resetBasePositionAndOrientation(body, self._bases[name], UPRIGHT, physicsClientId=client)
        p.changeDynamics(
            body,
            -1,
            activationState=p.ACTIVATION_STATE_DISABLE_SLEEPING | p.ACTIVATION_STATE_WAKE_UP,
            physicsClientId=client,
        )

    def _motors_off(self, name: str) -> None:
        chain = self._chains[name]
        self._last_commands.pop(name, None)
        p.setJointMotorControlArray(
            chain.body,
            chain.joints,
            p.VELOCITY_CONTROL,
            targetVelocities=chain.zeros,
            forces=chain.zeros,
            physicsClientId=self._client,
        )

    def _wipe(self) -> None:
        """Clear all contacts: every pair that can touch has a free body, and a free body far away ends its pairs."""
        for name, body in self._free.items():
            p.resetBasePositionAndOrientation(body, self._parking[name], UPRIGHT, self._client)
        self._end_pairs()

    def _end_pairs(self) -> None:
        """Let Bullet remove ended pairs."""
        p.performCollisionDetection(physicsClientId=self._client)

    def _wake_fetched(self) -> None:
        """Step once: Bullet wakes a body at the end of a step, and does not move it before."""
        p.stepSimulation(physicsClientId=self._client)

    def _change_jointed(self, wanted: set[str]) -> None:
        """Park and fetch jointed bodies until `wanted` are at their places. All free bodies are parked."""
        for name in sorted(self._loaded_jointed - wanted):
            self._park_jointed(name)
        fetched = sorted(wanted - self._loaded_jointed)
        for name in fetched:
            self._fetch_jointed(name)
        if fetched:
            self._wake_fetched()
        self._loaded_jointed = wanted

    # --- the tick ----------------------------------------------------------------------------------------------------

    def load(self, entities: Sequence[Entity], state: Sequence[float]) -> None:
        """Wipe the engine's memory and set these bodies to their state; park all others."""
        client, reset = self._client, p.resetJointState
        self._wipe()
        chains, free = self._chains, self._free
        jointed = {entity.name for entity in entities if entity.name in chains}
        if jointed != self._loaded_jointed:
            self._change_jointed(jointed)
        self._idle = jointed.copy()
        self._slack = {}
        self._governed, self._stops, self._details = {}, {}, {}
        self._state = state
        self._loaded_free = []
        last = self._substeps - 1.0
        self._logs = {}
        self._touching = set()
        for entity in entities:
            name = entity.name
            chain = chains.get(name)
            if chain is not None:
                body = chain.body
                for joint, at, speed, _ in chain.places:
                    reset(body, joint, state[at], state[speed], client)
                for _, ends, at, speed in chain.stops:
                    if may_stop(ends, state[at], state[speed], self._tick_s):
                        limited = [(joint, *its) for joint, its, _, _ in chain.stops]
                        self._stops[name] = Stops(client, body, limited)
                log = chain.log
            elif name in free:
                self._load_free(entity, state)
                log = entity.offsets["contacts"]
            else:
                continue
            if state[log + 2] == last:
                self._touching.add(name)
        if len(self._loaded_free) < len(free):
            for name, body in free.items():
                if name not in self._loaded_free:  # it would fall faster and faster
                    p.resetBaseVelocity(body, REST, REST, client)

    def _load_free(self, entity: Entity, state: Sequence[float]) -> None:
        body, offsets = self._free[entity.name], entity.offsets
        at, turned = offsets["position"], offsets["orientation"]
        velocity, spin = offsets["linear_velocity"], offsets["angular_velocity"]
        p.resetBasePositionAndOrientation(body, state[at : at + 3], state[turned : turned + 4], self._client)
        p.resetBaseVelocity(body, state[velocity : velocity + 3], state[spin : spin + 3], self._client)
        self._loaded_free.append(entity.name)

    def command(self, entities: Sequence[Entity], commands: Sequence[Sequence[tuple[float, ...]]]) -> None:
        """Set the motors of these robots: for each joint the numbers of a `drives.Motor`.

        Bullet sorts motors by island, unstably. That reorders nothing where the joints of a body do not couple.
        """
        client, mode, drive, chains = self._client, p.VELOCITY_CONTROL, p.setJointMotorControlArray, self._chains
        for entity, motors in zip(entities, commands, strict=True):
            name = entity.name
            chain = chains.get(name)
            if chain is not None:
                if len(motors) == len(motors[0]) == len(motors[1]) == 2:  # takes a third of what zip does
                    (one, force), (other, torque) = motors
                    speeds, forces = (one, other), (force, torque)
                    packed = _of_two_joints(one, other, force, torque)
                elif any(len(motor) > 2 for motor in motors):
                    self._govern(name, chain, [Motor(*motor) for motor in motors])
                    continue
                else:
                    speeds, forces = zip(*motors, strict=True)
                    packed = b""
                if not packed or self._last_commands.get(name) != packed:
                    drive(
                        chain.body, chain.joints, mode, targetVelocities=speeds, forces=forces, physicsClientId=client
                    )
                    self._last_commands[name] = packed
                if 0.0 in forces:
                    self._slack[name] = [place for joint, _, _, place in chain.places if forces[joint] == 0.0]
        self._idle.difference_update([entity.name for entity in entities])

    def _govern(self, name: str, chain: Chain, motors: Sequence[Motor]) -> None:
        """Set motors whose forces fall with the speed.

        Whether a free body can touch this one within the tick, or a joint reach its end, follows from the frame alone,
        independent of other loaded bodies.
        """
        self._last_commands.pop(name, None)
        forces: Sequence[float] = [motor.force for motor in motors]
        gains = [share_of(motor.slope, load, self._dt) for motor, load in zip(motors, chain.loads, strict=True)]
        if name in self._stops or self._may_be_touched(chain):
            self._governed[name] = MotorForces(
                self._client, chain.body, chain.joints, motors, chain.loads, chain.ends, self._dt
            )
            forces, gains = without_sloping(motors), [1.0] * len(motors)
        p.setJointMotorControlArray(
            chain.body,
            chain.joints,
            p.VELOCITY_CONTROL,
            targetVelocities=[motor.speed for motor in motors],
            forces=forces,
            velocityGains=gains,
            physicsClientId=self._client,
        )
        if 0.0 in forces:
            self._slack[name] = [place for joint, _, _, place in chain.places if forces[joint] == 0.0]

    def _may_be_touched(self, chain: Chain) -> bool:
        """Whether a free body can come to a jointed one within the tick."""
        for at, reach in self._comers:
            place = self._state[at : at + 3]
            if all(
                low - reach <= value <= high + reach
                for low, value, high in zip(chain.low, place, chain.high, strict=True)
            ):
                return True
        return False

    def step(self, substeps: int) -> None:
        """Advance the loaded bodies by `substeps` substeps and log their contacts."""
        assert substeps == self._substeps, (substeps, self._substeps)
        for name in sorted(self._idle):  # else it would follow a command of an earlier tick
            self._motors_off(name)
            self._slack[name] = [place for _, _, _, place in self._chains[name].places]
        client = self._client
        governed, stops = list(self._governed.values()), list(self._stops.values())
        for substep in range(substeps):
            for motors in governed:
                motors.apply()
            p.stepSimulation(client)
            for ends in stops:
                ends.apply()
            touched: dict[str, list[float]] = {}
            for name in self._loaded_free:
                self._collect(name, touched, substep)
            if touched:
                self._log(substep, touched)
            self._touching = set(touched)

    def _collect(self, name: str, touched: dict[str, list[float]], substep: int) -> None:
        """Add the normal impulses of a free body's contacts to it and to the jointed bodies that it touches."""
        body = self._free[name]
        for point in p.getContactPoints(body, physicsClientId=self._client):
            other = point[2] if point[1] == body else point[1]
            force = point[9]
            if other in self._silent or force <= 0.0:
                continue
            impulse = force * self._dt
            touched.setdefault(name, []).append(impulse)
            jointed = self._jointed_of_id.get(other)
            if jointed is not None:
                touched.setdefault(jointed, []).append(impulse)
                if jointed in self._detailed:
                    on_free, of_free, on_jointed, of_jointed = point[5], point[3], point[6], point[4]
                    link, place = (of_jointed, on_jointed) if point[1] == body else (of_free, on_free)
                    self._note(jointed, link, place, name, impulse, substep)

    def _note(self, jointed: str, link: int, point: Vector, free: str, impulse: float, substep: int) -> None:
        """Note the link of a jointed body that a free one touches, and the place along the axis of the first joint."""
        chain = self._chains[jointed]
        along = sum([(a - b) * c for a, b, c in zip(point, self._bases[jointed], chain.axis, strict=True)])
        slid = p.getJointState(chain.body, 0, self._client)[0] if chain.slides else 0.0
        log = self._details.get(jointed)
        if log is None:
            log = self._details[jointed] = TouchLog()
        log.add(self._indices[free], link, along - slid, impulse, substep)

    def _log(self, substep: int, touched: dict[str, list[float]]) -> None:
        """Count touches that begin, sum impulses, note the last substep.

        Bullet lists contacts in an order that depends on its past; `fsum` gives the same bits in any order.
        """
        for name, impulses in touched.items():
            count, total, _ = self._logs.get(name, NO_CONTACT)
            self._logs[name] = (count + (name not in self._touching), total + fsum(impulses), float(substep))

    def read(self, entities: Sequence[Entity], state: list[float]) -> None:
        """Write position, velocity and the tick's contact log of these bodies into `state`."""
        client, states, chains, logs, slack = self._client, p.getJointStates, self._chains, self._logs, self._slack
        governed, detailed = self._governed, self._detailed
        for entity in entities:
            name = entity.name
            chain = chains.get(name)
            if chain is not None:
                joints = states(chain.body, chain.joints, client)
                for joint, at, speed, effort in chain.places:
                    state[at], state[speed], _, state[effort] = joints[joint]
                log = chain.log
            elif name in self._free:
                self._read_free(entity, state)
                log = entity.offsets["contacts"]
            else:
                continue
            state[log : log + 3] = logs.get(name, NO_CONTACT)
            if detailed and name in detailed:
                self._details.get(name, NO_TOUCHES).write(entity, state, self._substeps)
            if slack and name in slack:
                for place in slack[name]:  # without a force Bullet keeps the last effort of a motor
                    state[place] = 0.0
            if governed and name in governed:
                for number, force in zip(governed[name].numbers, governed[name].efforts, strict=True):
                    state[chains[name].places[number][3]] = force

    def _read_free(self, entity: Entity, state: list[float]) -> None:
        body, offsets = self._free[entity.name], entity.offsets
        position, orientation = p.getBasePositionAndOrientation(body, self._client)
        velocity, turning = p.getBaseVelocity(body, self._client)
        for field, values in zip(FREE_FIELDS, (position, orientation, velocity, turning), strict=True):
            at = offsets[field]
            state[at : at + len(values)] = values

    def close(self) -> None:
        """Empty the physics client and keep it for the next engine."""
        if self._client >= 0:
            give_client(self._client)
            self._client = -1

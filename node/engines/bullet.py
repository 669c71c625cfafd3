"""The Bullet engine: rules under which each tick starts from the frame completely, whatever this engine did before.

Bullet keeps more than positions and velocities: contact points of pairs, search axes, orders of pairs and islands. The
rules below each undo one of these memories; tests/laws/test_engine_partition.py breaks each in turn and sees law 1
fail, for which the small methods (`_settings`, `_build_order`, `_make_ball`, `_make_scenery`, `_end_pairs`) are there.
This is the only file that imports pybullet.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from math import fsum, sqrt
from typing import Any, Final

from foosim.deployment.schema import Deployment
from foosim.node.engines.quiet import without_lines
from foosim.world.layout import Entity, Layout
from foosim.world.mesh import Mesh
from foosim.world.scene import UPRIGHT, Body, Box, Cylinder, Shape, Sphere, Vector, in_pieces
from foosim.world.scenes.build import build_scene

with without_lines(b"pybullet build time:"):
    import pybullet as p

# Pairs that can touch: balls with everything, nothing else. Rods would rub on the walls that they run through, and
# without a filter a step costs five times as much.
BALL_GROUP: Final = 1
ROD_GROUP: Final = 2
SCENERY_GROUP: Final = 4

SPARES_MAX: Final = 4
MESH_PIECE: Final = 4096
"""Triangles of one static body: Bullet takes 174,762 at most, and one of these is built in a few milliseconds."""
PARKING_Z_M: Final = 100.0
PARKING_STEP_M: Final = 10.0
"""Parked bodies stand this far apart, far above the table: no pair of theirs can touch."""
REST: Final[Vector] = (0.0, 0.0, 0.0)
SLIDE_SPIN: Final = (0, 1)
"""Joint indices of a rod."""
BALL_FIELDS: Final = ("position", "orientation", "linear_velocity", "angular_velocity")
NO_CONTACT: Final = (0.0, 0.0, -1.0)
SPEED_MAX: Final = 1000.0
"""Bullet clamps each coordinate's velocity of a multibody at 100 by default: a ball could not roll above 1.75 m/s."""


_spare_clients: list[int] = []
"""Connected clients without bodies. Emptied, a client is as new; the laws are tested with such ones, too."""


def connect_spares(count: int) -> None:
    """Connect this many spare clients, so that an engine can be built while ticks continue."""
    while len(_spare_clients) < count:
        _spare_clients.append(_connect())


def _connect() -> int:
    client: int = p.connect(p.DIRECT)
    assert client >= 0, "no physics client is left"
    return client


def _take_client() -> int:
    return _spare_clients.pop() if _spare_clients else _connect()


def _give_client(client: int) -> None:
    if len(_spare_clients) < SPARES_MAX:
        p.resetSimulation(physicsClientId=client)
        _spare_clients.append(client)
    else:
        p.disconnect(physicsClientId=client)


class BulletEngine:
    """The bodies of one layout in a physics client of their own."""

    def __init__(self, deployment: Deployment, layout: Layout) -> None:
        """Build scenery and bodies, all parked. Takes about 20 ms for the table, holding the interpreter."""
        for _ in self._build(deployment, layout):
            pass

    @classmethod
    def in_steps(cls, deployment: Deployment, layout: Layout) -> Generator[None, None, BulletEngine]:
        """Build one a body at a time, with ticks of another engine in between; a step takes up to 0.5 ms.

        So long as there is a spare client: connecting one takes 15 ms.
        """
        engine = cls.__new__(cls)
        yield from engine._build(deployment, layout)
        return engine

    def _build(self, deployment: Deployment, layout: Layout) -> Iterator[None]:
        self._table = deployment.table
        self._substeps = deployment.substeps
        self._dt = deployment.tick_ns / 1e9 / deployment.substeps
        self._client: int = _take_client()
        p.setGravity(0.0, 0.0, -deployment.table.gravity, physicsClientId=self._client)
        p.setPhysicsEngineParameter(**self._settings(), physicsClientId=self._client)
        yield
        scene = build_scene(deployment, layout)
        self._scenery_ids: dict[int, str] = {}
        for shape in in_pieces(scene.scenery, MESH_PIECE):
            self._scenery_ids[self._make_scenery(shape)] = shape.surface
            yield
        self._ids: dict[str, int] = {}
        for name in self._build_order(list(scene.bodies)):
            body = scene.bodies[name]
            self._ids[name] = self._make_ball(body) if body.model == "ball" else self._make_rod(body)
            yield
        self._bases = {name: body.position for name, body in scene.bodies.items()}
        self._balls = [entity.name for entity in layout.balls]
        self._rods = [entity.name for entity in layout.rods]
        self._rod_of_id = {self._ids[name]: name for name in self._rods}
        self._silent = frozenset(body for body, surface in self._scenery_ids.items() if surface in ("floor", "ramps"))
        spots = enumerate(sorted(scene.bodies))
        self._parking = {name: (0.0, 0.0, PARKING_Z_M + PARKING_STEP_M * index) for index, name in spots}
        self._loaded_rods: set[str] = set()
        self._loaded_balls: list[str] = []
        self._idle: set[str] = set()
        self._logs: dict[str, tuple[float, float, float]] = {}
        self._touching: set[str] = set()
        for name in self._rods:
            self._park_rod(name)
        self._wipe()

    # --- building ----------------------------------------------------------------------------------------------------

    def _settings(self) -> dict[str, Any]:
        """Return the parameters of the world (facts, sections 4 and 6)."""
        return {
            "fixedTimeStep": self._dt,
            "numSubSteps": 0,  # more would multiply the force limits of the motors
            "numSolverIterations": self._table.solver_iterations,
            "deterministicOverlappingPairs": 1,  # pairs are solved in an order of names, not of memory
            "minimumSolverIslandSize": 0,  # else small islands share one solver call, and stop on its common residual
            "solverResidualThreshold": 0,  # else iteration stops on what the other islands of the call are doing
            "contactERP": self._table.contact_erp,  # 0.08 by default: restitution would be e + (0 to 0.08)
            "contactBreakingThreshold": 0.001,  # 20 mm by default: points of contacts that are no more
            "restitutionVelocityThreshold": 0.05,  # slower contacts do not bounce: a ball comes to rest
            "warmStartingFactor": 0,  # starts from the impulses of the last step, which are not in the frame
            "contactSlop": 0,  # a tolerated penetration shifts where a contact begins
            "collisionFilterMode": 0,  # a pair needs both masks
        }

    def _build_order(self, names: list[str]) -> list[str]:
        """Return the order in which bodies are made: by name, since it sorts pairs and islands."""
        return sorted(names)

    def _make_scenery(self, shape: Shape, rigid: bool = True) -> int:
        """Make a rigid static: a tilted static *multibody* has its quaternion renormalised at every step."""
        body: int = p.createMultiBody(
            baseMass=0.0,
            baseCollisionShapeIndex=self._make_scenery_shape(shape),
            basePosition=shape.position,
            baseOrientation=shape.orientation,
            useMaximalCoordinates=rigid,
            physicsClientId=self._client,
        )
        p.setCollisionFilterGroupMask(body, -1, SCENERY_GROUP, BALL_GROUP, physicsClientId=self._client)
        self._make_surface(body, -1, shape.surface)
        return body

    def _make_ball(self, body: Body, rigid: bool = False) -> int:
        """Make a ball as a multibody: a rigid body's world inertia tensor is not reloaded with its pose."""
        link = body.links[0]
        ball: int = p.createMultiBody(
            baseMass=link.mass,
            baseCollisionShapeIndex=self._make_shape(link.shapes, placed=False),
            useMaximalCoordinates=rigid,
            physicsClientId=self._client,
        )
        p.setCollisionFilterGroupMask(
            ball, -1, BALL_GROUP, BALL_GROUP | ROD_GROUP | SCENERY_GROUP, physicsClientId=self._client
        )
        self._make_dynamics(ball, -1, link.mass, link.inertia)
        self._make_surface(ball, -1, "ball")
        p.changeDynamics(ball, -1, activationState=p.ACTIVATION_STATE_DISABLE_SLEEPING, physicsClientId=self._client)
        return ball

    def _make_rod(self, body: Body) -> int:
        """Make a rod as a multibody on a fixed base, with limits on its slide."""
        links = body.links
        count = len(links)
        rod: int = p.createMultiBody(
            baseMass=0.0,
            basePosition=body.position,
            linkMasses=[link.mass for link in links],
            linkCollisionShapeIndices=[self._make_shape(link.shapes, placed=True) for link in links],
            linkVisualShapeIndices=[-1] * count,
            linkPositions=[REST] * count,
            linkOrientations=[UPRIGHT] * count,
            linkInertialFramePositions=[link.centre_of_mass for link in links],
            linkInertialFrameOrientations=[UPRIGHT] * count,
            linkParentIndices=list(range(count)),
            linkJointTypes=[p.JOINT_PRISMATIC if link.joint == "prismatic" else p.JOINT_REVOLUTE for link in links],
            linkJointAxis=[link.axis for link in links],
            useMaximalCoordinates=False,
            physicsClientId=self._client,
        )
        for index, link in enumerate(links):
            p.setCollisionFilterGroupMask(rod, index, ROD_GROUP, BALL_GROUP, physicsClientId=self._client)
            self._make_dynamics(rod, index, link.mass, link.inertia)
            self._make_surface(rod, index, link.shapes[0].surface)
            if link.joint == "prismatic":
                p.changeDynamics(
                    rod,
                    index,
                    jointLowerLimit=link.limits[0],
                    jointUpperLimit=link.limits[1],
                    physicsClientId=self._client,
                )
        return rod

    def _make_scenery_shape(self, shape: Shape) -> int:
        """Make a collision shape; a mesh's triangles are handed over as numbers, never as the name of a file."""
        mesh = shape.geometry
        if not isinstance(mesh, Mesh):
            return self._make_shape((shape,), placed=False)
        made: int = p.createCollisionShape(
            p.GEOM_MESH,
            vertices=mesh.vertices.tolist(),
            indices=mesh.triangles.ravel().tolist(),
            physicsClientId=self._client,
        )
        assert made >= 0, shape
        return made

    def _make_shape(self, shapes: Sequence[Shape], placed: bool) -> int:
        """Make one collision shape, compound if there are several; `placed`: at the shapes' own poses."""
        parts: dict[str, list[Any]] = {
            key: [] for key in ("shapeTypes", "halfExtents", "radii", "lengths", "positions", "orientations")
        }
        for shape in shapes:
            geometry = shape.geometry
            assert not isinstance(geometry, Mesh), "meshes are scenery"
            kind = {Box: p.GEOM_BOX, Sphere: p.GEOM_SPHERE, Cylinder: p.GEOM_CYLINDER}[type(geometry)]
            parts["shapeTypes"].append(kind)
            parts["halfExtents"].append(geometry.half if isinstance(geometry, Box) else REST)
            parts["radii"].append(0.0 if isinstance(geometry, Box) else geometry.radius)
            parts["lengths"].append(geometry.length if isinstance(geometry, Cylinder) else 0.0)
            parts["positions"].append(shape.position if placed else REST)
            parts["orientations"].append(shape.orientation if placed else UPRIGHT)
        made: int = p.createCollisionShapeArray(
            shapeTypes=parts["shapeTypes"],
            halfExtents=parts["halfExtents"],
            radii=parts["radii"],
            lengths=parts["lengths"],
            collisionFramePositions=parts["positions"],
            collisionFrameOrientations=parts["orientations"],
            physicsClientId=self._client,
        )
        assert made >= 0, shapes
        return made

    def _make_dynamics(self, body: int, link: int, mass: float, inertia: Vector) -> None:
        """Set mass, inertia and damping of a body, and check that Bullet has accepted them."""
        client = self._client
        # Bullet's own inertia is that of the shapes' bounding box. It must be set together with the mass (alone, it
        # makes the mass 0) and without anything else (together with a damping it is dropped silently).
        p.changeDynamics(body, link, mass=mass, localInertiaDiagonal=inertia, physicsClientId=client)
        # Damping is 0.04 by default, which stops a rolling multibody within seconds.
        for value in ({"linearDamping": 0.0}, {"angularDamping": 0.0}, {"jointDamping": 0.0}):
            p.changeDynamics(body, link, **value, physicsClientId=client)
        p.changeDynamics(body, link, maxJointVelocity=SPEED_MAX, physicsClientId=client)
        info = p.getDynamicsInfo(body, link, physicsClientId=client)
        assert (info[0], info[2]) == (mass, inertia), (info, mass, inertia)

    def _make_surface(self, body: int, link: int, surface: str) -> None:
        """Set what makes the values of a pair: products of both sides' restitution and friction.

        A ball has the roots of the values of two balls, everything else what makes the product with a ball its pair
        value; rolling friction is (each side's own times the other's friction), and a ball's own is 0.
        """
        surfaces = self._table.surfaces
        bounce, grip = sqrt(surfaces.balls.restitution), sqrt(surfaces.balls.friction)
        if surface == "ball":
            values = (bounce, grip, 0.0)
        else:
            pair = getattr(surfaces, surface)
            values = (pair.restitution / bounce, pair.friction / grip, pair.rolling_friction / grip)
        p.changeDynamics(
            body,
            link,
            restitution=values[0],
            lateralFriction=values[1],
            rollingFriction=values[2],
            spinningFriction=0.0,
            contactProcessingThreshold=0.0,  # contacts ahead of the touch spoil restitution at low speed
            physicsClientId=self._client,
        )

    # --- parking -----------------------------------------------------------------------------------------------------

    def _park_rod(self, name: str) -> None:
        """Take a rod away from the table, at rest, and let it sleep: awake, it costs 2 us a substep."""
        body, client = self._ids[name], self._client
        p.resetBasePositionAndOrientation(body, self._parking[name], UPRIGHT, physicsClientId=client)
        for joint in SLIDE_SPIN:
            p.resetJointState(body, joint, 0.0, 0.0, physicsClientId=client)
        self._motors_off(name)
        p.changeDynamics(
            body,
            -1,
            activationState=p.ACTIVATION_STATE_ENABLE_SLEEPING | p.ACTIVATION_STATE_SLEEP,
            physicsClientId=client,
        )

    def _fetch_rod(self, name: str) -> None:
        """Put a parked rod's base back to its place and wake it."""
        body, client = self._ids[name], self._client
        p.resetBasePositionAndOrientation(body, self._bases[name], UPRIGHT, physicsClientId=client)
        p.changeDynamics(
            body,
            -1,
            activationState=p.ACTIVATION_STATE_DISABLE_SLEEPING | p.ACTIVATION_STATE_WAKE_UP,
            physicsClientId=client,
        )

    def _motors_off(self, name: str) -> None:
        p.setJointMotorControlArray(
            self._ids[name],
            SLIDE_SPIN,
            p.VELOCITY_CONTROL,
            targetVelocities=(0.0, 0.0),
            forces=(0.0, 0.0),
            physicsClientId=self._client,
        )

    def _wipe(self) -> None:
        """Forget all contacts: of every pair that can touch one is a ball, and balls far away end their pairs."""
        for name in self._balls:
            p.resetBasePositionAndOrientation(self._ids[name], self._parking[name], UPRIGHT, self._client)
        self._end_pairs()

    def _end_pairs(self) -> None:
        """Let Bullet notice which pairs are no more."""
        p.performCollisionDetection(physicsClientId=self._client)

    def _wake_fetched(self) -> None:
        """Step once: Bullet wakes a body at the end of a step, and does not move it before."""
        p.stepSimulation(physicsClientId=self._client)

    def _change_rods(self, wanted: set[str]) -> None:
        """Park and fetch rods until `wanted` are on the table. All balls are parked."""
        for name in sorted(self._loaded_rods - wanted):
            self._park_rod(name)
        fetched = sorted(wanted - self._loaded_rods)
        for name in fetched:
            self._fetch_rod(name)
        if fetched:
            self._wake_fetched()
        self._loaded_rods = wanted

    # --- the tick ----------------------------------------------------------------------------------------------------

    def load(self, entities: Sequence[Entity], state: Sequence[float]) -> None:
        """Wipe what the engine remembers and set these bodies to their state; park all others."""
        client, reset = self._client, p.resetJointState
        self._wipe()
        rods = {entity.name for entity in entities if entity.model == "rod"}
        if rods != self._loaded_rods:
            self._change_rods(rods)
        self._idle = rods.copy()
        self._loaded_balls = []
        last = self._substeps - 1.0
        self._logs = {}
        self._touching = set()
        for entity in entities:
            body, offsets = self._ids[entity.name], entity.offsets
            if entity.model == "rod":
                at, speed = offsets["joint_positions"], offsets["joint_velocities"]
                reset(body, 0, state[at], state[speed], client)
                reset(body, 1, state[at + 1], state[speed + 1], client)
            elif entity.model == "ball":
                self._load_ball(entity, state)
            if state[offsets["contacts"] + 2] == last:
                self._touching.add(entity.name)
        if len(self._loaded_balls) < len(self._balls):
            for name in self._balls:
                if name not in self._loaded_balls:  # it would fall faster and faster
                    p.resetBaseVelocity(self._ids[name], REST, REST, client)

    def _load_ball(self, entity: Entity, state: Sequence[float]) -> None:
        body, offsets = self._ids[entity.name], entity.offsets
        at, turned = offsets["position"], offsets["orientation"]
        velocity, spin = offsets["linear_velocity"], offsets["angular_velocity"]
        p.resetBasePositionAndOrientation(body, state[at : at + 3], state[turned : turned + 4], self._client)
        p.resetBaseVelocity(body, state[velocity : velocity + 3], state[spin : spin + 3], self._client)
        self._loaded_balls.append(entity.name)

    def command(self, entities: Sequence[Entity], commands: Sequence[Sequence[tuple[float, float]]]) -> None:
        """Set the motors of these robots: for each joint the target speed and the greatest force (SI units).

        The two axes do not couple, so Bullet's unstable sorting of motors by island cannot reorder anything.
        """
        client, mode, drive = self._client, p.VELOCITY_CONTROL, p.setJointMotorControlArray
        for entity, ((slide, force), (spin, torque)) in zip(entities, commands, strict=True):
            drive(
                self._ids[entity.name],
                SLIDE_SPIN,
                mode,
                targetVelocities=(slide, spin),
                forces=(force, torque),
                physicsClientId=client,
            )
            self._idle.discard(entity.name)

    def step(self, substeps: int) -> None:
        """Advance the loaded bodies by `substeps` substeps and log their contacts."""
        assert substeps == self._substeps, (substeps, self._substeps)
        for name in sorted(self._idle):  # else it would follow a command of an earlier tick
            self._motors_off(name)
        client = self._client
        for substep in range(substeps):
            p.stepSimulation(client)
            touched: dict[str, list[float]] = {}
            for name in self._loaded_balls:
                self._collect(name, touched)
            if touched:
                self._log(substep, touched)
            self._touching = set(touched)

    def _collect(self, ball: str, touched: dict[str, list[float]]) -> None:
        """Add the normal impulses of a ball's contacts to the ball and to the rods that it touches."""
        body = self._ids[ball]
        for point in p.getContactPoints(body, physicsClientId=self._client):
            other = point[2] if point[1] == body else point[1]
            force = point[9]
            if other in self._silent or force <= 0.0:
                continue
            impulse = force * self._dt
            touched.setdefault(ball, []).append(impulse)
            rod = self._rod_of_id.get(other)
            if rod is not None:
                touched.setdefault(rod, []).append(impulse)

    def _log(self, substep: int, touched: dict[str, list[float]]) -> None:
        """Count touches that begin, sum impulses, note the last substep.

        Bullet lists contacts in an order that depends on its past; `fsum` gives the same bits in any order.
        """
        for name, impulses in touched.items():
            count, total, _ = self._logs.get(name, NO_CONTACT)
            self._logs[name] = (count + (name not in self._touching), total + fsum(impulses), float(substep))

    def read(self, entities: Sequence[Entity], state: list[float]) -> None:
        """Write position, velocity and the tick's contact log of these bodies into `state`."""
        client, joints = self._client, p.getJointStates
        for entity in entities:
            body, offsets = self._ids[entity.name], entity.offsets
            if entity.model == "rod":
                slide, spin = joints(body, SLIDE_SPIN, client)
                at, speed = offsets["joint_positions"], offsets["joint_velocities"]
                state[at], state[speed] = slide[0], slide[1]
                state[at + 1], state[speed + 1] = spin[0], spin[1]
            else:
                position, orientation = p.getBasePositionAndOrientation(body, client)
                velocity, turning = p.getBaseVelocity(body, client)
                for field, values in zip(BALL_FIELDS, (position, orientation, velocity, turning), strict=True):
                    at = offsets[field]
                    state[at : at + len(values)] = values
            at = offsets["contacts"]
            state[at : at + 3] = self._logs.get(entity.name, NO_CONTACT)

    def close(self) -> None:
        """Empty the physics client and keep it for the next engine."""
        if self._client >= 0:
            _give_client(self._client)
            self._client = -1

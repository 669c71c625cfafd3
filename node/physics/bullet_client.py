"""Physics clients of Bullet, and the shapes of their bodies. This is the only file that imports pybullet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from foosim.node.physics.quiet import without_lines
from foosim.world.matter.mesh import Mesh
from foosim.world.matter.physics import Physics, Side
from foosim.world.scene import PRIMITIVES_MAX, UPRIGHT, Box, Capsule, Cylinder, Shape, Sphere, Vector

with without_lines(b"pybullet build time:"):
    import pybullet as p

__all__ = [
    "JOINT_TYPES",
    "MESH_PIECE",
    "REST",
    "bullet_indices",
    "give_client",
    "make_dynamics",
    "make_scenery",
    "make_shape",
    "make_surface",
    "p",
    "settings_of",
    "start_client",
]

SPARES_MAX: Final = 10
"""Clients without bodies that are kept; each takes 28 MiB."""
MESH_PIECE: Final = 4096
"""Triangles of one static body: Bullet takes 174,762 at most, and one of these is built in a few milliseconds."""
REST: Final[Vector] = (0.0, 0.0, 0.0)
SPEED_MAX: Final = 1000.0
"""Bullet clamps each coordinate's velocity of a multibody at 100 by default: a sphere of 1 cm rolls at 1 m/s."""
JOINT_TYPES: Final = {
    "prismatic": p.JOINT_PRISMATIC,
    "revolute": p.JOINT_REVOLUTE,
    "continuous": p.JOINT_REVOLUTE,
    "fixed": p.JOINT_FIXED,
}
SHAPE_TYPES: Final = {Box: p.GEOM_BOX, Sphere: p.GEOM_SPHERE, Cylinder: p.GEOM_CYLINDER, Capsule: p.GEOM_CAPSULE}

_spare_clients: list[int] = []
"""Connected clients without bodies. Emptied, a client is as new; the laws are tested with such ones, too."""


def start_client(settings: dict[str, Any], gravity: float) -> int:
    """Return a client without bodies, with these parameters of the world."""
    client = _spare_clients.pop() if _spare_clients else _connect()
    p.setGravity(0.0, 0.0, -gravity, physicsClientId=client)
    p.setPhysicsEngineParameter(**settings, physicsClientId=client)
    return client


def give_client(client: int) -> None:
    """Empty a client and keep it for the next engine."""
    if len(_spare_clients) < SPARES_MAX:
        p.resetSimulation(physicsClientId=client)
        _spare_clients.append(client)
    else:
        p.disconnect(physicsClientId=client)


def _connect() -> int:
    client: int = p.connect(p.DIRECT)
    assert client >= 0, "no physics client is left"
    return client


def settings_of(physics: Physics, substep_s: float) -> dict[str, Any]:
    """Return the parameters under which a step depends on nothing but the state that it starts from."""
    return {
        "fixedTimeStep": substep_s,
        "numSubSteps": 0,  # more would multiply the force limits of the motors
        "numSolverIterations": physics.solver_iterations,
        "deterministicOverlappingPairs": 1,  # pairs are solved in an order of names, not of memory
        "minimumSolverIslandSize": 0,  # else small islands share one solver call, and stop on its common residual
        "solverResidualThreshold": 0,  # else iteration stops by the other islands of the call
        "contactERP": physics.contact_erp,  # 0.08 by default: restitution would be e + (0 to 0.08)
        "restitutionVelocityThreshold": 0.05,  # slower contacts do not bounce: a sphere comes to rest
        "warmStartingFactor": 0,  # starts from the impulses of the last step, unknown to the frame
        "contactSlop": 0,  # a tolerated penetration shifts where a contact begins
        "collisionFilterMode": 0,  # a pair needs both masks
    }


def bullet_indices(client: int, body: int, count: int) -> tuple[int, ...]:
    """Return Bullet's index of each of the `count` links of a body, in the order in which they were given.

    Bullet numbers links depth first, and names each by its place in the order given: link1, link2, ...
    """
    names = [p.getJointInfo(body, index, client)[12] for index in range(p.getNumJoints(body, client))]
    given = [b"link%d" % number for number in range(1, count + 1)]
    assert sorted(names) == sorted(given), f"{count} links were given, Bullet has {len(names)}: {names}"
    places = {name: index for index, name in enumerate(names)}
    return tuple([places[name] for name in given])


def make_shape(client: int, shapes: Sequence[Shape], *, placed: bool) -> int:
    """Make one collision shape, compound if there are several; `placed`: at the shapes' own poses. None is -1.

    A mesh is the only one: Bullet has no compound of these. It is handed over as numbers, never as the name of a file.
    """
    assert len(shapes) <= PRIMITIVES_MAX, f"{len(shapes)} shapes: a compound in Bullet has {PRIMITIVES_MAX}"
    if not shapes:
        return -1
    if isinstance(shapes[0].geometry, Mesh):
        (shape,) = shapes
        return _make_triangles(client, shape, placed=placed)
    parts: dict[str, list[Any]] = {
        key: [] for key in ("shapeTypes", "halfExtents", "radii", "lengths", "positions", "orientations")
    }
    for shape in shapes:
        geometry = shape.geometry
        assert isinstance(geometry, Box | Sphere | Cylinder | Capsule), geometry
        parts["shapeTypes"].append(SHAPE_TYPES[type(geometry)])
        parts["halfExtents"].append(geometry.half if isinstance(geometry, Box) else REST)
        parts["radii"].append(0.0 if isinstance(geometry, Box) else geometry.radius)
        parts["lengths"].append(geometry.length if isinstance(geometry, Cylinder | Capsule) else 0.0)
        parts["positions"].append(shape.position if placed else REST)
        parts["orientations"].append(shape.orientation if placed else UPRIGHT)
    made: int = p.createCollisionShapeArray(
        shapeTypes=parts["shapeTypes"],
        halfExtents=parts["halfExtents"],
        radii=parts["radii"],
        lengths=parts["lengths"],
        collisionFramePositions=parts["positions"],
        collisionFrameOrientations=parts["orientations"],
        physicsClientId=client,
    )
    assert made >= 0, shapes
    return made


def _make_triangles(client: int, shape: Shape, *, placed: bool) -> int:
    """Make a static mesh."""
    geometry = shape.geometry
    assert isinstance(geometry, Mesh), geometry
    made: int = p.createCollisionShape(
        p.GEOM_MESH,
        vertices=geometry.vertices.tolist(),
        indices=geometry.triangles.ravel().tolist(),
        collisionFramePosition=shape.position if placed else REST,
        collisionFrameOrientation=shape.orientation if placed else UPRIGHT,
        physicsClientId=client,
    )
    assert made >= 0, shape
    return made


def make_scenery(client: int, shape: Shape, groups: tuple[int, int], side: Side, *, rigid: bool = True) -> int:
    """Make a fixed body in a collision group that meets others: `groups`.

    It is a rigid static: a tilted static *multibody* has its quaternion renormalised at every step.
    """
    body: int = p.createMultiBody(
        baseMass=0.0,
        baseCollisionShapeIndex=make_shape(client, (shape,), placed=False),
        basePosition=shape.position,
        baseOrientation=shape.orientation,
        useMaximalCoordinates=rigid,
        physicsClientId=client,
    )
    p.setCollisionFilterGroupMask(body, -1, *groups, physicsClientId=client)
    make_surface(client, body, -1, side)
    return body


def make_dynamics(client: int, body: int, link: int, mass: float, inertia: Vector) -> None:
    """Set mass, inertia and damping of a link, and check that Bullet has accepted them."""
    # Bullet's own inertia is that of the shapes' bounding box. It must be set together with the mass (alone, it
    # makes the mass 0) and without anything else (together with a damping it is dropped silently).
    p.changeDynamics(body, link, mass=mass, localInertiaDiagonal=inertia, physicsClientId=client)
    # Damping is 0.04 by default, which stops a rolling multibody within seconds.
    for value in ({"linearDamping": 0.0}, {"angularDamping": 0.0}, {"jointDamping": 0.0}):
        p.changeDynamics(body, link, **value, physicsClientId=client)
    p.changeDynamics(body, link, maxJointVelocity=SPEED_MAX, physicsClientId=client)
    info = p.getDynamicsInfo(body, link, physicsClientId=client)
    assert (info[0], info[2]) == (mass, inertia), (info, mass, inertia)


def make_surface(client: int, body: int, link: int, side: Side) -> None:
    """Set the side of a link in contacts: Bullet takes the products of both sides' restitution and friction.

    Rolling friction is each side's own times the other's friction.
    """
    p.changeDynamics(
        body,
        link,
        restitution=side.restitution,
        lateralFriction=side.friction,
        rollingFriction=side.rolling_friction,
        spinningFriction=0.0,
        contactProcessingThreshold=0.0,  # contacts ahead of the touch spoil restitution at low speed
        physicsClientId=client,
    )

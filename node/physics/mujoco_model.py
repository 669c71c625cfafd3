"""Builds the MuJoCo model of a composition: the scenery, the bodies of an island in name order, the movers in its way.

The first link of a free body has its MuJoCo frame at its centre of mass in its principal axes: then `qpos` has the
pose in the world's frame, and `qvel` the velocity, with the angular part in the body's own axes.

A motor (a target speed, and the greatest force with which it is reached) is dry friction against a turning shaft: a
*clock*, a heavy degree of freedom at 1 rad/s, and for each joint a fixed tendon of length q - speed x clock, whose
friction loss is the force. A gain actuator with a force range sags under load or chatters.

Contacts are explicit pairs of shapes. Each pair has the product of both sides' friction and restitution, where
MuJoCo's own rule takes the greater friction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

import mujoco
import numpy as np

from foosim.node.physics.floors import Plane
from foosim.world.matter.mesh import Mesh
from foosim.world.matter.physics import Physics, Side
from foosim.world.scene import (
    MOVING,
    ORIGIN,
    UPRIGHT,
    Body,
    Box,
    Capsule,
    Cylinder,
    Hull,
    Link,
    Quaternion,
    Shape,
    Sphere,
    Vector,
    conjugate,
    moved,
    multiply,
    rotate,
)

HEAVY: Final = 1e7
"""Mass (kg) and inertia (kg m2) of bodies that no contact moves: movers, and the clock of motors."""
IMPRATIO: Final = 200.0
"""The stiffness of friction, as a multiple of the normal stiffness of a contact. At 100 a box creeps by 86 um/s
on a slope of 15 degrees, at 200 by 43; at 1000 wheels shake at substeps of 10 ms, and stacks rock."""
NOSLIP: Final = 3
"""Iterations that take creep from friction, where motors may hold another body: 200 g in a grip that is shaken for 10 s
slips by 0.01 mm, and by 16 mm without."""
TOLERANCE: Final = 1e-10
"""At 1e-8 wheels that hold each other slip."""
MIMIC_TOLERANCE: Final = 1e-14
"""With mimic joints: at 1e-10 the solver ends too early where a motor reaches its speed, with an error of 2.7 mrad."""
LINE_SEARCHES: Final = 50
HARD: Final = (0.0, 0.99, 0.001, 0.5, 2.0)
"""`solimp` of contacts without restitution: impedance 0 at the touch, 0.99 from an overlap of 1 mm on. A sliding
body chatters where it begins above 0, or is narrower. A box on the floor sinks in by 0.2 mm, below nine others by
0.9 mm. tests/physics/test_solid_truths.py has the scenes by which the values here were chosen."""
BOUNCY: Final = (0.999, 0.999, 0.001, 0.5, 2.0)
BOUNCY_ERP: Final = 0.02
"""The share of an overlap that a substep corrects in a contact with restitution, at most: it adds to the rebound."""
FRICTION_SUBSTEPS: Final = 12.0
FRICTION_S_MAX: Final = 0.05
"""The time constant of friction. MuJoCo's cone couples normal and tangential speeds: with a shorter one a sliding
body hops, by 10 mm at 3 m/s with 8 substeps; with a longer one a slow body is braked by less than its friction."""
SERVO: Final = (0.999, 0.999, 0.001, 0.5, 2.0)
WELD: Final = (0.9999, 0.9999, 0.001, 0.5, 2.0)
"""`solimp` of grasps. Their direct `solref` takes away a slip within a substep: 3 kg on an arm that swings them at
2 m/s slip by 0.1 mm at substeps of 5 ms, and by 0.3 mm with a time constant of two substeps."""
LIMIT: Final = (0.95, 0.99, 0.001, 0.5, 2.0)
LEAST: Final = 1e-5
"""The smallest coefficient of friction in MuJoCo."""
GEOMS: Final = {
    Plane: "PLANE",
    Box: "BOX",
    Sphere: "SPHERE",
    Cylinder: "CYLINDER",
    Capsule: "CAPSULE",
    Hull: "MESH",
    Mesh: "MESH",
}
SCENERY: Final = -1
"""The place of shapes without a body."""
SILENT: Final = -2
"""The place of a shape whose contacts are not logged."""

VERSION: Final = f"mujoco {mujoco.__version__}"
step = mujoco.mj_step
warnings: Final[list[str]] = []
"""The warnings of MuJoCo, such as contacts dropped in a full arena."""


def _warned(text: str) -> None:
    if not text.startswith("Nan, Inf"):  # of non-finite numbers, whose bodies come into quarantine
        warnings.append(text)


mujoco.set_mju_user_warning(_warned)  # by default MuJoCo writes MUJOCO_LOG.TXT into the working folder


def is_mover(body: Body) -> bool:
    """Whether a free body has no mass: others are pushed by it, and it is moved by none."""
    return body.is_free and all(link.mass == 0.0 for link in body.links)


class Placed:
    """The places of a body in a model: MuJoCo's id of its base, the first places of its free joint in `qpos` and `qvel`
    (-1 without one), the places of its other joints, and the number of its first motor."""

    __slots__ = ("base", "body", "damping", "fixed_at", "is_free", "is_mover", "motor", "q", "qs", "v", "vs")

    def __init__(self, m: Any, body: Body, number: int, motor: int) -> None:
        self.body, self.base, self.motor = body, m.body(f"b{number}").id, motor
        self.is_free, self.is_mover = body.is_free, is_mover(body)
        free = m.joint(f"b{number}").id if body.is_free else -1
        self.q, self.v = (int(m.jnt_qposadr[free]), int(m.jnt_dofadr[free])) if free >= 0 else (-1, -1)
        moving = () if self.is_mover else [index for index, link in enumerate(body.links) if link.joint in MOVING]
        ids = [m.joint(f"b{number}.{index}").id for index in moving]  # by name: MuJoCo numbers them depth first
        self.qs, self.vs = [int(m.jnt_qposadr[one]) for one in ids], [int(m.jnt_dofadr[one]) for one in ids]
        self.damping = [body.links[index].damping for index in moving]
        self.fixed_at: Body | None = None
        """The body whose fixed base the model has now."""


class ModelBuilder:
    """Builds one model and its data, `m` and `d`.

    `placed` has the places of its bodies, `owners` the owner of each geom: the place of the body, `SCENERY` of the
    scenery, `SILENT` of shapes without a log. `clock` is the place of the clock in `qvel`, -1 without motors.
    """

    def __init__(
        self,
        physics: Physics,
        substep_s: float,
        scenery: Sequence[Shape],
        bodies: Sequence[Body],
        movers: Sequence[Body],
        welds: Sequence[tuple[int, int, int]] = (),
    ) -> None:
        self._physics, self._dt, self._count = physics, substep_s, len(bodies)
        self._stiff = -1.0 / (substep_s * substep_s), -1.0 / substep_s
        """The direct `solref` that takes away the error of a weld, or of a mimic joint, within a substep."""
        self._spec = mujoco.MjSpec()
        self._meshes: dict[int, str] = {}
        self._shapes: list[tuple[str, int, Side, bool]] = []
        """Of each geom its name, the place of its body, its side of contacts, and whether it is fixed."""
        self._joints: list[str] = []
        self._touching: dict[str, set[int]] = {}
        """Of shapes beside a grip the places of the bodies that are held there: they do not meet."""
        self._holding = _holding((*bodies, *movers), welds)
        self._set_options()
        for shape in scenery:
            self._add_shape(self._spec.worldbody, shape, SCENERY, ORIGIN, UPRIGHT, is_fixed=True)
        all_bodies = (*bodies, *movers)
        for number, body in enumerate(all_bodies):
            self._add_body(number, body)
        held = [self._add_weld(all_bodies[holder], holder, link, held) for holder, link, held in welds]
        if self._joints:
            self._add_motors()
            self._spec.option.noslip_iterations = NOSLIP if len(all_bodies) > 1 else 0
        self._add_pairs()
        self.m = m = self._spec.compile()
        self.d = mujoco.MjData(m)
        light = m.dof_M0[m.dof_M0 < HEAVY / 10]
        m.stat.meaninertia = float(light.mean()) if len(light) else 1.0  # scales the solver's tolerance
        self.placed: list[Placed] = []
        motor = 0
        for number, body in enumerate(all_bodies):
            self.placed.append(Placed(m, body, number, motor))
            motor += len(self.placed[-1].qs)
        self.motors = motor
        self.welds = [(m.equality(name).id, at, turned) for name, at, turned in held]
        self.clock = int(m.joint("clock").dofadr[0]) if motor else -1
        owners = {name: SILENT if side.silent else place for name, place, side, _ in self._shapes}
        self.owners = [owners[m.geom(index).name] for index in range(m.ngeom)]

    def _set_options(self) -> None:
        option, disable = self._spec.option, mujoco.mjtDisableBit
        option.timestep, option.gravity = self._dt, (0.0, 0.0, -self._physics.gravity)
        option.density, option.viscosity = self._physics.density, self._physics.viscosity
        option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        option.cone, option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, IMPRATIO
        option.iterations, option.tolerance = self._physics.solver_iterations, TOLERANCE
        option.ls_iterations = LINE_SEARCHES
        option.disableflags = int(disable.mjDSBL_AUTORESET | disable.mjDSBL_SENSOR | disable.mjDSBL_ISLAND)
        compiler = self._spec.compiler
        compiler.degree, compiler.usethread, compiler.inertiafromgeom = False, False, 0

    def _add_shape(
        self, parent: Any, shape: Shape, place: int, at: Vector, turned: Quaternion, *, is_fixed: bool
    ) -> None:
        """Add a shape of a link whose frame has the pose (`at`, `turned`) in the frame of MuJoCo's body."""
        geometry = shape.geometry
        geom = parent.add_geom()
        geom.name = f"g{len(self._shapes)}"
        geom.type = getattr(mujoco.mjtGeom, f"mjGEOM_{GEOMS[type(geometry)]}")
        if isinstance(geometry, Plane):
            geom.size = 1.0, 1.0, 1.0  # by its looks
        elif isinstance(geometry, Box):
            geom.size = geometry.half
        elif isinstance(geometry, Sphere):
            geom.size = geometry.radius, 0.0, 0.0
        elif isinstance(geometry, Cylinder | Capsule):
            geom.size = geometry.radius, geometry.length / 2, 0.0
        else:
            geom.meshname = self._mesh(geometry.mesh if isinstance(geometry, Hull) else geometry)
        geom.pos = moved(at, rotate(turned, shape.position), 1.0)
        geom.quat = _wxyz(multiply(turned, shape.orientation))
        geom.contype = geom.conaffinity = 0
        self._shapes.append((geom.name, place, self._physics.sides[shape.surface], is_fixed))

    def _mesh(self, mesh: Mesh) -> str:
        name = self._meshes.get(id(mesh))
        if name is None:
            made = self._spec.add_mesh()
            name = made.name = self._meshes[id(mesh)] = f"m{len(self._meshes)}"
            made.uservert = np.asarray(mesh.vertices, np.float64).ravel()
            made.userface = np.asarray(mesh.triangles, np.int32).ravel()
            made.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        return name

    def _add_body(self, number: int, body: Body) -> None:
        """Add a body. Its base, and the free joint of that, are called b and its number."""
        root, is_free, moves_alone = f"b{number}", body.is_free, is_mover(body)
        world = self._spec.worldbody
        base = world.add_body()
        base.name = root
        parents: list[tuple[Any, Vector, Quaternion, bool]] = []
        for index, link in enumerate(body.links):
            at, turned = ORIGIN, UPRIGHT
            if is_free and index == 0:
                made, is_fixed = base, False
                base.add_freejoint().name = root
                turned = conjugate(link.principal)
                at = rotate(turned, moved(ORIGIN, link.centre_of_mass, -1.0))
            else:
                parent, p_at, p_turned, is_fixed = (
                    parents[link.parent] if link.parent >= 0 else (base, ORIGIN, UPRIGHT, True)
                )
                made = parent.add_body()
                made.name = f"{root}.{index}"
                made.pos = moved(p_at, rotate(p_turned, link.position), 1.0)
                made.quat = _wxyz(multiply(p_turned, link.orientation))
                if link.joint in MOVING and not moves_alone:
                    self._add_joint(made, link, made.name)
                    is_fixed = False
            if moves_alone:
                made.gravcomp = 1.0
                if index == 0:
                    made.explicitinertial, made.mass, made.inertia = True, HEAVY, (HEAVY,) * 3
            elif link.mass > 0.0:
                made.explicitinertial, made.mass, made.inertia = True, link.mass, link.inertia
                if made is not base:
                    made.ipos, made.iquat = link.centre_of_mass, _wxyz(link.principal)
            parents.append((made, at, turned, is_fixed))
            for shape in link.shapes:
                self._add_shape(made, shape, number, at, turned, is_fixed=is_fixed)
                if (number, index) in self._holding:
                    self._touching[self._shapes[-1][0]] = self._holding[number, index]
        if not moves_alone:
            self._add_mimics(root, body)

    def _add_joint(self, made: Any, link: Link, name: str) -> None:
        joint = made.add_joint()
        joint.name, joint.axis = name, link.axis
        joint.type = getattr(mujoco.mjtJoint, "mjJNT_SLIDE" if link.joint == "prismatic" else "mjJNT_HINGE")
        joint.damping = (link.damping, 0.0, 0.0) if np.ndim(joint.damping) else link.damping
        if link.joint != "continuous":
            joint.limited, joint.range = True, link.limits
            joint.solref_limit, joint.solimp_limit = (2.0 * self._dt, 1.0), LIMIT
        self._joints.append(name)

    def _add_mimics(self, root: str, body: Body) -> None:
        """Couple joints that follow others to these, by equalities as stiff as welds."""
        for index, link in enumerate(body.links):
            if link.mimic is not None:
                coupling = self._spec.add_equality()
                coupling.type, coupling.objtype = mujoco.mjtEq.mjEQ_JOINT, mujoco.mjtObj.mjOBJ_JOINT
                coupling.name1, coupling.name2 = f"{root}.{index}", f"{root}.{link.mimic.leader}"
                coupling.data[:5] = link.mimic.offset, link.mimic.ratio, 0.0, 0.0, 0.0
                coupling.solref, coupling.solimp = self._stiff, WELD
                self._spec.option.tolerance = MIMIC_TOLERANCE

    def _add_weld(self, body: Body, holder: int, link: int, held: int) -> tuple[str, Vector, Quaternion]:
        """Add the grasp of one body by a link of another. Return its name, and the pose of the frame of the link in
        MuJoCo's body."""
        weld = self._spec.add_equality()
        weld.name = f"w{len(self._spec.equalities)}"
        weld.type, weld.objtype = mujoco.mjtEq.mjEQ_WELD, mujoco.mjtObj.mjOBJ_BODY
        weld.solref, weld.solimp = self._stiff, WELD
        weld.name2 = f"b{held}"
        if link == 0 and body.is_free:
            weld.name1, turned = f"b{holder}", conjugate(body.links[0].principal)
            return weld.name, rotate(turned, moved(ORIGIN, body.links[0].centre_of_mass, -1.0)), turned
        weld.name1 = f"b{holder}.{link}"
        return weld.name, ORIGIN, UPRIGHT

    def _add_motors(self) -> None:
        shaft = self._spec.worldbody.add_body()
        shaft.explicitinertial, shaft.mass, shaft.inertia, shaft.gravcomp = True, HEAVY, (HEAVY,) * 3, 1.0
        clock = shaft.add_joint()
        clock.name, clock.type, clock.axis = "clock", mujoco.mjtJoint.mjJNT_HINGE, (0.0, 0.0, 1.0)
        for joint in self._joints:
            tendon = self._spec.add_tendon()
            tendon.wrap_joint(joint, 1.0)
            tendon.wrap_joint("clock", -1.0)
            tendon.frictionloss = 1.0  # 0 would leave it out of the solve for ever
            tendon.solref_friction, tendon.solimp_friction = (2.0 * self._dt, 1.0), SERVO

    def _add_pairs(self) -> None:
        known: dict[tuple[Side, Side], tuple[Any, ...]] = {}
        count = self._count
        for number, (one, place, side, is_fixed) in enumerate(self._shapes):
            is_loose = place < count and not is_fixed
            for other, place2, side2, is_fixed2 in self._shapes[number + 1 :]:
                # One of both is a body's, and it moves; parts of one body do not meet.
                if place == place2 or not (is_loose or (place2 < count and not is_fixed2)):
                    continue
                if (place >= count and is_fixed2) or (place2 >= count and is_fixed):
                    continue
                if place2 in self._touching.get(one, ()) or place in self._touching.get(other, ()):
                    continue
                feel = known.get((side, side2))
                if feel is None:
                    feel = known[side, side2] = self._feel(side, side2)
                pair = self._spec.add_pair()
                pair.geomname1, pair.geomname2 = one, other
                pair.condim, pair.friction, pair.solref, pair.solimp = feel
                pair.solreffriction = min(FRICTION_SUBSTEPS * self._dt, FRICTION_S_MAX), 1.0

    def _feel(self, one: Side, other: Side) -> tuple[Any, ...]:
        """Return condim, friction (two sliding, one torsional, two rolling), solref and solimp of a pair."""
        mu = one.friction * other.friction
        rolling = one.rolling_friction * other.friction + other.rolling_friction * one.friction
        condim = 1 if mu == 0.0 else 6 if rolling > 0.0 else 3
        friction = max(mu, LEAST), max(mu, LEAST), LEAST, max(rolling, LEAST), max(rolling, LEAST)
        bounce = one.restitution * other.restitution
        return condim, friction, self._solref(bounce), BOUNCY if bounce > 0.0 else HARD

    def _solref(self, restitution: float) -> tuple[float, float]:
        """Return MuJoCo's direct `solref`, (-stiffness, -damping).

        A contact has the acceleration -b v - k r, v being the speed of approach and r the overlap. With b = (1 + e) / h
        the speed after a substep h is -e v. k = erp / h^2 corrects the share erp of the overlap, which adds up to
        erp v to a rebound: half of it is taken from e. MuJoCo divides b by the impedance, and k by its square.
        """
        h, erp, impedance, bounce = self._dt, self._physics.contact_erp, HARD[1], 0.0
        if restitution > 0.0:
            erp, impedance = min(erp, BOUNCY_ERP), BOUNCY[1]
            bounce = restitution - erp / 2.0
        return -erp / (h * h) * impedance * impedance, -(1.0 + bounce) / h * impedance


def _holding(bodies: Sequence[Body], welds: Sequence[tuple[int, int, int]]) -> dict[tuple[int, int], set[int]]:
    """Return the held bodies beside links, by places and indices: beside the link that holds, the links fixed to it,
    and the links that hang on these, its fingers."""
    found: dict[tuple[int, int], set[int]] = {}
    for holder, grip, held in welds:
        links, first = bodies[holder].links, grip
        while links[first].joint == "fixed" and links[first].parent >= 0:
            first = links[first].parent
        beside = {first}
        for index, one in enumerate(links):
            if one.parent in beside:
                beside.add(index)
        for index in beside:
            found.setdefault((holder, index), set()).add(held)
    return found


def _wxyz(q: Quaternion) -> tuple[float, float, float, float]:
    return q[3], q[0], q[1], q[2]


def without_names(body: Body) -> Body:
    """Return the parts of a model: links without names and looks; a mover has no masses."""
    moves_alone, black = is_mover(body), (0.0, 0.0, 0.0, 1.0)
    links = []
    for link in body.links:
        shapes = [Shape(one.geometry, one.surface, black, one.position, one.orientation) for one in link.shapes]
        bare = replace(link, name="", joint_name="", shapes=tuple(shapes), visuals=())
        links.append(replace(bare, inertia=ORIGIN, centre_of_mass=ORIGIN, principal=UPRIGHT) if moves_alone else bare)
    return Body("", "", ORIGIN, tuple(links))

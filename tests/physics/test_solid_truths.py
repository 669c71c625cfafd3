"""Rigid bodies of any kind against closed forms, at speeds, angles and masses drawn by a fixed seed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import repeat
from math import cos, pi, sin, sqrt
from pathlib import Path
from random import Random
from typing import Final

import mujoco
import pytest
from scipy.integrate import solve_ivp

from foosim.common.keyed_random import draw_key, draw_words, unit_interval
from foosim.library.mobile.rotors import QuadrotorRobot
from foosim.node.physics.interface import Island
from foosim.node.physics.mujoco_islands import CompositionEngine
from foosim.world.bodies.inertia import turned
from foosim.world.bodies.urdf import body_of, read_urdf
from foosim.world.components.drives import NO_DRIVES, Drives, Motor
from foosim.world.kinematics import forward_kinematics, twist
from foosim.world.matter.mesh import Mesh
from foosim.world.matter.physics import Side
from foosim.world.scene import (
    ORIGIN,
    UPRIGHT,
    Body,
    Box,
    Capsule,
    Cylinder,
    Hull,
    JointKind,
    Link,
    Sphere,
    Vector,
    from_rpy,
    multiply,
    rotate,
    turn,
)
from tests.kinematic_yard import Yard, yard_text
from tests.solids import GRAVITY, TICK_S, Solids, ball, box, physics, shape

SEED: Final = 17
KEY: Final = draw_key(SEED, "solids")
JOINT_KINDS: Final[tuple[JointKind, ...]] = ("prismatic", "revolute", "continuous", "fixed")
Y: Final = (0.0, 1.0, 0.0)
Z: Final = (0.0, 0.0, 1.0)


def draw(number: int, low: float, high: float) -> float:
    return low + (high - low) * unit_interval(draw_words(KEY, number)[0])


@contextmanager
def solids(*bodies: Body, **options: object) -> Iterator[Solids]:
    made = Solids(bodies, **options)  # type: ignore[arg-type]
    yield made
    made.close()


@pytest.mark.parametrize("case", range(4))
def test_free_fall(case: int) -> None:
    """After n steps of h: v = g n h, and the way of the semi-implicit rule, g h^2 n (n + 1) / 2. Spin stays."""
    speed, rate = draw(case, -3.0, 3.0), draw(10 + case, -5.0, 5.0)
    with solids(ball("a", 0.1, draw(20 + case, 0.1, 9.0)), scenery=()) as one:
        one.put("a", (0.0, 0.0, 5.0), velocity=(speed, 0.0, 0.0), spin=(0.0, 0.0, rate))
        one.run(50)
        steps, h = 200, TICK_S / 4
        assert one.get("a", "linear_velocity") == pytest.approx([speed, 0.0, -GRAVITY * steps * h], abs=1e-9)
        z = 5.0 - GRAVITY * h * h * steps * (steps + 1) / 2
        assert one.get("a", "position") == pytest.approx([speed * 0.5, 0.0, z], abs=1e-9)
        assert one.get("a", "angular_velocity")[2] == pytest.approx(rate, rel=1e-9)


@pytest.mark.parametrize("case", range(3))
def test_rolling_down_a_slope(case: int) -> None:
    """A solid sphere that rolls gains 5/7 g sin(angle)."""
    angle = draw(50 + case, 0.1, 0.3)
    slope = shape(Box((5.0, 1.0, 0.1)), "floor", position=(0.0, 0.0, 0.0), orientation=turn(Y, angle))
    nx, nz = sin(angle), cos(angle)
    with solids(ball("a", 0.1, 1.0), scenery=(slope,)) as one:
        one.put("a", (0.2 * nx, 0.0, 0.2 * nz))
        one.run(100)
        x, _, z = one.get("a", "linear_velocity")
        assert sqrt(x * x + z * z) == pytest.approx(5 / 7 * GRAVITY * sin(angle) * 1.0, rel=0.02)


@pytest.mark.parametrize("case", range(3))
def test_restitution(case: int) -> None:
    """A sphere that falls on a floor of restitution e comes back with e times its speed."""
    bounce = draw(60 + case, 0.3, 0.9)
    feel = physics(erp=0.005, ball=Side(1.0, 0.0), floor=Side(bounce, 0.0))
    with solids(ball("a", 0.1, 1.0, "ball"), feel=feel) as one:
        one.put("a", (0.0, 0.0, 0.5), velocity=(0.0, 0.0, -draw(70 + case, 1.0, 4.0)))
        before = 0.0
        for _ in range(100):
            one.run(1)
            now = one.get("a", "linear_velocity")[2]
            if now > 0.0:
                break
            before = now
        assert now == pytest.approx(-bounce * before, rel=0.05)
        assert one.get("a", "contacts")[0] == 1.0


def pendulum(length: float, mass: float, damping: float = 0.0) -> Body:
    """A point on a rod without a mass, which turns about y where its base is."""
    link = Link(
        "arm",
        "continuous",
        (shape(Sphere(0.02), position=(0.0, 0.0, -length)),),
        mass,
        (1e-6, 1e-6, 1e-6),
        centre_of_mass=(0.0, 0.0, -length),
        axis=Y,
        damping=damping,
    )
    return Body("arm", "pendulum", (0.0, 0.0, 3.0), (link,))


@pytest.mark.parametrize("case", range(3))
def test_a_pendulum_swings_with_its_period(case: int) -> None:
    """T = 2 pi sqrt(l / g) (1 + a^2 / 16) at the amplitude a."""
    length, amplitude = draw(80 + case, 0.3, 1.5), 0.1
    with solids(pendulum(length, draw(90 + case, 0.5, 5.0)), tick_s=0.002) as one:
        one.set("arm", "joint_positions", amplitude)
        period = 2 * pi * sqrt(length / GRAVITY) * (1 + amplitude * amplitude / 16)
        ticks = round(2 * period / 0.002)
        one.run(ticks)
        assert one.get("arm", "joint_positions")[0] == pytest.approx(amplitude, abs=0.003)


def test_a_double_pendulum_swings_as_its_equations_say() -> None:
    """Two points on rods without a mass, against Lagrange's equations, integrated by scipy to 1e-10, for 1.5 s.

    The error is that of the semi-implicit rule: it is half as large for half of the substep.
    """
    l1, l2, m1, m2 = draw(95, 0.3, 1.0), draw(96, 0.3, 1.0), draw(97, 0.5, 2.0), draw(98, 0.5, 2.0)
    upper, lower = pendulum(l1, m1).links[0], pendulum(l2, m2).links[0]
    links = upper, replace(lower, name="lower", parent=0, position=(0.0, 0.0, -l1))
    start = draw(99, 0.5, 1.0), draw(100, -1.0, -0.5)

    def rates(_: float, state: list[float]) -> list[float]:
        one, two, fast, faster = state
        c, s = cos(one - two), sin(one - two)
        top = -m2 * l2 * faster * faster * s - (m1 + m2) * GRAVITY * sin(one)
        low = m2 * l1 * fast * fast * s - m2 * GRAVITY * sin(two)
        a, b, e, d = (m1 + m2) * l1, m2 * l2 * c, m2 * l1 * c, m2 * l2
        return [fast, faster, (top * d - b * low) / (a * d - b * e), (a * low - e * top) / (a * d - b * e)]

    times = [0.25 * number for number in range(1, 7)]
    expected = solve_ivp(rates, (0.0, 1.5), [*start, 0.0, 0.0], t_eval=times, rtol=1e-10, atol=1e-10).y
    with solids(Body("arm", "double", (0.0, 0.0, 3.0), links), scenery=(), tick_s=0.00025) as one:
        one.set("arm", "joint_positions", start[0], start[1] - start[0])
        for number in range(len(times)):
            one.run(1000)
            first, second = one.get("arm", "joint_positions")
            assert (first, first + second) == pytest.approx(expected[:2, number].tolist(), abs=0.003)


def test_damping_slows_a_joint() -> None:
    """Without gravity: w = w0 exp(-d t / I)."""
    with solids(pendulum(0.5, 2.0, damping=0.25), feel=physics(0.0)) as one:
        one.set("arm", "joint_velocities", 2.0)
        one.run(100)
        inertia = 2.0 * 0.5 * 0.5
        assert one.get("arm", "joint_velocities")[0] == pytest.approx(2.0 * 2.718281828 ** (-0.25 / inertia), rel=0.02)


def chain(links: int) -> Body:
    """Links on a fixed base, each turning about an axis of its own, with centres of mass away from their origins."""
    made = []
    for number in range(links):
        axis = (Y, Z, (0.6, 0.0, 0.8))[number % 3]
        made.append(
            Link(
                f"link{number}",
                "revolute",
                (shape(Capsule(0.03, 0.2), position=(0.0, 0.0, 0.15)),),
                1.0,
                (0.01, 0.012, 0.004),
                centre_of_mass=(0.01, 0.02, 0.12),
                axis=axis,
                limits=(-3.0, 3.0),
                parent=number - 1,
                position=(0.0, 0.0, 0.5 if number == 0 else 0.3),
                orientation=turn((1.0, 0.0, 0.0), 0.2 * number),
                principal=turn((0.0, 0.6, 0.8), 0.3),
            )
        )
    return Body("arm", "chain", (0.0, 0.0, 1.0), tuple(made))


def energy_of(one: Solids, body: Body) -> float:
    """Kinetic and potential energy of a chain, by our own kinematics."""
    entity, total = one[body.name], 0.0
    poses = forward_kinematics(body, entity, one.numbers)
    for index, (link, (_, position, orientation)) in enumerate(zip(body.links, poses, strict=True)):
        x, y, z = rotate(orientation, link.centre_of_mass)
        middle = position[0] + x, position[1] + y, position[2] + z
        linear, angular = twist(body, entity, one.numbers, index, middle)
        px, py, pz, pw = link.principal
        turned = rotate(
            (-px, -py, -pz, pw), rotate((-orientation[0], -orientation[1], -orientation[2], orientation[3]), angular)
        )
        total += 0.5 * link.mass * sum(part * part for part in linear) + link.mass * GRAVITY * middle[2]
        total += 0.5 * sum(i * w * w for i, w in zip(link.inertia, turned, strict=True))
    return total


@pytest.mark.parametrize("case", range(3))
def test_the_energy_of_a_chain_stays(case: int) -> None:
    """Centres of mass away from the links' origins, principal axes turned: energy by our own kinematics is kept."""
    body = chain(3)
    with solids(body, scenery=(), tick_s=0.0005) as one:
        speeds = [draw(310 + 10 * case + number, -1.0, 1.0) for number in range(3)]
        one.set("arm", "joint_positions", *[draw(340 + 10 * case + number, -0.5, 0.5) for number in range(3)])
        one.set("arm", "joint_velocities", *speeds)
        before = energy_of(one, body)
        one.run(400)
        assert one.get("arm", "joint_velocities") != speeds
        assert energy_of(one, body) == pytest.approx(before, rel=0.002)


@pytest.mark.parametrize("case", range(3))
def test_links_are_where_our_kinematics_put_them(case: int) -> None:
    """MuJoCo's own poses of links, at drawn joint angles, against the one forward kinematics."""
    body = chain(6)
    with solids(body, scenery=()) as one:
        angles = [draw(100 + 10 * case + number, -2.0, 2.0) for number in range(6)]
        one.set("arm", "joint_positions", *angles)
        ours = forward_kinematics(body, one["arm"], one.numbers)
        island = Island((one["arm"],), (), (NO_DRIVES,))
        one.engine.load(one.engine.seats_of(island, [body]), island.drives, one.numbers, one.numbers)
        mujoco.mj_kinematics(one.engine.m, one.engine.d)
        for index, (_, position, orientation) in enumerate(ours):
            theirs = one.engine.d.body(f"b0.{index}")
            assert theirs.xpos == pytest.approx(position, abs=1e-12)
            w, x, y, z = theirs.xquat
            sign = 1.0 if w * orientation[3] >= 0 else -1.0
            assert [sign * x, sign * y, sign * z, sign * w] == pytest.approx(orientation, abs=1e-12)


def test_a_centre_of_mass_away_from_the_origin_of_a_free_body() -> None:
    """Thrown with a spin, the centre of mass flies on a parabola and the spin about a principal axis stays."""
    link = Link(
        "a",
        "free",
        (shape(Box((0.2, 0.1, 0.1))),),
        2.0,
        (0.02, 0.05, 0.06),
        centre_of_mass=(0.5, 0.1, 0.0),
        principal=turn(Z, 0.7),
    )
    body = Body("a", "offset", ORIGIN, (link,), speed_limit=10.0)
    with solids(body, scenery=()) as one:
        one.put("a", (1.0, 2.0, 5.0), velocity=(1.0, 0.0, 2.0), spin=(0.0, 0.0, 3.0))
        assert forward_kinematics(body, one["a"], one.numbers)[0][1] != (1.0, 2.0, 5.0)
        one.run(50)
        steps, h = 200, TICK_S / 4
        z = 5.0 + 2.0 * 0.5 - GRAVITY * h * h * steps * (steps + 1) / 2
        assert one.get("a", "position") == pytest.approx([1.5, 2.0, z], abs=1e-9)
        assert one.get("a", "angular_velocity") == pytest.approx([0.0, 0.0, 3.0], abs=1e-9)


@pytest.mark.parametrize("case", range(3))
def test_a_body_from_a_file_keeps_its_angular_momentum(case: int) -> None:
    """Without a torque R I R^T w stays, I being the tensor of the file: not diagonal, away from the link's origin."""
    xx, yy, zz = (draw(400 + 10 * case + axis, 0.02, 0.03) for axis in range(3))
    xy, xz, yz = (draw(430 + 10 * case + axis, -0.005, 0.005) for axis in range(3))
    inertia = f'<inertia ixx="{xx}" ixy="{xy}" ixz="{xz}" iyy="{yy}" iyz="{yz}" izz="{zz}"/>'
    mass = f'<inertial><origin xyz="0.1 -0.2 0.3" rpy="0.4 0 0"/><mass value="2"/>{inertia}</inertial>'
    ball_at = '<collision><geometry><sphere radius="0.05"/></geometry></collision>'
    text = f'<robot name="r"><link name="l">{mass}{ball_at}</link></robot>'.encode()
    robot = read_urdf("r.urdf", {"r.urdf": text})
    body = body_of(robot, "r", ORIGIN, UPRIGHT, fixed=False, surfaces=repeat("default"), speed_limit=50.0)
    spin = tuple(draw(460 + 10 * case + axis, -3.0, 3.0) for axis in range(3))

    def momentum(one: Solids) -> list[float]:
        (_, _, orientation), *_ = forward_kinematics(body, one["r"], one.numbers)
        tensor = turned((xx, xy, xz, yy, yz, zz), multiply(orientation, turn((1.0, 0.0, 0.0), 0.4)))
        a, b, c = one.get("r", "angular_velocity")
        x, xy_, xz_, y, yz_, z = tensor
        return [x * a + xy_ * b + xz_ * c, xy_ * a + y * b + yz_ * c, xz_ * a + yz_ * b + z * c]

    with solids(body, feel=physics(0.0), scenery=(), tick_s=0.002) as one:
        one.put("r", (0.0, 0.0, 5.0), from_rpy(0.3, -0.2, 0.9), spin=(spin[0], spin[1], spin[2]))
        before = momentum(one)
        one.run(500)
        size = sqrt(sum(part * part for part in before))
        assert momentum(one) == pytest.approx(before, abs=0.01 * size)
        assert one.get("r", "angular_velocity") != pytest.approx(spin, abs=0.05), "it tumbles"


def test_forces_and_torques_on_a_base_act_in_its_own_axes() -> None:
    """A body that is turned by 90 degrees about z: a force along its x accelerates along the world's y."""
    with solids(box("a", (0.2, 0.1, 0.1), 2.0), feel=physics(0.0), scenery=()) as one:
        one.put("a", (0.0, 0.0, 5.0), orientation=turn(Z, pi / 2))
        one.drives["a"] = Drives(wrench=((4.0, 0.0, 0.0), ORIGIN))
        one.run(50)
        assert one.get("a", "linear_velocity") == pytest.approx([0.0, 4.0 / 2.0 * 0.5, 0.0], abs=1e-6)
        one.put("a", (0.0, 0.0, 5.0), orientation=turn(Z, pi / 2))
        one.drives["a"] = Drives(wrench=(ORIGIN, (0.01, 0.0, 0.0)))
        one.run(50)
        inertia = 2.0 * (0.04 + 0.04) / 12
        assert one.get("a", "angular_velocity") == pytest.approx([0.0, 0.01 / inertia * 0.5, 0.0], abs=1e-6)


def test_motors_reach_speeds_with_their_forces() -> None:
    """Without gravity: torque over inertia, held at the speed."""
    inertia = 2.0 * 0.5 * 0.5 + 1e-6
    with solids(pendulum(0.5, 2.0), feel=physics(0.0)) as one:
        one.drives["arm"] = Drives((Motor(1.0, 2.0),))
        one.run(10)
        assert one.get("arm", "joint_velocities")[0] == pytest.approx(2.0 / inertia * 0.1, rel=1e-3)
        assert one.get("arm", "joint_efforts")[0] == pytest.approx(2.0, rel=1e-3)
        one.run(40)
        assert one.get("arm", "joint_velocities")[0] == pytest.approx(1.0, abs=1e-6)


PARTS: Final = "".join(
    f'<link name="{name}"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01"/></inertial>'
    '<collision><geometry><sphere radius="0.02"/></geometry></collision></link>'
    f'<joint name="to_{name}" type="continuous"><parent link="foot"/><child link="{name}"/><origin xyz="{x} 0 0"/>'
    '<axis xyz="0 0 1"/><limit effort="10" velocity="5"/></joint>'
    for x, name in enumerate(("left", "reach", "right", "spare"))
)
OWN_SPIN: Final = """
from foosim.library.rigid.joint_velocity import JointVelocities, JointVelocityActuator, JointVelocitySettings
from foosim.world.component_types.registry import actuator

class SpinSettings(JointVelocitySettings): pass

@actuator("spin", SpinSettings, JointVelocities, joints="joints")
class Spin(JointVelocityActuator):
    def __init__(self, settings, at):
        super().__init__(settings, at)
        self.joints = 3
"""


@pytest.mark.parametrize("kind", ["joint_velocity", "own_spin:Spin"])
def test_actuators_of_disjoint_joints_share_a_robot(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Wheels by speeds beside an arm by position; what no actuator names is free. An own attribute `joints` is one's
    own."""
    (tmp_path / "own_spin.py").write_text(OWN_SPIN)
    monkeypatch.syspath_prepend(str(tmp_path))
    actuators = {
        "arm": {"kind": "joint_position", "joints": "*_reach"},
        "wheels": {"kind": kind, "joints": ["to_right", "to_l*"]},
    }
    cart = {"model": "urdf", "file": "cart.urdf", "fixed": True, "at": {"z": "1 m"}, "actuators": actuators}
    files = {"cart.urdf": f'<robot name="cart"><link name="foot"/>{PARTS}</robot>'.encode()}
    yard = Yard(yard_text({"cart": cart}, engine="mujoco", physics={"gravity": "1 m/s2"}), files)
    yard.put("cart", "wheels.set_point", 2.0, -1.0)
    yard.put("cart", "arm.set_point", 0.5)
    yard.step(100)
    left, reach, right, spare = yard.vector("cart", "joint_positions")
    assert [left, right] == pytest.approx([-1.0, 2.0], rel=0.02)
    assert reach == pytest.approx(0.5, abs=0.01) and spare == pytest.approx(0.0, abs=1e-9)


def test_a_revolute_joint_stops_at_its_limits() -> None:
    body = Body("arm", "limited", (0.0, 0.0, 3.0), (Link(
        "arm", "revolute", (shape(Sphere(0.02), position=(0.0, 0.0, -0.5)),), 1.0, (1e-4,) * 3,
        centre_of_mass=(0.0, 0.0, -0.5), axis=Y, limits=(-0.5, 0.8),
    ),))  # fmt: skip
    with solids(body) as one:
        one.drives["arm"] = Drives((Motor(2.0, 50.0),))
        one.run(200)
        assert one.get("arm", "joint_positions")[0] == pytest.approx(0.8, abs=0.02)
        one.drives["arm"] = Drives((Motor(-2.0, 50.0),))
        one.run(200)
        assert one.get("arm", "joint_positions")[0] == pytest.approx(-0.5, abs=0.02)


def corners(half: Vector) -> Mesh:
    import numpy as np

    points = [[x, y, z] for x in (-half[0], half[0]) for y in (-half[1], half[1]) for z in (-half[2], half[2])]
    return Mesh(np.array(points), np.zeros((0, 3), np.int32), b"corners")


@pytest.mark.parametrize(
    ("name", "shapes", "height"),
    [
        ("box", (shape(Box((0.1, 0.1, 0.1))),), 0.1),
        ("cylinder", (shape(Cylinder(0.1, 0.3)),), 0.15),
        ("capsule", (shape(Capsule(0.1, 0.3), orientation=turn(Y, pi / 2)),), 0.1),
        ("hull", (shape(Hull(corners((0.1, 0.1, 0.1)))),), 0.1),
        ("hulls", (shape(Box((0.1, 0.1, 0.02))), shape(Hull(corners((0.05, 0.05, 0.1))))), 0.1),
        ("several", (shape(Sphere(0.05), position=(0.1, 0.0, -0.05)), shape(Box((0.2, 0.2, 0.1)))), 0.1),
    ],
)
def test_what_lies_on_the_floor_stays_as_high_as_its_shape(name: str, shapes: tuple, height: float) -> None:  # type: ignore[type-arg]
    body = Body(name, name, ORIGIN, (Link(name, "free", shapes, 1.0, (0.01, 0.01, 0.01)),), speed_limit=10.0)
    with solids(body) as one:
        one.put(name, (0.0, 0.0, height + 0.005))
        one.run(100)
        assert one.get(name, "position")[2] == pytest.approx(height, abs=0.003), one.get(name, "position")
        count, impulse, last = one.get(name, "contacts")
        assert (count, last) == (0.0, 3.0) and impulse == pytest.approx(GRAVITY * TICK_S, rel=0.02)


def tree(case: int, *, with_hulls: bool) -> Body:
    """Eight links of drawn joints on drawn parents, in no order of depth; with further hulls on each, or without.

    Its base is fixed where the case is even, else free.
    """
    random = Random(SEED * 100 + case)
    further = tuple([shape(Hull(corners((0.02, 0.02, 0.02))), position=(0.1, 0.0, z)) for z in (0.0, 0.1)])
    links = []
    for number in range(8):
        joint: JointKind = random.choice(JOINT_KINDS) if number else ("free" if case % 2 else "fixed")
        parent = random.randrange(number) if number else -1
        shapes = (shape(Box((0.03, 0.03, 0.03))), *(further if with_hulls else ()))
        mass, inertia = random.uniform(0.5, 2.0), (random.uniform(0.02, 0.03),) * 3
        axis = random.choice(((1.0, 0.0, 0.0), Y, Z))
        place = (random.uniform(0.2, 0.3), random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2))
        made = Link(f"a{number}", joint, shapes, mass, inertia, axis=axis, limits=(-1.0, 1.0))
        links.append(replace(made, parent=parent, position=place))
    return Body("tree", "tree", ORIGIN, tuple(links), speed_limit=10.0)


@pytest.mark.parametrize("case", range(6))
def test_each_joint_of_a_tree_with_further_hulls_is_the_one_that_is_commanded(case: int) -> None:
    """It moves and is read back, where the tree without them has it; so have all others, masses and motors."""
    ends = {}
    for with_hulls in (False, True):
        body = tree(case, with_hulls=with_hulls)
        count = len(body.joints)
        with solids(body, feel=physics(gravity=0.0), scenery=()) as one:
            start = one.numbers.copy()
            for joint in range(count):
                one.numbers[:] = start
                motors = [Motor(0.0, 1000.0)] * count
                motors[joint] = Motor(0.5, 1000.0)
                one.drives["tree"] = Drives(tuple(motors))
                one.run(20)
                positions = one.get("tree", "joint_positions")
                assert positions[joint] == pytest.approx(0.1, abs=0.01)
                others = positions[:joint] + positions[joint + 1 :]
                assert others == pytest.approx([0.0] * (count - 1), abs=0.01)
                ends[with_hulls, joint] = one.numbers.copy()
    for (with_hulls, joint), numbers in ends.items():
        assert numbers == pytest.approx(ends[False, joint], abs=1e-9), (with_hulls, joint)


def test_a_body_knows_whom_it_touches() -> None:
    """A box on a box: the lower one touches the upper one and the floor, impulses are of their weights."""
    with solids(box("a", (0.1, 0.1, 0.1), 1.0), box("b", (0.1, 0.1, 0.1), 2.0)) as one:
        one.put("a", (0.0, 0.0, 0.1))
        one.put("b", (0.0, 0.0, 0.3))
        one.run(100)
        assert one.get("a", "partners") == [1.0, -1.0, -1.0, -1.0] and one.get("b", "partners")[0] == 0.0
        assert one.get("b", "partner_impulses")[0] == pytest.approx(2.0 * GRAVITY * TICK_S, rel=0.05)
        assert one.get("a", "contacts")[1] == pytest.approx((2.0 + 3.0) * GRAVITY * TICK_S, rel=0.05)


# --- a quadrotor -----------------------------------------------------------------------------------------------------


def flying(case: int) -> tuple[Yard, QuadrotorRobot]:
    """A quadrotor of a drawn airframe, 5 m up; ticks of 10 ms with four substeps."""
    mass, arm = draw(200 + case, 0.3, 5.0), draw(210 + case, 0.1, 0.5)
    thrust = f"{draw(220 + case, 5e-6, 5e-5):.9e}"
    frame = {"mass": f"{mass:.6f} kg", "arm": f"{arm:.6f} m", "rotor_radius": f"{arm / 3:.6f} m"}
    settings = {**frame, "thrust_factor": float(thrust), "rotor_speed": "20000 rad/s", "at": {"z": "5 m"}}
    physics = {"gravity": f"{GRAVITY} m/s2"}
    text = yard_text({"quad": {"model": "quadrotor", **settings}}, engine="mujoco", substeps=4, physics=physics)
    yard = Yard(text)
    found = yard.deployment.robots["quad"]
    assert isinstance(found, QuadrotorRobot)
    return yard, found


def hover_speed(quad: QuadrotorRobot) -> float:
    return sqrt(quad.mass * GRAVITY / (4.0 * quad.thrust_factor))


@pytest.mark.parametrize("hovers", [True, False])
@pytest.mark.parametrize("case", range(3))
def test_a_quadrotor_climbs_with_the_thrust_above_its_weight(case: int, hovers: bool) -> None:
    """a = 4 k w^2 / m - g; after n substeps of h: v = a n h and the way a h^2 n (n + 1) / 2; it hovers where a is 0."""
    yard, quad = flying(case)
    speed = hover_speed(quad) * (1.0 if hovers else draw(230 + case, 0.9, 1.2))
    yard.put("quad", "rotors.set_point", *[speed] * 4)
    yard.step(50)
    steps, h = 200, TICK_S / 4
    rate = 4.0 * quad.thrust_factor * speed * speed / quad.mass - GRAVITY
    assert (abs(rate) > 0.1) is not hovers
    velocity, way = (0.0, 0.0, rate * steps * h), rate * h * h * steps * (steps + 1) / 2
    assert yard.vector("quad", "linear_velocity") == pytest.approx(velocity, rel=1e-6, abs=1e-9)
    assert yard.vector("quad", "position") == pytest.approx([0.0, 0.0, 5.0 + way], abs=1e-6 * abs(way) + 1e-9)
    assert yard.vector("quad", "angular_velocity") == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)


@pytest.mark.parametrize("case", range(3))
def test_a_quadrotor_turns_with_the_drag_of_its_rotors_and_tilts_with_their_thrusts(case: int) -> None:
    """Two rotors of one sense faster: 2 d (w1^2 - w2^2) / I_z about z. Two of one side: a roll of k s (...) / I_x."""
    yard, quad = flying(case)
    side, height, half = 0.6 * quad.arm, quad.height, quad.mass / 2.0
    about_z = half * side * side / 6.0 + half * quad.arm * quad.arm
    about_x = half * (side * side + height * height) / 12.0 + half * quad.arm * quad.arm / 2.0
    one = hover_speed(quad)
    other = one * draw(240 + case, 1.01, 1.05)
    yard.put("quad", "rotors.set_point", one, other, one, other)
    yard.step(10)
    yaw = -2.0 * quad.drag_factor * (other * other - one * one) / about_z * 0.1  # rear left and front right: positive
    turned = yard.vector("quad", "angular_velocity")
    assert turned[2] == pytest.approx(yaw, rel=1e-4) and turned[:2] == pytest.approx([0.0, 0.0], abs=1e-9)
    yard, _ = flying(case)
    yard.put("quad", "rotors.set_point", other, other, one, one)
    yard.step(1)
    roll = 2.0 * quad.arm / sqrt(2.0) * quad.thrust_factor * (other * other - one * one) / about_x * TICK_S
    assert yard.vector("quad", "angular_velocity")[0] == pytest.approx(roll, rel=1e-3)


# --- movers ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ticks", [1, 100])
def test_a_mover_pushes_a_box(ticks: int) -> None:
    """A wall without a mass reaches a box at 0.5 m/s: from the first tick on it has that speed, and stays before it."""
    wall = Body("wall", "wall", ORIGIN, (Link("wall", "free", (shape(Box((0.05, 0.5, 0.2))),), 0.0, ORIGIN),))
    with solids(box("a", (0.1, 0.1, 0.1), 1.0), wall) as one:
        step_s = TICK_S / one.substeps
        engine = CompositionEngine(one.feel, step_s, one.substeps, one.scenery, one.bodies[:1], one.bodies[1:])
        one.put("a", (0.15, 0.0, 0.1))
        for tick in range(ticks):
            one.put("wall", (0.0 + 0.5 * TICK_S * tick, 0.0, 0.2), velocity=(0.5, 0.0, 0.0))
            one.push(engine)
        engine.close()
        assert one.get("a", "linear_velocity")[0] == pytest.approx(0.5, abs=0.03 if ticks == 1 else 0.01)
        assert one.get("a", "position")[0] == pytest.approx(0.15 + 0.5 * TICK_S * ticks, abs=0.005)
        assert one.get("a", "partners")[0] == 1.0

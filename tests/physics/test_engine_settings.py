"""What each setting of the Bullet engine is there for: with another one a truth of the table does not hold any more.

A setting is undone in the engine as it was built. `numSubSteps`, `fixedTimeStep`, ERP, thresholds and slop are
parameters of the world; damping, the clamp of speeds and the threshold of processing are those of bodies.

No truth changes with `warmStartingFactor`, `deterministicOverlappingPairs`, `useSplitImpulse`, cones of friction, sleep
(a body that is loaded at each tick never falls asleep) and the groups of collision, which save four fifths of a step.
`minimumSolverIslandSize` and `solverResidualThreshold` keep law 1: tests/laws/test_engine_partition.py.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Final

import pybullet as p
import pytest

from foosim.node.physics.bullet_client import give_client, make_scenery, make_surface, settings_of, start_client
from foosim.world.assembly.sections import physics_of
from foosim.world.scene import Box, Shape

Make = Callable[..., Any]
NO_GRAVITY: Final = "table.gravity=0 m/s2"
EXACT: Final = "table.contact_erp=0"


@pytest.fixture
def bullet(world: Make) -> Make:
    return lambda *sets: world("engine=bullet", EXACT, *sets)


def of_world(one: Any, **settings: Any) -> None:
    p.setPhysicsEngineParameter(**settings, physicsClientId=one.engine._client)


def of_bodies(one: Any, **settings: Any) -> None:
    """Set something of all links of all bodies, scenery too."""
    client = one.engine._client
    for number in range(p.getNumBodies(client)):
        body = p.getBodyUniqueId(number, physicsClientId=client)
        for link in range(-1, p.getNumJoints(body, client)):
            p.changeDynamics(body, link, **settings, physicsClientId=client)


# --- the measurements ------------------------------------------------------------------------------------------------


def rebounds(one: Any, speed: float) -> tuple[float, float]:
    """The least and the greatest restitution at ten phases of a contact within a substep."""
    measured = []
    for phase in range(10):
        one.bounce_off_side(speed, phase / 10)
        measured.append(-one.velocity[1] / speed)
    return min(measured), max(measured)


def acceleration(one: Any) -> float:
    """That of a rod whose slide is driven by 50 N, as a share of F/m."""
    one.set_rod("red.goal", (0.0, 0.0), (0.0, 0.0))
    for _ in range(5):
        one.tick({"red.goal": ((1000.0, 50.0), (0.0, 0.0))}, ball=False)
    measured = one.of("red.goal", "joint_velocities", 2)[0] / (5 * one.tick_s)
    return float(measured / (50.0 / one.rod_mass("red.goal")))


def braking(one: Any, speed: float) -> float:
    """The deceleration of a ball that rolls for half a second, as a share of 5/7 rho g / r."""
    one.roll(x=-0.4, speed=speed, seconds=0.5)
    rho, ball = one.table.surfaces.floor.rolling_friction, one.table.ball
    measured = (speed - one.velocity[0]) / 0.5
    return float(measured / (5 / 7 * rho * one.table.gravity / ball.radius))


def speed_after(one: Any, speed: float, seconds: float) -> float:
    one.roll(x=-0.25, speed=speed, seconds=seconds)
    left: float = one.velocity[0]
    return left


# --- motors ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("substeps", [2, 4])
def test_substeps_of_bullets_own_multiply_the_force_of_motors(bullet: Make, substeps: int) -> None:
    one = bullet(NO_GRAVITY)
    assert acceleration(one) == pytest.approx(1.0, rel=0.001)
    of_world(one, numSubSteps=substeps)
    assert acceleration(one) == pytest.approx(substeps, rel=0.01)


# --- damping and clamps ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("damping", ["linearDamping", "angularDamping"])
def test_bullets_usual_damping_stops_a_free_roll(bullet: Make, damping: str) -> None:
    rolling = "table.surfaces.floor.rolling_friction=0 mm"
    one = bullet(rolling)
    assert speed_after(one, 0.2, 2.0) == pytest.approx(0.2, abs=1e-6)
    of_bodies(one, **{damping: 0.04})
    assert speed_after(one, 0.2, 2.0) < 0.199


def test_bullets_usual_damping_of_joints_brakes_a_free_rod(bullet: Make) -> None:
    one = bullet(NO_GRAVITY)
    after = []
    for joint_damping in (0.0, 0.04):
        for link in range(2):
            p.changeDynamics(
                one.engine._chains["red.goal"].body,
                link,
                jointDamping=joint_damping,
                physicsClientId=one.engine._client,
            )
        one.set_rod("red.goal", (0.0, 0.0), (0.5, 50.0))
        for _ in range(50):
            one.tick({"red.goal": ((0.0, 0.0), (0.0, 0.0))}, ball=False)
        after.append(one.of("red.goal", "joint_velocities", 2))
    assert after[0] == pytest.approx([0.5, 50.0], rel=1e-9)
    assert after[1][1] < 40.0


def test_bullets_usual_clamp_is_100_rad_per_second(bullet: Make) -> None:
    one = bullet("table.surfaces.floor.rolling_friction=0 mm")
    assert speed_after(one, 5.0, 0.1) == pytest.approx(5.0, rel=1e-6)
    motors = {"red.attack": ((0.0, 90.0), (150.0, 2.0))}
    turning = []
    for limit in (1000.0, 100.0):
        of_bodies(one, maxJointVelocity=limit)
        one.set_rod("red.attack", (0.0, 0.0), (0.0, 0.0))
        for _ in range(30):
            one.tick(motors, ball=False)
        turning.append(one.of("red.attack", "joint_velocities", 2)[1])
    assert turning == pytest.approx([150.0, 100.0], rel=1e-6)
    assert speed_after(one, 5.0, 0.1) < 4.9 and one.spin[1] <= 100.0 + 1e-9


# --- contacts --------------------------------------------------------------------------------------------------------


def test_bullets_usual_contact_erp_adds_up_to_a_tenth_of_the_restitution(bullet: Make) -> None:
    one = bullet(NO_GRAVITY)
    assert rebounds(one, 1.0) == pytest.approx((0.7, 0.7), abs=1e-4)
    of_world(one, contactERP=0.08)
    least, most = rebounds(one, 1.0)
    assert least > 0.7 - 1e-9 and 0.76 < most < 0.78


def test_contacts_ahead_of_the_touch_spoil_restitution(bullet: Make) -> None:
    """Processed as soon as they are seen, as is usual, they stop a slow ball before it touches."""
    one = bullet(NO_GRAVITY)
    assert rebounds(one, 0.3) == pytest.approx((0.7, 0.7), abs=1e-4)
    of_bodies(one, contactProcessingThreshold=1e18)
    least, most = rebounds(one, 0.3)
    assert least < 0.1 and most < 0.1
    of_world(one, contactBreakingThreshold=0.001)
    assert rebounds(one, 0.3)[0] < 0.6, "neither does a smaller threshold of breaking"


def test_contacts_that_break_too_early_brake_a_slow_ball(bullet: Make) -> None:
    """At 1 mm, a point stays where the ball has rolled away from it, and brakes as well."""
    one = bullet()
    for speed in (0.1, 0.2, 0.4):
        assert braking(one, speed) == pytest.approx(1.0, rel=0.01)
    of_world(one, contactBreakingThreshold=0.001)
    assert braking(one, 0.2) > 1.2 and braking(one, 0.4) > 1.1


def test_bullets_usual_threshold_of_restitution_stops_slow_balls(bullet: Make) -> None:
    """0.2 m/s: a ball at 15 cm/s stays at the wall."""
    one = bullet(NO_GRAVITY)
    assert rebounds(one, 0.15) == pytest.approx((0.7, 0.7), abs=1e-4)
    of_world(one, restitutionVelocityThreshold=0.2)
    assert rebounds(one, 0.15) == pytest.approx((0.0, 0.0), abs=1e-4)


def test_a_tolerated_penetration_makes_a_wall_soft(bullet: Make) -> None:
    one = bullet(NO_GRAVITY)
    of_world(one, contactSlop=0.001)
    assert rebounds(one, 1.0)[1] < 0.1


def test_one_iteration_of_the_solver_makes_a_held_rod_weak(bullet: Make) -> None:
    """Motor and contact need each other's result: of a kick of (1 + e) w a two thirds are left."""
    one = bullet()
    arm = one.table.rod.axis_height - one.table.ball.radius
    wanted = (1 + one.table.surfaces.figures.restitution) * 60.0 * arm
    assert one.kick("red.attack", 60.0, held=True)[0] == pytest.approx(wanted, rel=0.02)
    of_world(one, numSolverIterations=1)
    assert one.kick("red.attack", 60.0, held=True)[0] < 0.7 * wanted


def test_restitution_is_a_product_of_both_sides(bullet: Make) -> None:
    """Usual bodies have 0: a ball without its own does not bounce, whatever the wall has."""
    one = bullet(NO_GRAVITY)
    p.changeDynamics(one.engine._free["ball"], -1, restitution=0.0, physicsClientId=one.engine._client)
    assert rebounds(one, 1.0) == pytest.approx((0.0, 0.0), abs=1e-4)


# --- nothing passes through ------------------------------------------------------------------------------------------


def passed(one: Any) -> int:
    """How many of 40 shots at 15 m/s pass a foot that stands still."""
    return sum(one.shoot_at_foot("blue.midfield", 15.0, 0.0, phase / 40)[0] for phase in range(40))


def test_at_a_coarse_step_balls_pass_feet(bullet: Make) -> None:
    """4 ms, where 1/240 s is usual: more than half pass. Continuous collision detection does not help a multibody."""
    coarse = bullet("tick=4 ms", "substeps=1", "players={}")
    assert passed(coarse) > 20
    radius = coarse.table.ball.radius
    p.changeDynamics(
        coarse.engine._free["ball"], -1, ccdSweptSphereRadius=radius, physicsClientId=coarse.engine._client
    )
    assert passed(coarse) > 20


@pytest.fixture
def rigid_ball(bullet: Make) -> Iterator[Callable[[], list[float]]]:
    """The restitutions of a rigid ball at a wall at 1/240 s, 10 m/s and ten phases; `ccd` gives it CCD."""
    one = bullet(NO_GRAVITY)
    physics, step_s, radius = physics_of(one.deployment), 1 / 240, one.table.ball.radius
    client = start_client(settings_of(physics, step_s), 0.0)
    wall = Shape(Box((0.5, 0.2, 0.5)), "walls", (0.0, 0.0, 0.0, 1.0), (0.0, 0.2, 0.0))
    make_scenery(client, wall, (1, 1), physics.sides["walls"])
    shape = p.createCollisionShape(p.GEOM_SPHERE, radius=radius, physicsClientId=client)
    ball = p.createMultiBody(one.table.ball.mass, shape, useMaximalCoordinates=True, physicsClientId=client)
    for damping in ("linearDamping", "angularDamping"):
        p.changeDynamics(ball, -1, **{damping: 0.0}, physicsClientId=client)
    make_surface(client, ball, -1, physics.sides["ball"])

    def measured(ccd: float = 0.0) -> list[float]:
        p.changeDynamics(ball, -1, ccdSweptSphereRadius=ccd, physicsClientId=client)
        found = []
        for phase in range(10):
            start = (0.0, -radius - 0.03 - phase / 10 * 10.0 * step_s, 0.0)
            p.resetBasePositionAndOrientation(ball, start, (0.0, 0.0, 0.0, 1.0), client)
            p.resetBaseVelocity(ball, (0.0, 10.0, 0.0), (0.0, 0.0, 0.0), client)
            for _ in range(6):
                p.stepSimulation(client)
            found.append(-p.getBaseVelocity(ball, client)[0][1] / 10.0)
        return found

    yield measured
    give_client(client)


def test_continuous_collision_detection_takes_the_bounce(rigid_ball: Callable[..., list[float]]) -> None:
    """What it keeps from passing stops at the wall: Bullet gives its predictive contacts a restitution of 0."""
    assert rigid_ball() == pytest.approx([0.7] * 10, abs=1e-3)
    stopped = [bounce for bounce in rigid_ball(ccd=0.0175) if bounce < 0.1]
    assert len(stopped) >= 2

"""Physical truths of the Bullet engine as it is used: loaded anew at every tick, with the numbers of table.yaml.

Each truth is a formula from a textbook; its source and what Bullet does with other settings is said beside it.
"""

from collections.abc import Callable
from math import pi, sqrt
from typing import Any

import pytest

Make = Callable[..., Any]
FOOT = "blue.midfield"
"""The rod that is heavy enough (60 g at the ball's height) to throw a ball of 15 m/s back."""


@pytest.fixture
def bullet(world: Make) -> Make:
    return lambda *sets: world("engine=bullet", *sets)


def test_a_free_roll_keeps_its_speed(bullet: Make) -> None:
    """Default damping stops a multibody ball within seconds."""
    one = bullet("table.surfaces.floor.rolling_friction=0 mm")
    one.roll(x=-0.25, speed=0.1, seconds=5.0)
    assert abs(one.velocity[0] - 0.1) < 1e-6
    assert abs(one.position[0] - 0.25) < 1e-6


@pytest.mark.parametrize("erp", [0, 0.01])
@pytest.mark.parametrize(
    ("start", "velocity"),
    [
        ((0.0, 0.0, 0.0175), (3.0, 2.0, 0.0)),
        ((0.2, 0.1, 0.0175), (-5.0, 4.0, 0.0)),
        ((-0.45, 0.2, 0.03), (-1.0, 2.0, 0.0)),  # over a ramp, into its corner
        ((0.1, 0.05, 0.02), (10.0, 0.1, 0.0)),  # into the goal
    ],
)
def test_energy_of_a_free_ball_never_rises(bullet: Make, erp: float, start: Any, velocity: Any) -> None:
    one = bullet(f"table.contact_erp={erp}")
    rise, first, touches = one.energy_rises(start, velocity, ticks=1000)
    assert rise <= one.deployment.substeps * 1e-9 * first
    assert touches >= 2
    assert one.energy < 0.5 * first


@pytest.mark.parametrize("speed", [0.3, 1.0, 3.0, 8.0, 15.0])
def test_a_rebound_has_the_pairs_restitution(bullet: Make, speed: float) -> None:
    """With Bullet's default contactERP it is e + (0 to 0.08), by the phase of the contact within a substep."""
    for erp, more in ((0.0, 1e-4), (0.01, 0.01)):
        one = bullet("table.gravity=0 m/s2", f"table.contact_erp={erp}")
        wanted = one.table.surfaces.walls.restitution
        for phase in range(10):
            one.bounce_off_side(speed, phase / 10)
            assert wanted - 1e-4 <= -one.velocity[1] / speed <= wanted + more


@pytest.mark.parametrize("along", [0.2, 1.0, 5.0])
def test_an_oblique_rebound_slips_or_rolls(bullet: Make, along: float) -> None:
    """v_t' = v_t - min(mu (1 + e) v_n, 2/7 v_t), and the spin 5/2 of the change over r."""
    one = bullet("table.gravity=0 m/s2", "table.contact_erp=0")
    one.bounce_off_side(speed=4.0, phase=0.3, along=along)
    walls = one.table.surfaces.walls
    change = min(walls.friction * (1 + walls.restitution) * 4.0, 2 / 7 * along)
    assert one.velocity[0] == pytest.approx(along - change, rel=1e-9)
    assert one.velocity[1] == pytest.approx(-4.0 * walls.restitution, rel=1e-9)
    assert one.spin[2] == pytest.approx(2.5 * change / one.table.ball.radius, rel=1e-9)


def test_rolling_friction_brakes_as_its_formula_says(bullet: Make) -> None:
    """a = 5/7 rho g / r."""
    one = bullet()
    one.roll(x=-0.3, speed=0.5, seconds=0.5)
    rho = one.table.surfaces.floor.rolling_friction
    wanted = 5 / 7 * rho * one.table.gravity / one.table.ball.radius
    assert (0.5 - one.velocity[0]) / 0.5 == pytest.approx(wanted, rel=0.01)


def test_a_sliding_ball_ends_rolling(bullet: Make) -> None:
    """At 5/7 of its speed, after 2 v / (7 mu g)."""
    one = bullet("table.surfaces.floor.rolling_friction=0 mm")
    radius = one.table.ball.radius
    one.put((-0.3, 0.06, radius), (1.0, 0.0, 0.0))
    ticks = 0
    while one.velocity[0] - one.spin[1] * radius > 1e-4:
        one.tick()
        ticks += 1
        assert ticks < 100
    assert one.velocity[0] == pytest.approx(5 / 7, rel=0.01)
    wanted = 2 / (7 * one.table.surfaces.floor.friction * one.table.gravity)
    assert abs(ticks * one.tick_s - wanted) <= 0.01 * wanted + one.tick_s / 2


@pytest.mark.parametrize(("speed", "turning"), [(15.0, 0.0), (15.0, 140.0)])
def test_no_ball_passes_a_foot(bullet: Make, speed: float, turning: float) -> None:
    """At a substep of 4 ms 27 of 40 pass a still foot; a touch begins once."""
    one = bullet()
    shots = [one.shoot_at_foot(FOOT, speed, turning, phase / 40) for phase in range(40)]
    assert shots == [(False, 1.0)] * 40


@pytest.mark.parametrize("speed", [10.0, 15.0, 30.0])
def test_no_ball_passes_an_end_wall(bullet: Make, speed: float) -> None:
    one = bullet()
    end = one.table.field.length / 2
    for phase in range(40):
        one.put((0.45 - phase / 40 * speed * one.tick_s / 4, 0.2, 0.04), (speed, 0.0, 0.0))
        touches = 0.0
        for _ in range(20):
            one.tick()
            assert one.position[0] < end
            touches += one.of("ball", "contacts", 1)[0]
        assert touches >= 1 and one.velocity[0] < 0.0


def test_a_motor_gives_its_force(bullet: Make) -> None:
    """a = F/m and alpha = tau/I: with numSubSteps of n Bullet gives n times the force."""
    one = bullet("table.gravity=0 m/s2")
    name = "red.goal"
    for _ in range(5):
        one.tick({name: ((1000.0, 90.0), (1000.0, 0.5))}, ball=False)
    seconds = 5 * one.tick_s
    slide, spin = one.of(name, "joint_velocities", 2)
    assert slide / seconds == pytest.approx(90.0 / one.rod_mass(name), rel=0.001)
    assert spin / seconds == pytest.approx(0.5 / one.rod_inertia(name), rel=0.001)


def test_hanging_figures_swing_with_their_period(bullet: Make) -> None:
    """2 pi sqrt(I / (m g d)) (1 + a^2 / 16): mass, centre and inertia of what turns are in the engine as computed."""
    one = bullet()
    name = "red.attack"
    one.set_rod(name, (0.0, 0.1), (0.0, 0.0))
    link = one.scene.bodies[name].links[1]
    down, crossings = 0.1, []
    for tick in range(1200):
        one.tick({name: ((0.0, 0.0), (0.0, 0.0))}, ball=False)
        angle = one.of(name, "joint_positions", 2)[1]
        if down > 0.0 >= angle:
            crossings.append((tick + down / (down - angle)) * one.tick_s)
        down = angle
    below = link.mass * one.table.gravity * -link.centre_of_mass[2]
    wanted = 2 * pi * sqrt(one.rod_inertia(name) / below) * (1 + 0.1**2 / 16)
    assert len(crossings) >= 4
    assert (crossings[-1] - crossings[0]) / (len(crossings) - 1) == pytest.approx(wanted, rel=0.005)


@pytest.mark.parametrize("name", ["red.goal", "red.attack", "red.midfield"])
def test_a_free_rod_kicks_and_recoils(bullet: Make, name: str) -> None:
    """v = (1 + e) w a / (1 + m a^2 / I): a rod without recoil would be wrong by up to a factor of two."""
    one = bullet()
    for turning in (20.0, 60.0, 120.0):
        speed, theory, _ = one.kick(name, turning)
        assert speed == pytest.approx(theory, rel=0.02)


def test_nothing_is_clamped_and_strokes_hold(bullet: Make) -> None:
    """Bullet's default clamp of 100 rad/s would slow the ball to 1.75 m/s."""
    one = bullet("table.surfaces.floor.rolling_friction=0 mm")
    one.roll(x=-0.4, speed=5.0, seconds=0.1)
    assert one.spin[1] == pytest.approx(5.0 / one.table.ball.radius, rel=1e-6)
    name = "red.attack"
    one.set_rod(name, (0.0, 0.0), (3.0, 0.0))
    for _ in range(50):
        one.tick({name: ((0.0, 0.0), (0.0, 0.0))}, ball=False)
        assert one.of(name, "joint_positions", 1)[0] <= one.table.lines["attack"].half_stroke + 1e-4
    assert abs(one.of(name, "joint_velocities", 1)[0]) < 1e-9

"""Twelve truths of the Bullet engine as it is used: loaded anew at every tick, with the numbers of table.yaml.

Each is a formula from a textbook, with the tolerance to which the engine keeps it; its source and what Bullet does with
other settings is said beside it. Speeds, angles and phases are drawn; a test that fails prints the seed of its draws.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from math import atan2, cos, degrees, exp, log, pi, sin, sqrt
from typing import Any, Final

import pytest

Make = Callable[..., Any]
FOOT = "blue.midfield"
"""The rod that is heavy enough (60 g at the ball's height) to throw a ball of 15 m/s back."""
SEED: Final = 20
ERPS: Final = (0, 0.01)
"""Exact, and as the table plays: a ball that a figure presses down does not sink then."""
EACH: Final = pytest.mark.parametrize(("engine", "contact_erp"), [*(("bullet", erp) for erp in ERPS), ("pure", 0)])
"""The truths that both engines keep."""
NO_ROLLING: Final = "table.surfaces.floor.rolling_friction=0 mm"
NO_GRAVITY: Final = "table.gravity=0 m/s2"


@pytest.fixture
def bullet(world: Make) -> Make:
    return lambda *sets: world("engine=bullet", *sets)


@pytest.fixture
def draws(request: pytest.FixtureRequest) -> random.Random:
    seed = f"{SEED} {request.node.name}"
    print(f"seed of the draws: {seed!r}")
    return random.Random(seed)


def speed_of(draws: random.Random, least: float, most: float) -> float:
    """A speed with each order of magnitude as likely as another."""
    return exp(draws.uniform(log(least), log(most)))


def erp(value: float) -> str:
    return f"table.contact_erp={value}"


# --- 1: energy -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("contact_erp", ERPS)
def test_a_free_roll_keeps_its_speed(bullet: Make, draws: random.Random, contact_erp: float) -> None:
    """|v(5 s) - v0| < 1e-6. Default damping stops a multibody ball within seconds."""
    one = bullet(NO_ROLLING, erp(contact_erp))
    speed = draws.uniform(0.02, 0.1)
    one.roll(x=-0.25, speed=speed, seconds=5.0)
    assert abs(one.velocity[0] - speed) < 1e-6
    assert abs(one.position[0] - (-0.25 + 5.0 * speed)) < 1e-6


@EACH
def test_energy_of_a_free_ball_never_rises(world: Make, engine: str, draws: random.Random, contact_erp: float) -> None:
    """By no more than 1e-9 of what it was a substep: over the floor, walls, into goals and corners."""
    one = world(f"engine={engine}", erp(contact_erp))
    touched = 0
    for _ in range(6):
        start = (draws.uniform(-0.5, 0.5), draws.uniform(-0.25, 0.25), draws.uniform(0.03, 0.06))
        angle, speed = draws.uniform(0.0, 2.0 * pi), speed_of(draws, 0.5, 15.0)
        rise, first, touches = one.energy_rises(start, (speed * cos(angle), speed * sin(angle), 0.0), ticks=500)
        assert rise <= one.deployment.substeps * 1e-9 * first, (start, angle, speed)
        touched += touches
    assert touched >= 6


# --- 2, 3: rebounds --------------------------------------------------------------------------------------------------


@EACH
def test_a_rebound_has_the_pairs_restitution(
    world: Make, engine: str, draws: random.Random, contact_erp: float
) -> None:
    """e within 1e-4, or e to e + ERP. With Bullet's default contactERP it is e + (0 to 0.08), by the phase of the
    contact within a substep."""
    one = world(f"engine={engine}", NO_GRAVITY, erp(contact_erp))
    wanted = one.table.surfaces.walls.restitution
    for speed in (0.3, *(speed_of(draws, 0.3, 15.0) for _ in range(4)), 15.0):
        for phase in range(10):
            one.bounce_off_side(speed, (phase + draws.random()) / 10)
            assert wanted - 1e-4 <= -one.velocity[1] / speed <= wanted + max(contact_erp, 1e-4), (speed, phase)


@EACH
def test_an_oblique_rebound_slips_or_rolls(world: Make, engine: str, draws: random.Random, contact_erp: float) -> None:
    """v_t' = v_t - min(mu (v_n + v_n'), 2/7 v_t), v_n' = e v_n, and the spin 5/2 of the change over r."""
    one = world(f"engine={engine}", NO_GRAVITY, erp(contact_erp))
    walls = one.table.surfaces.walls
    slips, rolls = 0, 0
    for _ in range(40):
        onto, along = speed_of(draws, 0.5, 12.0), speed_of(draws, 0.2, 8.0)
        one.bounce_off_side(speed=onto, phase=draws.random(), along=along)
        x, y = one.velocity[0], -one.velocity[1]
        assert walls.restitution - 1e-9 <= y / onto <= walls.restitution + contact_erp + 1e-9
        change = min(walls.friction * (onto + y), 2 / 7 * along)
        slips, rolls = slips + (change < 2 / 7 * along), rolls + (change == 2 / 7 * along)
        assert x == pytest.approx(along - change, rel=1e-9)
        assert one.spin[2] == pytest.approx(2.5 * change / one.table.ball.radius, rel=1e-9)
        change = min(walls.friction * (1 + walls.restitution) * onto, 2 / 7 * along)
        wanted = degrees(atan2(along - change, walls.restitution * onto))
        assert abs(degrees(atan2(x, y)) - wanted) <= (0.5 if contact_erp else 0.01)
    assert slips >= 5 and rolls >= 5


# --- 4: rolling and sliding ------------------------------------------------------------------------------------------


@EACH
@pytest.mark.parametrize("rolling", [0.1, 0.2, 0.5])
def test_rolling_friction_brakes_as_its_formula_says(
    world: Make, engine: str, draws: random.Random, contact_erp: float, rolling: float
) -> None:
    """a = 5/7 rho g / r, at any speed."""
    one = world(f"engine={engine}", f"table.surfaces.floor.rolling_friction={rolling} mm", erp(contact_erp))
    wanted = 5 / 7 * rolling / 1000 * one.table.gravity / one.table.ball.radius
    for _ in range(6):
        speed = speed_of(draws, 0.05, 0.8) + 0.5 * wanted
        one.roll(x=-0.4, speed=speed, seconds=0.5)
        assert (speed - one.velocity[0]) / 0.5 == pytest.approx(wanted, rel=0.01)


@pytest.mark.parametrize("contact_erp", ERPS)
def test_a_sliding_ball_ends_rolling(bullet: Make, draws: random.Random, contact_erp: float) -> None:
    """At 5/7 of its speed, after 2 v / (7 mu g)."""
    one = bullet(NO_ROLLING, erp(contact_erp))
    radius = one.table.ball.radius
    speed = draws.uniform(0.8, 1.5)
    one.put((-0.3, 0.06, radius), (speed, 0.0, 0.0))
    ticks = 0
    while one.velocity[0] - one.spin[1] * radius > 1e-4:
        one.tick()
        ticks += 1
        assert ticks < 200
    assert one.velocity[0] == pytest.approx(5 / 7 * speed, rel=0.01)
    wanted = 2 * speed / (7 * one.table.surfaces.floor.friction * one.table.gravity)
    assert abs(ticks * one.tick_s - wanted) <= 0.01 * wanted + one.tick_s / 2


# --- 5, 6: in the air ------------------------------------------------------------------------------------------------


def test_a_flying_ball_is_half_a_substep_ahead_in_falling(bullet: Make, draws: random.Random) -> None:
    """z differs from the parabola by -g dt T / 2 (semi-implicit Euler: speeds first), x and y by nothing."""
    one = bullet()
    substep = one.tick_s / one.deployment.substeps
    for _ in range(5):
        vx, vy, vz = draws.uniform(-0.8, 0.8), draws.uniform(-0.5, 0.5), draws.uniform(1.5, 2.0)
        one.put((0.0, 0.0, 0.2), (vx, vy, vz))
        ticks = draws.randrange(50, 150)
        for _ in range(ticks):
            one.tick()
        time = ticks * one.tick_s
        x, y, z = one.position
        parabola = 0.2 + vz * time - one.table.gravity * time * time / 2
        assert z - parabola == pytest.approx(-one.table.gravity * substep * time / 2, abs=1e-9)
        assert (x, y) == (pytest.approx(vx * time, abs=1e-12), pytest.approx(vy * time, abs=1e-12))


@pytest.mark.parametrize("contact_erp", ERPS)
def test_a_dropped_ball_bounces_to_e_squared_of_its_height(
    bullet: Make, draws: random.Random, contact_erp: float
) -> None:
    """25, 6.25 and 1.56 mm from 100 mm at e = 0.5, within 3 % and what ERP gives."""
    one = bullet(erp(contact_erp))
    radius, bounce = one.table.ball.radius, one.table.surfaces.floor.restitution
    for height in (0.1, draws.uniform(0.08, 0.2), draws.uniform(0.08, 0.2)):
        one.put((0.1, 0.05, radius + height))
        peaks: list[float] = []
        climbs = False
        while len(peaks) < 3:
            one.tick()
            if climbs and one.velocity[2] <= 0.0:
                peaks.append(one.position[2] - radius)
            climbs = one.velocity[2] > 0.0
        for number, peak in enumerate(peaks, 1):
            least, most = bounce ** (2 * number), (bounce + contact_erp) ** (2 * number)
            assert 0.97 * least * height <= peak <= 1.03 * most * height, (height, peaks)


# --- 7: kicks --------------------------------------------------------------------------------------------------------


@EACH
@pytest.mark.parametrize("name", ["red.goal", "red.attack", "red.midfield"])
def test_a_free_rod_kicks_and_recoils(
    world: Make, engine: str, draws: random.Random, name: str, contact_erp: float
) -> None:
    """v = (1 + e) w a / (1 + m a^2 / I) within 1 %: a rod without recoil would be wrong by up to a factor of two.

    The rod keeps w (1 - (1 + e) / (1 + I / (m a^2))) of its spin, within 2 % of w. ERP may add its share to e.
    """
    one = world(f"engine={engine}", erp(contact_erp))
    more = contact_erp / (1 + one.table.surfaces.figures.restitution)
    arm = one.table.rod.axis_height - one.table.ball.radius
    ratio = one.rod_inertia(name) / (one.table.ball.mass * arm * arm)
    for turning in (20.0, *(draws.uniform(20.0, 120.0) for _ in range(4)), 120.0):
        speed, theory, after = one.kick(name, turning, phase=draws.random())
        assert speed == pytest.approx(theory, rel=0.01 + more)
        kept = 1 - (1 + one.table.surfaces.figures.restitution) / (1 + ratio)
        assert after / turning == pytest.approx(kept, abs=0.02 + more)


@pytest.mark.parametrize("contact_erp", ERPS)
def test_a_driven_rod_kicks_like_a_wall(bullet: Make, draws: random.Random, contact_erp: float) -> None:
    """v = (1 + e) w a within 2 %, and what ERP gives, with a motor that holds the speed."""
    one = bullet(erp(contact_erp))
    more = contact_erp / (1 + one.table.surfaces.figures.restitution)
    arm = one.table.rod.axis_height - one.table.ball.radius
    for turning in (20.0, *(draws.uniform(20.0, 120.0) for _ in range(4)), 120.0):
        speed, _, _ = one.kick("red.attack", turning, phase=draws.random(), held=True)
        assert speed == pytest.approx((1 + one.table.surfaces.figures.restitution) * turning * arm, rel=0.02 + more)


# --- 8: nothing passes through ---------------------------------------------------------------------------------------


BOTH: Final = pytest.mark.parametrize("engine", ["bullet", "pure"])


@BOTH
@pytest.mark.parametrize("turning", [0.0, 140.0])
def test_no_ball_passes_a_foot(world: Make, draws: random.Random, turning: float, engine: str) -> None:
    """200 shots at 15 m/s; at a substep of 4 ms 27 of 40 pass a still foot. A touch begins once. 40 slower ones."""
    one = world(f"engine={engine}")
    phases = [(number + draws.random()) / 200 * 4 for number in range(200)]
    shots = [one.shoot_at_foot(FOOT, 15.0, turning, phase) for phase in phases]
    assert [shot for shot in shots if shot != (False, 1.0)] == []
    for _ in range(40):
        speed = draws.uniform(5.0, 15.0)
        assert one.shoot_at_foot(FOOT, speed, turning, 4 * draws.random())[0] is False, speed


@BOTH
@pytest.mark.parametrize("speed", [10.0, 15.0, 30.0])
def test_no_ball_passes_an_end_wall(world: Make, draws: random.Random, speed: float, engine: str) -> None:
    one = world(f"engine={engine}")
    end = one.table.field.length / 2
    for phase in range(40):
        one.put((0.45 - (phase + draws.random()) / 40 * speed * one.tick_s / 4, 0.2, 0.04), (speed, 0.0, 0.0))
        touches = 0.0
        for _ in range(20):
            one.tick()
            assert one.position[0] < end
            touches += one.of("ball", "contacts", 1)[0]
        assert touches >= 1 and one.velocity[0] < 0.0


# --- 9: forces and inertias ------------------------------------------------------------------------------------------


def test_a_free_rod_keeps_its_speed(bullet: Make) -> None:
    """Bullet's default damping of joints takes a fifth of it in 0.1 s."""
    one = bullet(NO_GRAVITY)
    one.set_rod("red.goal", (0.0, 0.0), (0.5, 50.0))
    for _ in range(50):
        one.tick({"red.goal": ((0.0, 0.0), (0.0, 0.0))}, ball=False)
    assert one.of("red.goal", "joint_velocities", 2) == pytest.approx([0.5, 50.0], rel=1e-9)


@pytest.mark.parametrize("name", ["red.attack", "blue.goal"])
def test_hanging_figures_swing_with_their_period(bullet: Make, draws: random.Random, name: str) -> None:
    """2 pi sqrt(I / (m g d)) (1 + a^2 / 16), within 0.5 %: mass, centre and inertia of what turns are in the engine as
    computed."""
    one = bullet()
    angle = draws.uniform(0.05, 0.2)
    one.set_rod(name, (0.0, angle), (0.0, 0.0))
    link = one.scene.bodies[name].links[1]
    down, crossings = angle, []
    for tick in range(1500):
        one.tick({name: ((0.0, 0.0), (0.0, 0.0))}, ball=False)
        now = one.of(name, "joint_positions", 2)[1]
        if down > 0.0 >= now:
            crossings.append((tick + down / (down - now)) * one.tick_s)
        down = now
    below = link.mass * one.table.gravity * -link.centre_of_mass[2]
    wanted = 2 * pi * sqrt(one.rod_inertia(name) / below) * (1 + angle**2 / 16)
    assert len(crossings) >= 3
    assert (crossings[-1] - crossings[0]) / (len(crossings) - 1) == pytest.approx(wanted, rel=0.005)


# --- 10: ramps -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("contact_erp", ERPS)
def test_a_ball_in_a_corner_rolls_out_within_two_seconds(
    bullet: Make, draws: random.Random, contact_erp: float
) -> None:
    """Its energy never rises on the way; out is where the ramp ends.

    An ERP of 0.01 lifts a ball that lies too deep after its fall onto the ramp, by at most 1e-5 of the energy a tick.
    """
    one = bullet(erp(contact_erp))
    share = 1e-5 if contact_erp else one.deployment.substeps * 1e-9
    table, radius = one.table, one.table.ball.radius
    for side_x, side_y in ((1, 1), (-1, 1), (-1, -1), (1, -1)):
        inset = [radius + draws.uniform(0.001, 0.02) for _ in range(2)]
        one.put(
            (side_x * (table.field.length / 2 - inset[0]), side_y * (table.field.width / 2 - inset[1]), radius + 0.011)
        )
        first = before = one.energy
        ticks = 0
        while (
            table.field.length / 2 - abs(one.position[0]) + table.field.width / 2 - abs(one.position[1])
            < table.ramps.leg
        ):
            one.tick()
            ticks += 1
            assert one.energy <= before + share * first
            before = one.energy
            assert ticks * one.tick_s < 2.0


@pytest.mark.parametrize("contact_erp", ERPS)
def test_a_ball_on_a_strip_rolls_off_the_wall(bullet: Make, draws: random.Random, contact_erp: float) -> None:
    """Its energy never rises on the way; without a strip it stays where it lies."""
    strips = "table.strips={height: 8 mm, width: 20 mm}"
    for sets, rolls in (([strips], True), ([], False)):
        one = bullet(erp(contact_erp), *sets)
        radius, half = one.table.ball.radius, one.table.field.width / 2
        share = one.deployment.substeps * 1e-9 * one.table.ball.mass * one.table.gravity * 0.009
        for side in (1, -1):
            one.put((draws.uniform(-0.3, 0.3), side * (half - radius - 0.0005), radius + (0.009 if rolls else 0.0)))
            before = one.energy
            for _ in range(500):
                one.tick()
                assert contact_erp or one.energy <= before + share
                before = one.energy
            assert (abs(one.position[1]) < half - 0.05) == rolls


# --- 11, 12: symmetry, limits ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("contact_erp", ERPS)
def test_half_a_turn_of_the_start_turns_the_way(bullet: Make, draws: random.Random, contact_erp: float) -> None:
    """Within 1 um over a second."""
    one, other = bullet(erp(contact_erp)), bullet(erp(contact_erp))
    for _ in range(2):
        x, y, z = draws.uniform(-0.4, 0.4), draws.uniform(-0.2, 0.2), draws.uniform(0.0175, 0.05)
        angle, speed = draws.uniform(0.0, 2.0 * pi), speed_of(draws, 0.5, 4.0)
        vx, vy = speed * cos(angle), speed * sin(angle)
        one.put((x, y, z), (vx, vy, 0.0))
        other.put((-x, -y, z), (-vx, -vy, 0.0))
        for _ in range(500):
            one.tick()
            other.tick()
            there = [-other.position[0], -other.position[1], other.position[2]]
            assert one.position == pytest.approx(there, abs=1e-6), (x, y, z, angle, speed)


def test_no_spin_is_clamped(bullet: Make, draws: random.Random) -> None:
    """Bullet's default clamp of 100 rad/s would slow the ball to 1.75 m/s."""
    one = bullet(NO_ROLLING)
    for speed in (5.0, draws.uniform(2.0, 6.0)):
        one.roll(x=-0.4, speed=speed, seconds=0.1)
        assert one.spin[1] == pytest.approx(speed / one.table.ball.radius, rel=1e-6)
    name = "red.attack"
    for turning in (150.0, draws.uniform(110.0, 150.0)):
        one.set_rod(name, (0.0, 0.0), (0.0, 0.0))
        for _ in range(60):
            one.tick({name: ((0.0, 90.0), (turning, 2.0))}, ball=False)
        assert one.of(name, "joint_velocities", 2)[1] == pytest.approx(turning, rel=1e-6)


@pytest.mark.parametrize("line", ["goal", "defence", "midfield", "attack"])
def test_no_rod_leaves_its_stroke(bullet: Make, draws: random.Random, line: str) -> None:
    """By more than 0.1 mm: free at up to 3.5 m/s, and pushed on by its motor.

    Bullet notices a stop in the substep after it was passed, up to 1.75 mm later, and throws the rod back at 0.8 m/s.
    """
    one = bullet()
    name = f"red.{line}"
    most = one.table.lines[line].half_stroke + 1e-4
    for motors in (((0.0, 0.0), (0.0, 0.0)), ((3.5, 90.0), (0.0, 0.0)), ((-3.5, 90.0), (0.0, 0.0))):
        side = -1.0 if motors[0][0] < 0.0 else 1.0
        one.set_rod(name, (draws.uniform(0.0, 0.02), 0.0), (side * draws.uniform(1.0, 3.5), 0.0))
        for _ in range(150):
            one.tick({name: motors}, ball=False)
            assert abs(one.of(name, "joint_positions", 1)[0]) <= most
        assert abs(one.of(name, "joint_velocities", 1)[0]) < 1e-9, "it stops dead"

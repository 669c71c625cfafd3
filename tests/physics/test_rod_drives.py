"""Drives of rods against closed forms, by the whole way of a tick: a command is delivered, the world is solved.

On each engine. Numbers are drawn by the seed.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from math import exp
from random import Random
from typing import Any, Final

import pytest

from foosim.common.errors import DeploymentError
from foosim.deployment.loader import apply_sets
from foosim.library.table.settings import table_of
from foosim.node.physics.making import make_engine
from foosim.node.tick import Stepper, Work
from foosim.world.assembly.world import build_scene, initial_numbers
from foosim.world.layout import build_layout
from foosim.world.robot_packets import Delivered
from foosim.world.scene import load_of
from tests.deployed import TABLE, TEXT, deployed
from tests.placing import place_ball

SEED: Final = 18
STILL: Final = "table.gravity=0 m/s2"


class Driven:
    """The table, of which one rod is driven; which has so many balls."""

    def __init__(self, engine: str, actuator: str, *sets: str, rod: str = "red.goal", balls: int = 1) -> None:
        own = [f"robots.{rod}.actuators={{motors: {actuator}}}", *sets]
        own += [f"engine={engine}", f"table.spare_balls={balls - 1}"]
        self.deployment = deployed(*own)
        self.layout = build_layout(self.deployment)
        self.rod, self.table = self.layout[rod], table_of(self.deployment)
        self.numbers = initial_numbers(self.deployment, self.layout)
        self.stepper = Stepper(self.deployment, self.layout)
        self.engine = make_engine(self.deployment, self.layout)
        self.body = build_scene(self.deployment, self.layout).bodies[rod]
        self.loads = load_of(self.body, 0), load_of(self.body, 1)
        self.tick_s = self.deployment.tick_ns / 1e9
        self.tick = 0

    def step(self, *command: float, with_ball: bool = False, ticks: int = 1) -> None:
        """Send a command, if there is one, and compute some ticks."""
        bodies = (*self.layout.of("ball"), self.rod) if with_ball else (self.rod,)
        solved = tuple(entity.index for entity in bodies)
        packets = [Delivered(0, "me", 1, 0, self.rod.name, "motors", struct.pack("<2d", *command))] if command else []
        for _ in range(ticks):
            start = self.numbers.copy()
            self.stepper.deliver(packets, solved, self.numbers, self.tick, start)
            self.stepper.solve(self.engine, Work(self.tick, self.layout, (bodies,), solved, self.numbers, {}, start))
            self.tick += 1
            packets = []
        assert self.of("refused") == [0.0] and self.stepper.quarantined == []

    def of(self, field: str) -> list[float]:
        at = self.rod.offsets[field]
        return self.numbers[at : at + self.rod.counts[field]]

    def put(self, field: str, *values: float) -> None:
        at = self.rod.offsets[field]
        self.numbers[at : at + len(values)] = values

    @property
    def speeds(self) -> list[float]:
        return self.of("joint_velocities")


Make = Callable[..., Driven]
engines = pytest.mark.parametrize("engine", ["pure", "bullet"])


@engines
@pytest.mark.parametrize("rod", ["red.goal", "blue.midfield"])
def test_a_force_accelerates_by_its_mass(driven: Make, engine: str, rod: str) -> None:
    """a = F / m, alpha = tau / I; Bullet with numSubSteps would give a multiple."""
    one, draw = driven(engine, "{kind: rod_force}", STILL, rod=rod), Random(SEED)
    for _ in range(5):
        force, torque = draw.uniform(-80, 80), draw.uniform(-0.8, 0.8)
        one.put("joint_positions", 0.0, draw.uniform(-3, 3))
        before = one.speeds
        one.step(force, torque, ticks=3)
        gained = [(new - old) / (3 * one.tick_s) for new, old in zip(one.speeds, before, strict=True)]
        assert gained == pytest.approx([force / one.loads[0], torque / one.loads[1]], rel=0.001)
        assert one.of("joint_efforts") == pytest.approx([force, torque], rel=1e-12)


@engines
@pytest.mark.parametrize(
    ("kind", "command"), [("rod_position", (0.12, 900.0)), ("rod_velocity", (3.5, 150.0)), ("rod_force", (75.0, 0.8))]
)
def test_speed_and_acceleration_keep_their_limits(driven: Make, engine: str, kind: str, command: Any) -> None:
    """Both ways, to the limits of the acceleration and no farther, and to those of the speed."""
    limits = "table.drive.slide.acceleration=80 m/s2", "table.drive.spin.acceleration=9400 rad/s2"
    one = driven(engine, f"{{kind: {kind}}}", STILL, *limits, "table.drive.slide.gain=400")
    one.put("joint_positions", -0.12, 0.0)
    most = [0.0, 0.0]
    for way in (1.0, -1.0):
        for _ in range(24):
            before = one.speeds
            one.step(*(way * value for value in command))
            rates = [abs(new - old) / one.tick_s for new, old in zip(one.speeds, before, strict=True)]
            assert rates[0] <= 80.0 * 1.0001 and rates[1] <= 9400.0 * 1.0001
            assert abs(one.speeds[0]) <= 3.5 + 1e-9 and abs(one.speeds[1]) <= 150.0 + 1e-9
            most = [max(old, new) for old, new in zip(most, rates, strict=True)]
    if kind != "rod_force":
        assert most == pytest.approx([80.0, 9400.0], rel=0.001)


@engines
def test_a_motor_without_a_load_ends_at_its_voltage_over_its_back_emf(driven: Make, engine: str) -> None:
    one = driven(engine, "{kind: rod_voltage, slide: {resistance: 1 mOhm}}", STILL)
    one.put("joint_positions", -0.1, 0.0)
    one.step(7.0, -40.0, ticks=50)
    assert one.speeds == pytest.approx([7.0 / 14.0, -40.0 / 0.32], rel=1e-6)
    assert one.of("joint_efforts") == pytest.approx([0.0, 0.0], abs=1e-3)


@engines
def test_a_stalled_motor_takes_its_voltage_over_its_resistance_up_to_its_limit(driven: Make, engine: str) -> None:
    """Pressed against its stop, and a torque that gravity balances."""
    one = driven(engine, "{kind: rod_voltage}")
    one.put("joint_positions", one.table.lines["goal"].half_stroke, 0.0)
    for volts, amperes in ((5.0, 2.5), (12.0, 6.0), (13.0, 6.5), (48.0, 6.5)):
        one.step(volts, 0.0, ticks=20)
        assert one.of("joint_efforts")[0] / 14.0 == pytest.approx(amperes, rel=1e-9)
        assert abs(one.speeds[0]) < 1e-9


@engines
def test_speed_follows_the_exponential_of_the_back_emf(driven: Make, engine: str) -> None:
    """v = u/k_e + (v0 - u/k_e) exp(-t k_t k_e / (m R)), at each tick, from any speed; m is that with the rotor.

    Fast ones, too: a spin with 5 ms, and one with 20 us, a twentieth of a substep, which explicit steps would blow up.
    """
    draw = Random(SEED)
    for resistance in ("2 Ohm", "0.01 Ohm"):
        its = f"{{kind: rod_voltage, slide: {{current: 1000 A, resistance: {resistance}}}, "
        its += f"spin: {{current: 1000 A, resistance: {resistance}, torque_constant: 0.3 N m/A, rotor: 3e-5 kg m2}}}}"
        one = driven(engine, its, STILL)
        plain = Driven("pure", "{kind: rod_force}", STILL)
        assert one.loads == pytest.approx((plain.loads[0] + 0.1, plain.loads[1] + 3e-5), rel=1e-12)
        ohms = float(resistance.split()[0])
        slopes = 14.0 * 14.0 / ohms, 0.3 * 0.32 / ohms
        for _ in range(3):
            start = [draw.uniform(-1, 1), draw.uniform(-140, 140)]
            volts = draw.uniform(-40, 40), draw.uniform(-40, 40)
            ends = volts[0] / 14.0, volts[1] / 0.32
            one.put("joint_positions", 0.0, 0.0)
            one.put("joint_velocities", *start)
            for tick in range(1, 5):
                one.step(*volts)
                spent = tick * one.tick_s
                for axis in (0, 1):
                    wanted = ends[axis] + (start[axis] - ends[axis]) * exp(-spent * slopes[axis] / one.loads[axis])
                    assert one.speeds[axis] == pytest.approx(wanted, rel=1e-9, abs=1e-9)


@engines
def test_a_motor_near_the_ball_does_the_same(driven: Make, engine: str) -> None:
    """There Bullet is told a force at each substep."""
    found = []
    for place in ((0.0, 0.0), (-0.56, 0.3)):
        one = driven(engine, "{kind: rod_voltage}", STILL)
        place_ball(one.numbers, one.layout["ball"], (*place, 0.0175), (0.0, 0.0, 0.0))
        one.step(10.0, 10.0, ticks=5, with_ball=True)
        found.append((*one.speeds, *one.of("joint_efforts"), *one.of("joint_positions")))
        assert one.of("contacts")[0] == 0.0
    assert found[0] == pytest.approx(found[1], rel=1e-9) and found[0][1] > 10.0


@engines
@pytest.mark.parametrize("ticks", [0, 1, 3])
def test_a_dead_time_is_a_number_of_ticks(driven: Make, engine: str, ticks: int) -> None:
    modifiers = f", modifiers: [{{kind: delay, time: {2 * ticks} ms}}]"
    one = driven(engine, f"{{kind: rod_voltage{modifiers}}}", STILL)
    one.step(ticks=2)
    one.step(10.0, 10.0)
    for _ in range(ticks):
        assert one.speeds == [0.0, 0.0]
        one.step()
    assert min(one.speeds) > 0.0


@engines
@pytest.mark.parametrize(
    ("kind", "command"),
    [
        ("rod_position", (0.123, 0.0)),
        ("rod_velocity", (3.5, 0.0)),
        ("rod_force", (89.0, 0.0)),
        ("rod_voltage", (48.0, 0.0)),
    ],
)
def test_no_drive_pushes_a_rod_beyond_its_stroke(driven: Make, engine: str, kind: str, command: Any) -> None:
    """From speeds and places that are drawn, either way: at most by 0.1 mm."""
    one, draw = driven(engine, f"{{kind: {kind}}}"), Random(SEED)
    stroke = one.table.lines["goal"].half_stroke
    for number in range(12):
        way = 1.0 if number % 2 else -1.0
        one.put("joint_positions", way * draw.uniform(0.08, 0.12), 0.0)
        one.put("joint_velocities", way * draw.uniform(0.0, 3.5), 0.0)
        for _ in range(40):
            one.step(way * command[0], 0.0)
            assert abs(one.of("joint_positions")[0]) <= stroke + 1e-4
        if kind != "rod_position":
            assert way * one.of("joint_positions")[0] == pytest.approx(stroke, abs=1e-4)


@pytest.mark.parametrize("engine", ["bullet"])
def test_a_kick_is_that_of_a_free_rod_with_its_rotor(driven: Make, engine: str) -> None:
    """A motor without a current, at the voltage of its speed, adds nothing within the contact: the ball has (1 + e) w a
    / (1 + m a2 / I). Bullet's own motor would give it all that restores the speed, up to the limit of the current."""
    one = driven(engine, "{kind: rod_voltage, spin: {resistance: 20 Ohm}}", "table.contact_erp=0", rod="blue.goal")
    ball, rod, base = one.table.ball, one.table.rod, one.body.position
    arm = rod.axis_height - ball.radius
    for turning in (30.0, 60.0, 120.0):
        touch_x = base[0] - rod.foot.length / 2 - ball.radius - 0.004
        place_ball(one.numbers, one.layout["ball"], (touch_x, 0.0, ball.radius), (0.0, 0.0, 0.0))
        one.put("joint_positions", 0.0, -0.1)
        one.put("joint_velocities", 0.0, turning)
        for _ in range(20):
            one.step(0.0, 0.32 * turning, with_ball=True)
            if one.of("contacts")[0]:
                break
        velocity = one.numbers[one.layout["ball"].offsets["linear_velocity"]]
        bounce = 1 + one.table.surfaces.figures.restitution
        theory = bounce * turning * arm / (1 + ball.mass * arm * arm / one.loads[1])
        assert -velocity == pytest.approx(theory, rel=0.015)


@pytest.mark.parametrize("engine", ["pure", "bullet"])
def test_the_historical_gains_at_the_historical_period(driven: Make, engine: str) -> None:
    """0.3 and 0.01 of the error in each control period of 10 ms, 30 and 1 per second: a step of 100 mm is there to
    within 1 mm after 140 ms, or 22 mm away after 1.5 s. Neither overshoots."""
    for gain, seconds, least, most in ((0.3, 0.14, 0.0, 0.001), (0.01, 1.5, 0.022, 0.023)):
        period = "tick=10 ms", "substeps=20"
        one = driven(engine, "{kind: rod_position}", f"table.drive.slide.gain={gain / 0.01:g}", *period)
        one.put("joint_positions", -0.05, 0.0)
        for _ in range(round(seconds / one.tick_s)):
            one.step(0.05, 0.0)
            assert one.of("joint_positions")[0] <= 0.05
        assert least <= 0.05 - one.of("joint_positions")[0] <= most


@pytest.mark.parametrize(
    ("actuator", "place", "problem"),
    [
        ("{kind: rod_voltage, spin: {voltage: 49 V}}", "motors.spin.voltage", "153.125 rad/s without a load"),
        ("{kind: rod_voltage, slide: {back_emf: 10 V s/m}}", "motors.slide.voltage", "4.8 m/s without a load"),
    ],
)
def test_bad_parameters_are_refused_at_their_place(actuator: str, place: str, problem: str) -> None:
    with pytest.raises(DeploymentError) as refused:
        apply_sets(TEXT, TABLE.name, [f"robots.red.goal.actuators={{motors: {actuator}}}"])
    assert f"robots.red.goal.actuators.{place}: {problem}" in str(refused.value)

"""What sensors on the table measure, against what is there: contacts of figures, currents, encoders, the ball."""

from __future__ import annotations

from collections.abc import Callable
from math import floor, pi
from random import Random
from typing import Any, Final

import pytest

from foosim.common.errors import DeploymentError
from foosim.deployment.loader import apply_sets
from foosim.library.table.rod import figure_ys
from foosim.world.component_types.per_field import codec_of
from foosim.world.component_types.registry import find_component
from foosim.world.components.fitted import sensors_of
from foosim.world.components.sensing import Sensing
from foosim.world.components.view import SensingView
from tests.physics.test_rod_drives import SEED, STILL, TABLE, TEXT, Driven
from tests.placing import place_ball

TOUCH: Final = "robots.blue.midfield.sensors={touch: {kind: figure_contact, rate: 100 Hz}}"
NO_PLAYERS: Final = "players={}"
engines = pytest.mark.parametrize("engine", ["pure", "bullet"])


def read(one: Driven, channel: str, robot: str | None = None) -> Any:
    """Return the reading of a sensor, all modifiers applied."""
    entity = one.layout[robot or one.rod.name]
    (fitted,) = [sensor for sensor in sensors_of(one.deployment, one.layout, entity) if sensor.channel == channel]
    kind = one.deployment.robots[entity.name].sensors[channel].kind
    (payload,) = Sensing().sample([fitted], SensingView(one.tick, one.numbers))
    return None if payload is None else codec_of(find_component("sensor", kind)).decode(payload)


def is_due(one: Driven, channel: str) -> bool:
    (fitted,) = [its for its in sensors_of(one.deployment, one.layout, one.rod) if its.channel == channel]
    return fitted.is_due(one.tick, one.numbers)


def kicked(one: Driven, figure: int, slide: float, ball: str = "ball", gap: float = 0.004) -> None:
    """Put a ball in front of a figure that is about to kick it."""
    its, base = one.table.ball, one.body.position
    y = slide + figure_ys(one.table.lines["midfield"])[figure] + 0.003
    x = base[0] - one.table.rod.foot.length / 2 - its.radius - gap
    place_ball(one.numbers, one.layout[ball], (x, y, its.radius), (0.0, 0.0, 0.0))


@engines
def test_a_contact_names_ball_figure_substep_and_impulse(driven: Callable[..., Driven], engine: str) -> None:
    """It is told at the tick after, whatever the rate; its impulse is what the ball has gained."""
    one = driven(engine, "{kind: rod_velocity}", TOUCH, NO_PLAYERS, rod="blue.midfield", balls=2)
    draw = Random(SEED)
    for figure in range(5):
        slide = draw.uniform(-0.05, 0.05)
        kicked(one, figure, slide)
        place_ball(one.numbers, one.layout["ball-2"], (0.5, 0.0, 0.0175), (0.0, 0.0, 0.0))
        one.put("joint_positions", slide, -0.1)
        one.put("joint_velocities", 0.0, 40.0)
        one.tick = 5 * figure * 100 + 1
        silent = 0
        while not (reading := read(one, "touch")).count:
            assert not is_due(one, "touch") or one.tick % 5 == 0
            assert reading.balls == reading.figures == reading.substeps == (-1.0, -1.0)
            one.step(0.0, 40.0, with_ball=True)
            silent += 1
            assert silent < 20
        assert is_due(one, "touch") and silent > 1
        assert reading.count == 1.0
        assert reading.balls == (0.0, -1.0)
        assert reading.figures == (float(figure), -1.0)
        assert 0.0 <= reading.substeps[0] <= 3.0
        ball = one.layout["ball"]
        velocity = one.numbers[ball.offsets["linear_velocity"] : ball.offsets["linear_velocity"] + 3]
        gained = one.table.ball.mass * (velocity[0] ** 2 + velocity[1] ** 2) ** 0.5
        assert reading.impulses[0] == pytest.approx(gained, rel=0.05)
        assert reading.impulses[1:] == (0.0,)
        one.step(0.0, 40.0, with_ball=True, ticks=2)
        assert read(one, "touch").count == 0.0 and read(one, "touch").balls[0] == -1.0


@engines
def test_two_balls_and_the_tube_are_told_apart(driven: Callable[..., Driven], engine: str) -> None:
    """A ball lies on the tube, another one is kicked; a contact that lasts has begun once."""
    one = driven(engine, "{kind: rod_velocity}", TOUCH, NO_PLAYERS, rod="blue.midfield", balls=2)
    base, radius = one.body.position, one.table.ball.radius
    kicked(one, 1, 0.0, gap=0.0005)
    on_top = base[2] + one.table.rod.radius + radius
    place_ball(one.numbers, one.layout["ball-2"], (base[0], 0.2, on_top + 1e-5), (0.0, 0.0, -0.1))
    one.put("joint_velocities", 0.0, 10.0)
    found = []
    for _ in range(6):
        one.step(0.0, 10.0, with_ball=True)
        reading = read(one, "touch")
        found += [(ball, figure) for ball, figure in zip(reading.balls, reading.figures, strict=True) if ball >= 0.0]
    assert {(1.0, -1.0), (0.0, 1.0)} <= set(found)


@pytest.mark.parametrize("engine", ["pure", "bullet"])
def test_a_rod_without_the_sensor_has_no_such_fields(driven: Callable[..., Driven], engine: str) -> None:
    one = driven(engine, "{kind: rod_velocity}", TOUCH, NO_PLAYERS, rod="red.goal")
    assert "touches" in one.layout["blue.midfield"].offsets
    assert "touches" not in one.layout["red.goal"].offsets


@engines
def test_a_current_is_the_effort_over_the_motors_constants(driven: Callable[..., Driven], engine: str) -> None:
    """u / R of a motor that is stalled, up to the limit; of any other drive by constants of the sensor's own."""
    current = "robots.red.goal.sensors={current: {kind: motor_current, rate: 100 Hz}}"
    one = driven(engine, "{kind: rod_voltage}", current, NO_PLAYERS, STILL)
    one.put("joint_positions", one.table.lines["goal"].half_stroke, 0.0)
    for volts, amperes in ((6.0, 3.0), (-0.0, 0.0), (40.0, 6.5)):
        one.step(volts, 0.0, ticks=2)
        assert read(one, "current").slide == pytest.approx(amperes, abs=1e-9)
    own = "robots.red.goal.sensors={current: {kind: motor_current, rate: 100 Hz, slide: 9 N/A, spin: 50 mN m/A}}"
    other = driven(engine, "{kind: rod_force}", own, NO_PLAYERS, STILL)
    other.step(45.0, -0.2)
    assert list(map(float, (read(other, "current").slide, read(other, "current").spin))) == pytest.approx([5.0, -4.0])


def test_a_current_without_constants_is_refused() -> None:
    with pytest.raises(DeploymentError, match=r"red\.goal\.sensors\.current\.kind: the force of a current is unknown"):
        apply_sets(TEXT, TABLE.name, ["robots.red.goal.sensors.current={kind: motor_current, rate: 100 Hz}"])


def test_a_quantised_encoder_counts_as_a_real_one_does(driven: Callable[..., Driven]) -> None:
    """4,096 counts a turn, 0.1 mm along: the nearest count, so never wrong by more than half of one, over many turns
    and backwards alike; each count is as wide as the next."""
    step = "modifiers: [{kind: quantise, step: {slide: 0.1 mm, spin: 0.087890625 deg}}]"
    its = f"robots.red.goal.sensors={{encoder: {{kind: encoder, rate: 500 Hz, {step}}}}}"
    one, draw = driven("pure", "{kind: rod_velocity}", its, NO_PLAYERS), Random(SEED)
    count = 2 * pi / 4096
    for _ in range(200):
        slide, spin = draw.uniform(-0.12, 0.12), draw.uniform(-500.0, 500.0)
        one.put("joint_positions", slide, spin)
        reading = read(one, "encoder")
        assert reading.slide == pytest.approx(1e-4 * floor(slide / 1e-4 + 0.5), abs=1e-12)
        assert reading.spin == pytest.approx(count * floor(spin / count + 0.5), abs=1e-9)
        assert abs(reading.slide - slide) <= 0.5e-4 + 1e-12 and abs(reading.spin - spin) <= count / 2 + 1e-9
    seen = set()
    for place in range(3 * 4096):
        one.put("joint_positions", 0.0, -3.0 + 2 * pi * (place + 0.5) / (3 * 4096))
        seen.add(read(one, "encoder").spin)
    assert len(seen) in (4096, 4097)  # a turn that begins amid a count ends amid its next


def test_levels_of_abstraction_stand_side_by_side(driven: Callable[..., Driven]) -> None:
    """The exact state, and a camera's view of it with noise, 10 ms of delay and drop-outs, on one robot."""
    seen = "[{kind: gaussian_noise, std: {x: 1.5 mm, y: 1.5 mm}}, {kind: delay, time: 10 ms},"
    seen += " {kind: drop_out, probability: 10 %}]"
    sets = "robots.camera.sensors={exact: {kind: ball_state, rate: 500 Hz},"
    sets += f" ball: {{kind: ball, rate: 500 Hz, modifiers: {seen}}}}}"
    one = driven("pure", "{kind: rod_velocity}", sets, NO_PLAYERS)
    ball = one.layout["ball"]
    place_ball(one.numbers, ball, (0.1, 0.2, 0.0175), (1.0, -2.0, 0.0))
    at = ball.offsets["angular_velocity"]
    one.numbers[at : at + 3] = [1.0, 2.0, 3.0]
    exact = read(one, "exact", "camera")
    assert [exact.x, exact.y, exact.z, exact.vx, exact.vy, exact.vz] == [0.1, 0.2, 0.0175, 1.0, -2.0, 0.0]
    assert [exact.wx, exact.wy, exact.wz] == [1.0, 2.0, 3.0]
    assert read(one, "ball", "camera") is None  # nothing is 10 ms old yet

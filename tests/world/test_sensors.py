"""Sensors: keyed Gaussian noise, rates in whole ticks, and the numbering of samples."""

from __future__ import annotations

import struct
from math import radians, sqrt
from pathlib import Path
from statistics import NormalDist, fmean
from typing import Final

import numpy as np
import pytest

from foosim.common.batched.noise import NoiseKey
from foosim.common.keyed_random import draw_key
from foosim.deployment.schema import Deployment
from foosim.library.table.settings import table_of
from foosim.node.tick import Stepper
from foosim.world.assembly.world import initial_numbers
from foosim.world.components.fitted import BoundSensor, sensors_of
from foosim.world.components.sensing import Sensing
from foosim.world.components.view import SensingView
from foosim.world.frame import Frame
from foosim.world.layout import build_layout
from foosim.world.robot_packets import RobotPacket
from tests.deployed import deployed
from tests.own_components import folder_on_path, written

AT_ONCE: Final = "robots.camera.sensors.ball.modifiers=[{kind: gaussian_noise, std: {x: 1.5 mm, y: 1.5 mm}}]"
"""A camera without its latency: each tick has its picture."""
DEPLOYMENT: Final = deployed(AT_ONCE)
LAYOUT: Final = build_layout(DEPLOYMENT)
NUMBERS: Final = initial_numbers(DEPLOYMENT, LAYOUT)
COUNT: Final = 20_000
CELLS: Final = 64
CHI2_63_999: Final = 103.44


def fitted(robot: str, channel: str, deployment: Deployment = DEPLOYMENT) -> BoundSensor:
    layout = build_layout(deployment)
    return next(one for one in sensors_of(deployment, layout, layout[robot]) if one.channel == channel)


def sampled(one: BoundSensor, numbers: list[float], tick: int) -> bytes:
    (payload,) = Sensing().sample([one], SensingView(tick, numbers))
    assert payload is not None
    return payload


def samples(robot: str, channel: str, numbers: list[float], deployment: Deployment = DEPLOYMENT) -> list[list[float]]:
    one = fitted(robot, channel, deployment)
    sensing = Sensing()
    drawn = [payload for tick in range(COUNT) for payload in sensing.sample([one], SensingView(tick, numbers))]
    return [list(struct.unpack(f"<{len(raw) // 8}d", raw)) for raw in drawn if raw is not None]


def assert_gaussian(errors: list[float], sd: float) -> None:
    """Mean, variance and the whole distribution (chi-squared, 64 cells), each at 99.9 % for fixed seeds."""
    assert abs(fmean(errors)) < 3.29 * sd / sqrt(COUNT)
    assert abs(fmean(error * error for error in errors) / sd**2 - 1.0) < 3.29 * sqrt(2 / COUNT)
    counts = [0] * CELLS
    for error in errors:
        counts[int(NormalDist(0.0, sd).cdf(error) * CELLS)] += 1
    expected = COUNT / CELLS
    assert sum((count - expected) ** 2 / expected for count in counts) < CHI2_63_999


def correlation(one: list[float], other: list[float]) -> float:
    products = fmean(a * b for a, b in zip(one, other, strict=True))
    return products / sqrt(fmean(a * a for a in one) * fmean(b * b for b in other))


def test_an_encoder_measures_slide_and_spin_with_noise_of_its_own_on_each() -> None:
    numbers = NUMBERS.copy()
    at = LAYOUT["red.goal"].offsets["joint_positions"]
    numbers[at : at + 2] = [0.05, -2.5]
    drawn = samples("red.goal", "encoder", numbers)
    slides, spins = [slide - 0.05 for slide, _ in drawn], [spin + 2.5 for _, spin in drawn]
    assert_gaussian(slides, 0.0002)
    assert_gaussian(spins, radians(0.5))
    assert abs(correlation(slides, spins)) < 3.29 / sqrt(COUNT)
    assert abs(correlation(slides[1:], slides[:-1])) < 3.29 / sqrt(COUNT), "noise does not remember"


def test_noise_is_keyed_by_seed_robot_and_channel() -> None:
    """Any tick alone gives what it gives in a row; another seed, robot or channel gives another luck."""
    alone = sampled(fitted("red.goal", "encoder"), NUMBERS, 777)
    slide, spin = NoiseKey(draw_key(1, "sensor", "red.goal", "encoder", "gaussian_noise")).normal(777, 2)
    assert struct.unpack("<2d", alone) == (0.0002 * slide, radians(0.5) * spin)
    noise = "modifiers: [{kind: gaussian_noise, std: {slide: 0.2 mm, spin: 0.5 deg}}]"
    both = f"{{kind: encoder, rate: 100 Hz, {noise}}}"
    second = deployed(AT_ONCE, f"robots.red.goal.sensors={{encoder: {both}, second: {both}}}")
    start = initial_numbers(second, build_layout(second))
    others = [
        sampled(fitted("red.goal", "encoder", deployed(AT_ONCE, "seed=2")), NUMBERS, 777),
        sampled(fitted("red.attack", "encoder"), NUMBERS, 777),
        sampled(fitted("red.goal", "second", second), start, 777),
    ]
    assert len({alone, *others}) == 4
    assert sampled(fitted("red.goal", "encoder", second), start, 777) == alone, "what else it has is nothing"


def test_a_sensor_draws_by_a_key_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two of one type on a robot draw differently, and a change of one changes no draw of the other."""
    written(
        folder_on_path(tmp_path, monkeypatch),
        "from foosim.common.keyed_random import draw_words, unit_interval",
        "class Dice(Sensor):",
        "    def __init__(self, settings, at): self.key = at.key",
        "    def sample(self, view): return Number(unit_interval(draw_words(self.key, view.tick)[0]))",
        "sensor('dice', Settings, Number)(Dice)",
    )

    def drawn(robot: str, channel: str, beside: str, *sets: str) -> list[bytes]:
        dice = "{kind: 'own_form:Dice', rate: 100 Hz}"
        its = [f"robots.{name}.sensors={{one: {dice}{beside}}}" for name in ("red.goal", "red.attack")]
        deployment = deployed(AT_ONCE, "players={}", *its, *sets)
        numbers = initial_numbers(deployment, build_layout(deployment))
        return [sampled(fitted(robot, channel, deployment), numbers, tick) for tick in range(20)]

    second = ", two: {kind: 'own_form:Dice', rate: 50 Hz}"
    alone = drawn("red.goal", "one", "")
    others = drawn("red.goal", "two", second), drawn("red.attack", "one", ""), drawn("red.goal", "one", "", "seed=2")
    assert len({*alone}.union(*others)) == 80
    for beside in (second, second.replace("50 Hz", "100 Hz, count: 3"), ", two: {kind: encoder, rate: 100 Hz}"):
        assert drawn("red.goal", "one", beside) == alone


def test_without_noise_a_sample_is_the_frame() -> None:
    quiet = deployed(AT_ONCE, "robots.camera.sensors.ball.modifiers=[]")
    seen = {tuple(sample) for sample in samples("camera", "ball", NUMBERS, quiet)}
    assert seen == {(0.0, 0.0, table_of(DEPLOYMENT).ball.radius)}


def sensed(deployment: Deployment, ticks: int) -> dict[tuple[str, str], list[int]]:
    """The ticks at which each channel sends."""
    layout = build_layout(deployment)
    stepper = Stepper(deployment, layout)
    values = np.array(initial_numbers(deployment, layout))
    sent: dict[tuple[str, str], list[int]] = {}
    for tick in range(ticks):
        packets, remembered = stepper.sense(Frame(tick, layout, values), layout.robots)
        assert len(remembered) == len(packets) and set(remembered.values()) <= {1.0}
        for packet in packets:
            sent.setdefault((packet.robot, packet.channel), []).append(tick)
    return sent


def test_each_sensor_sends_at_its_own_rate_from_tick_zero() -> None:
    mixed = deployed(AT_ONCE, "robots.camera.sensors.ball.rate=50 Hz", "robots.red.goal.sensors.encoder.rate=500 Hz")
    sent = sensed(mixed, 60)
    assert sent.pop(("camera", "ball")) == list(range(0, 60, 10))
    assert sent.pop(("red.goal", "encoder")) == list(range(60))
    assert len(sent) == 7 and all(ticks == list(range(0, 60, 5)) for ticks in sent.values())


def test_counters_of_samples_are_the_owners_slots() -> None:
    stepper = Stepper(DEPLOYMENT, LAYOUT)
    robots = [LAYOUT["camera"], LAYOUT["red.goal"]]
    packets, remembered = stepper.sense(Frame(0, LAYOUT, np.array(NUMBERS)), robots)
    assert [packet.robot for packet in packets] == ["camera", "red.goal"]
    slots = [LAYOUT["camera"].offsets["ball.samples"], LAYOUT["red.goal"].offsets["encoder.samples"]]
    assert remembered == dict.fromkeys(slots, 1.0)
    assert all(robot.split <= slot < robot.stop for robot, slot in zip(robots, slots, strict=True))


def test_what_a_robot_sends_is_numbered_in_the_order_of_channels() -> None:
    two = deployed(
        AT_ONCE,
        "robots.red.goal.sensors={zeta: {kind: encoder, rate: 100 Hz}, alpha: {kind: encoder, rate: 100 Hz}}",
        "players={}",
    )
    layout = build_layout(two)
    frame = Frame(0, layout, np.array(initial_numbers(two, layout)))
    packets, _ = Stepper(two, layout).sense(frame, [layout["red.goal"]])
    payload = struct.pack("<2d", 0.0, 0.0)
    assert packets == [
        RobotPacket("red.goal", 0, "", "alpha", payload),
        RobotPacket("red.goal", 1, "", "zeta", payload),
    ]

"""Modifiers: what each does to readings and commands."""

from __future__ import annotations

import struct
from itertools import pairwise
from math import pi, sqrt
from pathlib import Path
from typing import Final

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foosim.deployment.loader import apply_sets, load_deployment
from foosim.node.edited_frame import edit
from foosim.node.tick import Stepper
from foosim.world.assembly.world import initial_numbers
from foosim.world.components.fitted import BoundSensor, sensors_of
from foosim.world.components.sensing import Sensing
from foosim.world.components.view import SensingView
from foosim.world.edits import Set
from foosim.world.frame import Frame
from foosim.world.layout import build_layout
from foosim.world.robot_packets import Delivered

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
TEXT: Final = TABLE.read_text()
ENCODER: Final = "robots.red.goal.sensors.encoder"
PERIOD: Final = 5
"""Ticks between two readings of an encoder."""


class Rod:
    """The encoder or the actuator of red.goal with modifiers of one's own, tick by tick."""

    def __init__(self, modifiers: str, of: str = "sensor") -> None:
        sets = [f"{ENCODER}.modifiers={modifiers}"]
        if of == "actuator":
            sets = [f"robots.red.goal.actuators={{position: {{kind: rod_position, modifiers: {modifiers}}}}}"]
        self.deployment = load_deployment(apply_sets(TEXT, TABLE.name, sets), TABLE.name)
        self.layout = build_layout(self.deployment)
        self.entity = self.layout["red.goal"]
        self.numbers = initial_numbers(self.deployment, self.layout)
        self.stepper = Stepper(self.deployment, self.layout)
        self._sensing = Sensing()

    @property
    def sensor(self) -> BoundSensor:
        return next(one for one in sensors_of(self.deployment, self.layout, self.entity) if one.channel == "encoder")

    def read(self, tick: int, slide: float, spin: float = 0.0) -> tuple[float, ...] | None:
        """Return the reading of a tick, and remember what the sensor does; None of one that is not sent."""
        at = self.entity.offsets["joint_positions"]
        self.numbers[at : at + 2] = slide, spin
        view = SensingView(tick, self.numbers)
        (payload,) = self._sensing.sample([self.sensor], view)
        for place, number in view.written.items():
            assert self.entity.split <= place < self.entity.stop, "an owner's slot"
            self.numbers[place] = number
        return None if payload is None else struct.unpack("<2d", payload)

    def command(self, tick: int, *slides: float) -> float:
        """Deliver commands at a tick; return the set-point of the slide afterwards."""
        packets = [
            Delivered(0, "player-red", number, 0, "red.goal", "position", struct.pack("<2d", slide, 0.0))
            for number, slide in enumerate(slides)
        ]
        self.stepper.deliver(packets, [self.entity.index], self.numbers, tick)
        return self.numbers[self.entity.offsets["position.set_point"]]


def test_a_number_becomes_the_nearest_multiple_of_its_step() -> None:
    rod = Rod("[{kind: quantise, step: {slide: 1 mm}}]")
    assert rod.read(0, 0.01234, 0.7) == pytest.approx((0.012, 0.7))
    assert rod.read(5, -0.0126, 0.7) == pytest.approx((-0.013, 0.7))
    assert rod.read(10, 0.0125) == pytest.approx((0.013, 0.0)), "upwards from the middle"


def test_a_number_is_held_within_its_range() -> None:
    rod = Rod("[{kind: clip, low: {slide: -1 cm}, high: {slide: 2 cm, spin: 90 deg}}]")
    assert rod.read(0, 0.05, 3.0) == (0.02, pi / 2)
    assert rod.read(5, -0.05, -3.0) == (-0.01, -3.0)


@given(
    slides=st.lists(st.floats(-0.1, 0.1), min_size=1, max_size=12), periods=st.integers(0, 4), rest=st.integers(0, 4)
)
@settings(max_examples=40)
def test_a_reading_is_the_newest_that_is_old_enough(slides: list[float], periods: int, rest: int) -> None:
    """A delay between two readings' distances waits for the next one."""
    ticks = periods * PERIOD + rest
    rod = Rod(f"[{{kind: delay, time: {2 * ticks} ms}}]")
    late = periods + (rest > 0)
    for number, slide in enumerate(slides):
        found = rod.read(number * PERIOD, slide, 1.0)
        assert found == (None if number < late else (slides[number - late], 1.0))


def test_after_a_gap_a_delayed_reading_is_still_the_newest_that_is_old_enough() -> None:
    rod = Rod("[{kind: delay, time: 20 ms}]")
    assert [rod.read(tick, 0.001 * tick) for tick in (0, 5, 10)] == [None, None, (0.0, 0.0)]
    assert rod.read(100, 0.1) == (0.01, 0.0), "what was read at tick 10"
    assert rod.read(105, 0.105) == (0.01, 0.0), "that of tick 100 is too young"
    assert rod.read(110, 0.11) == (0.1, 0.0)


def test_a_command_that_is_delayed_takes_effect_when_its_time_has_come() -> None:
    rod = Rod("[{kind: delay, time: 6 ms}]", "actuator")
    assert rod.command(0, 0.01) == 0.0
    assert rod.command(1, 0.02, 0.03) == 0.0
    assert rod.command(2) == 0.0
    assert rod.command(3) == 0.01
    assert rod.command(4) == 0.03, "of those of one tick the last counts"
    assert rod.command(5) == 0.03
    assert rod.numbers[rod.entity.offsets["refused"]] == 0.0, "to wait is no refusal"


def test_a_robot_that_is_taken_out_of_service_forgets_what_waits() -> None:
    rod = Rod("[{kind: delay, time: 6 ms}]", "actuator")
    rod.command(0, 0.01)
    frame = Frame(1, rod.layout, np.array(rod.numbers))
    rod.numbers, _ = edit(frame, [Set("red.goal", "down", [1.0])], rod.deployment)
    rod.numbers[rod.entity.offsets["down"]] = 0.0
    assert [rod.command(tick) for tick in range(1, 9)] == [0.0] * 8


def test_values_are_dropped_at_their_rate_and_each_for_itself() -> None:
    rod = Rod("[{kind: drop_out, probability: 30 %}]")
    dropped = [rod.read(tick, 0.01) is None for tick in range(2000)]
    assert sum(dropped) / 2000 == pytest.approx(0.3, abs=3.29 * sqrt(0.21 / 2000))
    pairs = sum(one and other for one, other in pairwise(dropped)) / 1999
    assert pairs == pytest.approx(0.09, abs=0.025)
    commanded = Rod("[{kind: drop_out, probability: 50 %}]", "actuator")
    taken = [commanded.command(tick, 1e-4 * tick, 1e-4 * tick + 5e-5) for tick in range(400)]
    seconds = sum(slide == 1e-4 * tick + 5e-5 for tick, slide in enumerate(taken))
    firsts = sum(slide == 1e-4 * tick for tick, slide in enumerate(taken))
    assert seconds == pytest.approx(200, abs=33) and firsts == pytest.approx(100, abs=29), "two draws in one tick"


def test_a_bias_begins_with_its_draw_and_walks_as_far_as_it_says() -> None:
    starts, ways = [], []
    for seed in range(60):
        rod = Rod("[{kind: bias_walk, initial: {slide: 1 mm}, walk: {slide: 2 mm}}]")
        rod.deployment = rod.deployment.model_copy(update={"seed": seed})
        walked = [rod.read(number * PERIOD, 0.0) for number in range(101)]
        assert all(spin == 0.0 for _, spin in filter(None, walked))
        slides = [slide for slide, _ in filter(None, walked)]
        starts.append(slides[0])
        ways += [later - slide for slide, later in pairwise(slides)]
    assert np.std(starts) == pytest.approx(0.001, rel=0.3)
    assert np.std(ways) == pytest.approx(0.002 * sqrt(0.01), rel=0.05)
    assert abs(np.mean(ways)) < 3.29 * 0.0002 / sqrt(len(ways))


def test_another_frame_has_points_moved_and_turned() -> None:
    sets = ["robots.camera.sensors.ball.modifiers=[{kind: frame_change, x: 1 m, y: 2 m, z: 3 m, yaw: 90 deg}]"]
    deployment = load_deployment(apply_sets(TEXT, TABLE.name, sets), TABLE.name)
    layout = build_layout(deployment)
    numbers = initial_numbers(deployment, layout)
    at = layout["ball"].offsets["position"]
    numbers[at : at + 3] = 1.5, 2.25, 3.125
    (camera,) = sensors_of(deployment, layout, layout["camera"])
    (payload,) = Sensing().sample([camera], SensingView(0, numbers))
    assert payload is not None
    assert struct.unpack("<3d", payload) == pytest.approx((0.25, -0.5, 0.125))


def test_modifiers_work_in_their_order_and_one_of_a_kind_is_not_the_other() -> None:
    one = Rod("[{kind: quantise, step: {slide: 1 cm}}, {kind: clip, high: {slide: 4 mm}}]")
    other = Rod("[{kind: clip, high: {slide: 4 mm}}, {kind: quantise, step: {slide: 1 cm}}]")
    assert one.read(0, 0.012) == (0.004, 0.0) and other.read(0, 0.012) == (0.0, 0.0)
    noise = "{kind: gaussian_noise, std: {slide: 1 mm}}"
    once, twice = Rod(f"[{noise}]"), Rod(f"[{noise}, {noise}]")
    first = [(once.read(tick, 0.0) or (0.0,))[0] for tick in range(500)]
    both = [(twice.read(tick, 0.0) or (0.0,))[0] for tick in range(500)]
    assert np.std(both) == pytest.approx(0.001 * sqrt(2), rel=0.1), "draws of their own"
    assert len({*first} & {*both}) == 0


FAILING: Final = '''
from msgspec import Struct

from foosim.world.component_types.quantities import Metres
from foosim.world.components.base import Sensor
from foosim.world.component_types.registry import sensor
from foosim.world.component_types.settings import SensorSettings


class Settings(SensorSettings):
    """Fails somehow."""

    how: str


class Reading(Struct, frozen=True):
    x: Metres


@sensor("failing", Settings, Reading)
class Failing(Sensor):
    """Fails."""

    def __init__(self, settings, at):
        self.how = settings.how
        self.joints = at.slot("joint_positions")
        if self.how == "made":
            raise ValueError("not like this")

    def sample(self, view):
        if self.how == "writes" and view.tick >= 50:
            view.write(self.joints, 1.0, 2.0)
        if self.how == "raises" and view.tick >= 50:
            raise ValueError("no more")
        return Reading(float("nan") if self.how == "nan" and view.tick >= 50 else 1.0)
'''


def test_a_reading_that_is_not_finite_is_said_once_and_not_sent(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "failing_sensor.py").write_text(FAILING)
    monkeypatch.syspath_prepend(tmp_path)
    own = "robots.red.goal.sensors.own={kind: 'failing_sensor:Failing', rate: 100 Hz, how: nan}"
    deployment = load_deployment(apply_sets(TEXT, TABLE.name, [own]), TABLE.name)
    layout = build_layout(deployment)
    stepper, values = Stepper(deployment, layout), np.array(initial_numbers(deployment, layout))
    sent = [
        len([p for p in stepper.sense(Frame(tick, layout, values), [layout["red.goal"]])[0] if p.channel == "own"])
        for tick in (45, 50, 55)
    ]
    assert sent == [1, 0, 0] and stepper.not_finite == {"red.goal own": 2}

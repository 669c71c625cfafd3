"""The position actuator: which commands it takes, and what it tells the motors."""

from __future__ import annotations

import struct
from math import inf, nan
from typing import Final

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foosim.common.errors import Malformed
from foosim.library.table.rod_position import ANGLE_RAD_MAX, Command, PositionActuator
from foosim.library.table.settings import table_of
from foosim.node.tick import Stepper
from foosim.world.assembly.world import body_of, initial_numbers
from foosim.world.components.fitted import BoundActuator, actuators_of
from foosim.world.components.view import View, WritableView
from foosim.world.robot_packets import Delivered
from foosim.world.scene import load_of
from tests.deployed import DEPLOYMENT, LAYOUT

ROD: Final = LAYOUT["red.goal"]
STROKE: Final = table_of(DEPLOYMENT).lines["goal"].half_stroke
DRIVE: Final = table_of(DEPLOYMENT).drive


def packed(slide: float, spin: float) -> bytes:
    return struct.pack("<2d", slide, spin)


def fitted(rod: str = ROD.name) -> BoundActuator:
    (found,) = actuators_of(DEPLOYMENT, LAYOUT, LAYOUT[rod])
    assert found.channel == "position" and isinstance(found.actuator, PositionActuator)
    return found


def takes(command: Command, numbers: list[float], rod: str = ROD.name) -> bool:
    return fitted(rod).actuator.accept(command, WritableView(0, numbers))


def wanted(numbers: list[float]) -> tuple[float, float]:
    at = ROD.offsets["position.set_point"]
    return numbers[at], numbers[at + 1]


MALFORMED: Final[dict[str, bytes]] = {
    "empty": b"",
    "a byte too few": packed(0.01, 0.0)[:-1],
    "a byte too many": packed(0.01, 0.0) + b"\x00",
    "one number": struct.pack("<d", 0.01),
    "three numbers": struct.pack("<3d", 0.01, 0.0, 0.0),
    "slide is no number": packed(nan, 0.0),
    "spin is no number": packed(0.01, nan),
    "slide without end": packed(inf, 0.0),
    "spin without end": packed(0.01, -inf),
}
OUT_OF_REACH: Final[dict[str, bytes]] = {
    "beyond the stroke": packed(STROKE + 1e-9, 0.0),
    "beyond the other stroke": packed(-STROKE - 1e-9, 0.0),
    "too many turns": packed(0.0, ANGLE_RAD_MAX + 1e-9),
    "too many turns back": packed(0.0, -ANGLE_RAD_MAX - 1e-9),
    "great": packed(1.7e308, -1.7e308),
}


@pytest.mark.parametrize("what", MALFORMED)
def test_a_malformed_command_is_refused_counted_and_changes_nothing(what: str) -> None:
    """The codec refuses what is none, before the actuator sees it."""
    numbers = initial_numbers(DEPLOYMENT, LAYOUT)
    assert takes(Command(0.05, 1.0), numbers) and wanted(numbers) == (0.05, 1.0)
    before = numbers.copy()
    with pytest.raises(Malformed):
        fitted().codec.decode(MALFORMED[what])
    packet = Delivered(0, "player-red", 1, 0, "red.goal", "position", MALFORMED[what])
    Stepper(DEPLOYMENT, LAYOUT).deliver([packet, packet], [ROD.index], numbers, 0)
    assert numbers[ROD.offsets["refused"]] == 2.0
    numbers[ROD.offsets["refused"]] = 0.0
    assert numbers == before


@pytest.mark.parametrize("what", OUT_OF_REACH)
def test_what_is_out_of_reach_is_clamped_and_counted(what: str) -> None:
    numbers = initial_numbers(DEPLOYMENT, LAYOUT)
    command = fitted().codec.decode(OUT_OF_REACH[what])
    expected = numbers.copy()
    expected[ROD.offsets["clamped"]] = 1.0
    at = ROD.offsets["position.set_point"]
    expected[at : at + 2] = [
        max(-STROKE, min(STROKE, command.slide)),
        max(-ANGLE_RAD_MAX, min(ANGLE_RAD_MAX, command.spin)),
    ]
    packet = Delivered(0, "player-red", 1, 0, "red.goal", "position", OUT_OF_REACH[what])
    Stepper(DEPLOYMENT, LAYOUT).deliver([packet], [ROD.index], numbers, 0)
    assert numbers == expected


@settings(max_examples=100)
@given(slide=st.floats(-STROKE, STROKE), spin=st.floats(-ANGLE_RAD_MAX, ANGLE_RAD_MAX))
def test_a_command_within_reach_is_the_actuators_memory(slide: float, spin: float) -> None:
    numbers = initial_numbers(DEPLOYMENT, LAYOUT)
    assert takes(fitted().codec.decode(packed(slide, spin)), numbers)
    assert wanted(numbers) == (slide, spin)
    at = ROD.offsets["position.set_point"]
    numbers[at : at + 2] = [0.0, 0.0]
    assert numbers == initial_numbers(DEPLOYMENT, LAYOUT), "and nothing else changes"


@settings(max_examples=200)
@given(
    wants=st.tuples(st.floats(-STROKE, STROKE), st.floats(-ANGLE_RAD_MAX, ANGLE_RAD_MAX)),
    position=st.tuples(st.floats(-STROKE, STROKE), st.floats(-1e4, 1e4)),
)
def test_the_loop_is_proportional_and_limited(wants: tuple[float, float], position: tuple[float, float]) -> None:
    numbers = initial_numbers(DEPLOYMENT, LAYOUT)
    at = ROD.offsets["joint_positions"]
    numbers[at : at + 2] = position
    assert takes(Command(*wants), numbers)
    (slide, force), (spin, torque) = fitted().actuator.command(View(0, numbers))
    rod = body_of(DEPLOYMENT, LAYOUT, ROD)
    slid, spun = DRIVE.slide, DRIVE.spin
    assert slid.acceleration is not None and spun.acceleration is not None
    assert force == min(slid.force, slid.acceleration * load_of(rod, 0)) == slid.force
    assert torque == min(spun.torque, spun.acceleration * load_of(rod, 1)) < spun.torque, (
        "a rod with one figure is light"
    )
    for speed, gain, limit, error in (
        (slide, DRIVE.slide.gain, DRIVE.slide.speed, wants[0] - position[0]),
        (spin, DRIVE.spin.gain, DRIVE.spin.speed, wants[1] - position[1]),
    ):
        assert abs(speed) <= limit
        assert speed == max(-limit, min(limit, gain * error))


def test_each_line_has_its_own_stroke() -> None:
    for name, stroke in (("red.midfield", "midfield"), ("blue.defence", "defence")):
        numbers = initial_numbers(DEPLOYMENT, LAYOUT)
        reach = table_of(DEPLOYMENT).lines[stroke].half_stroke  # type: ignore[index]
        assert takes(Command(-reach, 0.0), numbers, name)
        assert fitted(name).actuator.limits()["slide"] == (-reach, reach)


def test_it_holds_the_rod_where_it_is() -> None:
    numbers = initial_numbers(DEPLOYMENT, LAYOUT)
    at = ROD.offsets["joint_positions"]
    numbers[at : at + 2] = [0.03, -2.0]
    before = numbers.copy()
    fitted().actuator.hold(WritableView(0, numbers))
    assert wanted(numbers) == (0.03, -2.0)
    assert [speed for speed, _ in fitted().actuator.command(View(0, numbers))] == [0.0, 0.0]
    at = ROD.offsets["position.set_point"]
    numbers[at : at + 2] = [0.0, 0.0]
    assert numbers == before, "and nothing else changes"

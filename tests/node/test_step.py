"""The pure parts of a tick: what an order changes, what a packet changes, and that nothing else does."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from math import inf, nan
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest

from foosim.common.errors import Malformed
from foosim.deployment.loader import apply_sets, load_deployment
from foosim.deployment.schema import Deployment
from foosim.library.table.settings import table_of
from foosim.node.due_sensors import DueSensors
from foosim.node.physics.pure_engine import PureEngine
from foosim.node.tick import Stepper, Work
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.assembly.world import initial_numbers
from foosim.world.edits import Add, Edit, Push, Remove, Set, check_edits
from foosim.world.frame import Frame
from foosim.world.layout import Entity, Layout, build_layout
from foosim.world.robot_packets import Delivered
from tests.placing import added_ball, place_ball

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
DEPLOYMENT: Final = load_deployment(TABLE.read_text(), TABLE.name)
LAYOUT: Final = build_layout(DEPLOYMENT)
STEPPER: Final = Stepper(DEPLOYMENT, LAYOUT)
SPARES: Final = load_deployment(apply_sets(TABLE.read_text(), TABLE.name, ["table.spare_balls=2"]), TABLE.name)
WITH_SPARES: Final = build_layout(SPARES)
SPARE: Final = Stepper(SPARES, WITH_SPARES)
EVERY: Final = tuple(range(len(LAYOUT.entities)))
MASS: Final = table_of(DEPLOYMENT).ball.mass
HERE: Final = (0.1, -0.2, 0.03)


def in_play(deployment: Deployment = DEPLOYMENT, layout: Layout = LAYOUT, tick: int = 7, balls: int = 1) -> Frame:
    """A frame in which so many balls roll and a rod turns, so that nothing is zero by chance; the match is over, so
    that no clock counts."""
    numbers = initial_numbers(deployment, layout)
    for number, ball in enumerate(layout.of("ball")[:balls]):
        place_ball(numbers, ball, (0.2 - 0.1 * number, 0.1, 0.0175), (-1.5, 0.3, 0.0))
    numbers[layout["red.goal"].offsets["joint_velocities"]] = 0.4
    numbers[layout["world"].offsets["football.is_over"]] = 1.0
    return Frame(tick, layout, np.array(numbers))


def unclocked(numbers: list[float], layout: Layout) -> list[float]:
    """The numbers without the clock, which goes on at each tick of play."""
    at = layout["world"].offsets["football.played_ticks"]
    return [*numbers[:at], *numbers[at + 1 :]]


def slots(numbers: list[float], layout: Layout, name: str, field: str, count: int) -> list[float]:
    start = layout[name].offsets[field]
    return numbers[start : start + count]


def delivered(destination: str, payload: bytes = b"", channel: str = "position", **more: Any) -> Delivered:
    return Delivered(more.get("due", 0), "player-red", more.get("sequence", 1), 0, destination, channel, payload)


def command(slide: float, spin: float) -> bytes:
    return struct.pack("<2d", slide, spin)


# --- what robots send ------------------------------------------------------------------------------------------------


def test_who_measures_is_worked_out_once_for_robots_that_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    """From tick to tick the robots of a node are the same tuple; others are worked out anew."""
    stepper, frame = Stepper(DEPLOYMENT, LAYOUT), in_play(tick=5)
    made: list[Sequence[Entity]] = []

    def counted(robots: Sequence[Entity], sensors: Any, switches: Any) -> DueSensors:
        made.append(robots)
        return DueSensors(robots, sensors, switches)

    monkeypatch.setattr("foosim.node.tick.DueSensors", counted)
    first, _ = stepper.sense(frame, LAYOUT.robots)
    again, _ = stepper.sense(frame, LAYOUT.robots)
    assert again == first and len(made) == 1
    fewer, _ = stepper.sense(frame, LAYOUT.robots[:2])
    assert [packet.robot for packet in fewer] == [robot.name for robot in LAYOUT.robots[:2]] and len(made) == 2


# --- what an order does ----------------------------------------------------------------------------------------------


def test_without_edits_and_rules_at_work_the_frame_is_as_it_was() -> None:
    frame = in_play()
    numbers, _ = STEPPER.edited(frame, [], {})
    assert numbers is not frame.numbers
    assert unclocked(numbers, LAYOUT) == unclocked(frame.numbers, LAYOUT)


def test_a_push_is_impulse_over_mass_and_adds_up() -> None:
    frame = in_play()
    impulse = (0.021, -0.0042, 0.0)
    once, _ = STEPPER.edited(frame, [Push("ball", impulse)], {})
    before = frame.vector("ball", "linear_velocity", 3)
    expected = [v + p / MASS for v, p in zip(before, impulse, strict=True)]
    assert slots(once, LAYOUT, "ball", "linear_velocity", 3) == expected
    twice, _ = STEPPER.edited(frame, [Push("ball", impulse), Push("ball", impulse)], {})
    assert slots(twice, LAYOUT, "ball", "linear_velocity", 3) == [
        v + p / MASS for v, p in zip(expected, impulse, strict=True)
    ]
    clock = LAYOUT["world"].offsets["football.played_ticks"]
    changed = [i for i, (a, b) in enumerate(zip(once, frame.numbers, strict=True)) if a != b and i != clock]
    start = LAYOUT["ball"].offsets["linear_velocity"]
    assert changed == [start, start + 1]


def test_edits_apply_in_their_order() -> None:
    edits: list[Edit] = [added_ball(WITH_SPARES, "ball-2", HERE), Push("ball-2", (MASS, 0.0, 0.0))]
    numbers, _ = SPARE.edited(in_play(SPARES, WITH_SPARES), edits, {})
    assert slots(numbers, WITH_SPARES, "ball-2", "linear_velocity", 3) == [1.0, 0.0, 0.0]


@pytest.mark.parametrize(
    "edit",
    [
        added_ball(WITH_SPARES, "ball", HERE),
        added_ball(WITH_SPARES, "ball-3", HERE),
        Add("ball-2", [0.0]),
        Push("red.goal", HERE),
        Push("ball-2", HERE),
        Push("nobody", HERE),
        Remove("ball"),
        Remove("ball-2"),
        Set("ball-2", "position", [*HERE]),
        Set("ball", "position", [1.0]),
    ],
    ids=lambda edit: f"{type(edit).__name__} {edit.name}",
)
def test_an_edit_that_does_not_fit_changes_nothing(edit: Edit) -> None:
    """`ball` and `ball-3` are in the world, `ball-2` is not."""
    numbers = in_play(SPARES, WITH_SPARES).numbers
    place_ball(numbers, WITH_SPARES["ball-3"], (-0.2, -0.1, 0.0175))
    frame = Frame(7, WITH_SPARES, np.array(numbers))
    edited, _ = SPARE.edited(frame, [edit], {})
    assert unclocked(edited, WITH_SPARES) == unclocked(numbers, WITH_SPARES)


@pytest.mark.parametrize("bad", [nan, inf, -inf])
def test_edits_with_non_finite_numbers_are_malformed(bad: float) -> None:
    check_edits([Add("a2", [*HERE]), Push("ball", HERE), Remove("a2")])
    wrong: list[Edit] = [Add("a2", [0.0, bad]), Push("ball", (bad, 0.0, 0.0)), Set("ball", "position", [bad])]
    for edit in wrong:
        with pytest.raises(Malformed, match="non-finite"):
            check_edits([Remove("a2"), edit])


# --- what packets do -------------------------------------------------------------------------------------------------


def test_deliveries_apply_in_their_order_so_that_the_last_command_counts() -> None:
    numbers = initial_numbers(DEPLOYMENT, LAYOUT)
    packets = [delivered("red.goal", command(0.01 * n, float(n)), sequence=n) for n in range(1, 5)]
    assert STEPPER.deliver(packets, EVERY, numbers, 7) == {}
    assert slots(numbers, LAYOUT, "red.goal", "position.set_point", 2) == [0.04, 4.0]
    assert slots(numbers, LAYOUT, "red.goal", "refused", 1) == [0.0]
    STEPPER.deliver(packets[::-1], EVERY, numbers, 7)
    assert slots(numbers, LAYOUT, "red.goal", "position.set_point", 2) == [0.01, 1.0]


def test_a_node_applies_what_is_for_the_robots_that_it_solves() -> None:
    numbers = initial_numbers(DEPLOYMENT, LAYOUT)
    packets = [delivered("red.goal", command(0.01, 0.0)), delivered("blue.goal", command(0.02, 0.0))]
    STEPPER.deliver(packets, [LAYOUT["blue.goal"].index], numbers, 7)
    assert slots(numbers, LAYOUT, "red.goal", "position.set_point", 2) == [0.0, 0.0]
    assert slots(numbers, LAYOUT, "blue.goal", "position.set_point", 2) == [0.02, 0.0]


@pytest.mark.parametrize("destination", ["ball", "world", "nobody", "player-blue"])
def test_what_is_for_no_robot_changes_nothing(destination: str) -> None:
    numbers = initial_numbers(DEPLOYMENT, LAYOUT)
    for channel in ("position", "echo"):
        assert STEPPER.deliver([delivered(destination, command(0.01, 0.0), channel)], EVERY, numbers, 7) == {}
    assert numbers == initial_numbers(DEPLOYMENT, LAYOUT)


@pytest.mark.parametrize(("robot", "channel"), [("red.goal", "encoder"), ("red.goal", "none"), ("camera", "position")])
def test_a_channel_that_a_robot_does_not_hear_is_refused_and_counted(robot: str, channel: str) -> None:
    numbers = initial_numbers(DEPLOYMENT, LAYOUT)
    assert STEPPER.deliver([delivered(robot, command(0.01, 0.0), channel)] * 3, EVERY, numbers, 7) == {}
    assert slots(numbers, LAYOUT, robot, "refused", 1) == [3.0]


# --- solving ---------------------------------------------------------------------------------------------------------


def work_on(frame: Frame, *names: str) -> Work:
    island = tuple(sorted((LAYOUT[name] for name in names), key=lambda entity: entity.index))
    return Work(frame.tick, LAYOUT, (island,), tuple(entity.index for entity in island), frame.numbers.copy(), {})


def test_solving_writes_the_solved_bodies_and_nothing_else() -> None:
    frame = in_play()
    engine = PureEngine(DEPLOYMENT, LAYOUT)
    work = work_on(frame, "ball", "red.goal")
    STEPPER.solve(engine, work)
    changed = {e.name for e in LAYOUT.entities if work.numbers[e.start : e.stop] != frame.numbers[e.start : e.stop]}
    assert changed == {"ball", "red.goal"}
    x, y, _ = work.numbers[LAYOUT["ball"].start : LAYOUT["ball"].start + 3]
    tick_s = DEPLOYMENT.tick_ns / 1e9
    assert x == pytest.approx(0.2 - 1.5 * tick_s, abs=1e-4) and y == pytest.approx(0.1 + 0.3 * tick_s, abs=1e-4)


def test_a_share_without_bodies_needs_no_engine() -> None:
    frame = initial_frame(DEPLOYMENT)
    work = Work(0, LAYOUT, (), (LAYOUT["camera"].index, LAYOUT["world"].index), frame.numbers.copy(), {})
    STEPPER.solve(None, work)  # type: ignore[arg-type]
    assert work.numbers == frame.numbers


def test_the_frame_that_a_tick_starts_from_is_not_touched() -> None:
    frame = in_play()
    digest, raw = frame.digest, frame.values.tobytes()
    numbers, _ = STEPPER.edited(frame, [Push("ball", HERE)], {})
    STEPPER.deliver([delivered("red.goal", command(0.01, 1.0))], EVERY, numbers, 7)
    STEPPER.sense(frame, LAYOUT.robots)
    assert frame.values.tobytes() == raw and Frame(frame.tick, LAYOUT, np.array(frame.numbers)).digest == digest

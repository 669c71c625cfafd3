"""The requests `add` and `remove`: who comes where and on which node, and what is refused and changes nothing."""

from __future__ import annotations

from functools import cache
from math import sqrt
from typing import Any, Final

import numpy as np
import pytest

from foosim.deployment.loader import load_deployment
from foosim.deployment.text.yaml import write_yaml
from foosim.node.edited_frame import edit
from foosim.node.tick import Stepper
from foosim.protocol import channels
from foosim.protocol.codec import decode
from foosim.protocol.messages import Epoch
from foosim.world.assembly.world import initial_numbers
from foosim.world.component_types.descriptions import NO_ENTITY
from foosim.world.edits import Remove, parked
from foosim.world.frame import Frame
from foosim.world.layout import build_layout
from foosim.world.robot_packets import Delivered
from tests.kinematic_yard import yard_text
from tests.placing import added_ball
from tests.supervisor.test_requests import TABLE, Run

AT: Final = 40
BOX: Final = {"model": "box", "size": ["20 cm"] * 3, "mass": "1 kg", "count": 1, "spacing": {"x": "1 m"}}
WORLD: Final = yard_text(
    {"w": {"model": "holonomic", "at": {"y": "-3 m"}, "count": 2, "spare": 2, "spacing": {"x": "2 m"}}},
    engine="mujoco",
    objects={"b": {**BOX, "spare": 10, "at": {"z": "10 cm"}}, "wall": {**BOX, "at": {"y": "5 m", "z": "10 cm"}}},
)


def yard(nodes: int = 1) -> Run:
    return Run(nodes, ticks=80, world=WORLD)


@cache
def undisturbed() -> list[bytes]:
    return yard().go().digests


def came(run: Run) -> list[str]:
    """Who is in the world at the end and was not at the start, in name order."""
    first, last = run.frames[0], run.frames[-1]
    return [entity.name for entity in first.layout.present(last.numbers) if entity.is_absent(first.numbers)]


def test_the_name_of_a_fleet_adds_its_spares_in_the_order_of_their_numbers() -> None:
    run = yard()
    for tick in range(10, 10 + 9):
        run.ask_at(tick, "add", name="b")
    texts = [answer.text.split()[0] for answer in run.go().answers]
    assert texts == [f"b-{number}" for number in range(2, 11)], "b-10 after b-9"
    assert run.frames[-1].vector("b-3", "position", 3) == pytest.approx([2.0, 0.0, 0.1], abs=1e-3)


def test_a_place_may_be_said_with_a_heading() -> None:
    run = yard().ask_at(AT, "add", name="b-2", at="-4,1.5,0.1")
    run.ask_at(AT, "add", name="w", at={"x": "4 m", "y": "-20 cm", "yaw": "90 deg"})
    box, robot = run.go().answers
    assert box.accepted and robot.text == f"w-3 added at tick {robot.tick}"
    frame = run.frames[robot.tick]
    assert frame.vector("b-2", "position", 2) == pytest.approx([-4.0, 1.5], abs=1e-3)
    assert frame.vector("w-3", "position", 2) == pytest.approx([4.0, -0.2], abs=1e-3)
    assert frame.vector("w-3", "orientation", 4) == pytest.approx([0.0, 0.0, sqrt(0.5), sqrt(0.5)], abs=1e-3)


@pytest.mark.parametrize("node", ["n1", "n2", "n3"])
def test_a_node_owns_it_from_the_tick_of_the_one_answer_and_changes_nothing(node: str) -> None:
    run = yard(3).ask_at(AT, "add", name="w-3", node=node)
    (answer,) = run.go().answers
    state = run.system.supervisor.state
    assert answer.accepted and state.owners["w-3"] == node
    epochs = [decode(Epoch, payload) for channel, payload in run.said if channel == channels.EPOCH.name]
    moved = dict(epochs[0].owners)["w-3"] != node
    assert (len({epoch.epoch for epoch in epochs}), state.account.moves) == ((2, 1) if moved else (1, 0))
    assert run.digests == yard().ask_at(AT, "add", name="w-3").go().digests


REFUSED: Final[tuple[tuple[str, dict[str, Any], str], ...]] = (
    (
        "add",
        {"name": "b", "at": "0,5,0.1"},
        "at of b-2: a place that is occupied: b-2 would be in wall-1, ",
    ),
    ("add", {"name": "w-4", "at": "0,-3"}, "at of w-4: a place that is occupied: w-4 would be in w-1"),
    ("add", {"name": "w-4", "at": "0,-3", "node": "n2"}, "at of w-4: a place that is occupied"),
    ("add", {"name": "w-1"}, "w-1 is in the world already"),
    (
        "add",
        {"name": "wall"},
        "no wall is left to add: all 1 of the deployment are in the world, and objects.wall declares 0 spares",
    ),
    ("add", {"name": "wal"}, "'wal', nearest is 'wall'"),
    ("add", {"name": "w-4", "node": "n9"}, "no node 'n9'; there are n1, n2"),
    ("remove", {"name": "w-4"}, "w-4 is absent already"),
    ("remove", {"name": "w-5"}, "nothing to remove (there are: b-1, w-1, w-2, wall-1), 'w-5', nearest is 'w-1'"),
)


def test_what_cannot_come_or_go_is_refused_and_changes_nothing() -> None:
    run = yard(2)
    for verb, arguments, _ in REFUSED:
        run.ask_at(AT, verb, **arguments)
    for answer, (verb, arguments, expected) in zip(run.go().answers, REFUSED, strict=True):
        assert not answer.accepted and expected in answer.text, (verb, arguments, answer.text)
    assert run.digests == undisturbed() and run.system.supervisor.state.epoch == 1


def test_of_two_that_come_to_one_place_in_one_tick_the_second_is_refused() -> None:
    run = yard()
    for name in ("b-2", "w-3", "b-3"):
        run.ask_at(AT, "add", name=name, at="-4,0,0.1" if name[0] == "b" else "-4,0")
    run.ask_at(AT, "remove", name="b-2").ask_at(AT, "add", name="b-3", at="-4,0,0.1").go()
    first, robot, second, gone, third = run.answers
    assert [answer.accepted for answer in run.answers] == [True, False, False, True, True]
    assert {answer.tick for answer in (first, gone, third)} == {first.tick}
    assert robot.text.startswith("at of w-3: a place that is occupied: w-3 would be in b-2")
    assert second.text.startswith("at of b-3: a place that is occupied: b-3 would be in b-2")
    assert came(run) == ["b-3"]


def test_the_last_spare_is_the_last() -> None:
    run = yard().ask_at(20, "add", name="w").ask_at(20, "add", name="w").ask_at(30, "add", name="w")
    run.ask_at(40, "remove", name="w-1").ask_at(50, "add", name="w").go()
    assert [answer.text.rpartition(" at ")[0] or answer.text for answer in run.answers] == [
        "w-3 added",
        "w-4 added",
        "no w is left to add: all 4 of the deployment are in the world, and robots.w declares 2 spares",
        "w-1 removed",
        "w-1 added",
    ]


def test_an_answer_counts_with_the_events_of_the_ticks_that_are_released_already() -> None:
    """Spares come by events while others are requested: who is added by an answer comes at its tick."""
    added: list[dict[str, Any]] = [{"at": f"{tick}0 ms", "entity": f"b-{tick - 28}", "add": True} for tick in (30, 31)]
    gone = {"at": "310 ms", "entity": "w-2", "remove": True}
    run = Run(1, ticks=45, world=WORLD + write_yaml({"events": [*added, gone]}))
    run.ask_at(29, "add", name="b").ask_at(29, "remove", name="w-2").ask_at(
        29, "set", name="w-2", field="down", value=1
    )
    answer, *refused = run.go().answers
    assert answer.tick > 31, "released at once with the events"
    assert answer.text == f"b-4 added at tick {answer.tick}" and came(run) == ["b-2", "b-3", "b-4"]
    assert [one.text for one in refused] == ["w-2 is absent already", "w-2 is absent: add it first"]


def test_a_removal_clears_references_to_the_entity_in_the_memory_of_others() -> None:
    """As those of the game to whoever touched a ball last."""
    table = load_deployment(TABLE.read_text(), TABLE.name)
    layout = build_layout(table)
    numbers, touched = initial_numbers(table, layout), layout["ball"].offsets["football.touched_by"]
    spare = layout["ball-2"]
    added, _ = edit(Frame(0, layout, np.array(numbers)), [added_ball(layout, "ball-2", (0.2, 0.1, 0.05))], table)
    added[touched] = added[spare.offsets["football.touched_by"]] = float(spare.index)
    left, _ = edit(Frame(1, layout, np.array(added)), [Remove("ball-2")], table)
    assert left[touched] == left[spare.offsets["football.touched_by"]] == NO_ENTITY
    assert left == numbers


def test_what_reaches_a_robot_in_the_tick_in_which_it_leaves_changes_nothing() -> None:
    """Neither an echo, which would fill its outbox, nor a command, which would be counted as refused."""
    deployment = load_deployment(WORLD, TABLE.name)
    layout = build_layout(deployment)
    numbers, robot = initial_numbers(deployment, layout), layout["w-1"]
    stepper = Stepper(deployment, layout)
    packets = [Delivered(0, "me", 1, 0, "w-1", channel, b"x") for channel in ("echo", "drive")]
    assert stepper.deliver(packets, [robot.index], numbers.copy(), 1).keys() == {robot.index}
    gone, _ = stepper.edited(Frame(1, layout, np.array(numbers)), [Remove("w-1")], {})
    assert stepper.deliver(packets, [robot.index], gone, 1) == {}
    assert gone[robot.start : robot.stop] == parked(layout, robot)

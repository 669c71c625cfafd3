"""Parts become a frame only when together they hold each slot once, each of its own size, all finite."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from foosim.common import limits
from foosim.common.errors import Malformed
from foosim.deployment.loader import load_deployment
from foosim.protocol.barrier import BadParts, Barrier, Slots
from foosim.protocol.codec import encode
from foosim.protocol.messages import Part
from foosim.world.frame import Frame
from foosim.world.layout import build_layout
from foosim.world.robot_packets import Outbox, OutboxPacket

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
LAYOUT: Final = build_layout(load_deployment(TABLE.read_text(), TABLE.name))
ROBOTS: Final = [robot.name for robot in LAYOUT.robots]
NODES: Final = ("n1", "n2", "n3")
TICK: Final = 7
VALUES: Final[NDArray[np.float64]] = np.arange(LAYOUT.size, dtype=np.float64) + 0.25
"""Every slot has a number of its own."""
PACKETS: Final = encode([OutboxPacket("player-red", "echo", b"x")])


def slots_of(owners: Mapping[str, str]) -> Slots:
    return Slots(LAYOUT, owners)


def dealt(nodes: Sequence[str] = NODES) -> dict[str, str]:
    return {robot: nodes[number % len(nodes)] for number, robot in enumerate(ROBOTS)}


def shares(nodes: Sequence[str] = NODES) -> dict[str, list[int]]:
    """Entities dealt to nodes as solvers: not as to owners."""
    solved: dict[str, list[int]] = {node: [] for node in nodes}
    for entity in LAYOUT.entities:
        solved[nodes[(entity.index * 5 + 1) % len(nodes)]].append(entity.index)
    return solved


def part_of(node: str, solved: Sequence[int], slots: Slots, **changes: Any) -> Part:
    fields: dict[str, Any] = {
        "solver_values": VALUES[slots.solver(tuple(solved))].tobytes(),
        "owner_values": VALUES[slots.owner(node)].tobytes(),
        "outboxes": [],
        **changes,
    }
    return Part(1, TICK, node, bytes(32), list(solved), **fields)


def parts_of(slots: Slots, nodes: Sequence[str] = NODES) -> dict[str, Part]:
    return {node: part_of(node, solved, slots) for node, solved in shares(nodes).items()}


def collected(parts: Sequence[Part], slots: Slots, nodes: Sequence[str] = NODES) -> Barrier:
    barrier = Barrier(TICK, nodes, slots)
    for part in parts:
        barrier.add(part)
    return barrier


@settings(max_examples=60)
@given(
    solvers=st.lists(st.integers(0, 2), min_size=len(LAYOUT.entities), max_size=len(LAYOUT.entities)),
    owners=st.lists(st.integers(0, 2), min_size=len(ROBOTS), max_size=len(ROBOTS)),
    order=st.permutations(range(3)),
)
def test_each_slot_comes_from_its_one_writer(solvers: list[int], owners: list[int], order: list[int]) -> None:
    """However entities and robots are dealt, and in whatever order parts come, the frame is the same."""
    slots = slots_of({robot: NODES[owner] for robot, owner in zip(ROBOTS, owners, strict=True)})
    solved = {node: [index for index, at in enumerate(solvers) if NODES[at] == node] for node in NODES}
    barrier = Barrier(TICK, NODES, slots)
    for number, at in enumerate(order):
        assert barrier.missing == [node for node in NODES if node not in {NODES[i] for i in order[:number]}]
        barrier.add(part_of(NODES[at], solved[NODES[at]], slots))
    frame = barrier.assemble()
    assert frame.tick == TICK and frame.values.tobytes() == VALUES.tobytes()
    assert frame.digest == Frame(TICK, LAYOUT, VALUES).digest
    for entity in LAYOUT.entities:
        assert barrier.solver_of(entity.index) == NODES[solvers[entity.index]]


def test_slots_of_solvers_and_owners_are_each_slot_once() -> None:
    slots = slots_of(dealt())
    every = [slots.solver(tuple(range(len(LAYOUT.entities)))), *(slots.owner(node) for node in NODES)]
    assert sorted(np.concatenate(every).tolist()) == list(range(LAYOUT.size))
    assert slots.owner("stranger").size == slots.solver(()).size == 0


def test_outboxes_come_with_their_solver() -> None:
    slots = slots_of(dealt())
    index = LAYOUT["red.goal"].index
    parts = parts_of(slots)
    solver = next(node for node, part in parts.items() if index in part.solved)
    parts[solver] = msgspec.structs.replace(parts[solver], outboxes=[Outbox(index, PACKETS)])
    assert collected(list(parts.values()), slots).assemble().outboxes == {index: PACKETS}


def test_a_repeat_is_ignored_and_a_stranger_refused() -> None:
    slots = slots_of(dealt())
    parts = parts_of(slots)
    barrier = collected(list(parts.values()), slots)
    barrier.add(part_of("n1", shares()["n1"], slots, owner_values=bytes(len(parts["n1"].owner_values))))
    assert barrier.assemble().values.tobytes() == VALUES.tobytes(), "the first part of a node counts"
    with pytest.raises(Malformed, match=f"part {TICK} of n4: the roster is n1, n2, n3"):
        barrier.add(msgspec.structs.replace(parts["n1"], node="n4"))


WRONG: Final[dict[str, dict[str, Any]]] = {
    "a number too few": {"solver_values": b"short"},
    "a number too many": {"owner_values": bytes(8 * 200)},
    "none at all": {"solver_values": b"", "owner_values": b""},
    "not ascending": {"solved": [3, 1]},
    "twice": {"solved": [1, 1]},
    "not in the layout": {"solved": [len(LAYOUT.entities)]},
    "far from the layout": {"solved": [2**62]},
    "an outbox of another's entity": {"outboxes": [Outbox(LAYOUT["red.goal"].index, PACKETS)]},
    "an outbox of the ball": {"outboxes": [Outbox(LAYOUT["ball"].index, PACKETS)]},
    "an outbox out of the layout": {"outboxes": [Outbox(2**40, PACKETS)]},
    "an outbox that is none": {"outboxes": [Outbox(LAYOUT["blue.goal"].index, b"\xc1")]},
    "an outbox with a tail": {"outboxes": [Outbox(LAYOUT["blue.goal"].index, PACKETS + b"\x00")]},
    "two outboxes of one": {"outboxes": [Outbox(LAYOUT["blue.goal"].index, PACKETS)] * 2},
    "more packets than fit": {
        "outboxes": [Outbox(LAYOUT["blue.goal"].index, encode([OutboxPacket("p", "c", b"")] * 65))]
    },
}


@pytest.mark.parametrize("what", WRONG)
def test_a_part_that_does_not_fit_is_refused_and_the_right_one_still_counts(what: str) -> None:
    slots = slots_of(dealt())
    solved = sorted([LAYOUT["ball"].index, LAYOUT["blue.goal"].index])
    right = part_of("n1", solved, slots)
    barrier = Barrier(TICK, NODES, slots)
    with pytest.raises(Malformed, match=f"part {TICK} of n1: "):
        barrier.add(msgspec.structs.replace(right, **WRONG[what]))
    assert barrier.missing == list(NODES)
    barrier.add(right)
    assert barrier.missing == ["n2", "n3"]


def blamed(parts: Mapping[str, Part], slots: Slots) -> tuple[str, tuple[str, ...]]:
    """What the barrier says about these parts, and whom it blames; they are missing again once dropped."""
    barrier = collected(list(parts.values()), slots)
    with pytest.raises(BadParts) as caught:
        barrier.assemble()
    barrier.drop(caught.value.nodes)
    assert barrier.missing == sorted(caught.value.nodes)
    return str(caught.value), caught.value.nodes


def test_a_doubled_slot_is_blamed_on_both_who_claim_it() -> None:
    slots = slots_of(dealt())
    parts = parts_of(slots)
    ball = LAYOUT["ball"].index
    owner = next(node for node, part in parts.items() if ball in part.solved)
    other = next(node for node in NODES if node != owner)
    parts[other] = part_of(other, sorted([*parts[other].solved, ball]), slots)
    text, nodes = blamed(parts, slots)
    assert nodes == tuple(sorted([owner, other]))
    assert text == f"tick {TICK}: ball solved by {nodes[0]} and {nodes[1]}"


def test_a_missing_slot_is_named_and_nobody_trusted() -> None:
    slots = slots_of(dealt())
    parts = parts_of(slots)
    owner = next(node for node, part in parts.items() if LAYOUT["camera"].index in part.solved)
    parts[owner] = part_of(owner, [i for i in parts[owner].solved if i != LAYOUT["camera"].index], slots)
    text, nodes = blamed(parts, slots)
    assert text == f"tick {TICK}: camera solved by no node" and nodes == NODES


@pytest.mark.parametrize("field", ["solver_values", "owner_values"])
@pytest.mark.parametrize("bad", [float("nan"), float("inf"), float("-inf")])
def test_a_number_that_is_not_finite_is_blamed_on_its_sender(field: str, bad: float) -> None:
    slots = slots_of(dealt())
    parts = parts_of(slots)
    numbers = np.frombuffer(getattr(parts["n2"], field)).copy()
    numbers[-1] = bad
    parts["n2"] = msgspec.structs.replace(parts["n2"], **{field: numbers.tobytes()})
    text, nodes = blamed(parts, slots)
    assert nodes == ("n2",) and text == f"tick {TICK}: non-finite numbers of n2"


def test_great_numbers_are_finite_although_their_sum_is_not() -> None:
    slots = slots_of(dict.fromkeys(ROBOTS, "n1"))
    great = np.full(LAYOUT.size, 1.7e308)
    every = tuple(range(len(LAYOUT.entities)))
    values = {"solver_values": great[slots.solver(every)].tobytes(), "owner_values": great[slots.owner("n1")].tobytes()}
    barrier = Barrier(TICK, ["n1"], slots)
    barrier.add(part_of("n1", every, slots, **values))
    assert barrier.assemble().values.tobytes() == great.tobytes()


def test_an_outbox_may_be_as_full_as_its_limits() -> None:
    slots = slots_of(dealt())
    index = LAYOUT["red.goal"].index
    full = encode([OutboxPacket("p", "c", b"")] * limits.OUTBOX_PACKETS_MAX)
    assert len(full) <= limits.OUTBOX_BYTES_MAX
    Barrier(TICK, NODES, slots).add(part_of("n1", [index], slots, outboxes=[Outbox(index, full)]))

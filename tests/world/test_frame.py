"""A frame's digest depends on every bit, tick, layout and outbox; input digests and chains are exact functions."""

from __future__ import annotations

import struct
from hashlib import blake2b
from typing import Final

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from foosim.common.errors import Malformed
from foosim.protocol.barrier import edits_content, input_digest_of
from foosim.protocol.codec import encode
from foosim.protocol.messages import Order
from foosim.world.assembly.world import initial_numbers
from foosim.world.edits import Add, Edit, Push, Remove, Set, fitting_edits, write, written
from foosim.world.frame import CHAIN_START, Frame, chain_next, frame_from_bytes
from foosim.world.layout import build_layout
from foosim.world.robot_packets import Outbox
from tests.deployed import LAYOUT, deployed
from tests.placing import added_ball

SOME: Final[NDArray[np.float64]] = np.random.default_rng(1).normal(size=LAYOUT.size)
RED_GOAL: Final = LAYOUT["red.goal"].index
SPARES: Final = deployed("table.spare_balls=2")
WITH_SPARES: Final = build_layout(SPARES)
AT_START: Final = initial_numbers(SPARES, WITH_SPARES)
HERE: Final = (0.1, 0.0, 0.02)
REST: Final = (0.0, 0.0, 0.0)


def frame(values: NDArray[np.float64] = SOME, tick: int = 5, **outboxes: bytes) -> Frame:
    return Frame(tick, LAYOUT, values, {LAYOUT[name.replace("_", ".")].index: raw for name, raw in outboxes.items()})


def flipped(bit: int) -> NDArray[np.float64]:
    raw = bytearray(SOME.tobytes())
    raw[bit // 8] ^= 1 << bit % 8
    return np.frombuffer(bytes(raw))


@settings(max_examples=300)
@given(bit=st.integers(0, 64 * LAYOUT.size - 1))
def test_any_bit_changes_the_digest_and_that_of_its_entity_alone(bit: int) -> None:
    one, other = frame(), frame(flipped(bit))
    assert one.digest != other.digest
    changed = [e.name for e in LAYOUT.entities if one.entity_digest(e) != other.entity_digest(e)]
    assert changed == [e.name for e in LAYOUT.entities if e.start <= bit // 64 < e.stop]
    assert len(changed) == 1


def test_the_digest_is_the_one_that_the_design_names() -> None:
    """BLAKE2b of tick, layout and bytes as they are; what verify and other tools have to compute."""
    expected = blake2b(struct.pack("<Q", 5) + LAYOUT.digest + SOME.tobytes(), digest_size=32)
    assert frame().digest == expected.digest()
    outboxes = {LAYOUT["blue.goal"].index: b"", RED_GOAL: b"out"}
    for index, raw in sorted(outboxes.items()):
        expected.update(struct.pack("<QI", index, len(raw)) + raw)
    assert frame(red_goal=b"out", blue_goal=b"").digest == frame(blue_goal=b"", red_goal=b"out").digest
    assert frame(red_goal=b"out", blue_goal=b"").digest == expected.digest()


def test_an_outbox_is_part_of_its_entity_alone() -> None:
    changed = [e.name for e in LAYOUT.entities if frame().entity_digest(e) != frame(red_goal=b"a").entity_digest(e)]
    assert changed == ["red.goal"]
    assert len(frame().entity_digest(LAYOUT["ball"])) == 8


@settings(max_examples=50)
@given(
    values=st.lists(st.floats(allow_nan=False), min_size=LAYOUT.size, max_size=LAYOUT.size),
    outboxes=st.dictionaries(st.integers(0, len(LAYOUT.entities) - 1), st.binary(min_size=1, max_size=9)),
)
def test_a_frame_comes_back_from_its_bytes(values: list[float], outboxes: dict[int, bytes]) -> None:
    one = Frame(3, LAYOUT, np.array(values), outboxes)
    other = frame_from_bytes(3, LAYOUT, one.values.tobytes(), one.outbox_items)
    assert other.digest == one.digest and other.outboxes == one.outboxes
    assert struct.pack(f"<{LAYOUT.size}d", *other.numbers) == struct.pack(f"<{LAYOUT.size}d", *values)


def test_bytes_of_another_layout_are_malformed() -> None:
    raw = SOME.tobytes()
    for wrong in (raw[:-8], raw + bytes(8), raw[:-1], b""):
        with pytest.raises(Malformed, match=f"{len(wrong)} bytes of values, the layout has {len(raw)}"):
            frame_from_bytes(1, LAYOUT, wrong, [])
    for indices in ([1, 0], [2, 2], [len(LAYOUT.entities)], [2**62]):
        with pytest.raises(Malformed, match="not ascending or not in the layout"):
            frame_from_bytes(1, LAYOUT, raw, [Outbox(index, b"x") for index in indices])


# --- input digest and chain -------------------------------------------------------------------------------------------


def test_an_input_digest_is_of_digest_order_and_deliveries() -> None:
    push = [Push("ball", (0.0, 0.01, 0.0))]
    one = input_digest_of(frame().digest, push, b"deliveries")
    assert one == input_digest_of(frame().digest, list(push), b"deliveries")
    others = [
        input_digest_of(frame(tick=6).digest, push, b"deliveries"),
        input_digest_of(frame().digest, [], b"deliveries"),
        input_digest_of(frame().digest, [Push("ball", (0.0, 0.02, 0.0))], b"deliveries"),
        input_digest_of(frame().digest, [*push, *push], b"deliveries"),
        input_digest_of(frame().digest, push, b"Deliveries"),
        input_digest_of(frame().digest, push, b""),
    ]
    assert len({one, *others}) == 7


def test_where_an_order_ends_and_deliveries_begin_is_part_of_the_input_digest() -> None:
    content = edits_content([Remove("b")])
    assert input_digest_of(bytes(32), [], content) != input_digest_of(bytes(32), [Remove("b")], b"")


def test_the_content_of_an_order_has_no_epoch() -> None:
    edits: list[Edit] = [Remove("b"), Push("ball", REST)]
    assert encode(Order(1, 2, edits)) != encode(Order(9, 2, edits))
    assert edits_content(edits) in encode(Order(1, 2, edits))
    assert edits_content([]) == encode([])


def test_the_chain_is_over_digests_and_nothing_else() -> None:
    assert bytes(32) == CHAIN_START
    chain = chain_next(CHAIN_START, frame().digest)
    assert chain == blake2b(bytes(32) + frame().digest, digest_size=32).digest()
    assert chain_next(chain, frame().digest) != chain


# --- what an order does to a frame -----------------------------------------------------------------------------------


def added(name: str = "ball-2") -> Add:
    return added_ball(WITH_SPARES, name, HERE)


def fitting(numbers: list[float], edits: list[Edit]) -> list[Edit]:
    """Those of some edits that do something, each applied before the next one is looked at."""
    after, found = [*numbers], []
    for edit in fitting_edits(WITH_SPARES, after, edits):
        write(WITH_SPARES, after, edit)
        found.append(edit)
    return found


def after(edits: list[Edit], numbers: list[float] = AT_START) -> list[float]:
    return written(WITH_SPARES, numbers, edits)


NOTHING: Final[list[Edit]] = [
    added("ball"),
    Add("world", []),
    Add("red.goal", [0.0]),
    Add("ball-2", [0.0]),
    Add("ball2", added().numbers),
    Remove("ball"),
    Remove("ball-2"),
    Remove("world"),
    Remove("red.goal"),
    Remove("camera"),
    Remove("nobody"),
    Push("ball-2", HERE),
    Push("red.goal", HERE),
    Push("world", HERE),
    Push("nobody", HERE),
    Set("ball-2", "position", [*HERE]),
]


@pytest.mark.parametrize("edit", NOTHING, ids=lambda edit: f"{type(edit).__name__}-{edit.name}")
def test_an_edit_that_does_not_fit_changes_nothing(edit: Edit) -> None:
    assert fitting(AT_START, [edit]) == []
    assert after([edit]) == AT_START
    assert fitting(AT_START, [added("ball-3"), edit]) == [added("ball-3")]


@settings(max_examples=200)
@given(
    edits=st.lists(
        st.builds(added, st.sampled_from(["ball", "ball-2", "ball-3"]))
        | st.builds(Remove, st.sampled_from(["ball", "ball-2", "ball-3", "world"]))
        | st.builds(Push, st.sampled_from(["ball-2", "ball", "camera"]), st.just(REST)),
        max_size=12,
    ),
    cut=st.integers(0, 12),
)
def test_one_order_after_another_is_as_good_as_both_in_one(edits: list[Edit], cut: int) -> None:
    """So supervisor, nodes and vHub, who see the same edits, never disagree about who is there."""
    between = after(edits[:cut])
    assert after(edits[cut:], between) == after(edits)
    assert fitting(AT_START, edits) == fitting(AT_START, edits[:cut]) + fitting(between, edits[cut:])

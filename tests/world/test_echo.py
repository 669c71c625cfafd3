"""The built-in echo: a robot answers in the next tick, from a bounded outbox that is part of the frame."""

from __future__ import annotations

from typing import Final

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foosim.common import limits
from foosim.node.tick import Stepper
from foosim.protocol.codec import decode_any
from foosim.world.assembly.world import initial_numbers
from foosim.world.frame import Frame
from foosim.world.robot_packets import Delivered, OutboxPacket, RobotPacket
from tests.deployed import DEPLOYMENT, LAYOUT

STEPPER: Final = Stepper(DEPLOYMENT, LAYOUT)
EVERY: Final = tuple(range(len(LAYOUT.entities)))
GOAL: Final = LAYOUT["red.goal"]


def echo(payload: bytes, sequence: int = 1, source: str = "player-red", destination: str = "red.goal") -> Delivered:
    return Delivered(0, source, sequence, 0, destination, "echo", payload)


def after(packets: list[Delivered]) -> tuple[dict[int, bytes], list[float]]:
    numbers = initial_numbers(DEPLOYMENT, LAYOUT)
    return STEPPER.deliver(packets, EVERY, numbers, 0), numbers


def answers(outboxes: dict[int, bytes], tick: int = 1) -> list[RobotPacket]:
    frame = Frame(tick, LAYOUT, np.array(initial_numbers(DEPLOYMENT, LAYOUT)), outboxes)
    packets, _ = STEPPER.sense(frame, LAYOUT.robots)
    return [packet for packet in packets if packet.channel == "echo"]


def refused(numbers: list[float], robot: str = "red.goal") -> float:
    return numbers[LAYOUT[robot].offsets["refused"]]


@settings(max_examples=50)
@given(payloads=st.lists(st.binary(max_size=30), max_size=20))
def test_payloads_return_in_the_next_tick_to_their_sender(payloads: list[bytes]) -> None:
    outboxes, numbers = after([echo(payload, number) for number, payload in enumerate(payloads)])
    assert answers(outboxes) == [
        RobotPacket("red.goal", index, "player-red", "echo", payload) for index, payload in enumerate(payloads)
    ]
    assert refused(numbers) == 0.0 and set(outboxes) <= {GOAL.index}


def test_each_robot_has_an_outbox_and_answers_each_sender() -> None:
    packets = [echo(b"1"), echo(b"2", 1, "player-blue"), echo(b"3", 2, "player-red", "camera")]
    assert answers(after(packets)[0]) == [
        RobotPacket("camera", 0, "player-red", "echo", b"3"),
        RobotPacket("red.goal", 0, "player-red", "echo", b"1"),
        RobotPacket("red.goal", 1, "player-blue", "echo", b"2"),
    ]


def test_answers_are_numbered_among_the_samples_of_the_tick() -> None:
    """Channels in name order, within a channel in the order of the outbox: the same for any owner."""
    outboxes, _ = after([echo(b"1"), echo(b"2", 2)])
    frame = Frame(5, LAYOUT, np.array(initial_numbers(DEPLOYMENT, LAYOUT)), outboxes)
    packets, _ = STEPPER.sense(frame, [GOAL])
    assert [(packet.index, packet.channel, packet.payload[:1]) for packet in packets[:2]] == [
        (0, "echo", b"1"),
        (1, "echo", b"2"),
    ]
    assert (packets[2].index, packets[2].channel, packets[2].destination) == (2, "encoder", "")


def test_an_outbox_holds_64_packets_and_more_are_refused_and_counted() -> None:
    outboxes, numbers = after([echo(b"", number, "p") for number in range(70)])
    assert len(answers(outboxes)) == limits.OUTBOX_PACKETS_MAX == 64
    assert refused(numbers) == 6.0


@pytest.mark.parametrize("size", [1, 100, 300, 900])
def test_an_outbox_holds_a_kibibyte_and_more_is_refused_and_counted(size: int) -> None:
    packets = [echo(bytes(size), number) for number in range(60)]
    outboxes, numbers = after(packets)
    raw = outboxes[GOAL.index]
    kept = decode_any(list[OutboxPacket], raw)
    assert len(raw) <= limits.OUTBOX_BYTES_MAX == 1024
    assert len(kept) == len(answers(outboxes)) and len(kept) + refused(numbers) == 60.0
    assert len(raw) + len(raw) // len(kept) > limits.OUTBOX_BYTES_MAX - 8, "no room is wasted"


def test_too_large_a_packet_is_refused_and_a_small_one_still_fits_after_it() -> None:
    outboxes, numbers = after([echo(b"a"), echo(bytes(2000), 2), echo(b"b", 3)])
    assert [packet.payload for packet in answers(outboxes)] == [b"a", b"b"]
    assert refused(numbers) == 1.0


def test_an_outbox_is_sent_once() -> None:
    """The outboxes of the next frame are made anew: without packets it has none."""
    assert after([]) == ({}, initial_numbers(DEPLOYMENT, LAYOUT))


def test_only_who_solves_a_robot_fills_its_outbox() -> None:
    numbers = initial_numbers(DEPLOYMENT, LAYOUT)
    assert STEPPER.deliver([echo(b"x")], [LAYOUT["blue.goal"].index], numbers, 0) == {}
    assert refused(numbers) == 0.0

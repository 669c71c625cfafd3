"""Typed values to and from payloads: exact bytes, exact refusals."""

from __future__ import annotations

from math import inf, nan
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from foosim.common.errors import BadValue, Malformed, UnknownName
from foosim.deployment.channel_kinds import channel_kind
from foosim.deployment.loader import load_deployment
from foosim.world.payloads import (
    KINDS,
    BallPosition,
    Battery,
    Command,
    Drive,
    Pose,
    Ranges,
    RodPosition,
    Value,
    WheelTravel,
    decode_payload,
    encode_command,
    encode_payload,
)

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
DEPLOYMENT = load_deployment(TABLE.read_text(), TABLE.name)
VALUES: dict[str, Value] = {
    "encoder": RodPosition(0.1, -2.5),
    "ball": BallPosition(1 / 3, -0.0, 1e-300),
    "position": Command(-0.12, 1.5),
    "pose": Pose(1 / 3, -7.5, 3.1),
    "odometry": WheelTravel(12.5, -0.25),
    "battery": Battery(0.5, 24.6),
    "proximity": Ranges((4.0, 0.0, 1 / 3)),
    "drive": Drive(-0.5, 1.2),
    "echo": b"any \x00 bytes",
}


def test_every_kind_is_tested() -> None:
    assert sorted(VALUES) == sorted(KINDS)


@pytest.mark.parametrize("kind", KINDS)
def test_a_value_comes_back_as_it_was(kind: str) -> None:
    value = VALUES[kind]
    again = decode_payload(kind, encode_payload(kind, value))
    assert (again, type(again)) == (value, type(value))


@pytest.mark.parametrize("kind", ["encoder", "ball", "position"])
def test_numbers_are_little_endian_float64_in_order(kind: str) -> None:
    assert np.frombuffer(encode_payload(kind, VALUES[kind]), "<f8").tolist() == list(VALUES[kind])


@given(st.sampled_from(["encoder", "ball", "position"]), st.binary(max_size=40))
def test_random_bytes_are_a_value_or_malformed(kind: str, payload: bytes) -> None:
    size = 24 if kind == "ball" else 16
    if len(payload) == size and np.isfinite(np.frombuffer(payload, "<f8")).all():
        assert encode_payload(kind, decode_payload(kind, payload)) == payload
    else:
        with pytest.raises(Malformed):
            decode_payload(kind, payload)


@pytest.mark.parametrize("payload", [b"", bytes(12), bytes(8 * 129), np.array([1.0, nan]).tobytes()])
def test_rays_are_one_to_128_finite_numbers(payload: bytes) -> None:
    with pytest.raises(Malformed, match="proximity"):
        decode_payload("proximity", payload)


@pytest.mark.parametrize(
    ("payload", "text"),
    [
        (b"", "0 bytes, encoder has 16"),
        (bytes(24), "24 bytes, encoder has 16"),
        (np.array([0.0, nan]).tobytes(), "encoder with numbers that are not finite"),
        (np.array([inf, -inf]).tobytes(), "encoder with numbers that are not finite"),
    ],
)
def test_what_does_not_fit_says_why(payload: bytes, text: str) -> None:
    with pytest.raises(Malformed) as error:
        decode_payload("encoder", payload)
    assert str(error.value) == text


def test_the_kind_of_each_channel() -> None:
    assert channel_kind(DEPLOYMENT, "red.goal", "encoder") == "encoder"
    assert channel_kind(DEPLOYMENT, "red.goal", "position") == "position"
    assert channel_kind(DEPLOYMENT, "camera", "ball") == "ball"
    assert channel_kind(DEPLOYMENT, "camera", "echo") == "echo"


@pytest.mark.parametrize(
    ("robot", "channel", "text"),
    [
        ("red.goal", "bal", "red.goal has no such channel (there are: echo, encoder, position), 'bal'"),
        ("camera", "position", "camera has no such channel (there are: ball, echo), 'position'"),
        ("camera", "bal", "camera has no such channel (there are: ball, echo), 'bal', nearest is 'ball'"),
    ],
)
def test_an_unknown_channel_names_those_that_exist(robot: str, channel: str, text: str) -> None:
    with pytest.raises(UnknownName) as error:
        channel_kind(DEPLOYMENT, robot, channel)
    assert str(error.value) == text


def test_an_unknown_robot_names_the_nearest() -> None:
    with pytest.raises(UnknownName, match=r"unknown robot .*'red\.gol', nearest is 'red\.goal'"):
        channel_kind(DEPLOYMENT, "red.gol", "encoder")


@pytest.mark.parametrize(
    ("command", "text"),
    [
        (Command(0.1231, 0.0), "slide of red.goal is not within -0.123 to 0.123 m, 0.1231"),
        (Command(-0.1231, 0.0), "slide of red.goal is not within -0.123 to 0.123 m, -0.1231"),
        (Command(0.0, 1000.1), "spin of red.goal is not within -1000.0 to 1000.0 rad, 1000.1"),
        (Command(nan, 0.0), "position.slide is not finite, nan"),
        (Command(0.0, -inf), "position.spin is not finite, -inf"),
        (Command(10**400, 0.0), f"position.slide is not finite, 1{'0' * 43}...0"),
        (Command("left", 0.0), "position.slide is not a number, 'left'"),  # type: ignore[arg-type]
        (Command(0.0, None), "position.spin is not a number, null"),  # type: ignore[arg-type]
    ],
)
def test_a_command_out_of_reach_is_told_to_the_sender(command: Command, text: str) -> None:
    with pytest.raises(BadValue) as error:
        encode_command(DEPLOYMENT, "red.goal", command)
    assert str(error.value) == text


def test_a_command_at_the_edge_of_its_reach_is_good() -> None:
    assert encode_command(DEPLOYMENT, "red.goal", Command(0.123, -1000.0)) == np.array([0.123, -1000.0]).tobytes()


@pytest.mark.parametrize("robot", ["camera", "ball", "red.gaol"])
def test_what_is_no_rod_takes_no_command(robot: str) -> None:
    with pytest.raises(UnknownName, match=r"no rod \(there are: blue\.attack, .*red\.midfield\)"):
        encode_command(DEPLOYMENT, robot, Command(0.0, 0.0))

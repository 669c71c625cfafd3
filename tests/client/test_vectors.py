"""Readings and commands as vectors of numbers."""

from __future__ import annotations

import struct
from math import inf
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from foosim.client.vectors import CommandVector, ReadingVector, chosen
from foosim.common.errors import BadValue, UnknownName
from foosim.deployment.loader import load_deployment
from foosim.protocol.messages import Received
from foosim.simulation.simulation import read_for_stepping

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
DEPLOYMENT: Final = load_deployment(TABLE.read_text(), TABLE.name)
BALL: Final = ("camera", "ball")
ENCODER: Final = ("red.goal", "encoder")


def test_readings_are_in_the_order_of_their_names_with_units() -> None:
    vector = ReadingVector(DEPLOYMENT, [ENCODER, BALL, ("player-blue", "words")], ages=True)
    assert vector.pairs == (BALL, ENCODER) and vector.left_out == (("player-blue", "words"),)
    assert [column[:4] for column in vector.columns] == [
        ("camera", "ball", "x", "m"),
        ("camera", "ball", "y", "m"),
        ("camera", "ball", "z", "m"),
        ("red.goal", "encoder", "slide", "m"),
        ("red.goal", "encoder", "spin", "rad"),
        ("camera", "ball", "age", "s"),
        ("red.goal", "encoder", "age", "s"),
    ]
    assert vector.columns[0][4:] == (-inf, inf) and vector.columns[-1].low == -1.0


def test_payloads_are_joined_with_their_ages() -> None:
    vector = ReadingVector(DEPLOYMENT, [ENCODER, BALL], ages=True)
    payload = struct.pack("<3d", 0.1, -0.2, 0.3)
    packet = Received("camera", 3, 0, "ball", 1_000_000, 2_000_000, payload)
    assert vector.join({BALL: packet}, 5_000_000).tolist() == [0.1, -0.2, 0.3, 0.0, 0.0, 0.004, -1.0]
    plain = ReadingVector(DEPLOYMENT, [BALL]).join({BALL: packet}, 0)
    plain[0] = 7.0
    assert plain.tolist() == [7.0, -0.2, 0.3], "it is the caller's own"


def test_commands_are_clipped_and_packed_by_robot() -> None:
    vector = CommandVector(DEPLOYMENT, ["red.midfield", "red.goal"], bounds={"*.spin": (-1.0, 2000.0)})
    assert [(one.robot, one.field, one.low, one.high) for one in vector.columns] == [
        ("red.goal", "slide", -0.123, 0.123),
        ("red.goal", "spin", -1.0, 1000.0),
        ("red.midfield", "slide", -0.0615, 0.0615),
        ("red.midfield", "spin", -1.0, 1000.0),
    ]
    first, second = vector.packets(np.array([5.0, -5.0, 0.01, 3.0]))
    assert first[:2] == ("red.goal", "position") and struct.unpack("<2d", first.payload) == (0.123, -1.0)
    assert second[:2] == ("red.midfield", "position") and struct.unpack("<2d", second.payload) == (0.01, 3.0)


def test_what_is_no_command() -> None:
    vector = CommandVector(DEPLOYMENT, ["red.goal"], ["red.goal/*"])
    with pytest.raises(BadValue, match=r"an action of shape .*; expected \(2,\)"):
        vector.packets(np.zeros((1, 2)))
    with pytest.raises(BadValue, match=r"spin of red.goal is not finite, nan"):
        vector.packets(np.array([0.0, np.nan]))
    with pytest.raises(UnknownName, match=r"selects no robot/channel .there are: red.goal/position.*red.gaol"):
        CommandVector(DEPLOYMENT, ["red.goal"], ["red.gaol/*"])


def test_everything_may_be_nothing() -> None:
    assert chosen([], ["*"]) == []
    assert chosen([ENCODER, BALL], ["red.*/*", "camera/b*"]) == [BALL, ENCODER]


def test_commands_of_joints_have_a_column_for_each_with_its_own_limits() -> None:
    deployment = read_for_stepping(TABLE.with_name("yard.yaml"))
    vector = CommandVector(deployment, ["arm"])
    assert {one.channel for one in vector.columns} == {"joints"}
    assert [one.field for one in vector.columns][2:5] == [
        *("positions.upper_arm_roll", "positions.elbow_pitch", "positions.forearm_roll")
    ]
    assert len({(one.low, one.high) for one in vector.columns}) > 1
    middle = np.array([(one.low + one.high) / 2 if one.low > -inf else 0.0 for one in vector.columns])
    (packet,) = vector.packets(middle)
    assert struct.unpack(f"<{len(middle)}d", packet.payload) == tuple(middle.tolist())

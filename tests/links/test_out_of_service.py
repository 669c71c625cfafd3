"""Bodies that are out of service: who is on board of one neither sends nor receives, by whatever way."""

from __future__ import annotations

from typing import Final

import numpy as np
import pytest

from foosim.protocol.messages import Sent
from foosim.vhub.network.memory import Joining
from foosim.vhub.network.packet import Flight
from foosim.vhub.state.hub_state import HubState
from foosim.world.assembly.initial_state import initial_frame
from foosim.world.frame import Frame
from foosim.world.robot_packets import RobotPacket
from tests.links.offered import deployment_of

ON_BOARD: Final = "clients={a: {on: red.attack}, b: {}}"
WAYS: Final = {
    "wire": "network.links=[{id: wire, from: '*', to: '*', delay: 3 ms}]",
    "long": "network.links=[{id: long, from: '*', to: '*', delay: 3 ms, mtu: 9 B}]",
    "radio": "network={radios: {w: {preset: wifi_5_indoor}}, robots: {'*': [w]},"
    " places: {b: [1 m, 0 m, 1 m], camera: [0 m, 0 m, 2 m]}}",
    "nothing": "network.links=[]",
}
DOWN: Final = range(10, 20)


def carried(way: str) -> list[Flight]:
    """Have both clients and the robot send at every tick, to one another; the robot is down for a while."""
    deployment = deployment_of(ON_BOARD, WAYS[way])
    state, start, robot = HubState(deployment), initial_frame(deployment), "red.attack"
    for name in ("a", "b"):
        state.join(Joining(name, 0, []), 0)
    layout = start.layout
    fates: list[Flight] = []
    for tick in range(30):
        values = np.array(start.values)
        values[layout[robot].offsets["down"]] = float(tick in DOWN)
        frame = Frame(tick, layout, values)
        state.close_world(frame, [RobotPacket(robot, 0, "b", "data", b"r")], fates)
        sent = {
            "a": [Sent(2 * tick + 1, "b", "data", 0, b"a"), Sent(2 * tick + 2, "red.goal", "data", 0, b"a")],
            "b": [Sent(2 * tick + 1, "a", "data", 0, b"b"), Sent(2 * tick + 2, robot, "data", 0, b"b")],
        }
        state.close_clients(frame, sent, fates)
    return fates


@pytest.mark.parametrize("way", WAYS)
def test_who_is_on_board_neither_sends_nor_receives(way: str) -> None:
    """What arrives at robots at a tick was judged by the frame before."""
    seen = set()
    for flight in carried(way):
        sent = flight.sent_ns // 2_000_000
        if flight.source in ("a", "red.attack"):
            assert (flight.cause == "node_down") == (sent in DOWN), (flight.source, sent, flight.cause)
        else:
            arrived = flight.arrival_tick - (flight.destination == "red.attack")
            assert (flight.cause == "rx_down") == (arrived in DOWN), (flight.destination, arrived, flight.cause)
        seen.add((flight.source, flight.destination, flight.cause))
    assert {(source, to) for source, to, cause in seen if cause == "node_down"} == {
        ("a", "b"), ("a", "red.goal"), ("red.attack", "b"),
    }  # fmt: skip
    assert {(source, to) for source, to, cause in seen if cause == "rx_down"} == {("b", "a"), ("b", "red.attack")}
    assert {(source, to) for source, to, cause in seen if not cause} == {
        ("a", "b"), ("a", "red.goal"), ("red.attack", "b"), ("b", "a"), ("b", "red.attack"),
    }  # fmt: skip

"""The client library against a run of real processes: lockstep, free-running, and what it says when it is refused."""

from __future__ import annotations

from math import isfinite
from threading import Event
from typing import TYPE_CHECKING

import pytest

from foosim.client import control
from foosim.client.client import connect
from foosim.client.errors import ConnectionFailed, ConnectionRefused, NotJoined, RunEnded
from foosim.common.errors import BadValue, UnknownName
from foosim.library.table.encoder import RodPosition
from tests.wire.conftest import ONE

if TYPE_CHECKING:
    from foosim.client.client import Client
    from foosim.runtime.run_folder import RunInfo
    from tests.wire.conftest import House

CLIENTS = "clients={hand: {lockstep: true, rate: 100 Hz}, ear: {lockstep: false}}"
PERFECT = "network.links=[]"
TICKS = 50
PATIENCE_S = 900.0


def test_a_lockstep_client_moves_a_rod_and_sees_it_follow(house: House) -> None:
    up = house.up(
        "--set", CLIENTS, "--set", PERFECT, "--set", "engine=pure", "--pace", "fast", "--for", "1s", "--json", *ONE
    )
    radio = house.info().radio
    with connect(radio, "hand", "table", timeout_s=PATIENCE_S) as client:
        client.subscribe("red.goal", "encoder")
        client.subscribe("blue.attack", "encoder")
        goal, attack = client.robots["red.goal"], client.robots["blue.attack"]
        assert goal.sensors["encoder"] is None
        with pytest.raises(NotJoined, match="lockstep"):
            goal.actuators["position"].set(slide=0.0, spin=0.0)
        seen = []
        for tick in client.lockstep():
            seen.append(tick)
            assert client.tick == tick
            assert len(client.packets) == 2, "a perfect link brings what both send at this tick"
            with pytest.raises(BadValue, match="not finite"):
                goal.actuators["position"].set(slide=float("nan"), spin=0.0)
            goal.actuators["position"].set(slide=-0.1, spin=0.0)
            goal.actuators["position"].set(slide=0.1, spin=0.5)
            client.command({"blue.attack": {"slide": -0.05, "spin": 0.0}})
            if len(seen) == TICKS:
                break
        assert seen == list(range(0, 5 * TICKS, 5))
        for robot, slide, spin in ((goal, 0.1, 0.5), (attack, -0.05, 0.0)):
            sample = robot.sensors["encoder"]
            assert sample is not None and isinstance(sample.value, RodPosition)
            assert sample.value.slide == pytest.approx(slide, abs=0.005)
            assert sample.value.spin == pytest.approx(spin, abs=0.1)
            assert sample.sent_ns == seen[-1] * client.deployment.tick_ns
        with pytest.raises(UnknownName, match="not subscribed"):
            client.robots["red.attack"].sensors["encoder"]
        with pytest.raises(NotJoined, match="another rate"):
            client.lockstep(50)
        rest = list(client.lockstep())
        assert rest == list(range(5 * TICKS, 500, 5)), "the loop ends with the run"
        assert client.ended
        with pytest.raises(RunEnded):
            goal.actuators["position"].set(slide=0.0, spin=0.0)
        assert client.statistics().answered == 100
        assert client.statistics().sent == 2 * 50
    code, _, err = house.end(up)
    assert code == 0, err


def test_free_running_clients_hear_robots_and_one_another_and_who_is_refused_is_told_why(house: House) -> None:
    up = house.up("--set", CLIENTS.replace("true, rate: 100 Hz", "false"), "--set", "engine=pure", *ONE)
    info = house.info()
    assert_strangers_are_refused(info)
    due = Event()
    with (
        connect("run:newest", "ear", timeout_s=PATIENCE_S, notify=due.set) as client,
        connect(f"run:{info.run}", "hand", timeout_s=PATIENCE_S) as other,
    ):
        with pytest.raises(ConnectionRefused, match="a client hand is already here"):
            connect(info.radio, "hand", timeout_s=PATIENCE_S)
        assert_wrong_names_are_told(client)
        client.listen([("camera", "ball")])
        assert isfinite(client.deadline_s()), "Join is repeated"
        with pytest.raises(NotJoined):
            client.subscribe("red.goal", "encoder")
        with pytest.raises(UnknownName, match="unknown destination"):
            client.send("red.gaol", "echo", b"")
        other.listen()
        back: list[bytes] = []
        heard: list[bytes] = []
        number = 0
        while not (back and heard and client.robots["camera"].sensors["ball"]):
            number += 1  # what is sent before the vHub has taken a client in is lost, and one in 200 later
            assert number < 10_000
            client.robots["blue.goal"].send("echo", b"%d" % number)
            other.send("ear", "talk", b"%d" % number)
            assert due.wait(PATIENCE_S), "the camera is heard"
            due.clear()
            for packet in client.receive(0.0):
                if packet.channel == "echo":
                    assert (packet.source, packet.value) == ("blue.goal", packet.payload)
                    assert packet.due_ns > packet.sent_ns
                    back.append(packet.payload)
                elif packet.source == "hand":
                    heard.append(packet.payload)
        assert {int(payload) for payload in back + heard} <= set(range(1, number + 1))
        control.request("down")
        with pytest.raises(RunEnded):
            while due.wait(PATIENCE_S):
                due.clear()
                client.receive(0.0)
        with pytest.raises(RunEnded):
            client.send("camera", "echo", b"")
    code, _, err = house.end(up)
    assert code == 0, err


def assert_strangers_are_refused(info: RunInfo) -> None:
    with pytest.raises(ConnectionRefused, match=r"no client hands .*declared are ear, hand, nearest is hand"):
        connect(info.radio, "hands", timeout_s=PATIENCE_S)
    with pytest.raises(ConnectionRefused, match="world pool, this is table"):
        connect(info.radio, "hand", "pool", timeout_s=PATIENCE_S)
    with pytest.raises(ConnectionFailed, match="radio plane's address"):
        connect(info.simulation, "hand", timeout_s=1.0)
    with pytest.raises(BadValue, match="not a name for a client"):
        connect(info.radio, "Hand")


def assert_wrong_names_are_told(client: Client) -> None:
    """By a client that does not listen yet."""
    with pytest.raises(UnknownName, match=r"unknown robot .*'red.gaol', nearest is 'red.goal'"):
        client.robots["red.gaol"]
    with pytest.raises(UnknownName, match=r"no such actuator .*nearest is 'position'"):
        client.robots["red.goal"].actuators["positon"]
    with pytest.raises(UnknownName, match=r"no such channel to hear .*nearest is 'encoder'"):
        client.subscribe("red.goal", "encode")
    with pytest.raises(BadValue, match="not a whole number of ticks"):
        client.lockstep(300)
    with pytest.raises(BadValue, match="declares none for ear"):
        client.lockstep()


def test_nobody_at_the_address(house: House) -> None:
    with pytest.raises(ConnectionFailed, match=r"no router answers at tcp/127\.0\.0\.1:1 "):
        connect("tcp/127.0.0.1:1", "hand", timeout_s=0.1)

"""MORSE's socket: streams, services, triggers and the radio, over real sockets in a rehearsal on virtual time."""

from __future__ import annotations

import json
import random
import socket
from base64 import b64decode
from collections.abc import Iterator
from contextlib import ExitStack
from itertools import pairwise
from typing import Any

import pytest

from foosim.gateways.lines import LINE_BYTES_MAX, UNREAD_BYTES_MAX
from foosim.gateways.main import raise_descriptors
from foosim.gateways.socket import Socket
from tests.gateways.serving import Served, Wire

TEXT = """
format: 2
world: field
seed: 1
tick: 10 ms
substeps: 1
engine: pure
pace: fast
scene: {kind: empty}
robots:
  cat:
    label: Cat.001
    model: differential_drive
    speed: 2 m/s
    at: {x: -3 m}
    sensors: {pose: {kind: pose_3d, rate: 50 Hz, label: Pose}}
    actuators: {motion: {kind: v_w}}
  mouse:
    model: differential_drive
    speed: 2 m/s
    at: {x: 1 m}
    sensors:
      pose: {kind: pose_3d, rate: 50 Hz}
      job: {kind: job, actuator: go, rate: 10 Hz}
    actuators: {go: {kind: go_within}}
gateways:
  morse: {kind: socket, listen: '127.0.0.1:0', streams: 0}
nodes: {n1: {robots: [cat, mouse]}}
network:
  links: [{id: air, from: morse-cat, to: morse-mouse, delay: 100 ms}]
"""


class Program:
    """A program of MORSE: it sends requests, and keeps all answers."""

    def __init__(self, served: Served) -> None:
        gateway = served.gateway
        assert isinstance(gateway, Socket)
        self.services = Wire(served, gateway.service_port)
        self._served, self._asked, self.answers = served, 0, list[str]()

    def ask(self, component: str, service: str, *parameters: Any) -> str:
        """Send a request; return its id."""
        self._asked += 1
        self.services.write(f"id{self._asked} {component} {service} {json.dumps(parameters)}\n")
        return f"id{self._asked}"

    def answer(self, identity: str) -> str:
        """Return the answer to a request; empty while there is none."""
        self.answers += self.services.lines()
        found = [line.removeprefix(f"{identity} ") for line in self.answers if line.startswith(f"{identity} ")]
        assert len(found) <= 1, found
        return found[0] if found else ""

    def call(self, component: str, service: str, *parameters: Any) -> str:
        """Return the answer to a request that takes no time."""
        identity = self.ask(component, service, *parameters)
        while not (answer := self.answer(identity)):
            pass
        return answer

    def stream(self, component: str) -> Wire:
        """Connect to the stream of a component."""
        status, port = self.call("simulation", "get_stream_port", component).split()
        assert status == "SUCCESS"
        return Wire(self._served, int(port))


def test_commands_move_robots_and_readings_have_their_times_and_rates() -> None:
    read: list[dict[str, Any]] = []
    outcomes: list[str] = []

    def script(served: Served) -> Iterator[int]:
        program = Program(served)
        pose, motion = program.stream("Cat_001.Pose"), program.stream("Cat_001.motion")
        motion.write('{"v": 9.0}\n{"v": 1.0, "w": 0.0}\n')  # of lines that come at once the last one counts
        there = program.ask("mouse.go", "goto", 2.0, 0.0, 0.0, 0.1, 1.0)
        yield served.run.tick + 300
        read.extend(map(json.loads, pose.lines()))
        outcomes.append(program.answer(there))
        first, second = (program.ask("mouse.go", "goto", x, 0.0, 0.0) for x in (-2.0, 4.0))
        yield served.run.tick + 20
        outcomes.append(program.answer(first))
        program.services.write(f"{second} cancel\nnobody cancel\n")
        yield served.run.tick + 20
        outcomes.append(program.answer(second))

    Served(TEXT, "morse", script).rehearse(400)
    assert outcomes == ['SUCCESS "Arrived"', "PREEMPTED", "PREEMPTED"]
    times = [one["timestamp"] for one in read]
    assert {round(after - before, 9) for before, after in pairwise(times)} == {0.02}
    assert list(read[0]) == ["timestamp", "x", "y", "z", "yaw", "pitch", "roll"]
    speeds = {round((after["x"] - before["x"]) / 0.02, 6) for before, after in pairwise(read[-9:])}
    assert speeds == {1.0}


def test_a_stop_leaves_a_job_without_an_answer_until_it_goes_on_or_is_called_off() -> None:
    seen: list[Any] = []

    def script(served: Served) -> Iterator[int]:
        program = Program(served)

        def place() -> float:
            return float(json.loads(program.call("mouse.pose", "get_local_data").removeprefix("SUCCESS "))["x"])

        seen.append(program.call("mouse.go", "stop"))  # of what has no place to go to
        yield served.run.tick + 5
        for end in ("resume", "cancel", "goto"):
            going = program.ask("mouse.go", "goto", place() + 1.0, 0.0, 0.0)
            yield served.run.tick + 20
            assert program.call("mouse.go", "get_status") == 'SUCCESS "Transit"'
            assert program.call("mouse.go", "stop") == program.call("mouse.go", "get_status") == 'SUCCESS "Stop"'
            yield served.run.tick + 50
            stood = place()
            yield served.run.tick + 20
            assert (program.answer(going), place()) == ("", stood)
            if end == "resume":
                assert program.call("mouse.go", "resume") == 'SUCCESS "Transit"'
            elif end == "cancel":
                program.services.write(f"{going} cancel\n")
            else:
                program.ask("mouse.go", "goto", 0.0, 0.0, 0.0)
            yield served.run.tick + 150
            seen.append(program.answer(going))
        seen.append(program.call("mouse.go", "get_status"))

    Served(TEXT, "morse", script).rehearse(900)
    assert seen == ['SUCCESS "Stop"', 'SUCCESS "Arrived"', "PREEMPTED", "PREEMPTED", 'SUCCESS "Transit"']


ANSWERS = {
    "q1 simulation list_robots\n": 'q1 SUCCESS ["Cat_001", "mouse"]',
    "q2 \t simulation   list_robots  []  \n": 'q2 SUCCESS ["Cat_001", "mouse"]',
    "q3 Cat_001.motion set_speed [0.0, 0.0]\n": "q3 SUCCESS",
    "q4 simulation nope []\n": 'q4 FAILED "The request nope has not been registered in Socket service manager"',
    "q5 nobody stop\n": 'q5 FAILED "The request stop has not been registered in Socket service manager"',
    "q6\n": 'q6 FAILED "Malformed request! "',
    'q7 simulation get_stream_port ["dog"]\n': 'q7 FAILED "Stream unavailable for component dog"',
    "q8 time sleep [-1.0]\n": 'q8 FAILED "sleep takes 0 to 1e+06 simulated seconds, not -1.0"',
}
BEGINNINGS = {
    "w1 Cat_001.motion set_speed [1.0]\n": "Socket service manager: wrong # of parameters for service set_speed. ",
    "w2 Cat_001.motion set_speed\n": "Socket service manager: parameters expected for service set_speed! ",
    'w3 Cat_001.motion set_speed ["a", 0.0]\n': "Socket service manager: wrong parameter type for service set_speed. ",
    "w4 Cat_001.motion set_speed {}\n": "Invalid request syntax: error while parsing the parameters: {}. ",
    "w5 Cat_001.motion set_speed [1\n": "Invalid request syntax: error while parsing the parameters: [1. ",
    "w6 time sleep [[]]\n": "Socket service manager: wrong parameter type for service sleep. ",
}


def test_answers_are_those_of_morse() -> None:
    found: dict[str, str] = {}

    def script(served: Served) -> Iterator[int]:
        wire = Program(served).services
        for request in (*ANSWERS, *BEGINNINGS):
            half = len(request) // 2
            wire.write(request[:half])
            wire.write(request[half:])
            (found[request],) = wire.lines(1)
        wire.write("".join(ANSWERS))
        assert wire.lines(len(ANSWERS)) == [*ANSWERS.values()]
        yield 0

    Served(TEXT, "morse", script).rehearse(100)
    assert {request: found[request] for request in ANSWERS} == ANSWERS
    for request, beginning in BEGINNINGS.items():
        identity, status, text = found[request].split(" ", 2)
        assert (identity, status) == (request[:2], "FAILED")
        assert json.loads(text).startswith(beginning), text


def test_the_radio_takes_its_time_and_a_sleep_simulated_time() -> None:
    received: list[dict[str, Any]] = []
    slept: list[float] = []

    def script(served: Served) -> Iterator[int]:
        program = Program(served)
        inbox, begun = program.stream("mouse.received"), served.run.tick
        assert program.call("Cat_001.radio", "send", "mouse", {"at": [1, 2.5]}) == "SUCCESS"
        assert "no robot 'dog' has a radio here" in program.call("Cat_001.radio", "send", "dog", 1)
        sleep = program.ask("time", "sleep", 0.5)
        while not program.answer(sleep):
            yield 0
        slept.append((served.run.tick - begun) * 0.01)
        received.extend(map(json.loads, inbox.lines()))
        received[0]["later"] = served.run.components["mouse.received"].time_ns

    result = Served(TEXT, "morse", script).rehearse(200)
    assert slept == [pytest.approx(0.5, abs=0.011)]
    assert received[0]["from"] == "Cat_001"
    assert received[0]["data"] == {"at": [1, 2.5]}
    assert result.json["packets"]["dropped"] == 0


def test_with_a_trigger_each_step_waits_for_bytes_and_without_a_program_none_does() -> None:
    ticks: list[int] = []

    def script(served: Served) -> Iterator[int]:
        gateway, system = served.gateway, served.system
        assert isinstance(gateway, Socket)
        assert system is not None
        yield 50  # no program is connected
        wire = Wire(served, gateway.sync_port)
        while not gateway.connections:
            served.go_round()
        (program,) = gateway.connections

        def trigger() -> None:
            ticks.append(served.run.tick)
            wire.write(b"sync")
            while program.count < len(ticks):
                served.go_round()

        for step in range(1, 5):
            system.later(step * 1_000_000_000, trigger)
        system.later(4_500_000_000, wire.close)
        yield 300

    text = TEXT.replace("streams: 0", "streams: 0, sync: {rate: 10 Hz, port: 0}")
    result = Served(text, "morse", script).rehearse(200)
    assert ticks == [ticks[0] + step for step in (0, 10, 20, 30)]
    assert result.json["ticks"] == 200


def test_a_reader_that_hangs_costs_no_other_one_a_message() -> None:
    counts: list[int] = []

    def script(served: Served) -> Iterator[int]:
        gateway, component = served.gateway, served.run.components["Cat_001.Pose"]
        assert isinstance(gateway, Socket)
        program = Program(served)
        reader, hanging = program.stream(component.full), program.stream(component.full)
        name = hanging.socket.getsockname()[1]
        (slow,) = [one for one in gateway.connections if one.peer.endswith(f":{name}")]
        slow.transport.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
        hanging.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        for _ in range(40):
            for _ in range(100):
                gateway.arrived(component)
            counts.append(len(reader.lines(100)))
        assert slow.transport.get_write_buffer_size() <= 2 * UNREAD_BYTES_MAX
        assert slow.count < 4000, "it has missed messages"
        yield 0

    Served(TEXT, "morse", script).rehearse(60)
    assert counts == [100] * 40


@pytest.mark.parametrize("seed", range(3))
def test_garbage_ends_nothing_else(seed: int) -> None:
    draws = random.Random(seed)
    good: list[str] = []
    pieces = [
        b"id1 ",
        b"cat",
        b"Cat_001.motion ",
        b"set_speed ",
        b"[1.0, ",
        b"\xff\x00",
        b"\n",
        b"[" * 5000,
        b'{"v": 1e999}',
        b"simulation details []\n",
    ]

    def script(served: Served) -> Iterator[int]:
        gateway = served.gateway
        assert isinstance(gateway, Socket)
        ports = [gateway.service_port, *gateway.ports.values()]
        program = Program(served)
        for _ in range(40):
            wire = Wire(served, draws.choice(ports))
            for _ in range(draws.randrange(6)):
                wire.write(b"".join(draws.choices(pieces, k=draws.randrange(8))))
            if draws.random() < 0.7:
                wire.close()
        long = Wire(served, gateway.service_port)
        for _ in range(LINE_BYTES_MAX // 50_000 + 2):
            if long.is_open:
                long.write(b"x" * 50_000)
        assert long.lines() == []
        assert not long.is_open
        good.append(program.call("simulation", "list_robots"))
        yield 0

    result = Served(TEXT, "morse", script).rehearse(60)
    assert good == ['SUCCESS ["Cat_001", "mouse"]']
    assert not result.json["failed"]


def test_a_thousand_programs_are_served_and_an_id_is_used_once_at_a_time() -> None:
    answers: list[str] = []
    raise_descriptors()

    def script(served: Served) -> Iterator[int]:
        gateway = served.gateway
        assert isinstance(gateway, Socket)
        with ExitStack() as stack:
            for _ in range(1000):
                stack.enter_context(socket.create_connection(("127.0.0.1", gateway.service_port)))
            wire = Wire(served, gateway.service_port)
            wire.write("one time sleep [1e6]\none simulation list_robots\n")
            answers.extend(wire.lines(1))
            while len(gateway.connections) < 1001:
                served.go_round()
        while len(gateway.connections) > 1:
            served.go_round()
        wire.write("one cancel\n")
        answers.extend(wire.lines(1))
        yield 0

    Served(TEXT, "morse", script).rehearse(60)
    assert answers == ['one FAILED "The request one is still running"', "one PREEMPTED"]


def test_a_picture_is_drawn_for_a_reader_and_for_a_service_and_else_not() -> None:
    drawn: list[bool] = []
    size: list[int] = []

    def script(served: Served) -> Iterator[int]:
        program, camera = Program(served), served.run.components["mouse.eye"]
        yield served.run.tick + 20
        drawn.append(camera.fields is not None)
        assert camera.undrawn is not None
        _, data = program.call("mouse.eye", "get_local_data").split(" ", 1)
        size.append(len(b64decode(json.loads(data)["image"])))
        stream = program.stream("mouse.eye")
        while not camera.count:
            yield 0
        size.append(len(b64decode(json.loads(stream.lines(1)[0])["image"])))

    eye = "eye: {kind: camera, rate: 10 Hz, width: 16, height: 8, far: 10 m}"
    Served(TEXT.replace("job: {kind: job", f"{eye}\n      job: {{kind: job"), "morse", script).rehearse(100)
    assert drawn == [False]
    assert size == [16 * 8 * 4, 16 * 8 * 4]

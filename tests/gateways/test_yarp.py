"""The gateway to YARP in rehearsals: ports of components, services and composed bottles, through real sockets."""

from __future__ import annotations

import json
from collections.abc import Iterator
from math import degrees
from pathlib import Path
from typing import Any

import pytest

from foosim.capture.reader import open_capture
from foosim.capture.rows import PACKETS, PacketRow
from foosim.common.closable import Closable
from foosim.common.errors import DeploymentError
from foosim.deployment.loader import load_deployment
from foosim.gateways.yarp import Yarp, items_of
from foosim.gateways.yarp.ports import Port
from tests.gateways.serving import Served
from tests.gateways.test_socket import TEXT
from tests.gateways.yarp_peers import free_number

TABLE = Path(__file__).parents[2] / "deploy" / "table_yarp.yaml"


class Program(Closable):
    """Ports of a program of YARP, and what has come to them."""

    def __init__(self, served: Served) -> None:
        assert isinstance(served.gateway, Yarp)
        self._served, self._names, self.heard = served, served.gateway.names, dict[str, list[list[Any]]]()
        self._ports: list[Port] = []
        served.wires.append(self)

    def hear(self, name: str, port: str) -> None:
        """Have a port of the gateway send to one of the program."""
        heard = self.heard[name] = []
        own = Port(name, self._names, heard.append)
        self._ports.append(own)
        self._served.loop.run_until_complete(own.open())
        self._served.loop.run_until_complete(self._gateway_port(port).connect(f"fast_tcp:/{name}"))

    def write(self, port: str, values: list[Any]) -> None:
        """Send a bottle to a port of the gateway."""
        own = Port(f"/program{port}", self._names)
        self._served.loop.run_until_complete(own.open())
        self._served.loop.run_until_complete(own.connect(port))
        own.write(values)
        self._served.loop.run_until_complete(own.close())
        self._served.go_round()

    def read(self) -> None:
        """Let all come that was sent."""
        before = -1
        while before < (before := sum(map(len, self.heard.values()))):
            self._served.go_round()

    def close(self) -> None:
        for port in self._ports:
            self._served.loop.run_until_complete(port.close())

    def _gateway_port(self, name: str) -> Port:
        assert isinstance(self._served.gateway, Yarp)
        return self._served.gateway.ports[name]


def text_of(path_or_text: str | Path) -> str:
    """Return a deployment whose gateway has a name server of its own."""
    text = path_or_text.read_text() if isinstance(path_or_text, Path) else path_or_text
    return text.replace("kind: yarp", f"kind: yarp\n    name_server: 127.0.0.1:{free_number()}")


def test_a_program_of_2012_plays_the_table_and_a_real_table_is_in_the_capture(tmp_path: Path) -> None:
    real = [0.01 * index for index in range(8)] + [10.0 * index for index in range(8)]
    program: list[Program] = []

    def script(served: Served) -> Iterator[int]:
        one = Program(served)
        program.append(one)
        one.hear("/position", "/ors/robots/Table/Position/out")
        one.hear("/ball", "/ors/robots/Ball/BallPosition/out")
        one.hear("/picture", "/ors/robots/Table/CameraMain/out")
        one.write("/ors/robots/Table/RodController0/in", [-0.05, -1.0])
        one.write("/ors/robots/Table/RodController4/in", [0.02, 0.5])
        one.write("/ors/robots/Table/RodController1/in", ["x", 1.0])  # refused
        one.write("/real/Table/Position/in", real)
        one.write("/real/Ball/BallPosition/in", [0.1, 0.2, 0.0175])
        yield served.run.tick + 250
        one.read()

    capture = tmp_path / "run.mcap"
    text = text_of(TABLE).replace("engine: bullet", "engine: pure")
    Served(text, "yarp", script).rehearse(300, capture=capture)
    positions, places = program[0].heard["/position"], program[0].heard["/ball"]
    assert len(positions) == len(places) > 30
    assert positions[0] == [0.0] * 16
    wanted = [0.05, 0.0, 0.0, 0.0, -0.02, 0.0, 0.0, 0.0, degrees(1.0), 0.0, 0.0, 0.0, degrees(-0.5), 0.0, 0.0, 0.0]
    assert positions[-1] == pytest.approx(wanted, abs=1e-3)
    assert all(len(place) == 3 for place in places)

    kind, code, header, pixels = program[0].heard["/picture"][0]
    assert (kind, code, header) == ("mat", "rgba", [4, 320 * 200 * 4, 8, 320, 200])
    assert set(pixels[3::4]) == {255}
    assert len(set(pixels)) > 10

    packets = [row for row in open_capture(capture).rows(PACKETS) if isinstance(row, PacketRow)]
    packets = [row for row in packets if row.channel == "measured"]
    assert {row.destination for row in packets} == {"yarp"}
    states = {state.pop("sensor"): state for state in (json.loads(row.payload) for row in packets)}
    assert len(states) == len(packets) == 9
    assert states["camera.ball"] == {"x": 0.1, "y": 0.2, "z": 0.0175}
    assert states["red.goal.encoder"] == {"slide": 0.0, "spin": 0.0}
    assert states["blue.goal.encoder"]["slide"] == 0.07
    assert degrees(states["blue.goal.encoder"]["spin"]) == pytest.approx(70.0)


def test_ports_have_the_names_bottles_and_services_of_morse() -> None:
    programs: list[Program] = []

    def script(served: Served) -> Iterator[int]:
        program = Program(served)
        programs.append(program)
        program.hear("/pose", "/morse/Cat_001/Pose/out")
        for component in ("Cat_001.motion", "mouse.go"):
            program.hear(f"/{component}", f"/morse/services/{component}/reply")
        program.write("/morse/Cat_001/motion/in", [1.0, 0.0])
        program.write("/morse/services/mouse.go/request", [7, "mouse.go", "goto", "[2.0, 0.0, 0.0, 0.1]"])
        requests = "/morse/services/Cat_001.motion/request"
        program.write(requests, [8, "Cat_001.motion", "fly"])
        program.write(requests, [9, "Cat_001.motion", "set_speed", "__import__('os')"])
        program.write(requests, [10])
        yield served.run.tick + 300
        program.write(requests, [11, "Cat_001.motion", "stop"])
        program.write(requests, [12, "Cat_001.motion", "set_speed", [2.0, 0.0]])
        yield served.run.tick + 50
        program.read()

    text = text_of(TEXT.replace("kind: socket, listen: '127.0.0.1:0', streams: 0", "kind: yarp").replace(
        "{kind: yarp}", "\n    kind: yarp"
    ))  # fmt: skip
    Served(text, "morse", script).rehearse(400)
    heard = programs[0].heard
    first, last = heard["/pose"][-40], heard["/pose"][-39]
    assert len(first) == 7  # the time, and x, y, z, yaw, pitch, roll
    assert last[0] - first[0] == pytest.approx(0.02)
    assert heard["/mouse.go"] == [["7 SUCCESS Arrived"]]
    replies = [reply for (reply,) in heard["/Cat_001.motion"]]
    assert [reply.split()[:2] for reply in replies] == [
        ["8", "FAILED"], ["9", "FAILED"], ["10", "FAILED"], ["11", "SUCCESS"], ["12", "SUCCESS"],
    ]  # fmt: skip


def test_values_have_the_bottles_of_morse() -> None:
    seen = [{"name": "MOUSE", "position": [1.0, 2.0, 3.0], "orientation": {"w": 1.0, "x": 0.0, "y": 0.0, "z": 0.5}}]
    assert items_of(seen) == [[["name", "MOUSE"], ["position", [1.0, 2.0, 3.0]], ["orientation", [0.0, 0.0, 0.5, 1.0]]]]
    assert items_of(3) == [3]


WRONG = {
    "ports: {camera.nose: /x}": "no component that the gateway serves",
    "bottles: {/x/out: [camera.ball.x parsec]}": "not [-]ROBOT.CHANNEL.FIELD [UNIT] (units are ",
    "bottles: {/x/out: [camera.ball.w]}": "camera.ball has no such field (there are: x, y, z)",
    "bottles: {/x/out: [red.goal.position.slide]}": "an actuator in a bottle that is sent",
    "bottles: {/x/in: /y/out}": "no bottle to be equal to",
}


@pytest.mark.parametrize("setting", WRONG)
def test_wrong_ports_are_reported_at_their_place(setting: str) -> None:
    text = TABLE.read_text()
    line = text[: text.index("    ports:")].count("\n") + 1
    text = text[: text.index("    ports:")] + f"    {setting}\n" + text[text.index("\nnodes:") :]
    with pytest.raises(DeploymentError) as refused:
        load_deployment(text, "table.yaml")
    assert WRONG[setting] in str(refused.value)
    assert str(refused.value).startswith(f"table.yaml:{line}:")

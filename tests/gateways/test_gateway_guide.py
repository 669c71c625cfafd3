"""The guide's gateway as it is written there, with a viewer of the Foxglove protocol."""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from tests.gateways.serving import Served
from tests.gateways.test_socket import TEXT as SOCKET
from tests.own_components import folder_on_path, install

GUIDE = Path(__file__).parents[2] / "docs" / "how-to" / "write_a_gateway.md"
TEXT = SOCKET.replace("{kind: socket, listen: '127.0.0.1:0', streams: 0}", "{kind: live, port: 0}")
MESSAGE, PUBLISHED = 1, 1
"""Opcodes of the server and of the viewer."""


def test_a_viewer_sees_topics_and_readings_and_commands_a_robot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    (code,) = re.findall(r"```python\n# live.py\n(.*?)```", GUIDE.read_text(), re.DOTALL)
    (tmp_path / "live.py").write_text(code)
    advertised: dict[str, int] = {}
    readings: list[tuple[int, dict[str, Any]]] = []
    peers: list[tuple[str, str]] = []

    def script(served: Served) -> Iterator[int]:
        gateway: Any = served.gateway
        with connect(
            f"ws://127.0.0.1:{gateway.server.port}",
            subprotocols=[Subprotocol("foxglove.sdk.v1")],
            compression=None,
            close_timeout=0,
        ) as viewer:
            assert json.loads(viewer.recv())["name"] == "morse"
            while "/mouse.pose" not in advertised:
                message = json.loads(viewer.recv())
                assert message["op"] == "advertise"
                advertised.update({one["topic"]: one["id"] for one in message["channels"]})
            subscription = {"id": 7, "channelId": advertised["/Cat_001.Pose"]}
            viewer.send(json.dumps({"op": "subscribe", "subscriptions": [subscription]}))
            channel = {"id": 3, "topic": "/Cat_001.motion", "encoding": "json", "schemaName": ""}
            viewer.send(json.dumps({"op": "advertise", "channels": [channel]}))
            for command in (b"nothing", b'{"v": 1.0, "w": 0.0}'):
                viewer.send(struct.pack("<BI", PUBLISHED, 3) + command)
            while served.run.components["Cat_001.motion"].fields is None:
                served.go_round()
            peers.extend(one[:2] for one in gateway.peers())
            yield served.run.tick + 100
            while len(readings) < 30:
                data = viewer.recv()
                if isinstance(data, bytes) and data[0] == MESSAGE:
                    _, subscribed, time_ns = struct.unpack_from("<BIQ", data)
                    assert subscribed == 7
                    readings.append((time_ns, json.loads(data[13:])))

    folder_on_path(tmp_path, monkeypatch)
    install(tmp_path, "viewers", "1.0", "live")
    Served(TEXT, "morse", script).rehearse(200)
    assert {"/Cat_001.Pose", "/mouse.pose", "/tf"} <= {*advertised}
    assert peers[0][1] == "/Cat_001.Pose"
    (before_ns, before), (after_ns, after) = readings[-2:]
    assert after_ns - before_ns == 20_000_000
    assert after["time"] == after_ns / 1e9
    assert after["x"] > before["x"]
    assert [record.getMessage() for record in caplog.records if record.name == "morse"] == [
        "Cat_001.motion: Expecting value: line 1 column 1 (char 0)"
    ]

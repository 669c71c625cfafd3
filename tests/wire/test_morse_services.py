"""MORSE's services of the simulator, over an operator's session, in a run of real processes."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO, TYPE_CHECKING, Any

import pytest

from foosim.client import control
from tests.gateways.test_socket import TEXT
from tests.wire.conftest import ONE, processes_with, wait_for

if TYPE_CHECKING:
    from foosim.runtime.run_folder import RunFolder
    from tests.wire.conftest import House


@contextmanager
def connected(folder: RunFolder, start: int = 1) -> Iterator[IO[str]]:
    """Connect to the services of the gateway that was started for the first time, or again."""
    log = folder.logs / "socket.log"

    def stream() -> tuple[socket.socket, IO[str]] | None:
        found = re.findall(r"services at tcp/127\.0\.0\.1:(\d+)", log.read_text()) if log.exists() else []
        try:
            wire = socket.create_connection(("127.0.0.1", int(found[start - 1])), timeout=20)
        except (IndexError, OSError):
            return None
        return wire, wire.makefile("rw")

    wire, services = wait_for("the gateway", stream)
    with wire, services:
        yield services


def call(services: IO[str], component: str, service: str, *parameters: Any) -> Any:
    """Return the result of a service; of one that has failed its text after `FAILED: `."""
    print("id", component, service, json.dumps(parameters), file=services, flush=True)
    _, status, *result = services.readline().rstrip().split(" ", 2)
    found = json.loads(result[0]) if result else None
    return found if status == "SUCCESS" else f"{status}: {found}"


def test_the_simulator_is_supervised_and_a_killed_gateway_comes_back(house: House) -> None:
    path = house.folder / "field.yaml"
    text = TEXT.replace("pace: fast", "pace: realtime").replace("morse-", "socket-")
    path.write_text(
        "".join(line for line in text.splitlines(keepends=True) if "morse" not in line and "gateways" not in line)
    )
    own = "--set", "gateways.socket.listen='127.0.0.1:0'", "--set", "gateways.socket.streams=0"
    house.start("foosim", "gateway", "socket", path, *ONE, "--no-capture", *own)
    folder = house.live()
    with connected(folder) as services:
        assert call(services, "communication", "distance_and_view", "Cat_001", "mouse") == [pytest.approx(4.0), True]
        assert call(services, "simulation", "set_object_position", "mouse", [-3.0, 5.0, 0.0]) is None
        wait_for("the mouse", lambda: call(services, "simulation", "get_scene_objects")["mouse"][1] == [-3.0, 5.0, 0.0])
        assert call(services, "simulation", "set_object_position", "dog", [0, 0, 0]).startswith(
            "FAILED: dog does not exist"
        )
        assert call(services, "simulation", "reset_objects") == "Objects restored to initial position"
        wait_for("the mouse", lambda: call(services, "simulation", "get_scene_objects")["mouse"][1] == [1.0, 0.0, 0.0])
        assert call(services, "simulation", "deactivate", "Cat_001.Pose") is None
        last = wait_for("no reading", lambda: stood(services))
        assert call(services, "simulation", "activate", "Cat_001.Pose") is None
        wait_for("a reading", lambda: call(services, "Cat_001.Pose", "get_local_data") != last)
        assert call(services, "time", "set_time_scale", 2.0) is True
        assert call(services, "simulation", "suspend_dynamics") == "Physics is suspended"
        with control.connect() as run:
            assert run.status()["state"] == "paused"
            assert run.status()["pace"] == "2x"
        assert call(services, "simulation", "restore_dynamics") == "Physics is resumed"
        assert call(services, "time", "sleep", 0.2) is None
        assert call(services, "time", "statistics")["mean_time"] > 0.0
        with control.connect() as run:
            run.request("remove", name="mouse")
        assert call(services, "mouse.go", "goto", 9.0, 9.0, 0.0) == "FAILED: mouse.go has failed: its robot is absent"
        at_gateway = wait_for("the report", lambda: folder.gateways().get("socket", {}).get("programs"))
        assert at_gateway[0]["what"] == "services"
        (pid,) = processes_with(f"role gateway --name socket --connect run:{folder.name}")
        os.kill(pid, signal.SIGKILL)
        assert services.readline() == ""
    with connected(folder, 2) as again:
        print("id simulation quit", file=again, flush=True)
        assert again.readline() == "id SUCCESS\n"
    assert house.end(house.started[0])[0] == 0


def stood(services: IO[str]) -> Any:
    """Return the newest reading if it is the newest twice in a tenth of a second; None otherwise."""
    first = call(services, "Cat_001.Pose", "get_local_data")
    call(services, "time", "sleep", 0.1)
    return first if call(services, "Cat_001.Pose", "get_local_data") == first else None

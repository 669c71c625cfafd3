"""The client in C, compiled as its first lines have it, drives a robot over the socket."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from foosim.gateways.socket import Socket
from tests.gateways.serving import Served
from tests.gateways.test_socket import TEXT

SOURCE = Path(__file__).parents[2] / "examples" / "c" / "drive.c"
READING = 2
"""Ticks from one pose to the next."""


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_the_client_in_c_drives_a_robot(tmp_path: Path) -> None:
    program = tmp_path / "drive"
    subprocess.run(["cc", "-Wall", "-Wextra", "-Werror", "-o", program, SOURCE], check=True)
    ended: list[tuple[int, str]] = []
    places: list[float] = []

    def script(served: Served) -> Iterator[int]:
        gateway = served.gateway
        assert isinstance(gateway, Socket)
        pose, motion = (served.run.components[name] for name in ("Cat_001.Pose", "Cat_001.motion"))

        for words in (("Cat_001.Pose", "dog.motion", "1"), (pose.full, motion.full, "-1.0")):
            command = [str(program), "127.0.0.1", str(gateway.service_port), *words]
            with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
                while process.poll() is None and motion.full not in [one.what for one in gateway.connections]:
                    served.go_round()
                while process.poll() is None:
                    commands = motion.count
                    yield served.run.tick + READING
                    while process.poll() is None and motion.count == commands:
                        served.go_round()
                ended.append((process.returncode, process.stderr.read() if process.stderr else ""))
        served.go_round()
        assert pose.fields is not None
        places.extend((pose.fields["x"], pose.fields["y"]))

    Served(TEXT, "morse", script).rehearse(400)
    refusal = '1 FAILED "Stream unavailable for component dog.motion"\n'
    assert ended == [(1, f"dog.motion has no stream: {refusal}"), (0, "")]
    assert places == [pytest.approx(-1.0, abs=0.05), pytest.approx(0.0, abs=0.01)]

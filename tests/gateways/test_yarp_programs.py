"""The gateway's ports and name server with YARP's own programs, where `make yarp` has built them."""

from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from foosim.gateways.yarp.name_server import name_server
from foosim.gateways.yarp.ports import NameClient, Port
from tests.gateways.yarp_peers import PROGRAMS, Rig, run, until

pytestmark = pytest.mark.skipif(
    not (PROGRAMS / "yarp").exists(), reason=f"there is no {PROGRAMS / 'yarp'}: `make yarp` builds it"
)


class Programs:
    """Programs of YARP that find one name server."""

    def __init__(self, folder: Path, names: NameClient) -> None:
        (folder / "yarp.conf").write_text(f"{names.host} {names.number} yarp\n")
        places = dict.fromkeys(("HOME", "YARP_CONFIG_HOME", "YARP_DATA_HOME"), str(folder))
        self._environment = {**os.environ, **places}

    async def start(self, *command: str) -> asyncio.subprocess.Process:
        """Start a program; its output and its input are pipes."""
        return await asyncio.create_subprocess_exec(
            PROGRAMS / command[0],
            *command[1:],
            env=self._environment,
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.STDOUT,
        )

    async def output(self, *command: str) -> str:
        """Return what a program prints."""
        text, _ = await (await self.start(*command)).communicate()
        return text.decode()

    @asynccontextmanager
    async def running(self, *command: str) -> AsyncIterator[asyncio.subprocess.Process]:
        """Have a program until the end."""
        process = await self.start(*command)
        try:
            yield process
        finally:
            process.kill()
            await process.communicate()


async def line_with(process: asyncio.subprocess.Process, text: str) -> str:
    """Return the first line of a program that has a text."""
    assert process.stdout is not None
    lines = [""]
    while text not in lines[-1]:
        lines.append((await process.stdout.readline()).decode())
        assert lines[-1], f"it ended without {text!r}: {lines}"
    return lines[-1].strip()


def test_yarp_finds_reads_writes_and_calls_ports_at_the_name_server_of_the_gateway(tmp_path: Path) -> None:
    async def work(rig: Rig) -> None:
        programs = Programs(tmp_path, rig.names)
        heard: asyncio.Queue[Any] = asyncio.Queue()
        out = await rig.port("/f/out")
        await rig.port("/f/in", heard.put_nowait)
        await rig.port("/f/service", lambda values: ["ok", values])
        assert "registration name /f/out" in await programs.output("yarp", "name", "list")
        async with programs.running("yarp", "read", "/reader") as reader:
            await line_with(reader, "active at")
            for carrier in ("tcp", "fast_tcp", "text", "text_ack"):
                assert "Success" in await programs.output("yarp", "connect", "/f/out", "/reader", carrier)
                out.write([1, -2.5, "two words", [1.5, 2.5], ["x", [1, 2]]])
                assert await line_with(reader, "two words") == '1 -2.5 "two words" (1.5 2.5) (x (1 2))'
                assert "Success" in await programs.output("yarp", "disconnect", "/f/out", "/reader")
                assert not out.links
        async with programs.running("yarp", "write", "/writer", "/f/in") as writer:
            await line_with(writer, "Sending output")
            assert writer.stdin is not None
            writer.stdin.write(b'7 "a b" (1.5 2.5)\n')
            assert await heard.get() == [7, "a b", [1.5, 2.5]]
        async with programs.running("yarp", "rpc", "/f/service") as caller:
            assert caller.stdin is not None
            caller.stdin.write(b"set 1 2.5\n")
            caller.stdin.write_eof()  # it prints at its end
            assert await line_with(caller, "Response") == "Response: ok (set 1 2.5)"

    run(work)


def test_ports_of_the_gateway_are_found_at_the_name_server_of_yarp(tmp_path: Path) -> None:
    async def work(rig: Rig) -> None:
        await rig.server.close()  # YARP's own takes its place
        programs = Programs(tmp_path, NameClient("127.0.0.1", rig.names.number))
        command = "yarpserver", "--socket", str(rig.names.number), "--write", "--no-web-server"
        async with programs.running(*command) as server:
            line = await line_with(server, "Port /root active at")
            host = line.split("tcp://")[1].split(":")[0]
            names = NameClient(host, rig.names.number)
            assert await name_server(names) is None
            port = Port("/f/out", names)
            await port.open()
            assert "port" in await programs.output("yarp", "name", "query", "/f/out")
            async with programs.running("yarp", "read", "/reader", "/f/out") as reader:
                await line_with(reader, "Receiving input")
                await until(lambda: port.links)
                port.write([1, 2.5])
                assert await line_with(reader, "1 2.5") == "1 2.5"
            await port.close()
            assert "/f/out not known" in await programs.output("yarp", "name", "query", "/f/out")

    run(work)

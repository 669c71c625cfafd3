"""Ports on a name server of their own, bytes as YARP's programs sent them, and these programs where they were built."""

from __future__ import annotations

import asyncio
import json
import os
import re
import socket
from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack, suppress
from pathlib import Path
from typing import Any, Final

from foosim.gateways.yarp.name_server import NameServer, name_server
from foosim.gateways.yarp.ports import NameClient, Port

HERE: Final = Path(__file__).parent
SESSIONS: Final[dict[str, list[tuple[str, str]]]] = json.loads((HERE / "yarp_sessions.json").read_text())
"""Recorded between programs of YARP 3.5: who sent (c the one that connected) and what, by a name of the session."""
PROGRAMS: Final = Path(os.environ.get("FOOSIM_YARP", HERE.parents[1] / ".yarp" / "build" / "bin"))
"""Where `make yarp` builds them."""
WAIT_S: Final = 20.0


def free_number() -> int:
    """Return a number for a name server, which gives ports those after it: below those that the system gives."""
    for number in range(15_000 + os.getpid() * 20 % 15_000, 32_000):
        with suppress(OSError), socket.create_server(("127.0.0.1", number)):
            return number
    raise AssertionError("no number is free")


class Rig(AsyncExitStack):
    """A name server and ports on it, which close with it. What the loop could not handle is an error."""

    async def __aenter__(self) -> Rig:
        self.wrong: list[Any] = []
        asyncio.get_running_loop().set_exception_handler(lambda _, context: self.wrong.append(context))
        self.names = NameClient("127.0.0.1", free_number())
        server = await name_server(self.names)
        assert isinstance(server, NameServer)
        self.server = server
        self.push_async_callback(server.close)
        return self

    async def port(self, name: str, receive: Callable[[list[Any]], Any] | None = None) -> Port:
        """Return an open port."""
        port = Port(name, self.names, receive)
        await port.open()
        self.push_async_callback(port.close)
        return port


def run(work: Callable[[Rig], Awaitable[None]]) -> None:
    """Do the work with a rig."""

    async def main() -> None:
        async with asyncio.timeout(WAIT_S), Rig() as rig:
            await work(rig)
        await asyncio.sleep(0)
        assert rig.wrong == []

    asyncio.run(main())


async def until(reached: Callable[[], object]) -> None:
    """Let the others go on until something is reached."""
    while not reached():
        await asyncio.sleep(0)


async def replay(session: str, number: int) -> tuple[bytes, bytes]:
    """Send what the client of a session sent; return what came back and what had come back from YARP."""
    stream, writer = await asyncio.open_connection("127.0.0.1", number)
    got = recorded = b""
    for who, text in SESSIONS[session]:
        data = text.encode("latin-1")
        if who == "c":
            writer.write(data)
        else:
            recorded += data
            if session.startswith(("names", "admin")):
                end = b"<ACK>\r\n" if b"<ACK>" in data else b"\r\n" if b"Welcome" in data else b"]\r\n"
                end = b"*** end of message\r\n" if b"***" in data else end
                got += await stream.readuntil(end)
            else:
                got += await stream.readexactly(len(data))
    writer.close()
    return got, recorded


def plain(data: bytes) -> bytes:
    """Return it without hosts, numbers of ports, and ends of lines within a bottle."""
    data = re.sub(rb"YA(?!\0\0\0\0|\n\0\0\0)....RP", b"YA....RP", data, flags=re.DOTALL)
    return re.sub(rb"ip [\d.]+ port \d+", b"ip port", data).replace(b"\\r\\n", b"")

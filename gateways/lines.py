"""Servers of lines, which gateways derive from."""

from __future__ import annotations

import asyncio
import socket as sockets
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any, Final, Generic, TypeVar

from foosim.common.addresses import Address
from foosim.common.errors import Refused
from foosim.gateways.gateway import Gateway, Peer
from foosim.gateways.run import Run
from foosim.gateways.supervision import Supervision

CLOSE_S: Final = 1.0
"""How long programs may take to read what was written."""
LINE_BYTES_MAX: Final = 1 << 20
UNREAD_BYTES_MAX: Final = 1 << 16
"""A reader that has more than this to read misses messages of streams."""


class LineServer(Gateway):
    """A gateway whose programs connect to ports."""

    def __init__(self, settings: Any, run: Run, supervision: Supervision) -> None:
        super().__init__(settings, run, supervision)
        self.connections: Final[set[Connection[Any]]] = set()
        self._servers: list[asyncio.Server] = []

    async def listen(self, host: str, ports: range, make: Callable[[], asyncio.Protocol]) -> int:
        """Listen at the first free one of some ports; return it. Raises Refused where none is."""
        if not ports:
            raise Refused(f"{self.run.name}: no port is left up to 65535")
        family = sockets.AF_INET6 if ":" in host else sockets.AF_INET
        for port in ports:
            listener = sockets.socket(family)
            listener.setsockopt(sockets.SOL_SOCKET, sockets.SO_REUSEADDR, 1)
            try:
                listener.bind((host, port))
            except OSError as error:
                listener.close()
                why = error.strerror
                continue
            self._servers.append(await asyncio.get_running_loop().create_server(make, sock=listener, backlog=1024))
            return int(listener.getsockname()[1])
        raise Refused(f"{self.run.name}: no port from {ports[0]} to {ports[-1]} of {host} can be listened at: {why}")

    async def close(self) -> None:
        """Close all connections, after what is written."""
        for server in self._servers:
            server.close()
        for connection in [*self.connections]:
            connection.transport.close()
        with suppress(TimeoutError):
            async with asyncio.timeout(CLOSE_S):
                while self.connections:
                    await asyncio.sleep(CLOSE_S / 100.0)

    def peers(self) -> Iterator[Peer]:
        yield from (Peer(one.peer, one.what, one.count) for one in self.connections)


G = TypeVar("G", bound=LineServer)


class Connection(asyncio.Protocol, Generic[G]):
    """A connection that reads lines. One with a longer line than `LINE_BYTES_MAX` is closed."""

    what = ""
    """What it is connected to."""
    transport: asyncio.Transport

    def __init__(self, gateway: G) -> None:
        self._gateway, self.peer, self.count, self._rest = gateway, "", 0, b""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self.transport = transport
        host, port, *_ = transport.get_extra_info("peername")
        self.peer = str(Address(host, port))
        self._gateway.connections.add(self)

    def connection_lost(self, error: Exception | None) -> None:
        self._gateway.connections.discard(self)

    def data_received(self, data: bytes) -> None:
        *lines, self._rest = (self._rest + data).split(b"\n")
        if lines:
            self.count += len(lines)
            self.received(lines)
        if len(self._rest) > LINE_BYTES_MAX:
            self._gateway.log.warning("%s sends a line of more than %d bytes: it is closed", self.peer, LINE_BYTES_MAX)
            self.transport.close()

    def received(self, lines: list[bytes]) -> None:
        """Take whole lines."""

    def offer(self, line: bytes) -> None:
        """Write a line, unless the reader is too slow for it."""
        if self.transport.get_write_buffer_size() <= UNREAD_BYTES_MAX:
            self.transport.write(line)
            self.count += 1

    def answer(self, line: bytes) -> None:
        """Write a line that may not be missed: a program with more than `LINE_BYTES_MAX` to read is closed."""
        if self.transport.get_write_buffer_size() <= LINE_BYTES_MAX:
            self.transport.write(line)
        elif not self.transport.is_closing():
            self._gateway.log.warning("%s does not read its answers: it is closed", self.peer)
            self.transport.abort()

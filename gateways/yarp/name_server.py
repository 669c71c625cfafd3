"""A name server of YARP: where none runs, a gateway starts it, and YARP's own programs find its ports.

It is the port `/root`. A request is a line of text, the answer lines up to `*** end of message`.
"""

from __future__ import annotations

import itertools
from asyncio import StreamReader, StreamWriter
from contextlib import suppress
from typing import Any, Final

from foosim.common.errors import Failed
from foosim.common.limits import YARP_NAMES_MAX
from foosim.gateways.yarp.ports import END, NameClient, Port

REQUESTS: Final = "register NAME [CARRIER HOST NUMBER], unregister NAME, query NAME, list, announce NAME"


async def name_server(names: NameClient) -> NameServer | None:
    """Start a name server unless one answers; raises Refused."""
    with suppress(Failed):
        await names.request("query /root")
        return None
    server = NameServer(names)
    await server.open(names.number)
    return server


class NameServer(Port):
    """Knows which port listens where."""

    def __init__(self, names: NameClient) -> None:
        super().__init__("/root", names, lambda words: self.answer(words, names.host), names.host)
        self._ports: dict[str, tuple[str, str, str]] = {}
        self._numbers = itertools.count(names.number + 2)

    async def serve(self, head: bytes, carrier: str, stream: StreamReader, writer: StreamWriter) -> None:
        """Serve a line that starts with `NAME_SERVER`, or a connection as every port has it."""
        if head != b"NAME_SER":
            return await super().serve(head, carrier, stream, writer)
        words = (head + await stream.readuntil()).decode(errors="replace").split()
        writer.write(self.answer(words, writer.get_extra_info("peername")[0]).encode() + b"\r\n")
        await writer.drain()
        return None

    def answer(self, words: list[Any], host: str) -> str:
        """Return the lines that answer a request of a host. Of a register, `...` lets the server choose."""
        match [str(word) for word in words if word != "NAME_SERVER"]:
            case ["register", name, *place] if len(place) in (0, 1, 3, 4) and len(self._ports) < YARP_NAMES_MAX:
                chosen = ("tcp", host, str(next(self._numbers)))
                given = [None if word in ("...", "0") else word for word in (*place, *("...",) * 3)]
                name = f"/tmp/port/{chosen[2]}" if name == "..." else name
                self._ports[name] = given[0] or chosen[0], given[1] or chosen[1], given[2] or chosen[2]
                lines = self._lines(name)
            case ["query", name]:
                lines = self._lines(name)
            case ["list"]:
                lines = [line for name in sorted(self._ports) for line in self._lines(name)]
            case ["unregister", name]:
                self._ports.pop(name, None)
                lines = []
            case ["announce", *_]:
                return "[ok]"
            case _:
                lines = [f"not a request of this name server; valid are {REQUESTS}"]
        return "\r\n".join([*lines, END])

    def _lines(self, name: str) -> list[str]:
        if name not in self._ports:
            return []
        carrier, host, number = self._ports[name]
        return [f"registration name {name} ip {host} port {number} type {carrier}"]

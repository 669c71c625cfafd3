"""Ports of YARP: one listener each, known to a name server, with connections in and out.

A reader that hangs loses messages for itself alone: what waits for it is bounded. A connection that sends other than
YARP's wire is closed by itself, with a line in the log.
"""

from __future__ import annotations

import asyncio
import logging
import struct
from asyncio import StreamReader, StreamWriter
from collections import Counter
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from typing import Any, Final, TypeVar

from foosim.common.errors import Failed, Malformed, Refused
from foosim.common.limits import (
    YARP_BEHIND_BYTES_MAX,
    YARP_BEHIND_MESSAGES_MAX,
    YARP_LINE_BYTES_MAX,
    YARP_MESSAGE_BYTES_MAX,
)
from foosim.gateways.yarp.wire import Vocab, decode, encode, from_text, magic, message, to_text

CARRIERS: Final = {"tcp": magic(0x1EE4), "fast_tcp": magic(0x1E64), "text": b"CONNECT ", "text_ack": b"CONNACK "}
"""The first eight bytes of a connection."""
ACKNOWLEDGEMENTS: Final = {"tcp": magic(0), "text_ack": b"<ACK>\r\n", "fast_tcp": b"", "text": b""}
"""After each message."""
WAIT_S: Final = 5.0
"""How long a peer may take to accept a connection or to answer."""
END: Final = "*** end of message"
NAME_BYTES_MAX: Final = 1024
_LOG: Final = logging.getLogger("foosim.yarp")

T = TypeVar("T")
Reply = list[Any] | str | None
Receive = Callable[[list[Any]], Reply | Awaitable[Reply]]
"""Takes a bottle. The reply goes to a sender that waits for one; a str goes as it is."""


async def attempt(what: str, work: Awaitable[T]) -> T:
    """Return what a peer gives within the time; raises Failed."""
    try:
        return await asyncio.wait_for(work, WAIT_S)
    except (OSError, EOFError, TimeoutError) as error:
        raise Failed(f"{what}: {str(error) or type(error).__name__}") from None


async def read_message(stream: StreamReader, text: bool = False) -> tuple[str, list[Any]]:
    """Return the command of the next message and its bottle; raises Malformed, IncompleteReadError."""
    if text:
        command = (await stream.readuntil()).decode(errors="replace").strip()
        return command, from_text((await stream.readuntil()).decode()) if command[:1] in ("d", "D", "a") else []
    head = await stream.readexactly(18)
    if head[:8] != magic(10):
        raise Malformed(f"{head[:8]!r}, where a message starts with {magic(10)!r}")
    sizes = struct.unpack(f"<{head[8] + head[9]}i", await stream.readexactly(4 * (head[8] + head[9])))
    if min(sizes, default=0) < 0 or not 8 <= sum(sizes) <= YARP_MESSAGE_BYTES_MAX:
        raise Malformed(f"a message with blocks of {sizes} bytes; 8 to {YARP_MESSAGE_BYTES_MAX} in all are valid")
    data = await stream.readexactly(sum(sizes))
    word, _, body = (data[5:6], b"", data[8:]) if data[5] else data[8:].partition(b"\0")
    if data[4:5] != b"~":
        raise Malformed(f"a message without a command, {data[:8]!r}")
    return word.decode(errors="replace"), decode(body) if word[:1] in (b"d", b"D", b"a") else []


class NameClient:
    """Asks the name server at an address."""

    def __init__(self, host: str, number: int) -> None:
        self.host, self.number = host, number

    async def request(self, line: str) -> list[str]:
        """Return the words of the answer; raises Failed."""
        what = f"name server of YARP at {self.host}:{self.number}"
        stream, writer = await attempt(what, asyncio.open_connection(self.host, self.number))
        try:
            writer.write(f"NAME_SERVER {line}\n".encode())
            return (await attempt(what, stream.readuntil(END.encode()))).decode(errors="replace").split()[:-4]
        finally:
            writer.close()


class Link:
    """A connection to a reader."""

    def __init__(self, carrier: str, stream: StreamReader, writer: StreamWriter) -> None:
        self.carrier, self.writer, self.is_text = carrier, writer, carrier.startswith("text")
        self.dropped = self._unacknowledged = 0
        self._hearing = asyncio.ensure_future(self._hear(stream))

    def send(self, data: bytes) -> None:
        """Send a message, or drop it where the reader does not keep up."""
        waiting = self.writer.transport.get_write_buffer_size()
        if waiting > YARP_BEHIND_BYTES_MAX or self._unacknowledged >= YARP_BEHIND_MESSAGES_MAX:
            self.dropped += 1
        else:
            self._unacknowledged += bool(ACKNOWLEDGEMENTS[self.carrier])
            self.writer.write(data)

    async def _hear(self, stream: StreamReader) -> None:
        """Count acknowledgements until the reader closes the connection."""
        with suppress(ConnectionError):
            while data := await stream.read(1 << 16):
                self._unacknowledged -= data.count(ACKNOWLEDGEMENTS[self.carrier][-1:] or b"none")
        self.writer.close()


class Port:
    """A port by its name, such as `/morse/cat/pose/out`."""

    def __init__(self, name: str, names: NameClient, receive: Receive | None = None, host: str = "127.0.0.1") -> None:
        self.name, self.names, self._receive, self.host = name, names, receive, host
        self.links: dict[str, Link] = {}
        self.sources: dict[StreamWriter, str] = {}
        self.counts: Counter[str] = Counter()
        """Messages from and to each port that is or was connected."""
        self._refused = ""

    async def open(self, number: int = 0) -> None:
        """Listen and register; raises Refused."""
        try:
            self._server = await asyncio.start_server(self._serve, self.host, number, limit=YARP_LINE_BYTES_MAX)
        except OSError as error:
            raise Refused(f"port {self.name} cannot listen on {self.host}:{number}: {error.strerror}") from None
        self.number = self._server.sockets[0].getsockname()[1]
        try:
            await self.names.request(f"register {self.name} tcp {self.host} {self.number}")
        except Failed:
            self._server.close()
            raise

    async def close(self) -> None:
        """Take leave of readers, senders and the name server."""
        self._server.close()
        for target in (*self.links, *self.sources.values()):
            self.disconnect(target)
        with suppress(Failed):
            await self.names.request(f"unregister {self.name}")

    def write(self, values: Sequence[Any]) -> None:
        """Send a bottle to all readers."""
        self.links = {target: link for target, link in self.links.items() if not link.writer.is_closing()}
        forms = {text: message("D", values, text) for text in {link.is_text for link in self.links.values()}}
        for link in self.links.values():
            link.send(forms[link.is_text])
        self.counts.update(self.links.keys())

    async def connect(self, place: str) -> str:
        """Add a reader, `CARRIER://NAME` or `/NAME`; return a line about it, raises Refused."""
        carrier, _, target = place.rpartition(":/")
        carrier = carrier or "tcp"
        if carrier not in CARRIERS:
            raise Refused(f"Cannot connect to {place}: no carrier {carrier} (there are: {', '.join(CARRIERS)})")
        match await self.names.request(f"query {target}"):
            case [_, _, _, _, host, _, number, _, _]:
                stream, writer = await attempt(place, asyncio.open_connection(host, int(number)))
            case _:
                raise Refused(f"Do not know how to connect to {place}")
        name = self.name.encode()
        is_text = carrier.startswith("text")
        writer.write(
            CARRIERS[carrier] + (name + b"\r\n" if is_text else (len(name) + 1).to_bytes(4, "little") + name + b"\0")
        )
        await attempt(place, stream.readuntil() if is_text else stream.readexactly(8))
        self.disconnect(target)
        self.links[target] = Link(carrier, stream, writer)
        return f"Added connection from {self.name} to {place}"

    def disconnect(self, target: str) -> bool:
        """End the connections to and from a port; return whether there was one."""
        writers = [writer for writer, name in self.sources.items() if name == target]
        if link := self.links.pop(target, None):
            link.writer.write(message("q", text=link.is_text))
            writers.append(link.writer)
        for writer in writers:
            writer.close()
        return bool(writers)

    async def _serve(self, stream: StreamReader, writer: StreamWriter) -> None:
        who = str(writer.get_extra_info("peername"))
        try:
            head = await stream.readexactly(8)
            carrier = next((name for name, mark in CARRIERS.items() if mark == head), "")
            if carrier.startswith("text"):
                who = (await stream.readuntil()).decode(errors="replace").strip()
                writer.write(f"Welcome {who}\r\n".encode())
            elif carrier:
                size = int.from_bytes(await stream.readexactly(4), "little")
                if size > NAME_BYTES_MAX:
                    raise Malformed(f"a name of {size} bytes; at most {NAME_BYTES_MAX} are valid")
                who = (await stream.readexactly(size)).rstrip(b"\0").decode(errors="replace")
                writer.write(magic(self.number))
            self.sources[writer] = who
            await self.serve(head, carrier, stream, writer)
        except asyncio.IncompleteReadError as end:
            if end.partial:
                _LOG.warning("%s: the connection from %s ended within a message", self.name, who)
        except (Malformed, asyncio.LimitOverrunError, UnicodeDecodeError) as bad:
            _LOG.warning("%s: the connection from %s is closed: %s", self.name, who, bad)
        except ConnectionError as lost:
            _LOG.info("%s: the connection from %s is lost: %s", self.name, who, lost)
        finally:
            self.sources.pop(writer, None)
            writer.close()

    async def serve(self, head: bytes, carrier: str, stream: StreamReader, writer: StreamWriter) -> None:
        """Serve a connection by its first bytes; raises Malformed."""
        if not carrier:
            raise Malformed(f"it starts with {head!r}; valid are {', '.join(map(repr, CARRIERS.values()))}")
        command = ""
        while command[:1] != "q":
            command, values = await read_message(stream, carrier.startswith("text"))
            self.counts[self.sources[writer]] += 1
            reply = await self._perform(command, values)
            if reply is not None and carrier.startswith("text"):
                writer.write(f"{reply if isinstance(reply, str) else to_text(reply)}\r\n".encode())
            elif reply is not None:
                writer.write(reply.encode() if isinstance(reply, str) else encode(reply))
            writer.write(ACKNOWLEDGEMENTS[carrier])
            await writer.drain()

    async def _perform(self, command: str, values: list[Any]) -> Reply:
        """Perform the command of a message; return the reply, if any. Raises Malformed."""
        key = command[:1]
        if key not in ("d", "D"):
            words = {"/": ["add", command], "!": ["del", command[1:]], "~": ["del", command[1:]], "a": values}
            return None if key == "q" else await self._administer(words.get(key, [key]))
        if self._receive is None:
            raise Malformed("data for a port that only sends")
        try:
            reply = self._receive(values)
            if isinstance(reply, Awaitable) and key == "d":
                reply = await reply
            return None if key == "D" or isinstance(reply, Awaitable) else reply
        except Refused as bad:
            if str(bad) != self._refused:  # once, of a sender that repeats it
                _LOG.warning("%s: %s", self.name, bad)
            self._refused = str(bad)
            return [Vocab("fail"), str(bad)] if key == "d" else None

    async def _administer(self, words: list[Any]) -> Reply:
        """Return what answers `[add]`, `[del]`, `[list]`, `[ver]` or `*`."""
        reply: Reply
        match words:
            case ["add", str(target), *carrier]:
                reply = await self._added(f"{carrier[0]}:/{target}" if carrier else target)
            case ["del", str(target)] if self.disconnect(target):
                reply = [0, f"Removed connection from {self.name} to {target}"]
            case ["del", str(target)]:
                reply = [-1, f"Could not find a connection to {target}"]
            case ["list", "in", *_]:
                reply = list(self.sources.values())
            case ["list", "out"]:
                reply = list(self.links)
            case ["list", "out", str(target)]:
                link = self.links.get(target)
                reply = [["from", self.name], ["to", target], ["carrier", link.carrier]] if link else []
            case ["ver"]:
                reply = [Vocab("ver"), 1, 2, 3]
            case ["*"]:
                reply = f"This is {self.name} at tcp://{self.host}:{self.number}/"
            case _:
                reply = [Vocab("fail"), "a port takes [add], [del], [list] and [ver]"]
        return reply

    async def _added(self, place: str) -> list[Any]:
        try:
            return [0, await self.connect(place)]
        except Refused as bad:
            return [-1, str(bad)]

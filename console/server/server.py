"""The console's server: the page's files over HTTP, and a WebSocket for each browser, in one event loop.

A browser comes from this page (Origin), proves a token (first message) and sends messages of a page; any other one gets
the reason and is cut off, and so is one beyond the limit of browsers. The others are not affected.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import logging
import os
import ssl
from base64 import b64encode, urlsafe_b64encode
from collections.abc import AsyncIterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Final

from websockets.asyncio.server import ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from foosim.common.errors import Malformed, Refused
from foosim.common.json_text import encode_json
from foosim.console.server.board import Board
from foosim.console.server.page_files import HEADERS, page_files
from foosim.console.server.page_messages import MESSAGE_BYTES_MAX, Hello, PageRequest, read_message
from foosim.console.server.reader import Reader, Role, TooSlow
from foosim.console.shown.curves import name_and_unit
from foosim.console.shown.source import Answered, Curve, InvalidRequest, Source

READERS_MAX: Final = 64
"""Browsers at once."""
CONNECTIONS_MAX: Final = 256
"""Limit of all connections, authenticated or not."""
REQUESTS_MAX: Final = 8
"""Limit of one browser's unanswered requests."""
HELLO_S: Final = 5.0
LOOK: Final = "look"
"""The verb of a look through a camera."""
CLOSE_S: Final = 1.0
PING_S: Final = 20.0
WRITE_BYTES: Final = 64 * 1024
"""What may wait in a connection before its outbox does."""
REASON_BYTES_MAX: Final = 123
"""Of a WebSocket's close frame (RFC 6455, 5.5)."""
WRONG_TOKEN: Final = 4401
WRONG_ORIGIN: Final = 4403
TOO_SLOW: Final = 4408
NO_HELLO: Final = 4409
ENDED: Final = 4410
TOO_MANY: Final = 4429
GOING: Final = 1001
AGAINST_THE_RULES: Final = 1008
PLAIN: Final = "text/plain; charset=utf-8"
LOCAL_HOSTS: Final = frozenset({"127.0.0.1", "localhost", "[::1]"})


@dataclass(frozen=True, slots=True)
class Tokens:
    """The tokens of operators and viewers."""

    view: str
    operate: str

    def role(self, token: str) -> Role | None:
        """Return the permissions of a token."""
        given = token.encode()
        if hmac.compare_digest(given, self.operate.encode()):
            return "operator"
        return "viewer" if hmac.compare_digest(given, self.view.encode()) else None


def new_tokens() -> Tokens:
    """Return random tokens of 144 bits."""
    view, operate = (urlsafe_b64encode(os.urandom(18)).decode() for _ in range(2))
    return Tokens(view, operate)


class ConsoleServer:
    """Serves sources to browsers."""

    def __init__(self, sources: Sequence[Source], tokens: Tokens, version: str) -> None:
        """Call it in a running event loop."""
        self._loop = asyncio.get_running_loop()
        self._sources, self._tokens = sources, tokens
        self.board = Board(sources, version, self._loop.time, self._cut_off)
        self._files = page_files()
        self._connections: dict[str, ServerConnection] = {}
        """Of readers, by their name."""
        self._drawing = ThreadPoolExecutor(1, "console-drawing")
        self._tasks: set[asyncio.Task[None]] = set()
        self.connections = 0
        """All that there are at this moment."""
        self._counted = 0
        self._is_local = True
        self._secured = False

    @contextlib.asynccontextmanager
    async def listening(self, host: str, port: int, tls: ssl.SSLContext | None = None) -> AsyncIterator[int]:
        """Listen, yield the port, and close all connections in the end. Raises OSError."""
        self._is_local, self._secured = host in LOCAL_HOSTS or host == "::1", tls is not None
        server = await serve(
            self._serve,
            host,
            port,
            ssl=tls,
            process_request=self._answer_http,
            compression=None,  # poses are numbers: it would cost more than sending them
            max_size=MESSAGE_BYTES_MAX,
            max_queue=4,
            write_limit=WRITE_BYTES,
            open_timeout=HELLO_S,
            ssl_handshake_timeout=None if tls is None else HELLO_S,
            close_timeout=CLOSE_S,
            ping_interval=PING_S,
            ping_timeout=PING_S,
            server_header=None,
            logger=_silent(),
            create_connection=self._connection(),
        )
        try:
            yield server.sockets[0].getsockname()[1]
        finally:
            await self._take_leave()
            server.close()
            await server.wait_closed()
            for task in self._tasks:
                task.cancel()
            self._drawing.shutdown(wait=False, cancel_futures=True)

    async def run_sources(self) -> None:
        """Run all sources until this is cancelled."""
        async with asyncio.TaskGroup() as group:
            for number, source in enumerate(self._sources):
                group.create_task(self._run(number, source))

    async def _run(self, number: int, source: Source) -> None:
        try:
            await source.run(self.board.feeds[number])
        except Refused as refused:
            self.board.feeds[number].publish({"type": "note", "level": "error", "text": str(refused)})

    async def _take_leave(self) -> None:
        """Send all browsers the reason of the end: that of the source, or of this console alone."""
        text = self.board.has_ended()
        code, why = (ENDED, text) if text else (GOING, "the console was ended")

        async def end(reader: Reader, connection: ServerConnection) -> None:
            with contextlib.suppress(TimeoutError, ConnectionClosed):
                async with asyncio.timeout(CLOSE_S):
                    while (message := reader.take()) is not None:
                        await connection.send(message)
            await _close(connection, code, why)

        readers = self.board.readers.values()
        await asyncio.gather(*(end(reader, self._connections[reader.name]) for reader in readers))

    # --- HTTP --------------------------------------------------------------------------------------------------------

    def _connection(self) -> type[ServerConnection]:
        """Return the class of this server's connections: a connection above the limit is closed at once."""
        console = self

        class Counted(ServerConnection):
            def connection_made(self, transport: asyncio.BaseTransport) -> None:
                super().connection_made(transport)
                console.connections += 1
                if console.connections > CONNECTIONS_MAX:
                    self.transport.abort()

            def connection_lost(self, exc: Exception | None) -> None:
                console.connections -= 1
                super().connection_lost(exc)

        return Counted

    def _answer_http(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer a request for a file; None lets a WebSocket open."""
        hosts = request.headers.get_all("Host")
        if len(hosts) > 1:  # RFC 9112, 3.2
            return _response(400, PLAIN, b"A request has one Host header.\n")
        if self._is_local and _host("".join(hosts)) not in LOCAL_HOSTS:
            # Another host name that resolves to this address would give its pages the rights of this origin.
            return _response(421, PLAIN, b"The address of this console is 127.0.0.1 or localhost.\n")
        path = request.path.partition("?")[0]
        if path == "/ws":
            return None
        file = self._files.get(path)
        if file is None:
            return _response(404, PLAIN, b"There is no such file.\n")
        return _response(200, file.content_type, file.content)

    def _is_own_page(self, request: Request) -> bool:
        """Whether a WebSocket is opened by this page, or by no page at all: programs send no origin."""
        origin = request.headers.get("Origin")
        scheme = "https" if self._secured else "http"
        return origin is None or origin == f"{scheme}://{request.headers.get('Host', '')}"

    # --- WebSockets --------------------------------------------------------------------------------------------------

    async def _serve(self, connection: ServerConnection) -> None:
        """Serve one WebSocket until it ends."""
        assert connection.request is not None, "the handshake is over"
        if not self._is_own_page(connection.request):
            await _close(connection, WRONG_ORIGIN, "another page than the console's own")
            return
        if len(self._connections) >= READERS_MAX:
            await _close(connection, TOO_MANY, f"{READERS_MAX} browsers look on already, which are all that may")
            return
        with contextlib.suppress(ConnectionClosed):
            try:
                role = await self._role_of(connection)
            except TimeoutError:
                await _close(connection, NO_HELLO, f"no token came within {HELLO_S:g} s")
                return
            if role is None:
                await _close(connection, WRONG_TOKEN, "the address has no valid token: open the one that was printed")
                return
            self._counted += 1
            await self._serve_reader(connection, f"browser {self._counted}", role)

    async def _role_of(self, connection: ServerConnection) -> Role | None:
        """Return the role that a browser's first message proves. Raises TimeoutError."""
        try:
            async with asyncio.timeout(HELLO_S):
                hello = read_message(await connection.recv())
        except Malformed:
            return None
        return self._tokens.role(hello.token) if isinstance(hello, Hello) else None

    async def _serve_reader(self, connection: ServerConnection, name: str, role: Role) -> None:
        waits = asyncio.Event()
        reader = Reader(name, role, waits.set)
        self._connections[name] = connection
        writer = asyncio.create_task(_write(connection, reader, waits))
        try:
            self.board.join(reader)
            await self._read(connection, reader)
        except Malformed as malformed:
            await _close(connection, AGAINST_THE_RULES, str(malformed))
        finally:
            self.board.leave(reader)
            del self._connections[name]
            writer.cancel()

    async def _read(self, connection: ServerConnection, reader: Reader) -> None:
        """Handle a page's messages, until its connection ends. Raises Malformed."""
        slots = asyncio.Semaphore(REQUESTS_MAX)
        async for payload in connection:
            message = read_message(payload)
            if isinstance(message, Hello):
                raise Malformed("a second hello")
            if isinstance(message, PageRequest):
                self.board.checked(message.source)
                await slots.acquire()
                self._go(self._answer(reader, message, slots))
                continue
            curves = self.board.follow(reader, message)
            if curves:
                self._go(self._publish_history(reader, message.source, curves))

    def _go(self, work: Any) -> None:
        """Run a task; its failure affects one browser only."""
        task: asyncio.Task[None] = self._loop.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _answer(self, reader: Reader, request: PageRequest, slots: asyncio.Semaphore) -> None:
        """Forward a page's request to a source, and answer it."""
        source = self._sources[request.source]
        try:
            if request.verb == LOOK:
                self._put(reader, {**await self._look(source, request.arguments), "id": request.id})
                return
            if reader.role != "operator":
                raise InvalidRequest("this address only views; operate with the other printed address")
            if request.verb not in source.about.verbs:
                valid = ", ".join(source.about.verbs)
                raise InvalidRequest(f"{source.about.name} has no request {request.verb}; valid: {valid}")
            answered = await source.request(request.verb, request.arguments, reader.name)
        except Refused as refused:
            answered = Answered(str(refused), 0, accepted=False)
        finally:
            slots.release()
        self._put(
            reader,
            {
                "type": "answer",
                "id": request.id,
                "accepted": answered.accepted,
                "text": answered.text,
                "tick": answered.tick,
                "verb": request.verb,
                "who": reader.name,
            },
        )

    async def _look(self, source: Source, wanted: dict[str, Any]) -> dict[str, Any]:
        """Return the answer to a look through a camera, which viewers may take: one picture is drawn at a time."""
        camera = [wanted.get(name) for name in ("robot", "channel", "kind")]
        eyes = source.eyes()
        if len(wanted) != 3 or not all(isinstance(name, str) for name in camera):
            raise InvalidRequest(f"{LOOK} takes robot, channel and kind")
        if eyes is None:
            raise InvalidRequest(f"{source.about.name} has no frame to draw yet")
        tick, draw = eyes
        robot, channel, kind = map(str, camera)
        picture = await self._loop.run_in_executor(self._drawing, draw, robot, channel, kind)
        text = "data:image/png;base64," + b64encode(picture).decode()
        return {"type": "answer", "accepted": True, "text": "", "picture": text, "tick": tick, "verb": LOOK}

    async def _publish_history(self, reader: Reader, source: int, curves: tuple[Curve, ...]) -> None:
        """Send a browser the recorded points of curves that it has begun to plot."""
        series = []
        for curve in curves:
            name, unit, points = await self._sources[source].history(curve)
            if points:
                known, known_unit = name_and_unit(curve)
                series.append({"id": curve.id, "name": name or known, "unit": unit or known_unit, "points": points})
        if series:
            self._put(reader, {"type": "plotted", "source": source, "series": series})

    def _put(self, reader: Reader, message: dict[str, Any]) -> None:
        try:
            reader.put(encode_json(message))
        except TooSlow as slow:
            self._cut_off(reader, str(slow))

    def _cut_off(self, reader: Reader, why: str) -> None:
        """End the connection of a browser."""
        connection = self._connections.get(reader.name)
        if connection is not None:
            self.board.leave(reader)
            self._go(_close(connection, TOO_SLOW, why))


async def _write(connection: ServerConnection, reader: Reader, waits: asyncio.Event) -> None:
    """Send a browser's waiting messages as fast as it reads, until its connection ends."""
    with contextlib.suppress(ConnectionClosed):
        while True:
            await waits.wait()
            waits.clear()
            while (message := reader.take()) is not None:
                await connection.send(message)


async def _close(connection: ServerConnection, code: int, why: str) -> None:
    await connection.close(code, why.encode()[:REASON_BYTES_MAX].decode(errors="ignore"))


def _host(header: str) -> str:
    """Return a Host header without its port."""
    name, colon, port = header.rpartition(":")
    return name if colon and port.isdecimal() else header


def _response(status: int, content_type: str, content: bytes) -> Response:
    reasons = {200: "OK", 400: "Bad Request", 404: "Not Found", 421: "Misdirected Request"}
    headers = Headers(
        {**HEADERS, "Content-Type": content_type, "Content-Length": str(len(content)), "Connection": "close"}
    )
    return Response(status, reasons[status], headers, content)


def _silent() -> logging.Logger:
    """Return a silent log for connections that clients break: they are no errors of the console."""
    logger = logging.getLogger("foosim.console.connections")
    logger.setLevel(logging.CRITICAL)
    logger.propagate = False
    return logger

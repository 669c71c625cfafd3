"""A TCP proxy that makes a link bad: delay, rate, stalls, silence, half-closed and reset connections, by a seed.

TCP loses and reorders nothing inside a connection, so what a bad network does to it is: it comes later, it stops, it is
cut. Bytes pass unread, so what is inside may be encrypted. The proxy runs in a thread of its own; its methods may be
called from any other. What is drawn (jitter, stalls) depends on seed, number of the connection, direction and number of
the chunk; where chunks begin depends on the day.
"""

from __future__ import annotations

import asyncio
import random
import socket
import struct
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Final, Literal, Self

Direction = Literal["up", "down"]
"""Up: from who dials to who listens."""
BOTH: Final[tuple[Direction, ...]] = ("up", "down")
CHUNK_BYTES: Final = 65_536
CHUNKS_HELD_MAX: Final = 256
"""What is on its way: when there is more, the sender waits, as it does for a full pipe."""
RESET: Final = struct.pack("ii", 1, 0)
START_S: Final = 900.0


@dataclass(frozen=True, slots=True)
class Weather:
    """What one direction does to each chunk. A rate of 0 is none; order is always kept."""

    delay_s: float = 0.0
    jitter_s: float = 0.0
    """Up to so much more, drawn evenly."""
    bytes_per_s: float = 0.0
    stall: float = 0.0
    """Probability that a chunk, and all behind it, waits for `stall_s` more."""
    stall_s: float = 0.0


@dataclass(frozen=True, slots=True)
class _Link:
    """One connection: both sockets' writers."""

    number: int
    near: asyncio.StreamWriter
    far: asyncio.StreamWriter


class Proxy:
    """Listens on a port of its own and dials the target for each connection. Use it in `with`."""

    def __init__(self, port: int, seed: int = 1, up: Weather | None = None, down: Weather | None = None) -> None:
        """`port` of 127.0.0.1 is the target; nobody needs to listen there yet."""
        self.address = ""
        self.accepted = 0
        self._target = port
        self._seed = seed
        self._weather: dict[Direction, Weather] = {"up": up or Weather(), "down": down or Weather()}
        self._loop = asyncio.new_event_loop()
        self._gates: dict[Direction, asyncio.Event] = {}
        self._links: list[_Link] = []
        self._refuses = False
        self._end = asyncio.Event()
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._loop.run_until_complete, args=(self._serve(),), name="proxy")

    def __enter__(self) -> Self:
        self._thread.start()
        assert self._ready.wait(START_S)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._call(self._end.set)
        self._thread.join()
        self._loop.close()

    # --- what a test does to the link --------------------------------------------------------------------------------

    def silence(self, directions: Sequence[Direction] = BOTH) -> None:
        """Let nothing pass, neither bytes nor ends, on present and new connections: a cable that is out."""
        self._call(lambda: self._silence(directions))

    def cut(self, lasting: bool = False) -> None:
        """Reset every connection; when it is lasting, new ones, too, until `heal`."""
        self._call(lambda: self._cut(lasting))

    def half_close(self, direction: Direction) -> None:
        """End one direction of every connection; the other one goes on."""
        self._call(lambda: self._half_close(direction))

    def heal(self) -> None:
        """Let everything pass again, first what waits."""
        self._call(self._heal)

    # --- in the loop -------------------------------------------------------------------------------------------------

    def _call(self, what: Callable[[], object]) -> None:
        """Do something in the loop's thread, and wait until it is done."""
        done = threading.Event()

        def do() -> None:
            try:
                what()
            finally:
                done.set()

        self._loop.call_soon_threadsafe(do)
        assert done.wait(START_S)

    def _cut(self, lasting: bool) -> None:
        self._refuses = lasting
        for link in self._links:
            for writer in (link.near, link.far):
                _reset(writer)

    def _silence(self, directions: Sequence[Direction]) -> None:
        for direction in directions:
            self._gates[direction].clear()

    def _half_close(self, direction: Direction) -> None:
        for link in self._links:
            (link.far if direction == "up" else link.near).write_eof()

    def _heal(self) -> None:
        self._refuses = False
        for gate in self._gates.values():
            gate.set()

    async def _serve(self) -> None:
        for direction in BOTH:
            self._gates[direction] = asyncio.Event()
            self._gates[direction].set()
        server = await asyncio.start_server(self._accept, "127.0.0.1", 0)
        self.address = f"tcp/127.0.0.1:{server.sockets[0].getsockname()[1]}"
        self._ready.set()
        await self._end.wait()
        server.close()
        self._cut(lasting=True)
        tasks = asyncio.all_tasks() - {asyncio.current_task()}
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _accept(self, reader: asyncio.StreamReader, near: asyncio.StreamWriter) -> None:
        if self._refuses:
            _reset(near)
            return
        self.accepted += 1
        number = self.accepted
        try:
            far_reader, far = await asyncio.open_connection("127.0.0.1", self._target)
        except OSError:
            _reset(near)
            return
        link = _Link(number, near, far)
        self._links.append(link)
        for writer in (near, far):
            writer.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        try:
            await asyncio.gather(self._carry(reader, far, "up", number), self._carry(far_reader, near, "down", number))
        except (OSError, asyncio.CancelledError):  # one side has reset, so does the other; or the proxy ends
            pass
        finally:
            self._links.remove(link)
            for writer in (near, far):
                _reset(writer)

    async def _carry(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, direction: Direction, number: int
    ) -> None:
        """Carry one direction of one connection to its end."""
        held: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue(CHUNKS_HELD_MAX)
        await asyncio.gather(self._take(reader, held, direction, number), self._give(writer, held, direction))

    async def _take(
        self, reader: asyncio.StreamReader, held: asyncio.Queue[tuple[float, bytes]], direction: Direction, number: int
    ) -> None:
        """Read chunks, and decide when each is due on the other side."""
        weather, draw = self._weather[direction], random.Random(f"{self._seed} {number} {direction}")
        due_s, chunk = 0.0, b"-"
        while chunk:
            chunk = await reader.read(CHUNK_BYTES)
            jitter, stall = draw.random(), draw.random()
            wait_s = weather.delay_s + jitter * weather.jitter_s + (stall < weather.stall) * weather.stall_s
            due_s = max(due_s, self._loop.time() + wait_s)
            if weather.bytes_per_s:
                due_s += len(chunk) / weather.bytes_per_s
            await held.put((due_s, chunk))

    async def _give(
        self, writer: asyncio.StreamWriter, held: asyncio.Queue[tuple[float, bytes]], direction: Direction
    ) -> None:
        """Write chunks when they are due; an empty one is the end of this direction."""
        chunk = b"-"
        while chunk:
            due_s, chunk = await held.get()
            await asyncio.sleep(due_s - self._loop.time())
            await self._gates[direction].wait()
            if chunk:
                writer.write(chunk)
                await writer.drain()
            elif not writer.transport.is_closing():
                writer.write_eof()


def _reset(writer: asyncio.StreamWriter) -> None:
    """Close a connection by RST: nothing that waits is sent."""
    transport = writer.transport
    if not transport.is_closing():
        writer.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RESET)
    transport.abort()

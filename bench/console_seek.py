"""What the time slider of a capture costs: seeks to random ticks of ten minutes of the table, as a browser sees them.

A rehearsal is repeated, row by row and moved in time, until there are ten minutes; each packet, tick, frame and pose is
there. A browser without a page asks for a tick and waits for the poses of it, while the pass over what happened reads
on; then it asks again when that is done. Chunks are as of a run in real time (flushed each 100 ms), and as large as
they get.
"""

from __future__ import annotations

import asyncio
import json
import random
import tempfile
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

import msgspec
import numpy as np
from mcap import records
from msgspec.structs import replace
from websockets.asyncio.client import ClientConnection, connect

from bench.runs import TABLE, BenchError
from foosim.capture.contents import CHUNK_BYTES, declare_topics, write_all
from foosim.capture.foxglove import POSES
from foosim.capture.mcap.checks import CHECKS
from foosim.capture.mcap.format import McapFile, Message
from foosim.capture.mcap.writer import McapWriter
from foosim.capture.reader import DECODERS, TICK_MARKS, read_about
from foosim.capture.rows import FRAME, PACKETS, PROFILE, TICK, FrameRow, PacketRow, TickRow
from foosim.console.recorded.capture_source import FileSource
from foosim.console.server.server import ConsoleServer, new_tokens
from foosim.console.shown.poses import HEAD
from foosim.rehearsal.run import rehearse
from foosim.replay.between import Between

REHEARSED_S: Final = 10
MINUTES: Final = 10
SEEKS: Final = 200
FLUSH_NS: Final = 100_000_000
LIMIT_MS: Final = 100.0
_encode = msgspec.json.Encoder().encode


@dataclass(frozen=True, slots=True)
class Seeks:
    """Times in ms from asking for a tick to its poses, in a capture of so many ticks and MB."""

    chunks: str
    ticks: int
    megabytes: float
    opening_s: float
    """Until the first poses."""
    gathering_s: float
    """Until all that happened was read, seeks among it."""
    busy_p50_ms: float
    busy_p95_ms: float
    """While what happened is read."""
    p50_ms: float
    p95_ms: float


@dataclass(frozen=True, slots=True)
class Found:
    """Seeks to what was captured, by the size of chunks, and to ticks in between, which are computed again."""

    seeks: list[Seeks]
    exact_p95_ms: float


def console_seek(seconds: float = MINUTES * 60.0) -> Found:
    """Measure a capture of so many simulated seconds, with small chunks and with large ones."""
    with tempfile.TemporaryDirectory() as folder:
        rehearsed = Path(folder) / "rehearsed.mcap"
        text = TABLE.read_text()
        tick_s = 0.002
        rehearse(text, TABLE.name, round(REHEARSED_S / tick_s), 1, ["engine=pure"], capture=rehearsed)
        found = []
        for chunks, flush_ns in (("as flushed in real time", FLUSH_NS), ("of 4 MB", 0)):
            path = Path(folder) / f"run{flush_ns}.mcap"
            repeat(rehearsed, path, max(1, round(seconds / REHEARSED_S)), flush_ns)
            found.append(asyncio.run(_measured(path, chunks)))
        return Found(found, asyncio.run(_exact_ms(rehearsed)))


def repeat(path: Path, out: Path, times: int, flush_ns: int) -> None:
    """Write a capture that has the rows of another one so many times, one behind the other."""
    with path.open("rb") as stream:
        contents = list(McapFile(stream, path.stat().st_size, str(path)).contents())
    messages = [content for content in contents if isinstance(content, Message)]
    last_ns = max(message.log_ns for message in messages if message.topic == TICK)
    (ticks,) = (
        TICK_MARKS.decode(message.data).tick
        for message in messages
        if message.topic == TICK and message.log_ns == last_ns
    )
    with out.open("xb", buffering=0) as stream:
        mcap = McapWriter(partial(write_all, stream.fileno()), PROFILE)
        channels = declare_topics(mcap)
        for content in contents:
            if isinstance(content, records.Attachment):
                mcap.add_attachment(content.name, content.media_type, content.data)
            elif isinstance(content, records.Metadata) and content.name == CHECKS:
                mcap.add_checks()
            elif isinstance(content, records.Metadata):
                mcap.add_metadata(content.name, content.metadata)
        flushed_ns = 0
        for round_ in range(times):
            for message in _moved(messages, round_, round_ * ticks, round_ * last_ns):
                stamps = message.log_ns, message.publish_ns, message.sequence
                mcap.add_message(channels[message.topic], *stamps, message.data)
                due = flush_ns and message.topic == TICK and message.log_ns >= flushed_ns + flush_ns
                if due or mcap.chunk_bytes > CHUNK_BYTES:
                    mcap.end_chunk()
                    flushed_ns = message.log_ns
        mcap.finish()


def _moved(messages: list[Message], round_: int, ticks: int, by_ns: int) -> Iterator[Message]:
    """Yield messages moved in time; in later rounds without what stands at the beginning alone."""
    for message in messages:
        row = DECODERS[message.topic].decode(message.data) if message.topic in (TICK, FRAME, PACKETS) else None
        data = message.data
        if isinstance(row, TickRow | FrameRow):
            if round_ and row.tick == 0:
                continue
            data = _encode(replace(row, tick=row.tick + ticks)) if round_ else data
        elif isinstance(row, PacketRow) and round_:
            due_ns = row.due_ns + by_ns if row.due_ns >= 0 else -1
            arrival = row.arrival_tick + ticks if row.arrival_tick >= 0 else -1
            data = _encode(replace(row, sent_ns=row.sent_ns + by_ns, due_ns=due_ns, arrival_tick=arrival))
        elif round_ and (message.topic != POSES or message.log_ns == 0):
            continue
        yield Message(message.topic, message.log_ns + by_ns, message.publish_ns + by_ns, message.sequence, data)


class _Browser:
    """A browser without a page: asks for ticks, and sees poses."""

    def __init__(self, connection: ClientConnection) -> None:
        self._connection = connection
        self._asked = 0
        self.gathered = 0.0

    async def say(self, **message: object) -> None:
        await self._connection.send(json.dumps(message))

    async def seek(self, tick: int, shown: int) -> float:
        """Ask for a tick; return how long the poses of `shown` took, in s."""
        self._asked += 1
        begun = time.perf_counter()
        await self.say(type="ask", id=self._asked, verb="seek", arguments={"tick": tick})
        await self.seen({shown})
        return time.perf_counter() - begun

    async def seen(self, shown: set[int]) -> None:
        """Wait for poses of one of some ticks; any, for none."""
        async with asyncio.timeout(60):
            while True:
                payload = await self._connection.recv()
                if isinstance(payload, bytes):
                    if not shown or round(HEAD.unpack_from(payload)[5]) in shown:
                        return
                    continue
                message = json.loads(payload)
                if message["type"] == "status":
                    self.gathered = message["status"]["gathered"]
                elif message["type"] == "answer" and not message["accepted"]:
                    raise BenchError(message["text"])


@asynccontextmanager
async def _browser(source: FileSource) -> AsyncIterator[_Browser]:
    """Serve a capture, and look at it."""
    tokens = new_tokens()
    server = ConsoleServer([source], tokens, "bench")
    async with server.listening("127.0.0.1", 0) as port:
        running = asyncio.create_task(server.run_sources())
        async with connect(f"ws://127.0.0.1:{port}/ws", compression=None) as connection:
            browser = _Browser(connection)
            await browser.say(type="hello", token=tokens.operate)
            yield browser
        running.cancel()
        with suppress(asyncio.CancelledError):
            await running


async def _measured(path: Path, chunks: str) -> Seeks:
    begun = time.perf_counter()
    source, rng = FileSource(path), random.Random(1)
    first, last = source.recording.span
    every = source.recording.deployment.capture.frames_every
    async with _browser(source) as browser:
        await browser.seen(set())
        opening_s, busy = time.perf_counter() - begun, []
        while browser.gathered < 1.0:
            tick = rng.randint(first, last)
            busy.append(await browser.seek(tick, tick // every * every))
            await asyncio.sleep(0.05)
        gathering_s, calm = time.perf_counter() - begun, []
        for _ in range(SEEKS):
            tick = rng.randint(first, last)
            calm.append(await browser.seek(tick, tick // every * every))
    figures = [round(float(np.percentile(times, p)) * 1e3, 2) for times in (busy, calm) for p in (50, 95)]
    megabytes = round(path.stat().st_size / 1e6, 1)
    return Seeks(chunks, last, megabytes, round(opening_s, 2), round(gathering_s, 1), *figures)


async def _exact_ms(path: Path) -> float:
    """Return the 95th percentile of seeks to ticks that have to be computed again, which a repeated run cannot be."""
    source, rng = FileSource(path, recompute=Between(read_about(path))), random.Random(1)
    every = source.recording.deployment.capture.frames_every
    async with _browser(source) as browser:
        times = []
        for _ in range(SEEKS // 2):
            tick = rng.randrange(0, source.recording.span[1], every) + rng.randint(1, every - 1)
            times.append(await browser.seek(tick, tick))
    return round(float(np.percentile(times[1:], 95)) * 1e3, 2)


def lines(found: Found) -> list[str]:
    """Return the figures for people."""
    told = []
    for seeks in found.seeks:
        told += [
            f"{seeks.ticks} ticks, {seeks.megabytes} MB, chunks {seeks.chunks}: first poses after {seeks.opening_s} s",
            f"  a seek takes {seeks.p50_ms} ms, {seeks.p95_ms} ms at p95 (to stay below {LIMIT_MS:.0f})",
            f"  {seeks.busy_p50_ms} ms, {seeks.busy_p95_ms} ms at p95 while all is read, {seeks.gathering_s} s",
        ]
    return [*told, f"a seek to a tick between captured frames, computed again: {found.exact_p95_ms} ms at p95"]

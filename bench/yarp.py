"""Bottles between ports of YARP: delay and loss at the rates that the table of 2012 had, and through a run.

Port to port are two processes: the bench writes the time into each bottle, this module as a program reads it. Through
the run, a sensor of 100 Hz goes from the vHub's release, of which the capture has the time, over the gateway to that
program. All times are of the machine's monotonic clock. Connections are by the carrier tcp, which acknowledges.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np

from bench.machine import free_ports
from bench.runs import ROOT, BenchError, watch
from foosim.capture.reader import open_capture
from foosim.common.errors import Failed
from foosim.gateways.yarp.name_server import name_server
from foosim.gateways.yarp.ports import NameClient, Port
from foosim.gateways.yarp.wire import message

PORTS_2012: Final = {100: (0.1161, 0.0), 1_000: (0.1163, 2.1), 10_000: (0.1596, 40.1)}
"""Delay (ms) and loss (%) between two programs by rate (Hz), as measured for the table of 2012."""
RUN_2012_MS: Final = 0.8459
"""From its simulator to a client, at 100 Hz, without loss."""
RUN_MS: Final = 0.85
"""What the median through a run stays below."""
START_S: Final = 60.0
WARM_S: Final = 1.0
"""Of a run, left out: everything runs for the first time."""
READER, WRITER, SENSOR = "/bench/reader", "/bench/writer", "/morse/probe/pose/out"
TEXT: Final = """
format: 2
world: yarp
seed: 1
tick: 10 ms
substeps: 1
pace: realtime
scene: {{kind: empty}}
robots:
  probe: {{model: differential_drive, sensors: {{pose: {{kind: pose_3d, rate: 100 Hz}}}}}}
gateways: {{yarp: {{kind: yarp, name_server: '127.0.0.1:{number}'}}}}
nodes: {{one: {{robots: ["*"]}}}}
"""


@dataclass(frozen=True, slots=True)
class Delays:
    """Bottles at a rate, and of those that came the delays by p50, p99, max (ms)."""

    rate_hz: int
    sent: int
    lost_percent: float
    delay_ms: list[float]


@dataclass(frozen=True, slots=True)
class Yarp:
    """Port to port at each rate, and through the run."""

    ports: list[Delays]
    run: Delays


def yarp(seconds: float = 10.0) -> Yarp:
    """Measure each for some seconds. Raises BenchError."""
    return Yarp([asyncio.run(_port_to_port(rate_hz, seconds)) for rate_hz in PORTS_2012], _through_a_run(seconds))


def _reader(number: int, *options: str) -> list[str]:
    return ["-m", "bench.yarp", "--number", str(number), *options]


async def _port_to_port(rate_hz: int, seconds: float) -> Delays:
    names = NameClient("127.0.0.1", free_ports())
    server = await name_server(names)
    assert server is not None, "the number was free"
    out, sent = Port(WRITER, names), round(rate_hz * seconds)
    await out.open()
    reader = subprocess.Popen([sys.executable, *_reader(names.number)], cwd=ROOT, stdout=subprocess.PIPE, text=True)
    try:
        await _registered(names, READER)
        await out.connect(READER)
        begun_ns = time.monotonic_ns()
        for index in range(sent):
            due_ns = begun_ns + index * 1_000_000_000 // rate_hz
            while (left_ns := due_ns - time.monotonic_ns()) > 0:  # a sleep ends up to 1 ms late
                await asyncio.sleep((left_ns - 1_500_000) / 1e9 if left_ns > 3_000_000 else 0)
            out.write([index, time.monotonic_ns()])
        await asyncio.sleep(1.0)
        await out.close()
        printed, _ = await asyncio.to_thread(reader.communicate, timeout=START_S)
    finally:
        reader.kill()
        reader.wait()
        await server.close()
    return _delays(rate_hz, sent, [at_ns - sent_ns for (_, sent_ns), at_ns in json.loads(printed)])


def _through_a_run(seconds: float) -> Delays:
    number = free_ports()
    with TemporaryDirectory() as folder:
        file = Path(folder) / "yarp.yaml"
        file.write_text(TEXT.format(number=number))
        beside = [_reader(number, "--source", SENSOR)]
        run = watch("realtime", seconds + WARM_S, helpers=lambda *_: beside, read=_released, deployment=file)
    heard = {round(values[0] * 1e9): at_ns for values, at_ns in json.loads(run.printed[0])}
    if not heard:
        raise BenchError("no bottle came through the run")
    first_ns, last_ns = min(heard) + round(WARM_S * 1e9), max(heard)
    released = {sent_ns: at_ns for sent_ns, at_ns in run.found.items() if first_ns <= sent_ns <= last_ns}
    return _delays(100, len(released), [heard[sent] - at_ns for sent, at_ns in released.items() if sent in heard])


def _released(path: Path) -> dict[int, int]:
    """Return when the vHub released each reading of the sensor, by the simulated time of the reading."""
    packets = open_capture(path).packets
    ours = packets.where((packets.source == "probe") & (packets.wall_released_ns > 0))
    return dict(zip(ours.sent_ns.tolist(), ours.wall_released_ns.tolist(), strict=True))


def _delays(rate_hz: int, sent: int, delays_ns: Sequence[int]) -> Delays:
    if not delays_ns:
        raise BenchError(f"no bottle came at {rate_hz} Hz")
    found = [round(float(ms), 4) for ms in np.percentile(delays_ns, (50, 99, 100)) / 1e6]
    return Delays(rate_hz, sent, round(100 * (1 - len(delays_ns) / sent), 3), found)


def lines(row: Yarp) -> list[str]:
    """Return the figures for people."""
    shown = []
    for at in row.ports:
        (p50, p99, most), (then_ms, then_lost) = at.delay_ms, PORTS_2012[at.rate_hz]
        shown.append(
            f"{at.rate_hz:6} Hz port to port: p50 {p50:.4f} (2012: {then_ms}), p99 {p99:.3f}, max {most:.2f} ms, "
            f"lost {at.lost_percent:g} % of {at.sent} (2012: {then_lost} %)"
        )
    p50, p99, most = row.run.delay_ms
    through = f"p50 {p50:.3f} (to stay below {RUN_MS}; 2012: {RUN_2012_MS}), p99 {p99:.2f}, max {most:.2f} ms"
    return [*shown, f"   100 Hz through the run: {through}, lost {row.run.lost_percent:g} % of {row.run.sent}"]


async def _registered(names: NameClient, name: str) -> None:
    """Wait until a port is known; raises TimeoutError."""
    async with asyncio.timeout(START_S):
        while not await _answer(names, f"query {name}"):
            await asyncio.sleep(0.05)


async def _answer(names: NameClient, line: str) -> list[str]:
    try:
        return await names.request(line)
    except Failed:  # the gateway starts the name server with its run
        return []


async def _read(number: int, source: str) -> list[tuple[list[Any], int]]:
    """Return each bottle with its time (ns), until the writer has left."""
    names = NameClient("127.0.0.1", number)
    found: list[tuple[list[Any], int]] = []
    port = Port(READER, names, lambda values: found.append((values, time.monotonic_ns())))
    if source:
        await _registered(names, source)
    await port.open()
    if source:  # ask it to connect, as `yarp connect` does
        _, _, _, _, host, _, at, _, _ = await names.request(f"query {source}")
        _, writer = await asyncio.open_connection(host, int(at))
        writer.write(b"CONNECT bench\r\n" + message("a", ["add", READER], text=True))
        await writer.drain()
    while not port.sources:
        await asyncio.sleep(0.01)
    while port.sources:
        await asyncio.sleep(0.1)
    await port.close()
    return found


def main() -> None:
    """Run as the program that reads; it prints each bottle with its time."""
    parser = argparse.ArgumentParser(description="A program of YARP that reads.")
    parser.add_argument("--number", type=int, required=True)
    parser.add_argument("--source", default="")
    chosen = parser.parse_args()
    print(json.dumps(asyncio.run(_read(chosen.number, chosen.source))), flush=True)


if __name__ == "__main__":
    main()

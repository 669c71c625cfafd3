"""Raw readers of a console: browsers without a page, some of which stop reading.

With `--port` they read one that serves already; else this starts `foosim-console` for the newest live run, and says in
its last line what that took.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

from websockets.asyncio.client import ClientConnection, connect

from bench.machine import use_of
from foosim.client import control
from foosim.common.errors import Refused
from foosim.runtime.children import script

START_S = 120.0


async def read(port: int, token: str, seconds: float, stops: bool, begun: asyncio.Event) -> tuple[float, float]:
    """Return the moments that came in a second, and how many ms it took to have scene and first poses."""
    opened_s = time.monotonic()
    async with connect(f"ws://127.0.0.1:{port}/ws", compression=None, max_size=None, max_queue=4) as connection:
        await connection.send(json.dumps({"type": "hello", "token": token}))
        ready_s = await ready(connection) - opened_s
        begun.set()
        if stops:  # the library's queue fills, then the kernel's
            await asyncio.sleep(seconds)
            connection.transport.abort()
            return 0.0, ready_s * 1e3
        count, end_s = 0, time.monotonic() + seconds
        while time.monotonic() < end_s:
            count += isinstance(await connection.recv(), bytes)
        return count / seconds, ready_s * 1e3


async def ready(connection: ClientConnection) -> float:
    """Return when the scene and a moment have come."""
    lacking = {str, bytes}
    while lacking:
        payload = await connection.recv()
        if isinstance(payload, bytes) or '"scene"' in payload[:64]:
            lacking.discard(type(payload))
    return time.monotonic()


async def all_read(port: int, token: str, readers: int, stopped: int, seconds: float, pid: int) -> dict[str, Any]:
    """Read by so many, and say the medians; of the console with that process id its share of a core."""
    begun = [asyncio.Event() for _ in range(readers)]
    tasks = [
        asyncio.create_task(read(port, token, seconds, number < stopped, event)) for number, event in enumerate(begun)
    ]
    await asyncio.gather(*(event.wait() for event in begun))
    print("reading", flush=True)
    first, first_s = use_of(pid), time.monotonic()
    await asyncio.sleep(0.9 * seconds)
    last, last_s = use_of(pid), time.monotonic()
    rates, ready_ms = zip(*await asyncio.gather(*tasks), strict=True)
    share = None if first is None or last is None else round((last.cpu_s - first.cpu_s) / (last_s - first_s), 4)
    return {"share": share, "got_hz": round(min(rates[stopped:]), 2), "ready_ms": round(max(ready_ms), 1)}


def of_a_run(readers: int, stopped: int, seconds: float) -> dict[str, Any]:
    """Start a console for the live run and read it."""
    deadline_s = time.monotonic() + START_S
    while time.monotonic() < deadline_s:
        try:
            if control.status()["ticks"] > 1:
                break
        except Refused:
            time.sleep(0.1)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "addresses.json"
        command = [script("foosim-console"), "--announce", str(path)]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
        try:
            while not path.exists() and process.poll() is None:
                time.sleep(0.05)
            address, _, token = json.loads(path.read_bytes())["view"].partition("#view=")
            port = int(address.rstrip("/").rpartition(":")[2])
            return asyncio.run(all_read(port, token, readers, stopped, seconds, process.pid))
        finally:
            process.terminate()
            process.wait()


def main() -> None:
    """Read, and print what was found."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("--token", default="")
    parser.add_argument("--readers", type=int, default=1)
    parser.add_argument("--stopped", type=int, default=0)
    parser.add_argument("--seconds", type=float, required=True)
    asked = parser.parse_args()
    if asked.port:
        found = asyncio.run(all_read(asked.port, asked.token, asked.readers, asked.stopped, asked.seconds, 0))
    else:
        found = of_a_run(asked.readers, asked.stopped, asked.seconds)
    print(json.dumps(found), flush=True)


if __name__ == "__main__":
    main()

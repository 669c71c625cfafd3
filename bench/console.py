"""The console: what it takes of a core, how soon a page has poses, and whether readers that stop disturb anybody.

`served` is the console alone, in this process, fed with commits as the supervisor shows them, its readers in another
process: the table at 50 Hz, and as many poses as a large world has at 25 Hz. `runs` are real runs of the table in real
time by turns without a console, with one reader, and with many of which some never read: the ticks' cost and lag of
each, and what the console took.
"""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from bench.runs import ROOT, TABLE, watch
from foosim.common.errors import Refused
from foosim.console.live.following import Following
from foosim.console.server.server import ConsoleServer, new_tokens
from foosim.console.shown.source import About, Answered, Curve, Feed, Wanted
from foosim.deployment.loader import load_deployment
from foosim.deployment.schema import Deployment
from foosim.protocol.codec import encode
from foosim.protocol.messages import Commit
from foosim.world.frame import Frame
from foosim.world.layout import build_layout

WORLDS: Final = ((0, 50.0), (983, 25.0))
"""Balls beside the table's own bodies, which are 17 links; and frames a second."""
MANY: Final = 20
STOPPED: Final = 5
FRAMES: Final = 64
"""Different frames, which come by turns."""
TURNS: Final = ((0, 0), (1, 0), (MANY, STOPPED))
"""Readers of a run, and those among them that stop."""


@dataclass(frozen=True, slots=True)
class Served:
    """One world: links, frames a second, the share of a core, moments that a reader got in a second, in ms the first.

    `ready_ms` is from opening the connection to scene and first poses.
    """

    links: int
    hz: float
    share: float
    got_hz: float
    ready_ms: float


@dataclass(frozen=True, slots=True)
class Run:
    """One run: readers, those that stopped, the lag, the processor time of a tick, the console's share of a core."""

    readers: int
    stopped: int
    lag_p50_ms: float
    lag_p99_ms: float
    tick_us: float
    share: float | None
    ready_ms: float | None
    got_hz: float | None


@dataclass(frozen=True, slots=True)
class ConsoleFigures:
    """All of it."""

    served: list[Served]
    runs: list[Run]


class Fed:
    """A source that is told commits at a rate, and does with them what a live one does."""

    def __init__(self, balls: int, hz: float) -> None:
        self.about = About("live", "bench", "table", 2_000_000, ())
        self._following, self._hz = Following(self.about), hz
        text = TABLE.read_text()
        layout = build_layout(load_deployment(text, TABLE.name), [(f"b{n}", "ball") for n in range(balls)])
        values = np.random.default_rng(1).uniform(-1.0, 1.0, (FRAMES, layout.size))
        self._frames = [Frame(tick, layout, row.copy()) for tick, row in enumerate(values)]
        self._what = {
            "run": "bench",
            "deployment_name": TABLE.name,
            "deployment": text,
            "added": [(f"b{n}", "ball") for n in range(balls)],
            "layout": layout.digest.hex(),
            "tick": 1,
            "frame": None,
        }

    async def run(self, feed: Feed) -> None:
        commits = [encode(Commit(1, f.tick, f.digest, f.values.tobytes(), [], [], False)) for f in self._frames]
        world = self._following.world_of(self._what, no_files)
        self._following.turn_to(self._what, world)
        feed.describe(self.about, self._following.content())
        due_s = time.monotonic()
        while True:
            for payload in commits:
                due_s = max(due_s + 1.0 / self._hz, time.monotonic())
                await asyncio.sleep(due_s - time.monotonic())
                self._show(feed, payload)

    def _show(self, feed: Feed, payload: bytes) -> None:
        found = self._following.read(payload)
        assert found is not None, "it is of this layout"
        feed.show(self._following.show(*found))

    def want(self, wanted: Wanted) -> None:
        """Nothing: it comes at its rate."""

    async def ask(self, verb: str, arguments: Mapping[str, Any], who: str) -> Answered:
        raise Refused("a bench is not asked")

    async def history(self, curve: Curve) -> tuple[str, str, list[tuple[float, float]]]:
        return "", "", []


def no_files(deployment: Deployment) -> Mapping[str, bytes]:
    """The table names none."""
    return {}


def console(seconds: float = 10.0) -> ConsoleFigures:
    """Measure each for so many seconds."""
    served = [asyncio.run(_serve(balls, hz, seconds)) for balls, hz in WORLDS]
    return ConsoleFigures(served, [_run(readers, stopped, seconds) for _ in range(2) for readers, stopped in TURNS])


async def _serve(balls: int, hz: float, seconds: float) -> Served:
    source, tokens = Fed(balls, hz), new_tokens()
    server = ConsoleServer([source], tokens, "bench")
    async with server.listening("127.0.0.1", 0) as port:
        running = asyncio.create_task(server.run_sources())
        command = ["-m", "bench.console_reader", "--port", str(port), "--token", tokens.view, "--seconds", str(seconds)]
        reader = await asyncio.create_subprocess_exec(sys.executable, *command, cwd=ROOT, stdout=subprocess.PIPE)
        assert reader.stdout is not None
        await reader.stdout.readline()  # it reads
        cpu_s, wall_s = time.process_time(), time.monotonic()
        told = json.loads(await reader.stdout.readline())
        share = (time.process_time() - cpu_s) / (time.monotonic() - wall_s)
        await reader.wait()
        running.cancel()
    return Served(17 + balls, hz, round(share, 4), told["got_hz"], told["ready_ms"])


def _run(readers: int, stopped: int, seconds: float) -> Run:
    def look_on(simulation: str, radio: str) -> list[list[str]]:
        options = ["--readers", str(readers), "--stopped", str(stopped), "--seconds", str(seconds)]
        return [["-m", "bench.console_reader", *options]] if readers else []

    run = watch("realtime", 2.0 * seconds, ["tick=2 ms", "substeps=4"], every_s=1.0, helpers=look_on)
    told = json.loads(run.printed[0].splitlines()[-1]) if readers else {}
    costs = [cost for cost in run.costs() if cost.name != "launcher"]
    lag = run.result["lag_ms"]
    return Run(
        readers,
        stopped,
        lag["p50"],
        lag["p99"],
        round(sum(cost.cpu_us_per_tick for cost in costs), 1),
        told.get("share"),
        told.get("ready_ms"),
        told.get("got_hz"),
    )


def lines(found: ConsoleFigures) -> list[str]:
    """Return the figures for people."""
    shown = [
        f"{row.links:5} poses at {row.hz:g} Hz, one reader: {row.share:.1%} of a core, {row.got_hz:.1f} moments/s, "
        f"scene and first poses after {row.ready_ms:.0f} ms"
        for row in found.served
    ]
    for run in found.runs:
        who = f"{run.readers} readers, {run.stopped} of them stopped" if run.readers else "no console"
        text = f"run, {who}: lag p50 {run.lag_p50_ms:.2f}, p99 {run.lag_p99_ms:.2f} ms; {run.tick_us:.0f} us a tick"
        if run.share is not None:
            text += f"; console {run.share:.1%} of a core, first poses after {run.ready_ms:.0f} ms, {run.got_hz:.1f}/s"
        shown.append(text)
    return shown

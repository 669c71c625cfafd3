"""Pictures from above: frames a second, and a picture as multiples of the bare tick of Bullet.

Pictures of a frame are equal, so the least time of each frame's counts, and of bare ticks too.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bench.bare_tick import BareTable
from foosim.painting.overhead import OverheadPainter
from foosim.rehearsal.simulation import Simulation

DEPLOY: Final = Path(__file__).parents[1] / "deploy"
WORLDS: Final = (("table", (320, 180)), ("table", (960, 540)), ("warehouse", (320, 180)), ("yard", (320, 180)))
RUNS: Final = 20
TICKS: Final = 10
"""Ticks from one frame to the next."""


@dataclass(frozen=True, slots=True)
class Pictures:
    """Pictures of one world: `us` of the wall for one, frames a second, and a picture in bare ticks."""

    world: str
    pixels: tuple[int, int]
    us: float
    per_s: float
    bare_tick_us: float
    in_bare_ticks: float


def painter(seconds: float = 0.5) -> list[Pictures]:
    """Paint frames of so much simulated time."""
    return [_measured(world, pixels, seconds) for world, pixels in WORLDS]


def _measured(world: str, pixels: tuple[int, int], seconds: float) -> Pictures:
    table = BareTable()
    least: list[float] = []
    bare = []
    with Simulation(DEPLOY / f"{world}.yaml", agents=[]) as simulation:
        made = OverheadPainter(simulation.scene, simulation.frame.layout, pixels)
        for _ in range(max(1, round(seconds * 1e9 / simulation.deployment.tick_ns / TICKS))):
            simulation.step(ticks=TICKS)
            of_frame = float("inf")
            for _ in range(RUNS):
                begun_ns = time.perf_counter_ns()
                made.paint(simulation.frame)
                of_frame = min(of_frame, time.perf_counter_ns() - begun_ns)
            least.append(of_frame)
            begun_ns = time.perf_counter_ns()
            table.run(TICKS)
            bare.append((time.perf_counter_ns() - begun_ns) / TICKS)
    table.close()
    us, bare_us = sum(least) / len(least) / 1e3, min(bare) / 1e3
    return Pictures(world, pixels, round(us, 1), round(1e6 / us), round(bare_us, 1), round(us / bare_us, 2))


def lines(rows: list[Pictures]) -> list[str]:
    """Return the figures for people."""
    return [
        f"{row.world:12}{row.pixels[0]} x {row.pixels[1]:<5}{row.us:8.0f} us = {row.in_bare_ticks:.2f} b "
        f"(b {row.bare_tick_us:.0f} us), {row.per_s:.0f} frames/s"
        for row in rows
    ]

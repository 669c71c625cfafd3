"""How many seeds of the swarm one core flies in a second: rehearsals under random faults, with every law watched.

For one core processor time is counted, so that a busy machine tells the same; for all of them wall time.
"""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bench.runs import BenchError
from foosim.rehearsal.swarm.campaign import Flown, fly
from foosim.rehearsal.swarm.faults import TICKS
from foosim.rehearsal.swarm.workers import fly_seeds

TABLE: Final = Path(__file__).parents[1] / "deploy" / "table.yaml"
SEEDS: Final = 40
WARM: Final = range(1001, 1013)
"""Flown before, so that the worlds are made."""


@dataclass(frozen=True, slots=True)
class SwarmFigures:
    """What the seeds had and took, each on average. `jobs`: as many processes as processors."""

    seeds_per_s: float
    jobs: int
    seeds_per_s_jobs: float
    ticks: float
    faults: float
    nodes: float
    seen: float


def swarm(seconds: float | None = None) -> SwarmFigures:
    """Fly seeds: 40, or about as many as take that processor time."""
    text = TABLE.read_text()
    for seed in WARM:
        fly(text, TABLE.name, seed)
    begun_s = time.process_time()
    flown: list[Flown] = []
    while len(flown) < SEEDS if seconds is None else time.process_time() - begun_s < seconds:
        flown.append(fly(text, TABLE.name, len(flown) + 1))
    took_s = time.process_time() - begun_s
    broken = [flight.seed for flight in flown if flight.broken]
    if broken:
        raise BenchError(f"seeds {broken} broke a law: foosim-rehearse deploy/table.yaml --swarm --seed {broken[0]}")
    count, jobs = len(flown), os.cpu_count() or 1
    begun_s = time.monotonic()
    for _ in fly_seeds(text, TABLE.name, range(1, count * jobs + 1), TICKS, jobs):
        pass
    return SwarmFigures(
        round(count / took_s, 2),
        jobs,
        round(count * jobs / (time.monotonic() - begun_s), 2),
        round(sum(flight.ticks for flight in flown) / count, 1),
        round(sum(len(flight.faults) for flight in flown) / count, 1),
        round(sum(flight.nodes for flight in flown) / count, 1),
        round(sum(flight.seen for flight in flown) / count),
    )


def lines(figures: SwarmFigures) -> list[str]:
    """Return the figures for people."""
    return [
        f"{figures.seeds_per_s:.2f} seeds a second of one core, "
        f"{figures.seeds_per_s_jobs:.2f} a second in {figures.jobs} processes",
        f"each {figures.ticks:.0f} ticks on {figures.nodes:.1f} nodes, {figures.faults:.1f} faults, "
        f"{figures.seen:.0f} things written and said",
    ]

"""Deployments as `up` runs them: nodes, a recording vHub, supervisor and players as processes, in pace fast.

The figure is the median of the runs' ratios to real time; processes and capture are of that run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Final

from bench.runs import ROOT, TABLE, BenchError, ProcessCost, watch

DEPLOYMENTS: Final[dict[Path, float]] = {TABLE: 6.0, ROOT / "deploy" / "warehouse.yaml": 60.0}
"""With the simulated time of a run (s)."""


@dataclass(frozen=True, slots=True)
class Distributed:
    """One deployment."""

    deployment: str
    ticks: int
    rtf: float
    rtf_of_runs: list[float]
    processes: list[ProcessCost]
    cores_used: float
    """Seconds of processor of all processes a second of wall."""
    capture_mb_per_minute: float
    """Megabytes a minute of simulated time."""
    packets: dict[str, int]
    chain: str


def distributed(seconds: float | None = None, repeats: int = 3) -> list[Distributed]:
    """Measure each deployment; `seconds` is the simulated time of a run, None for its own."""
    return [_measure(file, seconds or own_s, repeats) for file, own_s in DEPLOYMENTS.items()]


def _measure(file: Path, seconds: float, repeats: int) -> Distributed:
    runs = sorted(
        (watch("fast", seconds, deployment=file) for _ in range(repeats)), key=lambda run: float(run.result["rtf"])
    )
    chains = {run.result["digest"]["chain"] for run in runs}
    if len(chains) != 1:
        raise BenchError(f"{file.name}: runs of one seed have the chains {', '.join(sorted(chains))}")
    middle = runs[len(runs) // 2]
    costs, ticks = middle.costs(), middle.result["ticks"]
    all_s = sum(cost.cpu_us_per_tick for cost in costs) / 1e6
    first, last = middle.looks[0], middle.looks[-1]
    return Distributed(
        file.stem,
        ticks,
        round(median(float(run.result["rtf"]) for run in runs), 2),
        [run.result["rtf"] for run in runs],
        costs,
        round(all_s * (last.ticks - first.ticks) / (last.wall_s - first.wall_s), 2),
        round(middle.capture_mb * 60.0 / (ticks * middle.tick_s), 1),
        middle.result["packets"],
        chains.pop(),
    )


def lines(rows: list[Distributed]) -> list[str]:
    """Return the figures for people."""
    shown = []
    for row in rows:
        spread = " ".join(f"{rtf:.2f}" for rtf in row.rtf_of_runs)
        shown += [
            f"{row.deployment}: {row.rtf:.2f}x real time (runs {spread}) over {row.ticks} ticks",
            f"    us of processor a tick: {cost_text(row.processes)}; {row.cores_used:.2f} cores used",
            f"    MB resident, start-end: {memory_text(row.processes)}",
            f"    capture {row.capture_mb_per_minute:g} MB a minute",
            f"    packets: {', '.join(f'{n} {fate}' for fate, n in row.packets.items())}; chain {row.chain[:16]}",
        ]
    return shown


def cost_text(processes: Sequence[ProcessCost]) -> str:
    """`vhub 170  red 490`, and all of them."""
    total = sum(cost.cpu_us_per_tick for cost in processes)
    return "  ".join(f"{cost.name} {cost.cpu_us_per_tick:g}" for cost in processes) + f"  all {total:.0f}"


def memory_text(processes: Sequence[ProcessCost]) -> str:
    """`vhub 80-82  red 90-90`."""
    return "  ".join(f"{cost.name} {cost.rss_mb_start:.0f}-{cost.rss_mb_end:.0f}" for cost in processes)

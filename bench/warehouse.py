"""The warehouse as `up` runs it: two nodes, a recording vHub, the fleet's controllers in two processes, in pace fast.

The figure is the median of the runs' ratios to real time. Beside it stands what each process costs: whether a machine
is fast enough is a matter of what all cost together over its cores, and of the chain of processes that a tick goes
through.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Final

from bench.distributed import cost_text, memory_text
from bench.runs import ROOT, BenchError, ProcessCost, watch

WAREHOUSE: Final[Path] = ROOT / "deploy" / "warehouse.yaml"
TO_REACH: Final = 5.0
"""Times real time."""


@dataclass(frozen=True, slots=True)
class Warehouse:
    """Processes, ticks and capture are those of the run whose ratio is the median; all runs have one chain."""

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


def warehouse(seconds: float = 60.0, repeats: int = 3) -> Warehouse:
    """Measure; `seconds` is the simulated time of each run. Raises BenchError when two runs differ in their chain."""
    runs = sorted(
        (watch("fast", seconds, deployment=WAREHOUSE) for _ in range(repeats)), key=lambda run: float(run.result["rtf"])
    )
    chains = {run.result["digest"]["chain"] for run in runs}
    if len(chains) != 1:
        raise BenchError(f"runs of one deployment and seed have the chains {', '.join(sorted(chains))}")
    middle = runs[len(runs) // 2]
    costs, rtf = middle.costs(), median(float(run.result["rtf"]) for run in runs)
    all_s = sum(cost.cpu_us_per_tick for cost in costs) / 1e6
    first, last = middle.looks[0], middle.looks[-1]
    return Warehouse(
        middle.result["ticks"],
        round(rtf, 2),
        [run.result["rtf"] for run in runs],
        costs,
        round(all_s * (last.ticks - first.ticks) / (last.wall_s - first.wall_s), 2),
        round(middle.capture_mb * 60.0 / (middle.result["ticks"] * middle.tick_s), 1),
        middle.result["packets"],
        middle.result["digest"]["chain"],
    )


def lines(row: Warehouse) -> list[str]:
    """Return the figures for people."""
    spread = " ".join(f"{rtf:.2f}" for rtf in row.rtf_of_runs)
    return [
        f"{row.rtf:.2f}x real time (runs {spread}, to reach {TO_REACH:g}x) over {row.ticks} ticks",
        f"us of processor a tick: {cost_text(row.processes)}; {row.cores_used:.2f} cores used",
        f"MB resident, start-end: {memory_text(row.processes)}; capture {row.capture_mb_per_minute:g} MB a minute",
        f"packets: {', '.join(f'{count} {what}' for what, count in row.packets.items())}; chain {row.chain[:16]}",
    ]

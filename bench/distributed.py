"""Two nodes, a recording vHub, a supervisor and two lockstep players as processes, as fast as they go.

For each length of tick the substep stays 0.5 ms. The plain runs give the figure, their median; one run more, whose node
red is `metered_node`, gives the split of its tick.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any, Final

from bench.runs import ProcessCost, watch

TICKS_MS: Final = (1, 2, 5, 10)
SUBSTEPS_PER_MS: Final = 2
TO_REACH: Final = {2: 2.0, 5: 4.0}
"""Times real time, by ms of tick."""


@dataclass(frozen=True, slots=True)
class Distributed:
    """One length of tick. Processes and capture are those of the run whose speed is the median."""

    tick_ms: int
    ticks: int
    ticks_per_s: float
    rtf: float
    rtf_of_runs: list[float]
    processes: list[ProcessCost]
    node_us: dict[str, float]
    """Of the metered run, by part of node red's tick."""
    capture_mb_per_minute: float
    """Megabytes a minute of simulated time."""
    handovers: int
    score: dict[str, int]


def distributed(seconds: float = 6.0, ticks_ms: Sequence[int] = TICKS_MS, repeats: int = 3) -> list[Distributed]:
    """Measure; `seconds` is the simulated time of each run."""
    return [_measure(tick_ms, seconds, repeats) for tick_ms in ticks_ms]


def _measure(tick_ms: int, seconds: float, repeats: int) -> Distributed:
    sets = [f"tick={tick_ms} ms", f"substeps={tick_ms * SUBSTEPS_PER_MS}"]
    runs = sorted((watch("fast", seconds, sets) for _ in range(repeats)), key=lambda run: float(run.result["rtf"]))
    middle = runs[len(runs) // 2]
    metered = watch("fast", seconds, [*sets, "nodes.red.launch=manual"], helpers=_metered_red)
    node_us: dict[str, float] = json.loads(metered.printed[0].splitlines()[-1])
    result: dict[str, Any] = middle.result
    rtf = median(float(run.result["rtf"]) for run in runs)
    return Distributed(
        tick_ms,
        result["ticks"],
        round(rtf * 1000 / tick_ms),
        round(rtf, 2),
        [run.result["rtf"] for run in runs],
        middle.costs(),
        node_us,
        round(middle.capture_mb * 60.0 / (result["ticks"] * middle.tick_s), 1),
        result["handovers"],
        result["score"],
    )


def _metered_red(simulation: str, radio: str) -> list[list[str]]:
    return [["-m", "bench.metered_node", "--name", "red", "--connect", simulation]]


def lines(rows: list[Distributed]) -> list[str]:
    """Return the figures for people."""
    shown = []
    for row in rows:
        to_reach = f", to reach {TO_REACH[row.tick_ms]:g}x" if row.tick_ms in TO_REACH else ""
        spread = " ".join(f"{rtf:.2f}" for rtf in row.rtf_of_runs)
        shown += [
            f"tick {row.tick_ms:2} ms: {row.ticks_per_s:6.0f} ticks/s {row.rtf:6.2f}x real time "
            f"(runs {spread}{to_reach}; {row.handovers} hand-overs, {row.score['red']} : {row.score['blue']})",
            f"    us of processor a tick: {cost_text(row.processes)}",
            f"    MB resident, start-end: {memory_text(row.processes)}",
            f"    capture: {row.capture_mb_per_minute:g} MB a minute",
            "    node red, us of wall: " + "  ".join(f"{part} {us:g}" for part, us in row.node_us.items()),
        ]
    return shown


def cost_text(processes: Sequence[ProcessCost]) -> str:
    """`vhub 170  red 490`, and all of them."""
    total = sum(cost.cpu_us_per_tick for cost in processes)
    return "  ".join(f"{cost.name} {cost.cpu_us_per_tick:g}" for cost in processes) + f"  all {total:.0f}"


def memory_text(processes: Sequence[ProcessCost]) -> str:
    """`vhub 80-82  red 90-90`."""
    return "  ".join(f"{cost.name} {cost.rss_mb_start:.0f}-{cost.rss_mb_end:.0f}" for cost in processes)

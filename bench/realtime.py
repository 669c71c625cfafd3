"""The table in real time: lag, drift, memory over a minute, and how soon the first tick comes.

Drift is how much the wall clock gained on simulated time between the first and the last quarter of the run, each by the
median of its looks. To the time until the first tick comes that of the command's own start, which other benches and
this one leave out by calling its functions.
"""

from __future__ import annotations

import subprocess
import time
from dataclasses import dataclass
from statistics import median

from bench.distributed import cost_text, memory_text
from bench.runs import BenchError, ProcessCost, Watched, watch
from foosim.runtime.process import script


@dataclass(frozen=True, slots=True)
class Realtime:
    """Lags are of every tick, in ms of the wall; `command_s` is the start of the command alone."""

    ticks: int
    lag_p50_ms: float
    lag_p99_ms: float
    lag_max_ms: float
    drift_ms: float
    command_s: float
    first_tick_s: float
    capture_mb: float
    processes: list[ProcessCost]


def realtime(seconds: float = 60.0) -> Realtime:
    """Run for some seconds."""
    command_s = _command_s()
    run = watch("realtime", seconds, ["tick=2 ms", "substeps=4"], every_s=min(1.0, seconds / 16))
    lag = run.result["lag_ms"]
    return Realtime(
        run.result["ticks"],
        lag["p50"],
        lag["p99"],
        lag["max"],
        round(_drift_ms(run), 2),
        round(command_s, 2),
        round(command_s + run.first_tick_s, 2),
        round(run.capture_mb, 1),
        run.costs(),
    )


def _command_s() -> float:
    begun_s = time.monotonic()
    subprocess.run([script(), "--version"], check=True, stdout=subprocess.DEVNULL)
    return time.monotonic() - begun_s


def _drift_ms(run: Watched) -> float:
    behind_s = [look.wall_s - look.ticks * run.tick_s for look in run.looks]
    quarter = len(behind_s) // 4
    if quarter == 0:
        raise BenchError("too short a run for a drift: fewer than four looks at it")
    return (median(behind_s[-quarter:]) - median(behind_s[:quarter])) * 1e3


def lines(row: Realtime) -> list[str]:
    """Return the figures for people."""
    return [
        f"lag p50 {row.lag_p50_ms:.2f}, p99 {row.lag_p99_ms:.2f} (to stay below 5), max {row.lag_max_ms:.2f} ms over "
        f"{row.ticks} ticks; drift {row.drift_ms:+.2f} ms",
        f"up to first tick {row.first_tick_s:.2f} s (to stay below 3), of it the command's start {row.command_s:.2f} s",
        f"us of processor a tick: {cost_text(row.processes)}",
        f"MB resident, start-end: {memory_text(row.processes)} (to stay below 200); capture {row.capture_mb:g} MB",
    ]

"""How long a run stands still when its vHub is killed: from kill -9 until the next commit, all that comes between.

A run in real time with both players and a capture; its vHub is killed twice (the launcher starts it again at once as
often), each time when the run has gone on for a while.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median
from typing import Final

from bench.machine import children
from bench.runs import BenchError, name_of, watch

KILLS: Final = 2
CALM_S: Final = 3.0
"""How long the run goes on between two kills, and before the first, in simulated time."""
LIMIT_MS: Final = 1000.0
VHUB: Final = "vhub"


@dataclass(frozen=True, slots=True)
class VhubLoss:
    """The outages in ms of the wall, in order."""

    outages_ms: list[float]
    median_ms: float
    max_ms: float


class Killer:
    """Kills the vHub whenever the run has gone on for a while, by simulated time.

    By wall time it would kill it before the first tick of a run that starts slowly, or once more before it is back.
    """

    def __init__(self, kill: Callable[[], None]) -> None:
        self._kill = kill
        self._left = KILLS
        self._next_s = CALM_S

    def __call__(self, simulated_s: float) -> None:
        if self._left and simulated_s >= self._next_s:
            self._left -= 1
            self._next_s = simulated_s + CALM_S
            self._kill()


def vhub_loss(seconds: float = 30.0) -> VhubLoss:
    """Kill it twice in each run of ten seconds, in as many runs as fit into the time."""
    outages: list[float] = []
    for _ in range(max(1, round(seconds / 10.0))):
        run = watch("realtime", 10.0, on_look=Killer(kill_vhub))
        told = [entry for entry in run.result["recoveries"] if entry["what"] == VHUB]
        if len(told) != KILLS:
            raise BenchError(f"the vHub was killed {KILLS} times, and the run tells of {len(told)}")
        outages += [entry["outage_ms"] for entry in told]
    return VhubLoss(outages, round(median(outages), 1), max(outages))


def kill_vhub() -> None:
    """Kill this process's vHub."""
    (pid,) = (pid for pid, command in children().items() if name_of(command) == VHUB)
    os.kill(pid, signal.SIGKILL)


def lines(found: VhubLoss) -> list[str]:
    """Return the figures for people."""
    each = " ".join(f"{outage:.0f}" for outage in found.outages_ms)
    return [
        f"outage: median {found.median_ms:.0f} ms, longest {found.max_ms:.0f} ms ({each}; to stay below {LIMIT_MS:.0f})"
    ]

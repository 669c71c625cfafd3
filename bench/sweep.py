"""A sweep of the table: its wall time in two processes against half of the sum of its runs' times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from bench.runs import ROOT
from foosim.simulation.study.study import study_of
from foosim.simulation.study.sweep import Progress, sweep
from foosim.simulation.workers import executor_here

RUNS: Final = 100
JOBS: Final = 2
DELAYS: Final = ("0ms", "5ms", "10ms", "20ms", "50ms")
SECONDS: Final = 4.0


@dataclass(frozen=True, slots=True)
class Swept:
    """Runs, their wall time in all, that of the sweep with the start of its processes, and the ratio to its share."""

    runs: int
    work_s: float
    elapsed_s: float
    of_share: float


def swept(seconds: float = SECONDS) -> Swept:
    """Run a hundred runs of some simulated seconds in two processes."""
    vary = {"network.links.0.delay": DELAYS}
    seeds = range(1, RUNS // len(DELAYS) + 1)
    study = study_of(ROOT / "deploy" / "table.yaml", f"{round(1e3 * seconds)}ms", vary, seeds)
    seen: list[Progress] = []
    with executor_here(JOBS) as executor:
        table = sweep(study, executor, progress=seen.append)
    failed = [row["message"] for row in table.rows if row["message"]]
    assert not failed, failed[0]
    last = seen[-1]
    return Swept(len(table.rows), last.wall_s, last.elapsed_s, last.elapsed_s / (last.wall_s / JOBS))


def lines(found: Swept) -> list[str]:
    """Return the figures for people."""
    return [
        f"{found.runs} runs in {JOBS} processes: {found.elapsed_s:.1f} s, the sum of the runs {found.work_s:.1f} s; "
        f"{found.of_share:.3f} of half of it"
    ]

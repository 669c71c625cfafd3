"""Sweeps: a deployment in a file over combinations of parameters and seeds."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from pathlib import Path

from foosim.common.errors import BadValue
from foosim.simulation.study.study import seeds_of, study_of
from foosim.simulation.study.sweep import LIMIT_S, Progress
from foosim.simulation.study.sweep import sweep as sweep_study
from foosim.simulation.study.table import Table
from foosim.simulation.workers import executor_here


def sweep(  # noqa: PLR0913  # options of a sweep, by keyword
    deployment: str | Path,
    duration: str,
    vary: Mapping[str, Sequence[object]],
    seeds: Sequence[int] | str = (1,),
    *,
    sets: Sequence[str] = (),
    out: str | Path | None = None,
    executor: Executor | None = None,
    jobs: int | None = None,
    limit_s: float = LIMIT_S,
    progress: Callable[[Progress], object] = lambda progress: None,
) -> Table:
    """Run a deployment for each combination of values and each seed, as `foosim sweep` does; return the table.

    `vary` has the values of each parameter, by its path as of `--set`; `duration` is the simulated time of each run
    (`"60s"`), `seeds` are numbers or `"1..20"`. `out` is a results file (.csv, .jsonl, .parquet): rows in it are not
    run again. `executor` is any of `concurrent.futures`, such as that of a Dask client; by default `jobs` processes of
    this machine, one for each processor. A run may take `limit_s` of wall time. `progress` is called after each run,
    with a `text` for people. `table["score.red"]` is a column as an array of numpy, `table.to_pandas()` a data frame; a
    run that failed has a `message` and no figures.

    Raises DeploymentError, AssetError, BadValue for bad values, OtherStudy for a file with results of another study.
    """
    if executor is not None and jobs is not None:
        raise BadValue("jobs: the workers are those of the executor", jobs)
    study = study_of(Path(deployment), duration, vary, seeds_of(seeds) if isinstance(seeds, str) else seeds, sets)
    processes = os.cpu_count() or 1 if jobs is None else jobs
    with executor_here(processes) if executor is None else nullcontext(executor) as its:
        return sweep_study(study, its, None if out is None else Path(out), limit_s, progress)

"""The command `foosim sweep`: runs over combinations of parameters and seeds, in several processes or on a cluster."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from foosim.cli.executor import DaskOption, JobsOption, executor_of
from foosim.cli.run_command import with_options
from foosim.common.errors import BadValue, read_at
from foosim.common.units import parse_ns
from foosim.runtime.command import DONE, FAILED, INTERRUPTED, new_app
from foosim.simulation.attendant import LINE_S
from foosim.simulation.study.study import Study, read_study, seeds_of, study_of, values_of
from foosim.simulation.study.sweep import LIMIT_S, Progress, sweep

app = new_app()


@dataclass(frozen=True, slots=True)
class SweepOptions:
    """The settings of a sweep; each field is an argument or option of the command."""

    file: Annotated[Path, typer.Argument(metavar="FILE", help="A deployment file, or a study file.")]
    vary: Annotated[
        tuple[str, ...],
        typer.Option(
            "--vary", metavar="PATH=VALUES", help="A parameter as of --set, and its values: 0ms,10ms or 1..5."
        ),
    ] = ()
    seeds: Annotated[str | None, typer.Option("--seeds", help="Seeds of each combination: 1..20 or 1,2,5.")] = None
    duration: Annotated[str | None, typer.Option("--for", help="Simulated time of each run, e.g. 60s.")] = None
    sets: Annotated[
        tuple[str, ...], typer.Option("--set", help="Change the deployment of all runs; may be repeated.")
    ] = ()
    out: Annotated[
        Path | None, typer.Option("--out", help="Results, .csv, .jsonl or .parquet; by default NAME-sweep.csv.")
    ] = None
    jobs: JobsOption = None
    dask: DaskOption = None
    limit: Annotated[str, typer.Option("--limit", metavar="TIME", help="Wall time that a run may take.")] = (
        f"{LIMIT_S:g}s"
    )


@app.command()
@with_options()
def sweep_command(options: SweepOptions) -> None:
    """Run a deployment for each combination of values and each seed, and write a table with a row for each run.

    Each run is a rehearsal. Its row has the values of its parameters, its seed, its metrics, packets and digest, and a
    message where it failed. A row that exists is not run again: the same command continues a sweep that was
    interrupted, one with more values or seeds extends it. Results of another study or version of foosim are refused.

    A run whose process is killed, or that takes longer than --limit, costs its row. With --dask the workers of a
    cluster do the runs (pip install 'foosim[dask]'); the deployment's folder has the same path there.
    `foosim sweep table` and `foosim sweep plot` show the results.

    Exit codes: 0 done, 1 a run has failed, 2 bad input, 3 results of another study, 130 Ctrl-C.
    """
    study = _study(options)
    out = options.out or Path(f"{options.file.stem}-sweep.csv")
    limit_s = read_at("--limit", parse_ns, options.limit) / 1e9
    so_far = _Progress()
    with executor_of(options.jobs, options.dask) as executor:
        try:
            sweep(study, executor, out, limit_s, so_far.take)
        except KeyboardInterrupt:
            typer.echo(f"interrupted, the same command continues the sweep: {so_far.last.text}", err=True)
            raise typer.Exit(INTERRUPTED) from None
    last = so_far.last
    typer.echo(f"{last.text}, in {out}: {last.ended} in {last.elapsed_s:.1f} s, {last.wall_s:.1f} s of work")
    raise typer.Exit(FAILED if last.failed else DONE)


class _Progress:
    """Writes a line of progress a second."""

    def __init__(self) -> None:
        self.last = Progress(0, 0, time.monotonic())
        self._line_s = self.last.begun_s + LINE_S

    def take(self, progress: Progress) -> None:
        self.last = progress
        if time.monotonic() >= self._line_s:
            self._line_s = time.monotonic() + LINE_S
            typer.echo(progress.text, err=True)


def _study(options: SweepOptions) -> Study:
    """Return the study of the options, which go before those of a study file. Raises Refused."""
    known, file, sets = read_study(options.file), options.file, options.sets
    vary: dict[str, list[object]] = {}
    duration, seeds = options.duration, options.seeds
    if known is not None:
        file, sets, vary = file.parent / known.deployment, (*known.sets, *sets), {**known.vary}
        duration = known.duration if duration is None else duration
        seeds = str(known.seeds) if seeds is None else seeds
    if duration is None:
        raise BadValue("--for is missing: the simulated time of each run, e.g. --for 60s")
    given: set[str] = set()
    for one in options.vary:
        path, equals, values = one.partition("=")
        if not equals:
            raise BadValue("--vary: not of the form PATH=VALUE,VALUE", one)
        if path in given:
            raise BadValue("--vary: the parameter is there twice", path)
        given.add(path)
        vary[path] = [*read_at(f"--vary: {path}", values_of, values)]
    return study_of(file, duration, vary, read_at("--seeds", seeds_of, "1" if seeds is None else seeds), sets)

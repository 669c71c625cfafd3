"""A sweep: the runs of a study by any `concurrent.futures.Executor`, and the table of their results.

Each run is done in a child process of the worker that has it (`workers.apart`). A results file that exists is extended:
its rows are not run again. It is written again as runs end, at most once a second, and when the sweep ends.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Mapping
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, as_completed
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeVar

from foosim.capture.new_file import check_writable
from foosim.common.errors import BadValue, Refused
from foosim.simulation.study.run import OtherVersion, Ran, Run, ran
from foosim.simulation.study.study import SEED, Study
from foosim.simulation.study.table import Row, Table, check_results, read_table, write_table
from foosim.simulation.workers import apart

Key = TypeVar("Key")

WRITE_S: Final = 1.0
LIMIT_S: Final = 3600.0
LIMIT_S_MAX: Final = 1_800_000.0
"""500 hours: milliseconds of a wait are a C int."""


@dataclass(slots=True)
class Progress:
    """How far a sweep is: runs of the study, rows that the results had before, runs that ended since `begun_s` and
    their wall time in all, failed runs of both."""

    runs: int
    known: int
    begun_s: float
    ended: int = 0
    failed: int = 0
    wall_s: float = 0.0

    @property
    def elapsed_s(self) -> float:
        """Wall time since the start."""
        return time.monotonic() - self.begun_s

    @property
    def text(self) -> str:
        """`12 of 120 runs, 1 failed, 3:20 min left`."""
        done = self.known + self.ended
        failed = f", {self.failed} failed" if self.failed else ""
        if not self.ended or done == self.runs:
            return f"{done} of {self.runs} runs{failed}"
        left_s = self.elapsed_s / self.ended * (self.runs - done)
        return f"{done} of {self.runs} runs{failed}, {left_s // 60:.0f}:{left_s % 60:02.0f} min left"


class OtherStudy(Refused):
    """A results file is of another study, or of another version of foosim."""


class Results:
    """The rows of a study, those of a results file first."""

    def __init__(self, study: Study, path: Path | None) -> None:
        """Raises BadValue, Failed and OtherStudy for a file that cannot have the results."""
        self.table, self._path, self._written_s = Table(study.parameters), path, 0.0
        self._identity = {"study": study.identity(), "foosim": study.version}
        if path is not None:
            check_results(path)
            check_writable(path)
            if path.exists():
                self._take(path, read_table(path))
        self.runs = {(*values, seed): study.run(values, seed) for values in study.combinations for seed in study.seeds}
        known = {self.table.key(row) for row in self.table.rows}
        self.missing = {key: run for key, run in self.runs.items() if key not in known}

    def _take(self, path: Path, table: Table) -> None:
        if {*table.parameters} != {*self.table.parameters}:
            raise OtherStudy(
                f"{path}: results of another study: its parameters are {', '.join(table.parameters) or 'none'}"
            )
        for number, row in enumerate(table.rows, 1):
            for name, own in self._identity.items():
                if row[name] != own:
                    what = "another study" if name == "study" else "another version of foosim"
                    raise OtherStudy(f"{path}: row {number} is of {what}, {row[name]}; this is {own}")
        self.table.rows = table.rows

    def add(self, key: tuple[Any, ...], outcome: Ran) -> None:
        """Add a row, and write the table when it is due."""
        texts = {"digest": "", "message": outcome.message, **self._identity}
        row: Row = {**dict(zip((*self.table.parameters, SEED), key, strict=True)), **texts, **outcome.figures}
        self.table.rows.append(row)
        now_s = time.monotonic()
        if now_s >= self._written_s:
            self.write()
            self._written_s = now_s + max(WRITE_S, 20 * (time.monotonic() - now_s))

    def write(self) -> None:
        """Write the table in the order of the study; rows of other values come last. Raises Failed."""
        order = {key: number for number, key in enumerate(self.runs)}
        self.table.rows.sort(key=lambda row: order.get(self.table.key(row), len(order)))
        if self._path is not None and self.table.rows:
            write_table(self._path, self.table)


def sweep(
    study: Study,
    executor: Executor,
    out: Path | None = None,
    limit_s: float = LIMIT_S,
    progress: Callable[[Progress], object] = lambda progress: None,
) -> Table:
    """Run what is missing of a study, each run within a limit of wall time, and return its table.

    A run that fails, hangs, or whose process dies has a row with a message. `progress` is called at the start and after
    each run. Raises BadValue, Failed and OtherStudy for a results file, before anything is run; OtherVersion for a
    worker with another version of foosim, BrokenExecutor for an executor that ends. What has run is in the file then,
    and after Ctrl-C.
    """
    if not 0.0 < limit_s <= LIMIT_S_MAX:
        raise BadValue(f"the wall time of a run is limited to more than 0 s, at most {LIMIT_S_MAX:g} s", limit_s)
    results = Results(study, out)
    failed = sum(bool(row["message"]) for row in results.table.rows)
    so_far = Progress(len(results.runs), len(results.runs) - len(results.missing), time.monotonic(), failed=failed)
    progress(so_far)
    try:
        with closing(outcomes(results.missing, executor, limit_s)) as found:
            for key, outcome in found:
                results.add(key, outcome)
                so_far.ended, so_far.failed = so_far.ended + 1, so_far.failed + bool(outcome.message)
                so_far.wall_s += outcome.wall_s
                progress(so_far)
    finally:
        results.write()
    return results.table


def outcomes(runs: Mapping[Key, Run], executor: Executor, limit_s: float) -> Generator[tuple[Key, Ran], None, None]:
    """Do runs, and yield what becomes of each as it ends. It raises as `sweep` does."""
    keys: dict[Future[Ran], Key] = {}
    try:
        for key, run in runs.items():
            keys[executor.submit(apart, ran, run, limit_s)] = key
        for done in as_completed(keys):
            yield keys.pop(done), _outcome(done)  # Dask would compute a result that is kept again, if its worker died
    finally:
        for future in keys:
            future.cancel()


def _outcome(done: Future[Ran]) -> Ran:
    """Return what became of a run; what its worker died of is its message. Raises OtherVersion, BrokenExecutor."""
    try:
        return done.result()
    except (OtherVersion, BrokenExecutor):
        raise
    except CancelledError:  # by its executor: the sweep cancels what it no longer waits for
        raise BrokenExecutor("runs were cancelled, as by a scheduler that has ended") from None
    except (ImportError, AttributeError) as error:
        raise OtherVersion(f"a worker lacks foosim or a part of it: {error}") from error
    except Exception as error:  # noqa: BLE001  # of any executor: a process was killed, a worker lost
        return Ran({}, str(error) or type(error).__name__)

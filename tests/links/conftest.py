"""The fixture of the statistical tests, and the table that `make stats` writes of what they measured."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Final

import msgspec
import pytest

from bench import lateness
from bench.machine import Machine, this_machine
from tests.links import throughput
from tests.links.proof import Proof, Row

ROWS: Final = "links"
"""Under this name a test's report has its rows, from whichever process it ran in."""
HEAD: Final = """\
# How the network was validated

`make stats` wrote this table (seed {seed}): every statistical test of `tests/links/`, at full size, on a seed that it
draws and prints; `make stats SEED={seed}` repeats it. One assertion fails by chance once in a million. `make test` has
the same tests with fixed seeds and smaller samples.

It ran on: {cpu}, {cores} cores, Python {python}, hot path {compiled}, load {load:.2f} over the minute before it began.

What the formulas of the radio give (T18, T19, T20, T28, and of T16 all but the stations *on their links* and *in a
hub*) is computed by the functions that links call. All else runs the real pipeline, from a deployment's text to a
packet's fate. Both are in simulated time, which no machine changes. T26 and the rate *by the wall clock* of T13 are
measured on real processes: these figures are this machine's, at its load of {wall_load:.2f} when they were begun.

What is compared is in the column *what*, with *n* the packets (or episodes, or cases) of which the figure is made. A
test that cannot be made on this machine has a row that says why.

| test | what | statistic | measured | accepted | n | verdict |
|---|---|---|---|---|---|---|
"""


@pytest.fixture
def proof(request: pytest.FixtureRequest) -> Iterator[Proof]:
    """The seed and the sizes of this run, and the rows of this test."""
    found = Proof(request.config.getoption("--links-seed"), request.config.getoption("--links-full"))
    yield found
    request.node.user_properties.append((ROWS, found.rows))


class Table:
    """Takes the rows of all tests and writes them when the session ends."""

    def __init__(self, path: Path, seed: int) -> None:
        self._path, self._seed = path, seed
        self._rows: dict[str, list[Row]] = {}
        self._machine = this_machine()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        for name, rows in report.user_properties:
            if name == ROWS and report.when == "teardown":
                self._rows[report.nodeid] = msgspec.convert(rows, list[Row])  # as it came from another process

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Write the file; measure what has to do with the wall clock, when all else is over; write it with that."""
        proof, then = Proof(self._seed, is_full=True), this_machine()
        self._write(then)
        for measure in (_lateness, _throughput):
            for row in measure(proof):
                try:
                    row()
                except AssertionError as error:
                    print(f"\n{error}")
                    session.exitstatus = pytest.ExitCode.TESTS_FAILED
        self._rows["wall clock"] = proof.rows
        self._write(then)

    def _write(self, then: Machine) -> None:
        """Write the rows that there are; `then` is the machine when those by the wall clock are measured."""
        rows = sorted(((int(row[0][1:]), row) for rows in self._rows.values() for row in rows), key=lambda of: of[:2])
        here = self._machine
        head = HEAD.format(
            seed=self._seed,
            cpu=here.cpu,
            cores=here.cores,
            python=here.python,
            compiled="compiled" if here.is_compiled else "interpreted",
            load=here.load,
            wall_load=then.load,
        )
        lines = [f"| {' | '.join(texts)} | {n:,} | {verdict} |" for _, (*texts, n, verdict) in rows]
        self._path.write_text(head + "\n".join(lines) + "\n")


def _lateness(proof: Proof) -> Iterator[Callable[[], None]]:
    late = lateness.lateness()
    for share, measured, limit in ((50, late.p50_ms, lateness.P50_MS), (99, late.p99_ms, lateness.P99_MS)):
        what = f"release less arrival at {lateness.RATE_HZ} packets/s: {share} % quantile in ms, to be below {limit:g}"
        yield partial(proof.below, "T26", what, measured, 3 * limit, late.packets)


def _throughput(proof: Proof) -> Iterator[Callable[[], None]]:
    found, expected = throughput.throughput(), throughput.RATE_BPS
    for which, bps in (("mean", found.mean_bps), ("least", found.least_bps), ("greatest", found.most_bps)):
        what = f"rate of saturated links by the wall clock, bit/s: {which} of nine"
        yield partial(proof.ratio, "T13", what, bps, expected, throughput.WITHIN, found.packets)


def pytest_configure(config: pytest.Config) -> None:
    path = config.getoption("--links-table", None)
    if path and not hasattr(config, "workerinput"):
        config.pluginmanager.register(Table(Path(path), config.getoption("--links-seed")), "links-table")

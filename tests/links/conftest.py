"""The fixture of the statistical tests, and the table that `make stats` writes of what they measured."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest

from bench import lateness
from bench.machine import this_machine
from tests.links.proof import Proof, Row

ROWS: Final = "links"
"""Under this name a test's report has its rows, from whichever process it ran in."""
HEAD: Final = """\
# How the network was validated

`make stats` wrote this table (seed {seed}; {cpu}, {cores} cores, Python {python}): every statistical test of
`tests/links/`, at full size, on a seed that it draws and prints; `make stats SEED={seed}` repeats it. One assertion
fails by chance once in a million. `make test` has the same tests with fixed seeds and smaller samples.

All of it runs the real pipeline, from a deployment's text to a packet's fate, in simulated time. What is compared is
in the column *what*, with *n* the packets (or episodes, or cases) of which the figure is made.

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

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        for name, rows in report.user_properties:
            if name == ROWS and report.when == "teardown":
                self._rows[report.nodeid] = [tuple(row) for row in rows]  # type: ignore[misc]  # from another process

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Measure what has to do with the wall clock, when all else is over; write the file."""
        proof = Proof(self._seed, is_full=True)
        late = lateness.lateness()
        for share, measured, limit in ((50, late.p50_ms, lateness.P50_MS), (99, late.p99_ms, lateness.P99_MS)):
            what = f"release less arrival at {lateness.RATE_HZ} packets/s: {share} % quantile in ms, to be below {limit:g}"
            try:
                proof.below("T26", what, measured, 3 * limit, late.packets)
            except AssertionError as error:
                print(f"\n{error}")
                session.exitstatus = pytest.ExitCode.TESTS_FAILED
        self._rows["lateness"] = proof.rows
        rows = sorted(((int(row[0][1:]), row) for rows in self._rows.values() for row in rows), key=lambda of: of[:2])
        here = this_machine()
        lines = [
            f"| {test} | {what} | {statistic} | {measured} | {accepted} | {n:,} | {'holds' if holds else '**fails**'} |"
            for _, (test, what, statistic, measured, accepted, n, holds) in rows
        ]
        head = HEAD.format(seed=self._seed, cpu=here.cpu, cores=here.cores, python=here.python)
        self._path.write_text(head + "\n".join(lines) + "\n")


def pytest_configure(config: pytest.Config) -> None:
    path = config.getoption("--links-table", None)
    if path and not hasattr(config, "workerinput"):
        config.pluginmanager.register(Table(Path(path), config.getoption("--links-seed")), "links-table")

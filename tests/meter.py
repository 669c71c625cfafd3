"""What the tests cost in processor time, and another load while they run: a plugin of pytest, registered by `conftest`.

Wall time says little on a machine that others use as well. Of each test it is measured what its worker used, and what
processes did that it waited for; the sum of all is that of pytest, its workers, and whatever these waited for.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections import defaultdict
from collections.abc import Generator
from pathlib import Path
from typing import Final

import pytest

SPENT: Final = "processor_s"
SPIN: Final = "while True: pass"
SLOWED: Final = Path(__file__).parent / "slowed"
"""What the Pythons that tests start read first, when their start is to be slow."""


def processor_s() -> float:
    """Return the processor time of this process and of those that it has waited for."""
    return sum(os.times()[:4])


TOGETHER: Final = ("tests/vhub/", "tests/wire/")
"""Folders whose files share runs, and tests/wire, whose runs would starve one another of cores."""
SECONDS: Final = Path(__file__).parent / "seconds.json"
"""The wall time of the scopes that take the longest, as `make test ARGS=--record-seconds` measures it."""
LISTED_S: Final = 3.0


def scope_of(nodeid: str) -> str:
    """Return which tests share a worker with this one: those of its file, which compute once what they share."""
    return next((place for place in TOGETHER if nodeid.startswith(place)), nodeid.partition("::")[0])


def measured_seconds() -> dict[str, float]:
    """Return the recorded wall time by scope."""
    return {**json.loads(SECONDS.read_text())}


def folder_of(nodeid: str) -> str:
    """Return what a test counts to: its folder in tests/, or its file if it stands in none."""
    return "/".join(nodeid.partition("::")[0].split("/")[:2])


class Meter:
    """Measures each test where it runs, and tells the sums where the output is."""

    def __init__(self, *, records: bool) -> None:
        self._begun_s = 0.0
        self._records = records
        self._wall_s: dict[str, float] = defaultdict(float)
        self._by_folder: dict[str, float] = defaultdict(float)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_logstart(self) -> None:
        self._begun_s = processor_s()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(
        self, call: pytest.CallInfo[None]
    ) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        report = yield
        if call.when == "teardown":
            report.user_properties.append((SPENT, processor_s() - self._begun_s))
        return report

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self._wall_s[scope_of(report.nodeid)] += report.duration
        if report.when == "teardown":
            spent_s = dict(report.user_properties)[SPENT]
            assert isinstance(spent_s, float)
            self._by_folder[folder_of(report.nodeid)] += spent_s

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        if self._records and not hasattr(session.config, "workerinput"):
            longest = sorted(self._wall_s.items(), key=lambda item: -item[1])
            listed = {scope: round(wall_s) for scope, wall_s in longest if wall_s >= LISTED_S}
            SECONDS.write_text(f"{json.dumps(listed, indent=2)}\n")

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        terminalreporter.section("processor time")
        for folder, spent_s in sorted(self._by_folder.items(), key=lambda item: -item[1]):
            terminalreporter.write_line(f"{spent_s:8.1f} s  {folder}")
        used = os.times()
        user_s, system_s = used.user + used.children_user, used.system + used.children_system
        terminalreporter.write_line(
            f"{user_s + system_s:8.1f} s  in all, user {user_s:.1f} s and system {system_s:.1f} s: tests, collecting"
            " them, and the start of pytest and its workers"
        )


class Burden:
    """Makes the machine a slow one while tests run: processes that only keep cores busy, starts that take longer."""

    def __init__(self, config: pytest.Config) -> None:
        self._load = int(config.getoption("--load"))
        self._slow_start_s = str(config.getoption("--slow-start"))
        self._is_worker = hasattr(config, "workerinput")
        self._runs_tests = self._is_worker or not config.getoption("numprocesses", None)
        self._processes: list[subprocess.Popen[bytes]] = []

    def pytest_sessionstart(self) -> None:
        if self._runs_tests and float(self._slow_start_s):
            os.environ["FOOSIM_TEST_SLOW_START_S"] = self._slow_start_s
            os.environ["PYTHONPATH"] = str(SLOWED)
        if not self._is_worker:
            self._processes = [subprocess.Popen([sys.executable, "-I", "-c", SPIN]) for _ in range(self._load)]

    def pytest_sessionfinish(self) -> None:
        for process in self._processes:
            process.kill()
            process.wait()

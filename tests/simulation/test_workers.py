"""Work in child processes: the order of results, what one that dies or hangs costs, and whom the end of a pool ends."""

from __future__ import annotations

import os
import signal
from contextlib import closing
from math import sqrt
from pathlib import Path
from time import sleep

import pytest

from foosim.common.errors import Failed
from foosim.simulation.workers import Lost, apart, executor_here, in_processes


def children() -> set[int]:
    """Return the processes that threads of this one have started."""
    tasks = Path("/proc/self/task").iterdir()
    return {int(pid) for task in tasks for pid in (task / "children").read_text().split()}


@pytest.mark.parametrize("jobs", [1, 2])
def test_results_come_in_order_errors_come_out_and_nobody_is_left(jobs: int) -> None:
    before = children()
    with closing(in_processes(sqrt, [9.0, 4.0, 1.0, -1.0], jobs, "the test")) as results:
        assert [next(results) for _ in range(3)] == [3.0, 2.0, 1.0]
        with pytest.raises(ValueError, match="math domain error"):
            next(results)
    assert children() == before


def test_a_child_that_dies_or_hangs_costs_its_work_only() -> None:
    before = children()
    with executor_here(2) as pool:
        hangs, ends = pool.submit(apart, sleep, 600.0, 0.2), pool.submit(apart, os._exit, 3)
        killed = pool.submit(apart, signal.raise_signal, signal.SIGKILL)
        assert pool.submit(apart, sqrt, 9.0).result() == 3.0
        assert str(hangs.exception()) == "not done after 0.2 s of wall time, its process was killed"
        assert str(ends.exception()) == "its process ended with exit code 3"
        assert str(killed.exception()) == "its process was killed by SIGKILL"
        assert isinstance(killed.exception(), Lost)
    assert children() == before


def test_the_end_of_a_pool_ends_work_and_a_killed_process_of_many_is_named() -> None:
    before = children()
    results = in_processes(sleep, [0.0, *[600.0] * 8], 2, "the test")
    next(results)
    results.close()
    assert children() == before
    with pytest.raises(Failed, match="a process of the test was killed; fewer than --jobs 2 need less memory"):
        list(in_processes(os._exit, [3, 3], 2, "the test"))
    assert children() == before

"""Work in child processes: the order of results, what one that dies or hangs costs, and whom the end of a pool ends."""

from __future__ import annotations

import os
import signal
from math import sqrt
from pathlib import Path
from select import select
from time import sleep

from foosim.simulation.workers import Lost, apart, executor_here


def children() -> set[int]:
    """Return the processes that threads of this one have started."""
    tasks = Path("/proc/self/task").iterdir()
    return {int(pid) for task in tasks for pid in (task / "children").read_text().split()}


def test_results_and_errors_come_out_and_the_child_is_used_again() -> None:
    before = children()
    with executor_here(1) as pool:
        first, second = pool.submit(apart, getpid, None), pool.submit(apart, getpid, None)
        bad = pool.submit(apart, sqrt, -1.0).exception()
        assert first.result() == second.result() != os.getpid()
        assert isinstance(bad, ValueError) and "in serve" in bad.__notes__[0]
    assert children() == before


def getpid(_: None) -> int:
    return os.getpid()


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


def test_what_work_forks_neither_answers_nor_outlives_the_child() -> None:
    with executor_here(1) as pool:
        pool.submit(apart, forks, 0.0).result()
        assert pool.submit(apart, sqrt, 9.0).result() == 3.0
        there = os.pidfd_open(pool.submit(apart, forks, 600.0).result())
        died = pool.submit(apart, forks_and_exits, 600.0, 10.0)
        assert str(died.exception()) == "its process ended with exit code 3"
    assert select([there], [], [], 10.0)[0]


def forks(time_s: float) -> int:
    """Return the process of a fork that sleeps, and then returns as well."""
    if pid := os.fork():
        return pid
    sleep(time_s)
    return 0


def forks_and_exits(time_s: float) -> None:
    if forks(time_s):
        os._exit(3)


def test_the_end_of_a_pool_ends_work_that_runs() -> None:
    before = children()
    with executor_here(2) as pool:
        futures = [pool.submit(apart, sleep, time_s) for time_s in (0.0, *[600.0] * 8)]
        futures[0].result()
    assert children() == before
    assert all(isinstance(future.exception(), Lost) for future in futures[1:] if not future.cancelled())

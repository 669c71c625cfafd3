"""Work in several processes: the order of results, and whom it ends."""

from __future__ import annotations

from contextlib import closing
from math import sqrt
from multiprocessing import active_children, get_context
from time import sleep

import pytest

from foosim.common.errors import Failed
from foosim.simulation.workers import in_processes


def test_workers_end_with_their_iterator_and_other_processes_of_the_caller_live_on() -> None:
    stranger = get_context("spawn").Process(target=sleep, args=(600.0,))
    stranger.start()
    before = {*active_children()}
    try:
        with closing(in_processes(sqrt, [9.0, 4.0, 1.0], 2, "the test")) as results:
            assert next(results) == 3.0 and len({*active_children()} - before) == 2
            assert [*results] == [2.0, 1.0]
        assert {*active_children()} == before and stranger.is_alive()
    finally:
        stranger.kill()
        stranger.join()


@pytest.mark.parametrize("jobs", [1, 2])
def test_what_work_raises_comes_out_and_nobody_is_left(jobs: int) -> None:
    before = {*active_children()}
    with pytest.raises(ValueError, match="math domain error"):
        list(in_processes(sqrt, [1.0, -1.0, 4.0], jobs, "the test"))
    assert {*active_children()} == before


def test_a_worker_that_was_killed_is_named_and_nobody_is_left() -> None:
    before = {*active_children()}
    results = in_processes(sleep, [0.0, *[600.0] * 8], 2, "the test")
    next(results)
    ({*active_children()} - before).pop().kill()
    with pytest.raises(Failed, match="a process of the test was killed; fewer than --jobs 2 need less memory"):
        next(results)
    assert {*active_children()} == before

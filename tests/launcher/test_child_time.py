"""The clock of a child, on observations such as real processes give, and what reads them."""

from __future__ import annotations

import os
import random
import subprocess
import sys
import time
from typing import Final

import pytest

from foosim.launcher.children.child_time import WARNED_EVERY_S, WINDOW_S, ChildTime, ChildTimes, Observed, observe

STARVED: Final = (
    *((0.0, 0.02), (0.2, 0.03), (0.4, 0.04), (0.6, 0.04), (0.8, 0.05), (1.0, 0.06), (1.2, 0.07), (1.4, 0.08)),
    *((1.6, 0.08), (1.8, 0.09)),
)
"""Such as of a busy loop under a quota of 4 % of a core: time, and processor time, in s."""
BUSY: Final = ((0.0, 1.31), (1.0, 2.30), (2.0, 3.30), (3.0, 4.29), (4.0, 5.28))
"""The same loop with a core of its own: not recorded, each second has the processor time of about a second."""


def passed(*looks: tuple[float, Observed | None]) -> float:
    """Return the time by the clock of a process between its first observation and its last."""
    (first_s, first), *others = looks
    clock = ChildTime(first_s, first)
    for now_s, observed in others:
        clock.look(now_s, observed)
    return clock.time_s(looks[-1][0]) - first_s


def test_of_a_process_that_waits_for_a_processor_only_what_it_receives_counts() -> None:
    looks = [(now_s, Observed(True, processor_s)) for now_s, processor_s in STARVED]
    assert passed(*looks) == pytest.approx(STARVED[-1][1] - STARVED[0][1])


def test_all_of_a_busy_loop_counts() -> None:
    looks = [(now_s, Observed(True, processor_s)) for now_s, processor_s in BUSY]
    assert passed(*looks) == pytest.approx(4.0, rel=0.02)


def test_all_of_a_sleep_counts_and_all_of_what_cannot_be_observed() -> None:
    assert passed(*((float(second), Observed(False, 0.5)) for second in range(6))) == 5.0
    assert passed((0.0, None), (5.0, None)) == passed((0.0, None), (5.0, Observed(True, 0.0))) == 5.0


def test_a_clock_never_runs_back_nor_faster_than_its_launchers() -> None:
    draw = random.Random(1)
    now_s = processor_s = 0.0
    clock = ChildTime(0.0, Observed(True, 0.0))
    before_s = clock.time_s(0.0)
    for _ in range(2_000):
        step_s = draw.random()
        now_s, processor_s = now_s + step_s, processor_s + draw.random() * 2 * step_s  # of several threads
        clock.look(now_s, draw.choice([None, Observed(draw.random() < 0.5, processor_s)]))
        assert before_s - 1e-9 <= clock.time_s(now_s) <= before_s + step_s + 1e-9
        before_s = clock.time_s(now_s)


def test_a_starved_process_is_reported_and_no_longer_when_it_has_a_processor_again() -> None:
    shares = iter([0.0, 0.04, 0.04, 0.9, 0.9])
    received_s = 0.0

    def look(pid: int) -> Observed:
        nonlocal received_s
        received_s += next(shares) * WINDOW_S
        return Observed(True, received_s)

    times = ChildTimes(look)
    reported = []
    for window in range(5):
        times.at(7, window * WINDOW_S)
        reported.append(times.warning({"red": 7, "blue": 8}, window * WINDOW_S))
    warning = "this machine is starved of processor time: red received 0.2 s of processor time in 5 s"
    assert reported == ["", f"{warning}; their deadlines are extended", "", "", ""], "not again so soon"
    assert times.at(7, 4 * WINDOW_S + 0.1) == pytest.approx(0.1 + 1.88 * WINDOW_S), "not observed again so soon"
    assert times.warning({"red": 7}, WINDOW_S + WARNED_EVERY_S) == "", "it has a processor again"


def test_what_the_system_reports_of_a_process() -> None:
    """Of this one, which runs, of one that sleeps, and of one that has ended."""
    own = observe(os.getpid())
    assert own is not None and own.is_runnable
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as child:
        while True:  # until it waits for its input
            of_child = observe(child.pid)
            assert of_child is not None
            if not of_child.is_runnable and of_child.processor_s > 0:
                break
            time.sleep(0.005)
        child.communicate(b"\n")
    assert observe(child.pid) is None

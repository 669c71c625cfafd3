"""The clock of a child, on what the system reports of processes."""

from __future__ import annotations

import os
import random

import pytest

from foosim.launcher.liveness import OBSERVED_EVERY_S, STARVED_S, WARNED_EVERY_S, ChildTimes, waited_s


def passed(*looks: tuple[float, float | None]) -> float:
    """Return the time by the clock of a process between its first observation and its last: (time, time waited)."""
    observed = iter([waited for _, waited in looks])
    times = ChildTimes(lambda pid: next(observed))
    begun_s, *_, ended_s = [times.at(7, now_s) for now_s, _ in looks]
    return ended_s - begun_s


def test_time_without_a_processor_does_not_count_and_all_other_time_does() -> None:
    assert passed((0.0, 1.0), (1.0, 1.96), (2.0, 2.9)) == pytest.approx(0.1), "4 % and 6 % of a core"
    assert passed((0.0, 1.0), (1.0, 1.0), (2.0, 1.0)) == 2.0, "a busy loop, or a sleep"
    assert passed((0.0, None), (5.0, None), (6.0, 9.0)) == 6.0, "what cannot be observed"


def test_a_clock_never_runs_back_nor_faster_than_its_launchers() -> None:
    draw = random.Random(1)
    now_s, before_s = 0.0, 0.0
    times = ChildTimes(lambda pid: draw.choice([None, 5.0 * draw.random() * now_s]))
    for _ in range(2_000):
        step_s = OBSERVED_EVERY_S + draw.random()
        now_s += step_s
        time_s = times.at(7, now_s)
        assert before_s - 1e-9 <= time_s <= before_s + step_s + 1e-9
        before_s = time_s


def test_a_starved_process_is_reported_and_no_longer_when_it_has_a_processor_again() -> None:
    shares = iter([0.0, 0.96, 0.96, 0.1, 0.1])
    total_s = 0.0

    def look(pid: int) -> float:
        nonlocal total_s
        total_s += next(shares) * STARVED_S
        return total_s

    times = ChildTimes(look)
    reported = []
    for window in range(5):
        times.at(7, window * STARVED_S)
        reported.append(times.warning({"red": 7, "blue": 8}, window * STARVED_S))
    warning = "this machine is starved of processor time: red received 0.2 s of processor time in 5 s"
    assert reported == ["", f"{warning}; their deadlines are extended", "", "", ""], "not again so soon"
    assert times.at(7, 4 * STARVED_S + OBSERVED_EVERY_S / 2) == pytest.approx(OBSERVED_EVERY_S / 2 + 1.88 * STARVED_S)
    assert times.warning({"red": 7}, STARVED_S + WARNED_EVERY_S) == "", "it has a processor again"


def test_what_the_system_reports_of_a_process() -> None:
    before_s, after_s = waited_s(os.getpid()), waited_s(os.getpid())
    assert before_s is not None and after_s is not None and 0.0 <= before_s <= after_s
    assert waited_s(2**30) is None

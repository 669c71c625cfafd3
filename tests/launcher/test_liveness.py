"""Which processes a launcher kills because they hang: in virtual time, without a process."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import pytest

from foosim.deployment.loader import load_deployment
from foosim.launcher.liveness import (
    CUT_OFF_S,
    LOOK_S_MAX,
    QUESTION_S,
    STALLED_S,
    UNANSWERED_MAX,
    OwnTime,
    StalledWatch,
    SupervisorWatch,
)

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
DEADLINES: Final = load_deployment(TABLE.read_text(), TABLE.name).deadlines
START_S: Final = DEADLINES.start_ns / 1e9


def test_questions_count_only_once_the_supervisor_has_said_where_it_listens() -> None:
    watch = SupervisorWatch(DEADLINES)
    watch.started(100.0)
    for second in range(1, int(START_S)):
        watch.unanswered(QUESTION_S)
        assert watch.why_killed(100.0 + second) == ""
    watch.is_found = True
    for _ in range(UNANSWERED_MAX - 1):
        watch.unanswered(QUESTION_S)
    assert watch.why_killed(100.0 + 10 * START_S) == ""
    watch.unanswered(QUESTION_S)
    assert watch.why_killed(100.0 + 10 * START_S) == "it had not answered for 5 s"


def test_an_answer_begins_the_count_anew() -> None:
    watch = SupervisorWatch(DEADLINES)
    watch.started(0.0)
    watch.is_found = True
    for _ in range(20):
        for _ in range(UNANSWERED_MAX - 1):
            watch.unanswered(QUESTION_S)
        watch.answered()
    assert watch.why_killed(1e6) == ""


def test_a_supervisor_that_never_listens_has_the_time_of_a_start() -> None:
    watch = SupervisorWatch(DEADLINES)
    for started_s in (0.0, 1000.0):
        watch.started(started_s)
        assert watch.why_killed(started_s + START_S - 0.1) == ""
        said = "it had not published its address within 60 s (deadlines.start)"
        assert watch.why_killed(started_s + START_S) == said


def status(begun: bool = True, reason: str = "no heartbeat for 1 s", **lost: bool) -> dict[str, Any]:
    recoveries = [{"what": "node", "name": name, "reason": reason} for name in lost]
    processes = {name: {"lost": is_lost} for name, is_lost in lost.items()}
    return {"begun": begun, "processes": processes, "recoveries": recoveries}


def look(
    watch: StalledWatch, status: dict[str, Any], pids: dict[str, int], away: set[str], now_s: float
) -> dict[str, str]:
    """Look at processes whose clocks have the launcher's time."""
    return watch.look(status, pids, away, dict.fromkeys(pids, now_s))


def watching(**pids: int) -> StalledWatch:
    """A watch that has seen these processes take part."""
    watch = StalledWatch(DEADLINES)
    for now_s in (-2.0, -1.0):
        assert look(watch, status(True, "", **dict.fromkeys(pids, False)), pids, set(), now_s) == {}
    return watch


def test_a_process_that_the_run_has_lost_is_killed_when_it_does_not_come_back() -> None:
    watch, pids = watching(red=1, blue=2), {"red": 1, "blue": 2}
    for now_s in (10.0, 10.0 + STALLED_S - 0.1):
        assert look(watch, status(red=True, blue=False), pids, set(), now_s) == {}
    why = "the run had lost it (no heartbeat for 1 s), and it did not come back within 1 s"
    assert look(watch, status(red=True, blue=False), pids, set(), 10.0 + STALLED_S) == {"red": why}


def test_one_that_comes_back_is_not() -> None:
    watch = watching(red=1)
    for now_s in range(20):
        assert look(watch, status(red=now_s % 2 == 0), {"red": 1}, set(), now_s / 1.9) == {}


def test_nobody_is_killed_before_the_run_has_begun() -> None:
    watch = watching(red=1)
    for now_s in range(0, 100, 5):
        assert look(watch, status(begun=False, red=True), {"red": 1}, set(), now_s) == {}


@pytest.mark.parametrize("looks", ["lost, other", "other", "other, not lost yet"])
def test_one_that_was_started_since_has_the_time_of_a_start(looks: str) -> None:
    """Also when the launcher looks only then, or is told of the one before it."""
    watch = watching(red=1)
    if looks == "lost, other":
        assert look(watch, status(red=True), {"red": 1}, set(), 0.0) == {}
    elif looks == "other, not lost yet":
        assert look(watch, status(red=False), {"red": 2}, set(), 0.0) == {}
    for now_s in (1.0, 5.0, START_S):
        assert look(watch, status(red=True), {"red": 2}, set(), now_s) == {}
    assert look(watch, status(red=True), {"red": 2}, set(), 1.0 + START_S).keys() == {"red"}


def test_one_on_another_machine_may_only_be_cut_off() -> None:
    watch = watching(red=1)
    for now_s in (0.0, CUT_OFF_S - 0.1):
        assert look(watch, status(red=True), {"red": 1}, {"red"}, now_s) == {}
    assert look(watch, status(red=True), {"red": 1}, {"red"}, CUT_OFF_S).keys() == {"red"}


def test_time_in_which_the_launcher_stood_still_counts_for_nobody() -> None:
    time = OwnTime(0.0)
    assert time.at(1.0) == 1.0 and time.at(1.0 + LOOK_S_MAX) == 1.0 + LOOK_S_MAX
    assert time.at(101.0 + LOOK_S_MAX) == 1.0 + 2 * LOOK_S_MAX
    assert time.at(102.0 + LOOK_S_MAX) == 2.0 + 2 * LOOK_S_MAX

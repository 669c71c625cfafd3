"""When what ended is started again: the waits double, an old end is forgotten, one that ends for ever is given up."""

from __future__ import annotations

from foosim.launcher.liveness import AWAY_S, WAITS_S, WINDOW_S, Restarts


def test_the_waits_double_and_then_it_is_given_up() -> None:
    restarts = Restarts()
    now_s = 100.0
    for wait_s in WAITS_S:
        assert restarts.ended("blue", now_s) == wait_s and restarts.is_known("blue")
        assert restarts.due(now_s + wait_s - 0.01) == []
        assert restarts.due(now_s + wait_s) == ["blue"] and restarts.due(now_s + wait_s) == []
        assert not restarts.is_known("blue")
        now_s += wait_s + 0.1
    assert restarts.ended("blue", now_s) is None
    assert restarts.failed == ["blue"] and restarts.is_known("blue") and restarts.due(now_s + 1e6) == []


def test_an_end_long_ago_does_not_count() -> None:
    restarts = Restarts()
    for count in range(20):
        assert restarts.ended("blue", count * WINDOW_S) == WAITS_S[0]
        assert restarts.due((count + 0.5) * WINDOW_S) == ["blue"]


def test_one_whose_machine_is_away_is_never_given_up() -> None:
    restarts = Restarts()
    for count in range(50):
        assert restarts.ended("blue", count * AWAY_S, is_away=True) == AWAY_S
        assert restarts.due((count + 1) * AWAY_S) == ["blue"]
    assert restarts.failed == [] and restarts.ended("blue", 50 * AWAY_S) == WAITS_S[0]

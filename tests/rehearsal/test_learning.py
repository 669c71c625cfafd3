"""Training, and the command around it: what is learned from, that it repeats, and what is written."""

from __future__ import annotations

import json
import pickle
from collections.abc import Sequence
from math import inf
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree

import numpy as np
import pytest
from typer.testing import CliRunner

from foosim.client.vectors import Vector
from foosim.common.errors import Refused
from foosim.players.learning.exercises import DEFEND, TABLE
from foosim.players.learning.learned import SHIPPED, read_policy
from foosim.rehearsal.learning import main
from foosim.rehearsal.learning.chart import Level, Point, curve_svg
from foosim.rehearsal.learning.main import app
from foosim.rehearsal.learning.shots import Network, Range
from foosim.rehearsal.learning.training import (
    EFFORT,
    FIRST_TEST,
    Best,
    Effort,
    Measured,
    Pace,
    Row,
    Shares,
    learn,
    train,
)
from foosim.rehearsal.simulation import read_for_stepping
from foosim.runtime.command import BAD_INPUT

SVG = "{http://www.w3.org/2000/svg}"


TARGET: Final = np.array([0.4, -0.8, 0.2])


def shares_near(target: Vector, seen: list[Sequence[Row]]) -> Shares:
    """Return an exercise in which weights save more the nearer they are to a target, and note who is asked for what."""

    def shares(rows: Sequence[Row]) -> list[float]:
        seen.append(rows)
        return [1.0 / (1.0 + float(np.square(weights - target).sum())) for weights, _ in rows if weights is not None]

    return shares


def learned(shares: Shares, generations: int, **options: Any) -> Best:
    """Learn three weights with little effort, without an end by time."""
    given: dict[str, Any] = {"seed": 1, "report": lambda measured: None, "pace": Pace(inf, lambda: 0.0)} | options
    return learn(shares, 3, generations, effort=EFFORT._replace(policies=6, shots=10), **given)


def test_the_strategy_finds_the_weights_that_save_most() -> None:
    told: list[Measured] = []
    found = learned(shares_near(TARGET, []), 20, report=told.append)
    assert np.abs(found.weights - TARGET).max() < 0.1
    assert found.curve == told and told[0].saved < 0.6 and found.kept.saved > 0.95
    assert [(one.generation, one.shots) for one in told] == [(number, 60 * number) for number in range(21)]
    assert learned(shares_near(TARGET, []), 20).curve == told, "it repeats"
    assert learned(shares_near(TARGET, []), 20, seed=2).curve != told


def test_nothing_is_tested_or_chosen_by_a_shot_that_was_learned_from() -> None:
    seen: list[Sequence[Row]] = []
    learned(shares_near(TARGET, seen), 3)
    learned(shares_near(TARGET, seen), 3, seed=2)
    of_generations = [{seeds for _, seeds in rows} for rows in seen if len(rows) == 6]
    assert all(len(one) == 1 for one in of_generations), "the policies of a generation meet the same shots"
    measuring = {tuple(seeds for _, seeds in rows) for rows in seen if len(rows) == 2}
    assert len(measuring) == 1, "all means meet the same shots"
    apart = [*(seeds for one in of_generations for seeds in one), *measuring.pop()]
    assert len({seed for seeds in apart for seed in seeds}) == 6 * 10 + EFFORT.tests + EFFORT.choices


def test_the_mean_that_is_kept_is_chosen_by_other_shots_than_those_of_the_curve() -> None:
    """Here each mean saves more of the test's shots than the one before; those that choose like the second one best."""
    liked = iter([0.5, 0.9, 0.6, 0.7, 0.2])
    saved = iter([0.1, 0.2, 0.3, 0.4, 0.6])

    def shares(rows: Sequence[Row]) -> list[float]:
        return [next(saved), next(liked)] if len(rows) == 2 else [*map(float, range(len(rows)))]

    found = learned(shares, 4)
    assert found.kept == (1, 60, 0.2) and [one.saved for one in found.curve] == [0.1, 0.2, 0.3, 0.4, 0.6]


def test_training_ends_before_its_time_with_one_generation_at_least() -> None:
    """A generation takes 10 s, the third one would end at 50 s."""
    for end_s, generations in ((0.0, 1), (49.0, 3), (50.0, 4), (51.0, 4)):
        clock = iter(range(0, 1000, 10))
        curve = learned(shares_near(TARGET, []), 9, pace=Pace(end_s, lambda: float(next(clock)))).curve  # noqa: B023
        assert curve[-1].generation == generations, (end_s, curve)


def test_training_plays_the_exercise() -> None:
    """Who is compared with it follows the ball."""
    found = train(1, 3, 1, effort=Effort(policies=2, shots=1, choices=4, tests=3))
    assert len(found.file.weights) == DEFEND.untrained.size and len(found.curve) == 2
    there = Range(DEFEND)
    tests = range(FIRST_TEST, FIRST_TEST + 3)
    assert found.by_hand == sum(there.wins_by_hand(tests)) / 3
    assert found.curve[0].saved == sum(there.wins([0.0] * DEFEND.untrained.size, tests)) / 3
    assert found.kept.saved == sum(there.wins(found.file.weights, tests)) / 3
    there.close()
    assert pickle.loads(pickle.dumps(DEFEND)) == DEFEND, "other processes get it, too"


def test_the_exercise_has_the_camera_of_the_table() -> None:
    here, table = read_for_stepping(DEFEND.file, DEFEND.sets), read_for_stepping(TABLE)
    assert sorted(here.robots) == ["camera", "red.goal"]
    assert here.robots["camera"] == table.robots["camera"]


def test_what_was_shipped_saves_more_than_who_follows_the_ball() -> None:
    shots = range(20, 34)
    there = Range(DEFEND)
    by_hand, learned = sum(there.wins_by_hand(shots)), sum(there.wins(read_policy(SHIPPED).weights, shots))
    there.close()
    assert learned >= by_hand + 4, (by_hand, learned)


def test_delay_costs_saves() -> None:
    saved = []
    for delay_ms in (0.0, 80.0):
        there = Network(DEFEND, delay_ms)
        saved.append(sum(there.wins(range(100, 105))))
        there.close()
    assert saved[0] > saved[1], saved


def test_the_command_counts_and_draws(tmp_path: Path) -> None:
    picture = tmp_path / "curve.svg"
    arguments = ["delays", "--delay", "0 ms, 20 ms", "--shots", "2", "--picture", str(picture)]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 0, done.output
    lines = done.stdout.splitlines()
    assert [line.partition(":")[0] for line in lines] == ["0 ms", "20 ms"] and "of 2 shots" in lines[0]
    assert len(ElementTree.fromstring(picture.read_text()).findall(f"{SVG}circle")) == 2
    told = CliRunner().invoke(app, ["delays", "--delay", "0 ms", "--shots", "1", "--json"]).stdout
    assert [(row["delay_ms"], row["shots"]) for row in json.loads(told)] == [(0, 1)]


def test_the_command_refuses_what_is_not_valid(tmp_path: Path) -> None:
    for arguments, words in (
        (["delays", "--delay", "3"], "--delay: "),
        (["delays", str(tmp_path / "no.json"), "--shots", "1"], "a policy that cannot be read"),
        (["delays", "--delay", "2 min"], "network.links[0].delay: out of range 0 s to 60 s"),
        (["train", str(tmp_path)], "cannot be written: it is a folder"),
        (["train", str(tmp_path / "no" / "policy.json")], "cannot be written: its folder is not there"),
        (["delays", "--picture", str(tmp_path / "no" / "curve.svg")], "cannot be written: its folder is not there"),
    ):
        done = CliRunner().invoke(app, arguments)
        assert words in str(done.exception), (arguments, done.exception)
        assert isinstance(done.exception, Refused) and done.exception.exit_code == BAD_INPUT, arguments


def test_who_lacks_a_library_is_told_which(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(main, "LIBRARIES", ("cma", "no_such_library"))
    done = CliRunner().invoke(app, ["delays"])
    assert "not installed: no_such_library; pip install 'foosim[learn]'" in str(done.exception)


def test_a_curve_shows_each_point_at_its_share() -> None:
    tree = ElementTree.fromstring(
        curve_svg("A <b>", "x", "y", [Point(0.0, 0.0, 0.1), Point(10.0, 1.0, 0.0)], Level("< c", 0.5))
    )
    first, last = tree.findall(f"{SVG}circle")
    assert (first.get("cx"), first.get("cy")) == ("60.0", "290.0")
    assert (last.get("cx"), last.get("cy")) == ("620.0", "40.0")
    assert {"A <b>", "< c"} <= {text.text for text in tree.findall(f"{SVG}text")}
    dashed = next(line for line in tree.findall(f"{SVG}line") if line.get("stroke-dasharray"))
    assert (dashed.get("y1"), dashed.get("y2")) == ("165.0", "165.0")


@pytest.mark.campaign
def test_training_improves_a_player() -> None:
    """With the effort of the command: some minutes on two slow cores."""
    effort = Effort(policies=4, shots=2, choices=3, tests=5)
    assert train(2, 5, 3, effort=effort) == train(2, 5, 1, effort=effort), "on any number of processes"
    found = train(8)
    assert found.curve[0].saved < found.by_hand + 0.1 < 0.7 < found.kept.saved, found

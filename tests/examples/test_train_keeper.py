"""The example that trains a goalkeeper: it learns, what it writes is what it measured, and that plays."""

from __future__ import annotations

import importlib
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import pytest

from foosim.client.player import Sample
from foosim.library.table.ball import BallPosition
from foosim.library.table.learning.exercises import TABLE
from foosim.simulation.simulation import read_for_stepping

EXAMPLES: Final = Path(__file__).parents[2] / "examples"
SHORT: Final = ("--generations", "2", "--policies", "6", "--shots", "8", "--trials", "20", "--seed", "1", "--jobs", "2")


@pytest.fixture
def example(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """The example as a module, as a run imports it."""
    monkeypatch.syspath_prepend(EXAMPLES)
    module = importlib.import_module("train_keeper")
    yield module
    module.environment.cache_clear()
    sys.modules.pop("train_keeper")


def test_it_learns_and_what_it_writes_plays(example: Any, tmp_path: Path) -> None:
    command = [sys.executable, str(EXAMPLES / "train_keeper.py"), *SHORT, "--minutes", "0.01"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    start, *generations, kept = [float(found) for found in re.findall(r"mean reward ([+-]\d\.\d\d)", done.stdout)]
    assert len(generations) == 2 and kept == max(generations) > start
    scores = re.findall(r"^(.*) against the shipped keeper: \d+ : \d+$", done.stdout, re.MULTILINE)
    assert scores == ["standing still", "trained"]
    weights = json.loads((tmp_path / "keeper.json").read_text())
    trials = range(example.FIRST_TRIAL, example.FIRST_TRIAL + 20)
    assert example.mean_reward(weights, trials) == pytest.approx(kept)
    example.environment().close()


def test_it_plays_for_either_team(example: Any, tmp_path: Path) -> None:
    """Blue's goalkeeper, whose goal is at the other end, does what red's does with the ball that it sees."""
    (tmp_path / "keeper.json").write_text(json.dumps([0.1 * number for number in range(example.WEIGHTS)]))
    deployment = read_for_stepping(TABLE)
    slides = {}
    for team, side in (("red", 1.0), ("blue", -1.0)):
        keeper = example.Keeper(deployment, {"team": team, "weights": str(tmp_path / "keeper.json")})
        assert keeper.act(0, {}) == {}
        for tick in (5, 10):
            ball = BallPosition(side * (-0.3 - 0.01 * tick), 0.02 * tick, 0.0)
            sample = Sample("camera", "ball", tick, tick * deployment.tick_ns, tick * deployment.tick_ns, ball)
            commands = keeper.act(tick + 1, {("camera", "ball"): sample})
        ((rod, command),) = commands.items()
        assert rod == f"{team}.goal"
        slides[team] = command["slide"]
    assert slides["red"] == slides["blue"] != 0.0

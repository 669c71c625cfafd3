"""Neither side of the table is better: with a ball and its mirror image, teams play mirror images of one game.

Without noise and with one aim, as the draws of these are each team's own; on the engine that matches are played on.
"""

from __future__ import annotations

from collections.abc import Iterator
from random import Random
from typing import Final

import numpy as np
import pytest

from foosim.library.table.players.football import Playing
from foosim.library.table.settings import LINE_NAMES
from foosim.simulation.simulation import Simulation
from foosim.world.frame import Frame
from tests.deployed import TABLE
from tests.placing import place_ball

NOISELESS: Final = [
    *(f"robots.{team}.{line}.sensors.encoder.modifiers=[]" for team in ("red", "blue") for line in LINE_NAMES),
    "robots.camera.sensors.ball.modifiers=[{kind: delay, time: 10 ms}]",
    "network.links=[]",
]
SEED: Final = 4
BALLS: Final = 6
TICKS: Final = 400
ROUNDING: Final = 1e-6
"""m and rad: what sums in another order may differ by after shots and rebounds, each of which multiplies it."""


@pytest.fixture(scope="module")
def table() -> Iterator[Simulation]:
    with Simulation(TABLE, agents=[], network=True, sets=NOISELESS) as found:
        yield found


def seen(table: Simulation, side: float, ball: tuple[float, float, float, float]) -> list[list[float]]:
    """Where ball and rods are at each tick, as the team sees it that attacks along `side` of x; its rods are first."""
    u, y, vu, vy = ball
    table.reset()
    frame, layout = table.frame, table.frame.layout
    numbers = list(frame.numbers)
    place_ball(numbers, layout["ball"], (side * u, y, 0.0175), (side * vu, vy, 0.0))
    numbers[layout["ball"].offsets["football.wait_ticks"]] = 0.0
    table.reset(Frame(frame.tick, layout, np.array(numbers)))
    teams = ("red", "blue") if side > 0.0 else ("blue", "red")
    found = []
    for _ in range(TICKS):
        table.step()
        x, across, up = table.frame.vector("ball", "position", 3)
        row = [side * x, across, up]
        for rod in [f"{team}.{line}" for team in teams for line in LINE_NAMES]:
            slide, spin = table.frame.vector(rod, "joint_positions", 2)
            row += [slide, side * spin]
        found.append(row)
    return found


@pytest.mark.parametrize("number", range(BALLS))
def test_both_teams_play_alike(table: Simulation, number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Playing, "_aim", lambda self, tick: self._aim_y)
    random = Random(SEED + number)
    ball = random.uniform(-0.5, 0.4), random.uniform(-0.3, 0.3), random.uniform(-0.6, 0.6), random.uniform(-0.5, 0.5)
    print(f"seed {SEED + number}: {ball}")
    game = seen(table, 1.0, ball)
    assert max(row[0] for row in game) - min(row[0] for row in game) > 0.05, "the ball is in play"
    assert seen(table, -1.0, ball) == [pytest.approx(row, abs=ROUNDING) for row in game]

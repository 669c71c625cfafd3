"""Neither side of the table is better: what one team does with a ball, the other does with its mirror image.

Without noise and with one aim, as the draws of these are each team's own; on the engine that matches are played on.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import Final

import numpy as np
import pytest

from foosim.players.football import Playing
from foosim.rehearsal.simulation import Simulation
from foosim.world.frame import Frame
from foosim.world.parameters.table import LINE_NAMES
from tests.placing import place_ball

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
NOISELESS: Final = [
    *(f"robots.{team}.{line}.sensors.encoder.modifiers=[]" for team in ("red", "blue") for line in LINE_NAMES),
    "robots.camera.sensors.ball.modifiers=[{kind: delay, time: 10 ms}]",
    "network.links=[]",
]
OTHER: Final = {"red": "blue", "blue": "red"}
SIDE: Final = {"red": 1.0, "blue": -1.0}
SEED: Final = 4
BALLS: Final = 6
TICKS: Final = 300
ROUNDING: Final = 1e-9
"""m and rad: what sums in another order may differ by after a shot and some rebounds."""


@pytest.fixture(scope="module")
def tables() -> Iterator[dict[str, Simulation]]:
    """By team: a table on which it plays against resting rods."""
    passive = "class=foosim.players.football:Passive"
    found = {
        team: Simulation(
            TABLE, agents=[], network=True, sets=[*NOISELESS, "seed=1", f"players.player-{other}.{passive}"]
        )
        for team, other in OTHER.items()
    }
    yield found
    for one in found.values():
        one.close()


def seen(table: Simulation, team: str, ball: tuple[float, float, float, float]) -> list[list[float]]:
    """Where ball, own rods and those of the other team are at each tick, as the team sees it."""
    side = SIDE[team]
    u, y, vu, vy = ball
    table.reset()
    frame, layout = table.frame, table.frame.layout
    numbers = list(frame.numbers)
    place_ball(numbers, layout["ball"], (side * u, y, 0.0175), (side * vu, vy, 0.0))
    numbers[layout["ball"].offsets["football.wait_ticks"]] = 0.0
    table.reset(Frame(frame.tick, layout, np.array(numbers)))
    found = []
    for _ in range(TICKS):
        table.step()
        x, across, up = table.frame.vector("ball", "position", 3)
        row = [side * x, across, up]
        for rod in [f"{one}.{line}" for one in (team, OTHER[team]) for line in LINE_NAMES]:
            slide, spin = table.frame.vector(rod, "joint_positions", 2)
            row += [slide, side * spin]
        found.append(row)
    return found


@pytest.mark.parametrize("number", range(BALLS))
def test_both_teams_play_the_same_ball_alike(
    tables: dict[str, Simulation], number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Playing, "_aim", lambda self, tick: self._aim_y)
    random = Random(SEED + number)
    ball = random.uniform(-0.5, 0.4), random.uniform(-0.3, 0.3), random.uniform(-0.6, 0.6), random.uniform(-0.5, 0.5)
    print(f"seed {SEED + number}: {ball}")
    red = seen(tables["red"], "red", ball)
    assert max(row[0] for row in red) - min(row[0] for row in red) > 0.01, "the ball is in play"
    assert seen(tables["blue"], "blue", ball) == [pytest.approx(row, abs=ROUNDING) for row in red]

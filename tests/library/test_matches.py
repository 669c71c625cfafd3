"""Matches of the shipped players on the table as deployed: who wins, who is equal, whether the ball stays on it.

`make play` plays them; `make test` has seconds of play in tests/simulation/test_a_minute_of_play.py.
"""

from __future__ import annotations

from typing import Final

import pytest

from foosim.library.table.players import OF_THE_TABLE
from foosim.simulation.match.figures import chance
from foosim.simulation.match.game import Fixture, Game, Played, run_of
from foosim.simulation.match.game import played as result_of
from foosim.simulation.study.run import ran
from tests.deployed import DEPLOYMENT, TABLE, TEXT

MINUTE_TICKS: Final = 60_000_000_000 // DEPLOYMENT.tick_ns
AHEAD: Final = 5
AWAY_MAX: Final = 1
"""Balls that leave the table in a minute."""
MATCHES: Final = 40
CHANCE_MIN: Final = 0.01


def played(a: str, b: str, seed: int, minutes: float, *, is_swapped: bool = False) -> Played:
    fixture = Fixture(TEXT, TABLE.name, TABLE.parent, (OF_THE_TABLE[a], OF_THE_TABLE[b]), round(minutes * MINUTE_TICKS))
    chosen = Game(seed, is_swapped)
    game = result_of(fixture, chosen, ran(run_of(fixture, chosen)))
    assert not game.failed, game.failed
    return game


@pytest.mark.campaign
@pytest.mark.parametrize("seed", range(1, 11))
def test_a_team_wins_against_resting_rods_by_five(seed: int) -> None:
    """In five minutes; a match is over with its tenth goal."""
    game = played("team", "passive", seed, 5.0, is_swapped=seed % 2 == 0)
    assert game.points[0] - game.points[1] >= AHEAD, game


@pytest.mark.campaign
@pytest.mark.parametrize("seed", range(1, 6))
def test_the_ball_stays_on_the_table(seed: int) -> None:
    """By where and how fast feet strike: no rule holds it there."""
    assert played("team", "team", seed, 1.0).away <= AWAY_MAX


@pytest.mark.campaign
def test_of_two_equals_none_wins_more_often() -> None:
    games = [played("team", "team", seed, 0.5) for seed in range(1, MATCHES + 1)]
    red = sum(game.points[0] > game.points[1] for game in games)
    blue = sum(game.points[1] > game.points[0] for game in games)
    assert chance(red, red + blue) > CHANCE_MIN, f"red {red}, blue {blue}, drawn {MATCHES - red - blue}"

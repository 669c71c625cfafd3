"""A minute of the table as deployed: the players score, and the ball changes its solver, on good links and bad.

`make test` plays the first five seconds of one of the minutes, `make play` all of them.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from foosim.rehearsal.run import rehearse

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
MINUTE_TICKS = 30_000
LINKS = ("table.yaml's", "perfect")
PLAYED = [(2, "table.yaml's", MINUTE_TICKS // 12)]
CAMPAIGN = [(seed, links, MINUTE_TICKS) for seed in (1, 2, 3, 4, 5) for links in LINKS]


@pytest.mark.parametrize(
    ("seed", "links", "ticks"),
    [*PLAYED, *(pytest.param(*minute, marks=pytest.mark.campaign) for minute in CAMPAIGN)],
)
def test_play_has_goals_and_hand_overs(seed: int, links: str, ticks: int) -> None:
    sets = [f"seed={seed}", *(["network.links=[]"] if links == "perfect" else [])]
    result = rehearse(TABLE.read_text(), TABLE.name, ticks, None, sets).json
    assert result["handovers"] >= 20
    assert sum(result["score"].values()) >= 1
    assert (result["packets"]["dropped"] > 0) == (links != "perfect")
    assert result["packets"]["refused"] == 0

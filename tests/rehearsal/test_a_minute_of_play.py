"""A minute of the table as deployed: the players score, and the ball changes its solver, on good links and bad.

`make test` plays some of the minutes, `make play` the others.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from foosim.rehearsal.rehearse import rehearse

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
TICKS = 30_000
SHARE = {(1, "table.yaml's"), (2, "perfect")}
"""What `make test` plays."""


@pytest.mark.parametrize(
    ("seed", "links"),
    [
        pytest.param(seed, links, marks=() if (seed, links) in SHARE else pytest.mark.campaign)
        for seed in (1, 2, 3, 4, 5)
        for links in ("table.yaml's", "perfect")
    ],
)
def test_a_minute_has_goals_and_hand_overs(seed: int, links: str) -> None:
    sets = [f"seed={seed}", *(["network.links=[]"] if links == "perfect" else [])]
    result = rehearse(TABLE.read_text(), TABLE.name, TICKS, None, sets).json
    assert result["handovers"] >= 20
    assert sum(result["score"].values()) >= 1
    assert (result["packets"]["dropped"] > 0) == (links != "perfect")
    assert result["packets"]["refused"] == 0

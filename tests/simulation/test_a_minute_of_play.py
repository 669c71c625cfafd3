"""A minute of the table as deployed: the players score, and the ball changes its solver, on good links and bad.

`make test` plays the first five seconds of one of the minutes, `make play` all of them.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from foosim.deployment.loader import load_deployment, with_owners
from foosim.simulation.run import rehearse

TABLE = Path(__file__).parents[2] / "deploy" / "table.yaml"
MINUTE_TICKS = 30_000
LINKS = ("table.yaml's", "perfect")
PLAYED = [(1, "table.yaml's", MINUTE_TICKS // 12)]
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


def test_a_match_ends_with_its_time_and_rests() -> None:
    """On any number of nodes with the same digest; the ball lies on the middle line, and the clock stands."""
    sets = ["engine=pure", "table.rules.kickoff_delay=20 ms", "table.rules.match={duration: 1 s}"]
    names = sorted(load_deployment(TABLE.read_text(), TABLE.name).robots)
    digests = []
    for nodes in (1, 3):
        owners = {f"n{number + 1}": names[number::nodes] for number in range(nodes)}
        result = rehearse(with_owners(TABLE.read_text(), TABLE.name, owners, sets), TABLE.name, 800, None, []).json
        score = result["score"]
        leader = None if score["red"] == score["blue"] else max(score, key=score.__getitem__)
        assert (result["is_over"], result["clock_s"], result["winner"]) == (True, 1.0, leader)
        assert result["ball"]["position"][:2] == [0.0, 0.0]
        digests.append(result["digest"])
    assert digests[0] == digests[1]

"""A hall in real processes: many controllers in one process, each a client of its own, and the world of a rehearsal."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from foosim.simulation.run import rehearse
from tests.wire.conftest import LONG

if TYPE_CHECKING:
    from tests.wire.conftest import House


def test_players_that_share_a_process_are_what_they_would_be_alone(
    house: House, fleet_text: Callable[..., str], tmp_path: Path
) -> None:
    """Two nodes, and four players in two processes: what the capture has is what a rehearsal computes."""
    text = fleet_text(3, LONG, "players.pilot03.process=other")
    file = tmp_path / "hall.yaml"
    file.write_text(text)
    code, out, err = house.run("foosim", "up", file, "--pace", "fast", "--for", "2s", "--json")
    assert code == 0, err
    content = json.loads(out.splitlines()[-1])
    assert content["reason"] == "done" and content["ticks"] == 100 and "score" not in content
    (run,) = (house.folder / "state" / "foosim" / "runs").iterdir()
    logs = {log.stem for log in (run / "logs").iterdir()}
    assert logs == {"supervisor", "vhub", "west", "east", "fleet-west", "other"}
    rehearsed = rehearse(text, "hall.yaml", 100, nodes=None).json
    for same in ("digest", "packets", "nodes"):
        assert content[same] == rehearsed[same], same

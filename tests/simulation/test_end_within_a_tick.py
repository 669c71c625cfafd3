"""Runs that end while a tick waits for a client: nodes are ahead of it, and all that is committed is captured."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from foosim.capture.info import capture_info
from foosim.capture.reader import open_capture
from foosim.common.limits import RELEASE_AHEAD
from foosim.simulation.run import rehearse
from foosim.simulation.system import IDLE_NS_MAX, System
from foosim.simulation.verify import verify_capture
from tests.turns import BY_PERIOD

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
PERIOD: Final = 5
"""Players are due each so many ticks."""


def test_a_run_that_loses_a_player_is_captured_to_its_last_commit(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"

    def prepare(system: System) -> None:
        def lose() -> None:
            system.processes["player-red"].busy_until_ns = 10 * IDLE_NS_MAX

        system.at_tick(60, lose)

    sets = ("engine=pure", "deadlines.lockstep_fast=200 ms", *BY_PERIOD)
    run = rehearse(TABLE.read_text(), TABLE.name, 400, 2, sets, prepare=prepare, capture=path).json
    found = re.fullmatch(r"player-red has not answered tick (\d+) for 0.2 s \(deadlines.lockstep_fast\)", run["reason"])
    assert found is not None, run["reason"]
    waited = int(found[1])
    assert waited % PERIOD == 0 and waited < run["ticks"] <= waited + 1 + RELEASE_AHEAD, "nodes are ahead of that tick"
    info, capture = capture_info(path), open_capture(path)
    assert (info.ticks, info.chain) == (run["ticks"], run["digest"]["chain"])
    assert capture.ticks.tolist() == list(range(run["ticks"] + 1)) and verify_capture(path).equal
    fates = {fate: int((capture.packets.fate == fate).sum()) for fate in ("delivered", "dropped", "in_flight")}
    assert fates == {fate: run["packets"][fate] for fate in fates} and fates["in_flight"] > 0

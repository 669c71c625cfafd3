"""Law 3: a run that lost nodes and got them back is the run that would have been, to the last bit."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Final

import pytest

from foosim.rehearsal.rehearse import rehearse
from foosim.rehearsal.system import Settings, System

TABLE: Final = Path(__file__).parents[2] / "deploy" / "table.yaml"
TICKS: Final = 400


@cache
def undisturbed() -> tuple[bytes, ...]:
    return tuple(rehearse(TABLE.read_text(), TABLE.name, TICKS, 1, ["engine=pure"]).digests)


@pytest.mark.parametrize("seed", range(3))
def test_killed_nodes(seed: int) -> None:
    def prepare(system: System) -> None:
        for tick, name in ((40 + seed, "n2"), (120 + 3 * seed, "n1"), (250, "n3")):
            system.at_tick(tick, lambda name=name: system.kill(name))  # type: ignore[misc]
            system.at_tick(tick + 40, lambda name=name: system.start(name))  # type: ignore[misc]

    run = rehearse(TABLE.read_text(), TABLE.name, TICKS, 3, ["engine=pure"], Settings(), prepare=prepare)
    assert tuple(run.digests) == undisturbed()
    told = run.json["recoveries"]
    assert [(entry["what"], entry["name"]) for entry in told] == [
        ("node", "n2"), ("join", "n2"), ("node", "n1"), ("join", "n1"), ("node", "n3"), ("join", "n3"),
    ]  # fmt: skip
    assert run.json["handovers"] >= 2 and not run.json["failed"]
